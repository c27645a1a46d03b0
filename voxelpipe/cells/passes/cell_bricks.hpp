// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks and tiles of rows of cells, which are runs of voxels with the same values (cell_runs.hpp): the runs of cells
// of 2^n voxels a side that have one value, masks, and values by rank. Functors for Backend::for_each, the same on
// every backend.

#include <voxelpipe/cells/passes/cell_runs.hpp>
#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/sparse/passes/row_runs.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core::passes {

// Runs of parents whose eight children are of one value, from those of their children's rows, as join_rows<true>; with
// the number of a run of voxels that has the value. Counted where `counts` is not null, with a 0 behind the last
// parent.
template <class Values>
struct join_equal_rows {
    const std::uint64_t* first_child;
    std::uint64_t count; // parents
    run_view from;
    const std::uint32_t* sources; // runs of voxels, of each run; null: its own number
    const Values* values;
    std::uint32_t* counts;
    const std::uint64_t* first;
    std::uint32_t *bounds, *to_sources;

    VOXELPIPE_HD void operator()(std::uint64_t p) const {
        std::uint32_t made = 0;
        if (p < count && first_child[p + 1] - first_child[p] == 4) {
            std::uint64_t at[4], end[4];
            for (int c = 0; c < 4; ++c) {
                at[c] = from.first[first_child[p] + static_cast<std::uint64_t>(c)];
                end[c] = from.first[first_child[p] + static_cast<std::uint64_t>(c) + 1];
            }
            while (at[0] < end[0] && at[1] < end[1] && at[2] < end[2] && at[3] < end[3]) {
                std::uint32_t low = 0, high = ~0u;
                for (const std::uint64_t a : at) {
                    low = from.bounds[a] > low ? from.bounds[a] : low;
                    high = from.bounds[a + 1] < high ? from.bounds[a + 1] : high;
                }
                const std::uint32_t b = (low + 1) >> 1, e = high >> 1;
                if (b < e && are_equal(at)) {
                    if (counts == nullptr) {
                        bounds[first[p] + made] = b;
                        bounds[first[p] + made + 1] = e;
                        to_sources[(first[p] + made) / 2] = source_of(at[0]);
                    }
                    made += 2;
                }
                for (std::uint64_t& a : at)
                    if (from.bounds[a + 1] == high) a += 2;
            }
        }
        if (counts != nullptr) counts[p] = made;
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t source_of(std::uint64_t bound) const {
        return sources == nullptr ? static_cast<std::uint32_t>(bound / 2) : sources[bound / 2];
    }
    [[nodiscard]] VOXELPIPE_HD bool are_equal(const std::uint64_t (&at)[4]) const {
        const std::uint32_t one = source_of(at[0]);
        bool equal = true;
        for (int c = 1; c < 4; ++c) {
            const std::uint32_t other = source_of(at[c]);
            equal = equal && (one == other || are_same_bits(values[one], values[other]));
        }
        return equal;
    }
};

// ---- bricks and tiles -----------------------------------------------------------------------------------------------

// The Morton key of what has this key where x is along rows of an axis. turn_key(turn_key(k, axis), (3 - axis) % 3) is
// k.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t turn_key(std::uint64_t key, int axis) {
    if (axis == 0) return key;
    constexpr std::uint64_t low = 0x1249249249249249u;
    const std::uint64_t a = key & low, b = key >> 1 & low, c = key >> 2 & low;
    return axis == 1 ? c | a << 1 | b << 2 : b | c << 1 | a << 2;
}
struct turn_keys {
    std::uint64_t* keys;
    int axis;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { keys[i] = turn_key(keys[i], axis); }
};

// Rows of voxels and their runs, for bricks that are listed by key with their rows of bricks.
struct brick_rows {
    const std::uint64_t* keys;
    const std::uint32_t* rows;      // of bricks
    const std::uint64_t* first_row; // of voxels, for each row of bricks
    const std::uint64_t* row_keys;  // of rows of voxels
    run_view runs;
    int axis;

