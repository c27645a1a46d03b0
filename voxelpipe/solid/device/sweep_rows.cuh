// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sorted entries become voxels: a warp takes a row and goes through it 32 voxels at a time, a lane a voxel. The winding
// number of a voxel in a body is the sum of the body's crossings up to it; so is how often the body's surface covers
// it. Nobody else writes to the row's voxels.

#include <voxelpipe/solid/device/crossing_list.cuh>
#include <voxelpipe/solid/device/solid_source.cuh>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>

namespace voxelpipe::device {

// A sweep's parameters.
struct sweep_rules {
    row_grid grid;
    glm::ivec3 offset; // of the computed part in the whole grid
    fill_rule rule;
    solid_extent extent;
    bool count_voxels;
    bool counts_crossings; // the entries; otherwise they have been counted
};

// Entries of a row, or of one body in it.
struct entry_span {
    std::uint64_t begin, end;
};

// A body at a lane's voxel.
struct body_at_voxel {
    std::uint32_t body;
    std::int32_t winding; // there are fewer than 2^31 entries: see max_listed_entries
    bool is_inside;       // by rule and extent
};
inline constexpr std::uint64_t max_listed_entries = 0x7fffffffu;

// Shared memory of a warp.
struct sweep_memory {
    std::int32_t winding[32], cover[32];
};

// The end of the entries from `begin` on that have the same key or, if that is wanted, the same row. All lanes take
// part.
template <bool SameRow>
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t find_end(const crossing_list& list, std::uint64_t begin,
                                                                 std::uint64_t end, std::uint64_t wanted) {
    const unsigned lane = threadIdx.x % 32;
    for (std::uint64_t first = begin;; first += 32) {
        const std::uint64_t i = first + lane;
        const bool is_other = i >= end || (SameRow ? list.row(i) : list.key(i)) != wanted;
        const unsigned others = __ballot_sync(0xffffffffu, static_cast<int>(is_other));
        if (others != 0) return first + static_cast<unsigned>(__ffs(static_cast<int>(others))) - 1;
    }
}

// The sum over the lanes up to this one. All lanes take part.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::int32_t sum_up_to_lane(std::int32_t value) {
    const unsigned lane = threadIdx.x % 32;
    for (unsigned step = 1; step < 32; step *= 2) {
        const std::int32_t other = __shfl_up_sync(0xffffffffu, value, step);
        if (lane >= step) value += other;
    }
    return value;
}
[[nodiscard]] __device__ VOXELPIPE_INLINE std::int32_t sum_of_warp(std::int32_t value) {
    return static_cast<std::int32_t>(__reduce_add_sync(0xffffffffu, static_cast<unsigned>(value)));
}

// One row of a sweep.
struct row_sweep {
    const crossing_list& list;
    const sweep_rules& rules;
    sweep_memory& memory; // of the warp
    std::uint64_t row;
    entry_span entries;

