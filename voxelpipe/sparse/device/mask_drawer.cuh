// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Draws pairs of a triangle and a brick, 32 at a time (sparse/device/mask_pass.cuh).

#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/sparse/device/brick_index.cuh>
#include <voxelpipe/sparse/device/mask_setups.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The offset of a brick of the raster from the lowest voxel of a triangle's box, in the axes of its rows.
template <class Setup>
[[nodiscard]] __device__ VOXELPIPE_INLINE core::triple<int> offset_of_brick(const Setup& s, int x, int y, int z) {
    return core::turn_to_row(s.row(), (x << log2_mask_brick) - s.lowest(0), (y << log2_mask_brick) - s.lowest(1),
                             (z << log2_mask_brick) - s.lowest(2));
}

// The setup of a pair's triangle.
template <bool Large>
[[nodiscard]] __device__ VOXELPIPE_INLINE decltype(auto) mask_setup_of(mask_memory& memory, unsigned slot) {
    if constexpr (Large)
        return static_cast<const large_mask_triangle&>(memory.large[slot]);
    else
        return mask_column{memory.small, slot};
}

// The sum of `value` over the lanes before this one, and over all. All lanes call it.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned exclusive_sum(unsigned value, unsigned& total) {
    const unsigned lane = threadIdx.x % 32;
    unsigned sum = value;
    for (unsigned d = 1; d < 32; d *= 2) {
        const unsigned other = __shfl_up_sync(0xffffffffu, sum, d);
        if (lane >= d) sum += other;
    }
    total = uniform(sum);
    return sum - value;
}

// ---- 32 pairs -------------------------------------------------------------------------------------------------------
// Three functions out of line, so that the code that all warps run stays in the instruction cache: with four copies of
// it, two thirds of all cycles were waits for instructions.

// Finds the rows of each lane's pair, of n pairs from number `first` on.
template <bool Large, class Call>
__device__ __noinline__ void find_mask_rows(const Call& call, mask_memory& memory, int first, int n) {
    const unsigned lane = threadIdx.x % 32;
    std::uint64_t met = 0;
    if (static_cast<int>(lane) < n) {
        const auto& out = call.out;
        const mask_pair p = memory.pairs[first + static_cast<int>(lane)];
        const auto& s = mask_setup_of<Large>(memory, p.slot);
        const int row = s.row();
        const int at[3] = {p.x << log2_mask_brick, p.y << log2_mask_brick, p.z << log2_mask_brick};
        int from[3], to[3];
        for (int k = 0; k < 3; ++k) {
            const int low = s.first(k) - at[k], high = s.last(k) - at[k];
            from[k] = low > 0 ? low : 0;
            to[k] = high < core::mask_brick_size - 1 ? high : core::mask_brick_size - 1;
        }
        const auto begin = core::turn_to_row(row, from[0], from[1], from[2]),
                   end = core::turn_to_row(row, to[0], to[1], to[2]);
        const core::small_conservative q = core::in_mask_brick(s, offset_of_brick(s, p.x, p.y, p.z));
        const core::near_plane plane(q.n, q.below, q.above, 0, true);
        for (int k = 0; k < 3; ++k) memory.planes[k][lane] = plane.n[k];
        memory.planes[3][lane] = plane.middle;
        memory.planes[4][lane] = plane.half;
        memory.planes[5][lane] = plane.inverse;
        const core::mask_rows rows(q, {{begin[0], begin[1], begin[2]}, {end[0], end[1], end[2]}});
        met = rows.met;
        memory.limits[0][lane] = static_cast<word>(rows.by_across);
        memory.limits[1][lane] = static_cast<word>(rows.by_across >> 32);
        memory.limits[2][lane] = static_cast<word>(rows.by_deep);
        memory.limits[3][lane] = static_cast<word>(rows.by_deep >> 32);
        memory.axes[lane] = static_cast<word>(row);
        memory.bricks[lane] = out.level.number_of(short_morton_key((at[0] + out.lead.x) >> log2_mask_brick,
                                                                   (at[1] + out.lead.y) >> log2_mask_brick,
                                                                   (at[2] + out.lead.z) >> log2_mask_brick));
    }
    memory.met[0][lane] = static_cast<word>(met);
    memory.met[1][lane] = static_cast<word>(met >> 32);
}

// A row whose plane floats cannot decide.
template <bool Large>
[[nodiscard]] __device__ __noinline__ word mask_row_by_integers(mask_memory& memory, int pair, int across, int deep,
                                                                word limit) {
    const mask_pair p = memory.pairs[pair];
    const auto& s = mask_setup_of<Large>(memory, p.slot);
    core::small_conservative q;
    for (int k = 0; k < 3; ++k) q.n[k] = s.normal(k);
    s.plane(offset_of_brick(s, p.x, p.y, p.z), q.below, q.above);
    return q.plane_bits(0, across, deep, limit);
}

