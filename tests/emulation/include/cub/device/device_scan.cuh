// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Takes the place of CUB's header where device code is compiled for the CPU (tests/emulation/README.md): the prefix
// sums of an array, in the type of the first.

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

namespace cub {

struct DeviceScan {
    template <class In, class Out, class Add, class Sum>
    static cudaError_t ExclusiveScan(void* storage, std::size_t& bytes, const In* in, Out* out, Add add, Sum first,
                                     std::uint64_t num, cudaStream_t stream) {
        if (storage == nullptr) {
            bytes = num + 1;
            return cudaSuccess;
        }
        if (bytes < num + 1) return cudaErrorInvalidValue;
        return emulation::put(stream, [=] {
            Sum sum = first;
            for (std::uint64_t i = 0; i < num; ++i) {
                const Sum next = add(sum, in[i]);
                out[i] = static_cast<Out>(sum);
                sum = next;
            }
        });
    }
};

} // namespace cub
