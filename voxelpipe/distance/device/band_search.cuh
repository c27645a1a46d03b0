// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The nearest triangles of the samples of all bricks that have a list. A warp takes an octant of a brick with a short
// list; of a brick with a long one a block takes an octant, and its warps share the list.

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

    static constexpr std::uint64_t nowhere = ~std::uint64_t{0}; // place of a brick that no triangle is near
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t slot_of(std::uint32_t brick) const {
        if (primitives == nullptr) return nowhere;
        if (slots == nullptr) return brick;
        return slots[brick] != no_slot ? slots[brick] : nowhere;
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
inline constexpr int band_search_blocks = 4; // of a multiprocessor: more warps hide more than 64 registers cost

// The triangles of an octant that are searched together.
struct octant_item {
    std::uint32_t slot, brick;     // place and number of the brick
    std::uint32_t begin, end;      // of m.listed
    std::uint32_t part, num_parts; // of the list; parts of one list follow each other
    unsigned octant;

    // item: parts of the longest lists come first, then long lists, then short ones, each with its 8 octants.
    [[nodiscard]] __device__ static octant_item of(const band_memory& m, unsigned item, unsigned num_parts,
                                                   unsigned num_long) {
        const unsigned n = item / 8;
        octant_item r{0, 0, 0, 0, 0, 1, item % 8};
        if (n < num_parts) {
            r.slot = m.parts[n].slot;
            r.part = n;
            r.num_parts = m.parts[n].count;
        } else {
            r.slot = n < num_parts + num_long ? m.long_ones[n - num_parts] : m.short_ones[n - num_parts - num_long];
        }
        r.brick = m.of_slot[r.slot];
        r.end = m.ends[r.brick];
        r.begin = r.end - m.counts[r.brick];
        if (n < num_parts) {
            r.begin += m.parts[n].number * band_memory::part_length;
            if (r.end - r.begin > band_memory::part_length) r.end = r.begin + band_memory::part_length;
        }
        return r;
    }
    // Leaves what a warp has found in a part to the warp that ends the list's last part, which takes all other parts.
    // True for that one. All lanes call it.
    [[nodiscard]] __device__ bool join_parts(const band_memory& m, octant_search& search) const {
        const unsigned lane = threadIdx.x % 32;
        const std::uint32_t first = part - m.parts[part].number;
        const auto place = [&](std::uint32_t p, unsigned s) {
            return (std::uint64_t{p} * 8 + octant) * octant_samples + s;
        };
        for (unsigned s = lane; s < octant_samples; s += 32) {
            m.part_squares[place(part, s)] = search.m.square[s];
            m.part_primitives[place(part, s)] = search.m.primitive[s];
        }
        __threadfence();
        __syncwarp();
        std::uint32_t done = 0;
        if (lane == 0) done = atomicAdd(m.parts_done + std::uint64_t{first} * 8 + octant, 1u);
        if (__shfl_sync(0xffffffffu, done, 0) != num_parts - 1) return false;
        __threadfence();
        for (std::uint32_t p = first; p < first + num_parts; ++p)
            for (unsigned s = lane; p != part && s < octant_samples; s += 32) {
                const std::uint32_t primitive = __ldcg(m.part_primitives + place(p, s));
                search.take(primitive != no_primitive, s, __ldcg(m.part_squares + place(p, s)), primitive);
            }
        return true;
    }
};

// First the blocks take the octants of bricks with long lists, then each warp octants of short ones until none is left:
// octants of a brick differ in their work, so warps wait for each other in long lists alone.
template <int = 0>
__global__ __launch_bounds__(threads_per_block,
                             band_search_blocks) void search_band(const __grid_constant__ distance_input in,
                                                                  const __grid_constant__ band_memory m,
                                                                  const __grid_constant__ found_samples to,
                                                                  pipeline_state* state, capacities limits) {
    __shared__ octant_memory memory[warps_of_search];
    __shared__ near_triangle nearest_of[warps_of_search];
    if (has_failed(*state, limits)) return;
    const unsigned warp = warp_in_block(), lane = threadIdx.x % 32;
    const unsigned num_parts = state->num_images, num_long = state->num_splits,
                   first_short = 8 * (num_parts + num_long), end_short = first_short + 8 * state->num_items;
    for (unsigned item = blockIdx.x;;) {
        const bool is_long = item < first_short;
        if (!is_long) {
            if (lane == 0) item = first_short + atomicAdd(&state->next_item, 1u);
            item = __shfl_sync(0xffffffffu, item, 0);
            if (item >= end_short) return;
        }
        const octant_item own = octant_item::of(m, item, num_parts, num_long);
        octant_search search(in, memory[warp], first_of_octant(in.first_sample(own.brick), own.octant));
        // The rounds of 32 that are the warp's own.
        const std::uint32_t first = own.begin + (is_long ? 32 * warp : 0), step = is_long ? threads_per_block : 32;
        near_triangle nearest = near_triangle::none();
        for (std::uint32_t i = first + lane; i < own.end; i += step)
            nearest.take({search.look(m.listed[i]).high, m.listed[i]});
        __syncwarp();
        nearest = nearest.of_warp();
        if (is_long) {
            if (lane == 0) nearest_of[warp] = nearest;
            __syncthreads();
            nearest = nearest_of[lane % warps_of_search].of_warp();
        }
        search.begin(nearest);
        for (std::uint32_t i = first; i < own.end; i += step) {
            const bool has_one = i + lane < own.end;
            search.visit(has_one, has_one ? m.listed[i + lane] : 0);
        }
        search.decide();
        if (!is_long) {
            to.write(search, own.slot);
            __syncwarp();
            continue;
        }
        __syncthreads();
        if (warp == 0) {
            for (unsigned other = 1; other < warps_of_search; ++other)
                for (unsigned s = lane; s < octant_samples; s += 32)
                    search.take(memory[other].primitive[s] != no_primitive, s, memory[other].square[s],
                                memory[other].primitive[s]);
            if (own.num_parts == 1 || own.join_parts(m, search)) to.write(search, own.slot);
        }
        __syncthreads();
        item += gridDim.x;
    }
}

// Lists are made. Sets what the samples of all placed bricks have.
template <int = 0>
void search_bricks(const distance_input& in, const band_memory& m, const found_samples& to, pipeline_state* state,
                   const capacities& limits, cudaStream_t stream) {
    search_band<0><<<fill_device(std::uint64_t{limits.fragment_records} * threads_per_block, band_search_blocks),
                     threads_per_block, 0, stream>>>(in, m, to, state, limits);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
