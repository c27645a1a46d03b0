// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The counters and flags of a call in progress (pipeline_state) and the capacities of its arrays. Both decide whether a
// call may write to its targets (has_failed).

#include <voxelpipe/core/primitive.hpp>

#include <cstdint>

namespace voxelpipe::device {

// Bits of pipeline_state::index_error: an index that names no vertex, numbers of a subset that do not ascend below its
// whole, or that the work before the call asks for nothing to be written (workspace_view::stop).
inline constexpr unsigned int bad_index = 1, bad_numbers = 2, stopped = 4;

// Lies in global memory and is zero when a call starts. Totals go on counting past a capacity, so they say how much is
// needed.
struct pipeline_state {
    unsigned long long nonfinite, too_far, zero_area, outside, drawn;
    unsigned long long fragments, discarded, voxels;
    unsigned long long tile_pairs, tile_records;         // coarse raster
    unsigned long long list_fragments, fragment_records; // A-buffer
    unsigned long long list_voxels;
    unsigned long long filtered, kept; // listed fragments that the shader discards, and all others
    unsigned int index_error;          // bad_index, bad_numbers, stopped
    // Tile split; solids: the last two count long rows; distances: short lists, long ones, parts of the longest ones.
    unsigned int num_items, num_splits, num_images;
    unsigned int has_wide_splits;   // tile split: 1 if a tile has many images
    unsigned int next_item;         // fine raster; solids: entries that have a place
    unsigned int num_ordered[5];    // fragment order: lengths of order_lists
    unsigned long long longest_run; // of those, the longest run of one voxel that is too long for a block
    struct {
        unsigned long long split, lengths[4];
        unsigned long long setups_ready; // split triangles whose setup is kept (split_setup)
        unsigned long long drawn;        // 1 if a deferred pass has drawn them
        [[nodiscard]] VOXELPIPE_HD bool are_none() const {
            return (split | lengths[0] | lengths[1] | lengths[2] | lengths[3]) == 0;
        }
        // Triangles that would be left to a deferred pass, or ~0 if any is more than little work for one thread. Tiny
        // thin triangles only wait for others of their warp, so they do not count.
        [[nodiscard]] VOXELPIPE_HD unsigned long long num_deferred(coverage rule) const {
            if ((split | lengths[2] | lengths[3]) != 0) return ~0ull;
            return rule == coverage::thin ? lengths[1] : lengths[0] + lengths[1];
        }
    } deferred; // one draw's triangles that the first pass leaves (deferred_triangles)
    struct {
        unsigned long long crossings;
        unsigned long long cover_ends; // listed: where runs of covered voxels begin and end
        unsigned long long open_rows, max_winding;
        unsigned long long next_large; // row_triangles
    } solid;                           // solid/
    struct {
        unsigned long long nodes, bricks, voxels;
    } sparse; // what a sparse call in the caller's memory needs

    // The counter of triangles of this kind.
    [[nodiscard]] VOXELPIPE_HD unsigned long long* counter_of(core::triangle_class kind) {
        using core::triangle_class;
        return kind == triangle_class::nonfinite   ? &nonfinite
               : kind == triangle_class::too_far   ? &too_far
               : kind == triangle_class::zero_area ? &zero_area
               : kind == triangle_class::outside   ? &outside
                                                   : &drawn;
    }

    // For capacities::longest_ordered: 0 if the windows order all voxels, 1 if a block can take the longest that they
    // leave.
    [[nodiscard]] VOXELPIPE_HD unsigned long long longest_ordered() const {
        return longest_run != 0 ? longest_run : (num_ordered[0] | num_ordered[1] | num_ordered[2]) != 0 ? 1 : 0;
    }
};

// Who draws the triangles that the first pass would defer. As wide as the members of `capacities`, so that these have
// no padding (call_bytes).
enum class deferral : unsigned long long {
    // The deferred pass draws all of them.
    by_pass,
    // A block of the first pass that has few at its end draws these itself. The deferred pass draws those of other
    // blocks.
    by_blocks_then_pass,
    // The blocks draw theirs, and there is no deferred pass. The call fails if a block has many.
    by_blocks,
};

// Lengths of a call's arrays. Elements that do not fit are counted but not written.
struct capacities {
    unsigned long long tile_pairs, tile_records, fragments, fragment_records;
    // Kernels for voxels of more fragments than this are not launched, because earlier calls like this one hardly
    // needed them.
    unsigned long long longest_ordered = ~0ull;
    deferral deferred = deferral::by_pass;
};

// True if triangles were deferred and no deferred pass has drawn them.
[[nodiscard]] VOXELPIPE_HD inline bool misses_deferred(const pipeline_state& s, const capacities& c) {
    return c.deferred == deferral::by_blocks && s.deferred.drawn == 0 && !s.deferred.are_none();
}
// True if the call must not write its targets: an index is out of range, or something did not fit.
[[nodiscard]] VOXELPIPE_HD inline bool has_failed(const pipeline_state& s, const capacities& c) {
    return s.index_error != 0 || s.tile_pairs > c.tile_pairs || s.tile_records > c.tile_records ||
           s.list_fragments > c.fragments || s.fragment_records > c.fragment_records ||
           s.longest_ordered() > c.longest_ordered || misses_deferred(s, c);
}

} // namespace voxelpipe::device
