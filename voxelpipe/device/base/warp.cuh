// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Operations of whole warps and blocks.

#include <voxelpipe/config.hpp>
#include <voxelpipe/tuning/tuning_raster.hpp>

#include <cstdint>

namespace voxelpipe::device {

using word = std::uint32_t;

// The bits of a row that belong to this lane if group_lanes lanes share it: every group_lanes-th bit, so that
// neighbouring lanes have neighbouring voxels.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t bits_of_lane() {
    return ~0u / ((1u << tuning::group_lanes) - 1) << threadIdx.x % tuning::group_lanes;
}

// Returns a value that is equal in all lanes, in a form that tells the compiler so. A value loaded from memory or
// derived from threadIdx may differ between lanes as far as the compiler can see; it then lets the lanes of a loop with
// such a bound diverge for good, and a __syncwarp in the loop makes them meet but not stay together. All lanes call it.
__device__ VOXELPIPE_INLINE std::uint32_t uniform(std::uint32_t value) { return __reduce_max_sync(0xffffffffu, value); }
__device__ VOXELPIPE_INLINE unsigned long long uniform(unsigned long long value) {
    return static_cast<unsigned long long>(uniform(static_cast<std::uint32_t>(value >> 32))) << 32 |
           uniform(static_cast<std::uint32_t>(value));
}
__device__ VOXELPIPE_INLINE unsigned warp_in_block() { return uniform(threadIdx.x / 32); }

// The sum of `value` over the block, in thread 0. All threads call it.
__device__ inline unsigned long long block_sum(unsigned long long value) {
    __shared__ unsigned long long partial[32];
    for (int step = 16; step > 0; step /= 2) value += __shfl_down_sync(0xffffffffu, value, step);
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    __syncthreads(); // the previous use of `partial` is over
    if (lane == 0) partial[warp] = value;
    __syncthreads();
    if (warp == 0) {
        value = lane < (blockDim.x + 31) / 32 ? partial[lane] : 0;
        for (int step = 16; step > 0; step /= 2) value += __shfl_down_sync(0xffffffffu, value, step);
    }
    return value;
}

} // namespace voxelpipe::device
