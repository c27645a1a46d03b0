// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a call, classified, kept and put into frames; and, for each brick that the band meets, the list of
// the triangles near it: they are counted, the bricks take their places, and the triangles are written. A thread takes
// a triangle near few bricks, a block a part of the bricks of a large one. The order within a list does not show.

#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/distance/device/distance_input.cuh>

#include <cstdint>

namespace voxelpipe::device {

// A part of a list.
struct list_part {
    std::uint32_t slot, number, count; // the brick's place; of the part among count
};

// Arrays of the lists. Capacities are those of the call: tile_records for `records`, fragment_records for the bricks'
// places and tile_pairs for the listed triangles.
struct band_memory {
    std::uint32_t* counts;    // triangles of each brick of the grid; zero when the call starts
    std::uint32_t* ends;      // of each brick's list; while it is written, where the next one goes
    std::uint32_t* slots;     // place of each brick of the grid, or no_slot
    std::uint32_t* of_slot;   // the brick of each place
    std::uint32_t* long_ones; // places whose lists are long
    std::uint32_t* short_ones;
    std::uint32_t* listed; // primitives
    chunk_record* records; // parts of large triangles
    list_part* parts;      // of lists that are longer still, those of a list one after the other
    // By part and octant: what its samples have in the part, and in the first part of a list how many parts are
    // searched.
    unsigned long long* part_squares;
    std::uint32_t *part_primitives, *parts_done;

