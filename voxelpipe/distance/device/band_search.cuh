// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The nearest triangles of the samples of all bricks that have a list. A block takes a brick with a short list, a warp
// each octant; of a brick with a long one a block takes an octant, and its warps share the list.

#include <voxelpipe/distance/device/band_lists.cuh>
#include <voxelpipe/distance/device/octant_search.cuh>

#include <cstdint>

namespace voxelpipe::device {

// What the samples of the placed bricks have, 512 a brick, x fastest: the distance, which is positive, and the nearest
// primitive, or no_primitive beyond the band.
struct found_samples {
    float* distances;
    std::uint32_t* primitives;
    std::uint32_t* slots; // place of each brick; null: its number

    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t slot_of(std::uint32_t brick) const {
        return slots != nullptr ? slots[brick] : brick;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static std::uint64_t place(std::uint64_t slot, int x, int y, int z) {
        return slot * brick_samples +
               static_cast<std::uint64_t>(
                   ((z % distance_brick) * distance_brick + y % distance_brick) * distance_brick + x % distance_brick);
    }
    // Writes what an octant's warp, or the first of its block, has found.
    __device__ void write(const octant_search& s, std::uint64_t slot) const {
        for (unsigned i = threadIdx.x % 32; i < octant_samples; i += 32) {
            const glm::ivec3 at = s.sample(i);
            const auto square = core::bit_cast<double>(s.m.square[i]);
            float distance = s.m.primitive[i] != no_primitive ? core::distance_of(square) : 0.0f;
            const bool in_band = s.m.primitive[i] != no_primitive && distance <= s.in.band;
            const std::uint64_t to = place(slot, at.x, at.y, at.z);
            distances[to] = in_band ? distance : s.in.band;
            primitives[to] = in_band ? s.m.primitive[i] : no_primitive;
        }
    }
};

[[nodiscard]] __device__ VOXELPIPE_INLINE glm::ivec3 first_of_octant(const glm::ivec3& brick, unsigned octant) {
    return brick + octant_side * glm::ivec3(static_cast<int>(octant & 1), static_cast<int>(octant >> 1 & 1),
                                            static_cast<int>(octant >> 2));
}

inline constexpr unsigned warps_of_search = threads_per_block / 32;
static_assert(warps_of_search == 8, "a warp an octant");

template <int = 0>
__global__ __launch_bounds__(threads_per_block) void search_band(const __grid_constant__ distance_input in,
                                                                 const __grid_constant__ band_memory m,
                                                                 const __grid_constant__ found_samples to,
                                                                 pipeline_state* state, capacities limits) {
    __shared__ octant_memory memory[warps_of_search];
    __shared__ float nearest_of[warps_of_search];
    __shared__ unsigned next;
    if (has_failed(*state, limits)) return;
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    const unsigned num_long = 8 * state->num_splits, num = num_long + state->num_items;
    for (;;) {
        __syncthreads();
        if (threadIdx.x == 0) next = atomicAdd(&state->next_item, 1u);
        __syncthreads();
        const unsigned item = uniform(next);
        if (item >= num) return;
        const bool is_long = item < num_long;
        const std::uint32_t slot = is_long ? m.long_ones[item / 8] : m.short_ones[item - num_long];
        const std::uint32_t brick = m.of_slot[slot], end = m.ends[brick], count = m.counts[brick], begin = end - count;
        octant_search search(in, memory[warp], first_of_octant(in.first_sample(brick), is_long ? item % 8 : warp));
        // The rounds of 32 that are the warp's own.
        const std::uint32_t first = begin + (is_long ? 32 * warp : 0), step = is_long ? threads_per_block : 32;
        float nearest = octant_search::infinity;
        for (std::uint32_t i = first; i < end; i += step) {
            if (i + lane < end) {
                const float high = search.look(m.listed[i + lane]).high;
                nearest = high < nearest ? high : nearest;
            }
        }
        __syncwarp();
        nearest = least_of_warp(nearest);
        if (is_long) {
            if (lane == 0) nearest_of[warp] = nearest;
            __syncthreads();
            nearest = least_of_warp(nearest_of[lane % warps_of_search]);
        }
        search.begin(nearest);
        for (std::uint32_t i = first; i < end; i += step) {
            const bool has_one = i + lane < end;
            search.visit(has_one, has_one ? m.listed[i + lane] : 0);
        }
        search.decide();
        if (is_long) {
            __syncthreads();
            if (warp == 0)
                for (unsigned other = 1; other < warps_of_search; ++other)
                    for (unsigned s = lane; s < octant_samples; s += 32)
                        search.take(memory[other].primitive[s] != no_primitive, s, memory[other].square[s],
                                    memory[other].primitive[s]);
        }
        if (!is_long || warp == 0) to.write(search, slot);
    }
}

// Lists are made. Sets what the samples of all placed bricks have.
template <int = 0>
void search_bricks(const distance_input& in, const band_memory& m, const found_samples& to, pipeline_state* state,
                   const capacities& limits, cudaStream_t stream) {
    search_band<0>
        <<<fill_device(std::uint64_t{limits.fragment_records} * threads_per_block, 4), threads_per_block, 0, stream>>>(
            in, m, to, state, limits);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