    // Calls f(body, entries of the body) for the bodies of the row, ascending. All lanes take part.
    template <class F>
    __device__ VOXELPIPE_INLINE void for_each_body(F&& f) const {
        if (list.num_bodies == 1) {
            f(0u, entries);
            return;
        }
        for (std::uint64_t begin = entries.begin; begin < entries.end;) {
            const std::uint64_t key = list.key(begin), end = find_end<false>(list, begin, entries.end, key);
            f(static_cast<std::uint32_t>(key - row * list.num_bodies), entry_span{begin, end});
            begin = end;
        }
    }
    // Calls f(body_at_voxel) for the bodies of the row, at voxel x0 + lane. All lanes take part.
    template <class F>
    __device__ VOXELPIPE_INLINE void for_each_body_at(int x0, F&& f) const {
        const unsigned lane = threadIdx.x % 32;
        const bool has_cover = rules.extent != solid_extent::centre;
        for_each_body([&](std::uint32_t body, const entry_span& of_body) VOXELPIPE_INLINE_LAMBDA {
            memory.winding[lane] = memory.cover[lane] = 0;
            __syncwarp();
            std::int32_t winding = 0, cover = 0;
            for (std::uint64_t i = of_body.begin + lane; i < of_body.end; i += 32) {
                const entry_value e{list.values[i]};
                const int at = e.position() - x0;
                if (at >= 32) continue;
                if (at > 0)
                    atomicAdd((e.is_crossing() ? memory.winding : memory.cover) + at, e.step());
                else
                    (e.is_crossing() ? winding : cover) += e.step();
            }
            __syncwarp();
            winding = sum_of_warp(winding) + sum_up_to_lane(memory.winding[lane]);
            bool is_inside = core::is_inside(rules.rule, winding);
            if (has_cover) {
                cover = sum_of_warp(cover) + sum_up_to_lane(memory.cover[lane]);
                is_inside = rules.extent == solid_extent::outer ? is_inside || cover != 0 : is_inside && cover == 0;
            }
            __syncwarp(); // before the memory is written to again
            f(body_at_voxel{body, winding, is_inside && x0 + static_cast<int>(lane) < rules.grid.extent.x});
        });
    }
    // The voxels that a row's entries reach: to the row's end if a body is open, else up to the last entry.
    struct reach {
        std::uint32_t num_open; // bodies
        int begin, end;         // voxels
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE reach find_reach() const {
        reach r{0, rules.grid.extent.x, 0};
        for_each_body([&](std::uint32_t, const entry_span& of_body) VOXELPIPE_INLINE_LAMBDA {
            std::int32_t sum = 0, cover = 0;
            unsigned lowest = static_cast<unsigned>(rules.grid.extent.x), highest = 0;
            for (std::uint64_t i = of_body.begin + threadIdx.x % 32; i < of_body.end; i += 32) {
                const entry_value e{list.values[i]};
                (e.is_crossing() ? sum : cover) += e.step();
                const auto at = static_cast<unsigned>(e.position());
                lowest = at < lowest ? at : lowest;
                highest = at > highest ? at : highest;
            }
            __syncwarp();
            sum = sum_of_warp(sum);
            cover = sum_of_warp(cover);
            const bool is_open = rules.rule == fill_rule::even_odd ? (sum & 1) != 0 : sum != 0;
            r.num_open += static_cast<std::uint32_t>(is_open);
            const auto begin = static_cast<int>(__reduce_min_sync(0xffffffffu, lowest));
            const int end = sum != 0 || cover != 0 ? rules.grid.extent.x
                                                   : static_cast<int>(__reduce_max_sync(0xffffffffu, highest));
            r.begin = begin < r.begin ? begin : r.begin;
            r.end = end > r.end ? end : r.end;
        });
        return r;
    }
};

// Totals of a thread; add_up adds those of a block.
struct sweep_totals {
    unsigned long long open_rows = 0, fragments = 0, discarded = 0, voxels = 0;
    std::uint32_t max_winding = 0;

    __device__ VOXELPIPE_INLINE void see(std::int32_t winding) {
        const auto size = static_cast<std::uint32_t>(winding < 0 ? -winding : winding);
        max_winding = size > max_winding ? size : max_winding;
    }
    // All threads of the block take part.
    __device__ void add_up(const sweep_rules& rules, pipeline_state* state) const {
        if (rules.counts_crossings && blockIdx.x == 0 && threadIdx.x == 0)
            state->solid.crossings = state->list_fragments - state->solid.cover_ends;
        const auto add = [](unsigned long long one, unsigned long long* total) {
            const unsigned long long sum = block_sum(one);
            if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
        };
        add(open_rows, &state->solid.open_rows);
        add(fragments, &state->fragments);
        add(discarded, &state->discarded);
        if (rules.count_voxels) add(voxels, &state->voxels);
        if (rules.rule == fill_rule::even_odd) return;
        const std::uint32_t most = __reduce_max_sync(0xffffffffu, max_winding);
        if (threadIdx.x % 32 == 0 && most != 0)
            atomicMax(&state->solid.max_winding, static_cast<unsigned long long>(most));
    }
};

// Calls f(row_sweep, first entry's number) for each row that has entries; a warp a row.
template <class F>
__device__ VOXELPIPE_INLINE void for_each_row(const crossing_list& list, const sweep_rules& rules, sweep_memory& memory,
                                              std::uint64_t num, F&& f) {
    const unsigned lane = threadIdx.x % 32;
    const std::uint64_t warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t first = (std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block()) * 32;
         first < num; first += warps * 32) {
        const std::uint64_t i = first + lane;
        const std::uint64_t row = i < num ? list.row(i) : ~std::uint64_t{0};
        std::uint64_t previous = __shfl_up_sync(0xffffffffu, row, 1);
        if (lane == 0) previous = first == 0 ? ~std::uint64_t{0} : list.row(first - 1);
        for (unsigned starts = __ballot_sync(0xffffffffu, i < num && row != previous); starts != 0;
             starts &= starts - 1) {
            const int at = __ffs(static_cast<int>(starts)) - 1;
            const std::uint64_t mine = __shfl_sync(0xffffffffu, row, at), begin = first + static_cast<unsigned>(at);
            const std::uint64_t end = find_end<true>(list, begin, num, mine);
            f(row_sweep{list, rules, memory, mine, {begin, end}});
        }
    }
}

} // namespace voxelpipe::device
