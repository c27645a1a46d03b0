// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cub/block/block_scan.cuh>

namespace cub {
struct DeviceScan {
    template <class In, class Out, class F, class T, class N>
    static cudaError_t ExclusiveScan(void* storage, ::std::size_t& bytes, In in, Out out, F f, T first, N num,
                                     cudaStream_t stream = nullptr) {
        if (storage == nullptr) {
            bytes = 1;
            return cudaSuccess;
        }
        return emulation::put(stream, [=] {
            T before = first;
            for (N i = 0; i < num; ++i) {
                const T next = static_cast<T>(f(before, in[i]));
                out[i] = before;
                before = next;
            }
        });
    }
};
} // namespace cub