    // Calls visit(voxel's number in the brick, run) for the voxels of brick i in row r that exist.
    template <class Visit>
    VOXELPIPE_HD void for_each_voxel(std::uint64_t i, std::uint64_t r, Visit&& visit) const {
        const std::uint32_t low = gather_bits(turn_key(keys[i], (3 - axis) % 3)) * 8;
        const std::uint64_t end = runs.first[r + 1];
        std::uint64_t a = runs.first[r], b = end; // the first run that ends behind `low`
        while (a < b) {
            const std::uint64_t middle = a + (b - a) / 4 * 2;
            if (runs.bounds[middle + 1] <= low)
                a = middle + 2;
            else
                b = middle;
        }
        for (; a < end && runs.bounds[a] < low + 8; a += 2) {
            const std::uint32_t from = runs.bounds[a] > low ? runs.bounds[a] : low;
            const std::uint32_t to = runs.bounds[a + 1] < low + 8 ? runs.bounds[a + 1] : low + 8;
            for (std::uint32_t x = from; x < to; ++x)
                visit(static_cast<unsigned>(turn_key((row_keys[r] & 511u) | spread_bits(x - low), axis)), a / 2);
        }
    }
};
// The masks of bricks, and the numbers of their voxels, with a 0 behind the last.
struct make_cell_masks {
    brick_rows bricks;
    std::uint64_t count;
    brick_mask* masks;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        counts[i] = 0;
        if (i == count) return;
        brick_mask mask;
        for (std::uint64_t r = bricks.first_row[bricks.rows[i]]; r < bricks.first_row[bricks.rows[i] + 1]; ++r)
            bricks.for_each_voxel(
                i, r, [&](unsigned bit, std::uint64_t) { mask.words[bit >> 6] |= std::uint64_t{1} << (bit & 63u); });
        masks[i] = mask;
        counts[i] = mask.count();
    }
};
// A value by its rank. Other threads may change other bits of a word.
template <class Target>
VOXELPIPE_HD void store_by_rank(typename rank_map<Target>::element* to, std::uint64_t rank,
                                const typename Target::value_type& value) {
    if constexpr (rank_map<Target>::is_bit)
        store_shared(to[rank >> 5], 1u << (rank & 31u), value);
    else
        rank_map<Target>::store(to, rank, value);
}
// Values of target I in the voxels of bricks: call 64 i + k has row k of brick i.
template <std::size_t I, class Target, class Values>
struct store_brick_values {
    brick_rows bricks;
    const brick_mask* masks;
    const std::uint64_t* offsets;
    const Values* values;
    typename rank_map<Target>::element* to;

    VOXELPIPE_HD void operator()(std::uint64_t call) const {
        const std::uint64_t i = call / 64, r = bricks.first_row[bricks.rows[i]] + call % 64;
        if (r >= bricks.first_row[bricks.rows[i] + 1]) return;
        bricks.for_each_voxel(i, r, [&](unsigned bit, std::uint64_t run) {
            store_by_rank<Target>(to, offsets[i] + masks[i].before(bit), voxelpipe::get<I>(values[run]));
        });
    }
};
// Those of the tiles, whose ranks begin with `first`.
template <std::size_t I, class Target, class Values>
struct store_tile_values {
    const std::uint32_t* sources;
    const Values* values;
    std::uint64_t first;
    typename rank_map<Target>::element* to;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        store_by_rank<Target>(to, first + i, voxelpipe::get<I>(values[sources[i]]));
    }
};
// Cells of 2^log2_bricks bricks a side as tiles, and the run of voxels that has a tile's value.
struct make_cell_tiles {
    const std::uint64_t* keys;
    const std::uint32_t* rows; // of each cell
    run_view runs;
    const std::uint32_t* sources; // of each run
    int log2_bricks, axis;
    std::uint64_t* to;
    std::uint32_t* to_sources;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t begin = runs.first[rows[i]] / 2, end = runs.first[rows[i] + 1] / 2;
        const std::uint32_t x = gather_bits(keys[i]);
        const std::uint64_t run =
            begin + bisect(end - begin, [&](std::uint64_t k) { return runs.bounds[2 * (begin + k)] <= x; }) - 1;
        to[i] = brick_tile::of(turn_key(keys[i] << (3 * log2_bricks), axis), log2_bricks).bits;
        to_sources[i] = sources[run];
    }
};

} // namespace voxelpipe::core::passes
