// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cub/block/block_scan.cuh>

namespace cub {
struct DeviceSelect {
    template <class In, class Out, class Count, class N, class F>
    static cudaError_t If(void* storage, ::std::size_t& bytes, In in, Out out, Count* count, N num, F f,
                          cudaStream_t stream = nullptr) {
        if (storage == nullptr) {
            bytes = 1;
            return cudaSuccess;
        }
        return emulation::put(stream, [=] {
            Count selected = 0;
            for (N i = 0; i < num; ++i)
                if (f(in[i])) out[selected++] = in[i];
            *count = selected;
        });
    }
};
} // namespace cub
