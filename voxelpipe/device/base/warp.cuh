// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values that a warp or a block agrees on.

#include <voxelpipe/config.hpp>

#include <cstdint>

namespace voxelpipe::device {

using word = std::uint32_t;

inline constexpr int group_lanes = 8; // of a warp, for one larger triangle
// The bits of a row that are a lane's where group_lanes share it: neighbours have neighbouring voxels.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t bits_of_lane() {
    return ~0u / ((1u << group_lanes) - 1) << threadIdx.x % group_lanes;
}

// A value that all lanes of a warp have, in a way that the compiler knows it: what is read from memory, or follows from
// threadIdx, may differ for all that it can see, and then it lets the lanes of a loop with such a bound run apart for
// good (a __syncwarp within such a loop makes them meet, not stay together). All lanes take part.
__device__ VOXELPIPE_INLINE std::uint32_t uniform(std::uint32_t value) { return __reduce_max_sync(0xffffffffu, value); }
__device__ VOXELPIPE_INLINE unsigned long long uniform(unsigned long long value) {
    return static_cast<unsigned long long>(uniform(static_cast<std::uint32_t>(value >> 32))) << 32 |
           uniform(static_cast<std::uint32_t>(value));
}
__device__ VOXELPIPE_INLINE unsigned warp_in_block() { return uniform(threadIdx.x / 32); }

// The sum of `value` over the block, in thread 0. All threads take part.
__device__ inline unsigned long long block_sum(unsigned long long value) {
    __shared__ unsigned long long partial[32];
    for (int step = 16; step > 0; step /= 2) value += __shfl_down_sync(0xffffffffu, value, step);
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    __syncthreads(); // the last use of `partial` is over
    if (lane == 0) partial[warp] = value;
    __syncthreads();
    if (warp == 0) {
        value = lane < (blockDim.x + 31) / 32 ? partial[lane] : 0;
        for (int step = 16; step > 0; step /= 2) value += __shfl_down_sync(0xffffffffu, value, step);
    }
    return value;
}

} // namespace voxelpipe::device