    // Lists that a block searches together, and those that many blocks do, a part of part_length each.
    static constexpr std::uint32_t long_list = 512, longest_list = 4096, part_length = 2048;
    // A list of n triangles, more than longest_list, has at most n / part_length + 1 parts, and 1 is below n /
    // longest_list.
    [[nodiscard]] VOXELPIPE_HD static std::uint64_t max_parts(const capacities& limits) {
        static_assert(longest_list == 2 * part_length);
        return limits.tile_pairs * 3 / longest_list + 1;
    }
    [[nodiscard]] static band_memory take(arena& a, std::uint32_t num_bricks, std::uint32_t* counts,
                                          const capacities& limits) {
        band_memory m{};
        m.counts = counts;
        m.ends = a.take<std::uint32_t>(num_bricks);
        m.slots = a.take<std::uint32_t>(num_bricks);
        m.of_slot = a.take<std::uint32_t>(limits.fragment_records);
        m.long_ones = a.take<std::uint32_t>(limits.tile_pairs / long_list + 1);
        m.short_ones = a.take<std::uint32_t>(limits.fragment_records);
        m.listed = a.take<std::uint32_t>(limits.tile_pairs);
        m.records = a.take<chunk_record>(limits.tile_records);
        m.parts = a.take<list_part>(max_parts(limits));
        m.part_squares = a.take<unsigned long long>(8 * octant_samples * max_parts(limits));
        m.part_primitives = a.take<std::uint32_t>(8 * octant_samples * max_parts(limits));
        m.parts_done = a.take<std::uint32_t>(8 * max_parts(limits));
        return m;
    }
};

// Bricks whose samples a triangle's band may meet, from low to high; none if high is lower.
struct brick_box {
    glm::ivec3 low, high;
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const {
        if (high.x < low.x || high.y < low.y || high.z < low.z) return 0;
        return std::int64_t{high.x - low.x + 1} * (high.y - low.y + 1) * (high.z - low.z + 1);
    }
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 brick(std::int64_t i) const {
        const std::int64_t nx = high.x - low.x + 1, ny = high.y - low.y + 1;
        return low + glm::ivec3(static_cast<int>(i % nx), static_cast<int>(i / nx % ny), static_cast<int>(i / nx / ny));
    }
};
[[nodiscard]] __device__ inline brick_box bricks_near(const distance_input& in, const core::voxel_box& voxels) {
    brick_box b{};
    for (int k = 0; k < 3; ++k) {
        const std::int64_t low = voxels.lo[k] - in.halo[k], high = voxels.hi[k] + in.halo[k];
        b.low[k] = low < 0 ? 0 : low >= in.extent[k] ? in.bricks[k] : static_cast<int>(low) / distance_brick;
        b.high[k] = high < 0 ? -1 : high >= in.extent[k] ? in.bricks[k] - 1 : static_cast<int>(high) / distance_brick;
    }
    return b;
}

// True if a sample of the brick may lie within the triangle's band.
[[nodiscard]] __device__ inline bool may_meet(const distance_input& in, const triangle_frame& f,
                                              const glm::ivec3& brick) {
    if (f.is_wide != 0) return true;
    const int fraction = in.geo.snap.fraction;
    constexpr int half = distance_brick / 2;
    const frame_point p =
        to_frame(f, in.units, (brick.x * distance_brick + half) << fraction,
                 (brick.y * distance_brick + half) << fraction, (brick.z * distance_brick + half) << fraction);
    const float error = error_at(f, p, in.brick_radius);
    const float across =
        3.5f * (magnitude(f.z_axis[0]) * in.units.voxel[0] + magnitude(f.z_axis[1]) * in.units.voxel[1] +
                magnitude(f.z_axis[2]) * in.units.voxel[2]);
    if (magnitude(p.z) > in.band_units + across + error) return false;
    const float most = in.band_units + in.brick_radius + error;
    return measure(f, p) <= most * most;
}

inline constexpr std::int64_t bricks_of_thread = 32, bricks_of_record = 1024;

template <int = 0>
__global__ __launch_bounds__(threads_per_block) void place_triangles(const __grid_constant__ distance_input in,
                                                                     const __grid_constant__ band_memory m,
                                                                     pipeline_state* state, capacities limits) {
    using core::triangle_class;
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const bool valid = i < in.geo.num_primitives;
    triangle_class kind = triangle_class::drawn;
    bool bad = false;
    if (valid) {
        const auto id = static_cast<std::uint32_t>(i);
        const loaded_triangle t = in.geo.load(id);
        bad = !t.index_ok;
        if (!bad) kind = core::classify_positions(t.a, t.b, t.c);
        core::voxel_box box{};
        if (!bad && kind == triangle_class::drawn) {
            box = core::bounds(t.a, t.b, t.c, in.geo.snap.fraction);
            if (core::intersect(box, in.reach).empty()) kind = triangle_class::outside;
        }
        if (!bad && kind == triangle_class::drawn) {
            const bool fits = int32_position::of(t.a).fits_int32 != 0 && int32_position::of(t.b).fits_int32 != 0 &&
                              int32_position::of(t.c).fits_int32 != 0;
            triangle_frame f{};
            kept_triangle k{};
            if (fits) {
                f = make_triangle_frame(t.a, t.b, t.c, in.units);
                const core::snapped_position* const v[3] = {&t.a, &t.b, &t.c};
                for (int n = 0; n < 3; ++n) {
                    k.vertex[n][0] = static_cast<std::int32_t>(v[n]->x);
                    k.vertex[n][1] = static_cast<std::int32_t>(v[n]->y);
                    k.vertex[n][2] = static_cast<std::int32_t>(v[n]->z);
                }
                k.is_narrow = static_cast<std::uint32_t>(core::is_narrow(t.a, t.b, t.c, in.most));
            } else {
                f.is_wide = 1;
            }
            in.frames[id] = f;
            in.triangles[id] = k;
            if (m.counts != nullptr) {
                const brick_box near = bricks_near(in, box);
                const std::int64_t count = near.count();
                if (count <= bricks_of_thread) {
                    for (std::int64_t b = 0; b < count; ++b) {
                        const glm::ivec3 brick = near.brick(b);
                        if (may_meet(in, f, brick))
                            atomicAdd(m.counts + in.brick_number(brick.x, brick.y, brick.z), 1u);
                    }
                } else {
                    const auto records =
                        static_cast<unsigned long long>((count + bricks_of_record - 1) / bricks_of_record);
                    const unsigned long long first = atomicAdd(&state->tile_records, records);
                    for (unsigned long long r = 0; r < records && first + r < limits.tile_records; ++r)
                        m.records[first + r] = {id, static_cast<std::uint32_t>(r)};
                }
            }
        } else {
            triangle_frame none{};
            none.is_wide = 2; // not drawn
            in.frames[id] = none;
        }
    }
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, bad_index);
    const bool counts = valid && !bad && i < in.num_counted;
    const auto add = [&](triangle_class which, unsigned long long* total) {
        const int count = __syncthreads_count(static_cast<int>(counts && kind == which));
        if (threadIdx.x == 0 && count != 0) atomicAdd(total, static_cast<unsigned long long>(count));
    };
    add(triangle_class::drawn, &state->drawn);
    if (__syncthreads_or(static_cast<int>(counts && kind != triangle_class::drawn)) == 0) return;
    add(triangle_class::nonfinite, &state->nonfinite);
    add(triangle_class::too_far, &state->too_far);
    add(triangle_class::outside, &state->outside);
}

