// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Prefix sums over the threads of a warp and of a block.

#include <voxelpipe/config.hpp>
#include <voxelpipe/device/base/warp.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The sum over this lane and those before it. T: std::uint32_t or unsigned long long. All lanes call it.
template <class T>
[[nodiscard]] __device__ VOXELPIPE_INLINE T warp_sum_up_to(T own) {
    T sum = own;
#pragma unroll
    for (unsigned apart = 1; apart < 32; apart *= 2) {
        const T other = __shfl_up_sync(0xffffffffu, sum, apart);
        sum += threadIdx.x % 32 >= apart ? other : 0;
    }
    return sum;
}

// The sum over all lanes, in each of them. All lanes call it.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t warp_sum(std::uint32_t own) {
    return __reduce_add_sync(0xffffffffu, own);
}
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long warp_sum(unsigned long long own) {
#pragma unroll
    for (unsigned apart = 16; apart > 0; apart /= 2) own += __shfl_xor_sync(0xffffffffu, own, apart);
    return own;
}

// Shared memory of a prefix sum over the block. T: std::uint32_t or unsigned long long.
template <class T, unsigned Threads>
struct block_scan {
    static_assert(Threads % 32 == 0 && Threads <= 1024);
    T warps[Threads / 32];

    // The sum over the threads before this one. All threads call it. A barrier goes before the next call.
    [[nodiscard]] __device__ VOXELPIPE_INLINE T sum_before(T own) {
        const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
        const T up_to = warp_sum_up_to(own);
        if (lane == 31) warps[warp] = up_to;
        __syncthreads();
        return warp_sum(lane < warp ? warps[lane] : T{0}) + up_to - own;
    }
    // The sum over all threads, after sum_before. All threads call it.
    [[nodiscard]] __device__ VOXELPIPE_INLINE T sum() const {
        const unsigned lane = threadIdx.x % 32;
        return warp_sum(lane < Threads / 32 ? warps[lane] : T{0});
    }
};

} // namespace voxelpipe::device