// Draws the rows that were found, whatever pairs they are of, and writes the words of each lane's brick. Returns the
// lane's number of fragments. masks: 16 words a brick.
template <int = 0>
__device__ __noinline__ unsigned draw_mask_rows(mask_memory& memory, int first, bool are_large, word* masks) {
    constexpr unsigned all = 0xffffffffu;
    const unsigned lane = threadIdx.x % 32;
    unsigned fragments = 0;
    for (int w = 0; w < 16; ++w) memory.bits[lane][w] = 0;
    std::uint64_t met = memory.met[0][lane] | std::uint64_t{memory.met[1][lane]} << 32;
    while (__any_sync(all, met != 0)) {
        unsigned mine = static_cast<unsigned>(__popcll(met)), total = 0;
        if (mine > mask_memory::rows_each) mine = mask_memory::rows_each;
        unsigned at = exclusive_sum(mine, total);
        for (; mine != 0; --mine, met &= met - 1)
            memory.rows[at++] =
                static_cast<std::uint16_t>(static_cast<unsigned>(__ffsll(static_cast<long long>(met)) - 1) | lane << 6);
        __syncwarp();
        for (unsigned i = lane; i < total; i += 32) {
            const unsigned code = memory.rows[i], of = code >> 6;
            const int across = static_cast<int>(code & 7u), deep = static_cast<int>(code >> 3 & 7u);
            const word limit = memory.limits[across >> 2][of] >> (8 * (across & 3)) &
                               memory.limits[2 + (deep >> 2)][of] >> (8 * (deep & 3)) & 255u;
            if (limit == 0) continue;
            core::near_plane plane;
            for (int k = 0; k < 3; ++k) plane.n[k] = memory.planes[k][of];
            plane.middle = memory.planes[3][of];
            plane.half = memory.planes[4][of];
            plane.inverse = memory.planes[5][of];
            bool sure = false;
            word bits = plane.clip(exact::lowest_one(limit), exact::highest_one(limit), across, deep, sure);
            if (!sure) {
                const int pair = first + static_cast<int>(of);
                bits = are_large ? mask_row_by_integers<true>(memory, pair, across, deep, limit)
                                 : mask_row_by_integers<false>(memory, pair, across, deep, limit);
            }
            fragments += static_cast<unsigned>(__popc(bits));
            core::place_mask_row(static_cast<int>(memory.axes[of]), across, deep, bits,
                                 [&](unsigned w, word part)
                                     VOXELPIPE_INLINE_LAMBDA { atomicOr(&memory.bits[of][w], part); });
        }
        __syncwarp();
    }
    auto* const mask = reinterpret_cast<unsigned long long*>(masks + std::uint64_t{memory.bricks[lane]} * 16);
#pragma unroll 1
    for (int w = 0; w < 8; ++w) {
        const unsigned long long bits =
            memory.bits[lane][2 * w] | static_cast<unsigned long long>(memory.bits[lane][2 * w + 1]) << 32;
        if (bits != 0) atomicOr(mask + w, bits);
    }
    return fragments;
}

// ---- all pairs of a warp --------------------------------------------------------------------------------------------

template <bool Large, class Call>
struct mask_drawer {
    const Call& call;
    mask_memory& memory;
    unsigned lane = threadIdx.x % 32;
    unsigned fragments = 0;
    int waiting = 0;

    // Queues the pair of each lane that meets its triangle, and draws 32 of them as soon as 32 wait. All lanes call it.
    __device__ VOXELPIPE_INLINE void push(bool wanted, const mask_pair& p) {
        if (wanted) {
            const auto& s = mask_setup_of<Large>(memory, p.slot);
            wanted = core::meets_mask_brick(s, offset_of_brick(s, p.x, p.y, p.z));
        }
        const int slot = take_slot(wanted, waiting);
        if (wanted) memory.pairs[slot] = p;
        if (waiting >= 32) draw(waiting - 32);
    }
    // Draws what waits. All lanes call it.
    __device__ VOXELPIPE_INLINE void flush() {
        if (waiting != 0) draw(0);
    }

private:
    // Draws the pairs from number `first` on, at most 32.
    __device__ VOXELPIPE_INLINE void draw(int first) {
        __syncwarp();
        find_mask_rows<Large>(call, memory, first, waiting - first);
        __syncwarp();
        fragments += draw_mask_rows<0>(memory, first, Large, reinterpret_cast<word*>(call.out.masks));
        __syncwarp();
        waiting = first;
    }
};

} // namespace voxelpipe::device