// Calls visit(primitive, brick number) for the bricks of large triangles. A block takes a record.
template <class Visit>
__device__ VOXELPIPE_INLINE void for_each_large(const distance_input& in, const band_memory& m,
                                                const pipeline_state* state, const capacities& limits,
                                                const Visit& visit) {
    const unsigned long long num =
        state->tile_records < limits.tile_records ? state->tile_records : limits.tile_records;
    for (unsigned long long r = blockIdx.x; r < num; r += gridDim.x) {
        const chunk_record record = m.records[r];
        const loaded_triangle t = in.geo.load(record.primitive);
        const brick_box near = bricks_near(in, core::bounds(t.a, t.b, t.c, in.geo.snap.fraction));
        const triangle_frame& f = in.frames[record.primitive];
        const std::int64_t first = std::int64_t{record.first} * bricks_of_record, all = near.count(),
                           end = first + bricks_of_record < all ? first + bricks_of_record : all;
        for (std::int64_t b = first + threadIdx.x; b < end; b += blockDim.x) {
            const glm::ivec3 brick = near.brick(b);
            if (may_meet(in, f, brick)) visit(record.primitive, in.brick_number(brick.x, brick.y, brick.z));
        }
    }
}
template <int = 0>
__global__ __launch_bounds__(threads_per_block) void count_large_triangles(const __grid_constant__ distance_input in,
                                                                           const __grid_constant__ band_memory m,
                                                                           const pipeline_state* state,
                                                                           capacities limits) {
    if (state->index_error != 0) return;
    for_each_large(in, m, state, limits, [&](std::uint32_t, std::uint32_t brick) VOXELPIPE_INLINE_LAMBDA {
        atomicAdd(m.counts + brick, 1u);
    });
}

// Gives the bricks that have triangles a place, and their lists room.
template <int = 0>
__global__ __launch_bounds__(threads_per_block) void place_bricks(std::uint32_t num_bricks,
                                                                  const __grid_constant__ band_memory m,
                                                                  pipeline_state* state, capacities limits) {
    const unsigned lane = threadIdx.x % 32;
    const unsigned before = (1u << lane) - 1;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t at = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; at - lane < num_bricks;
         at += threads) {
        const std::uint32_t count = at < num_bricks ? m.counts[at] : 0;
        const unsigned any = __ballot_sync(0xffffffffu, count != 0);
        if (any == 0) {
            if (at < num_bricks) m.slots[at] = no_slot;
            continue;
        }
        // Long lists may have more than 2^32 together, which the call then refuses.
        unsigned long long upto = count;
        for (unsigned step = 1; step < 32; step *= 2) {
            const unsigned long long other = __shfl_up_sync(0xffffffffu, upto, step);
            if (lane >= step) upto += other;
        }
        const unsigned is_longest = __ballot_sync(0xffffffffu, count > band_memory::longest_list);
        const unsigned is_long = __ballot_sync(0xffffffffu, count > band_memory::long_list) & ~is_longest;
        const unsigned is_short = any & ~is_long & ~is_longest;
        unsigned long long first_slot = 0, first_pair = 0;
        unsigned first_long = 0, first_short = 0;
        if (lane == 31) {
            first_slot = atomicAdd(&state->fragment_records, static_cast<unsigned long long>(__popc(any)));
            first_pair = atomicAdd(&state->tile_pairs, upto);
            if (is_long != 0) first_long = atomicAdd(&state->num_splits, static_cast<unsigned>(__popc(is_long)));
            if (is_short != 0) first_short = atomicAdd(&state->num_items, static_cast<unsigned>(__popc(is_short)));
        }
        first_slot = __shfl_sync(0xffffffffu, first_slot, 31);
        first_pair = __shfl_sync(0xffffffffu, first_pair, 31);
        first_long = __shfl_sync(0xffffffffu, first_long, 31);
        first_short = __shfl_sync(0xffffffffu, first_short, 31);
        if (at >= num_bricks) continue;
        if (count == 0) {
            m.slots[at] = no_slot;
            continue;
        }
        const unsigned long long slot = first_slot + static_cast<unsigned>(__popc(any & before));
        m.ends[at] = static_cast<std::uint32_t>(first_pair + upto - count);
        m.slots[at] = static_cast<std::uint32_t>(slot);
        if (slot >= limits.fragment_records) continue;
        m.of_slot[slot] = static_cast<std::uint32_t>(at);
        const unsigned n_long = first_long + static_cast<unsigned>(__popc(is_long & before)),
                       n_short = first_short + static_cast<unsigned>(__popc(is_short & before));
        if ((is_longest >> lane & 1u) != 0) {
            const std::uint32_t parts = (count + band_memory::part_length - 1) / band_memory::part_length,
                                first = atomicAdd(&state->num_images, parts);
            for (std::uint32_t p = 0; p < parts && first + p < band_memory::max_parts(limits); ++p)
                m.parts[first + p] = {static_cast<std::uint32_t>(slot), p, parts};
        } else if ((is_short >> lane & 1u) != 0)
            m.short_ones[n_short] = static_cast<std::uint32_t>(slot);
        else if (n_long <= limits.tile_pairs / band_memory::long_list)
            m.long_ones[n_long] = static_cast<std::uint32_t>(slot);
    }
}

template <int = 0>
__global__ __launch_bounds__(threads_per_block) void list_triangles(const __grid_constant__ distance_input in,
                                                                    const __grid_constant__ band_memory m,
                                                                    const pipeline_state* state, capacities limits) {
    if (has_failed(*state, limits)) return;
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= in.geo.num_primitives) return;
    const auto id = static_cast<std::uint32_t>(i);
    const triangle_frame f = in.frames[id];
    if (f.is_wide == 2) return;
    const loaded_triangle t = in.geo.load(id);
    const brick_box near = bricks_near(in, core::bounds(t.a, t.b, t.c, in.geo.snap.fraction));
    const std::int64_t count = near.count();
    if (count > bricks_of_thread) return;
    for (std::int64_t b = 0; b < count; ++b) {
        const glm::ivec3 brick = near.brick(b);
        if (may_meet(in, f, brick)) m.listed[atomicAdd(m.ends + in.brick_number(brick.x, brick.y, brick.z), 1u)] = id;
    }
}
template <int = 0>
__global__ __launch_bounds__(threads_per_block) void list_large_triangles(const __grid_constant__ distance_input in,
                                                                          const __grid_constant__ band_memory m,
                                                                          const pipeline_state* state,
                                                                          capacities limits) {
    if (has_failed(*state, limits)) return;
    for_each_large(in, m, state, limits, [&](std::uint32_t id, std::uint32_t brick) VOXELPIPE_INLINE_LAMBDA {
        m.listed[atomicAdd(m.ends + brick, 1u)] = id;
    });
}

template <int = 0>
void make_band_lists(const distance_input& in, const band_memory& m, pipeline_state* state, const capacities& limits,
                     cudaStream_t stream) {
    constexpr stage where = stage::coarse_raster;
    const auto large = fill_device(limits.tile_records * threads_per_block);
    check(cudaMemsetAsync(m.parts_done, 0, 8 * band_memory::max_parts(limits) * sizeof(std::uint32_t), stream), where);
    place_triangles<0><<<num_blocks(in.geo.num_primitives), threads_per_block, 0, stream>>>(in, m, state, limits);
    check(cudaGetLastError(), where);
    count_large_triangles<0><<<large, threads_per_block, 0, stream>>>(in, m, state, limits);
    check(cudaGetLastError(), where);
    place_bricks<0><<<fill_device(in.num_bricks()), threads_per_block, 0, stream>>>(in.num_bricks(), m, state, limits);
    check(cudaGetLastError(), where);
    list_triangles<0><<<num_blocks(in.geo.num_primitives), threads_per_block, 0, stream>>>(in, m, state, limits);
    check(cudaGetLastError(), where);
    list_large_triangles<0><<<large, threads_per_block, 0, stream>>>(in, m, state, limits);
    check(cudaGetLastError(), where);
}

} // namespace voxelpipe::device
