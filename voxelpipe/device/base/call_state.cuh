// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The counters and flags of a call in progress (pipeline_state) and the capacities of its arrays. Both decide whether a
// call may write to its targets (has_failed).

#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::device {

// In global memory, zeroed when a call starts. Totals go on counting past a capacity, so that they say what is needed.
struct pipeline_state {
    unsigned long long nonfinite, too_far, zero_area, outside, drawn;
    unsigned long long fragments, discarded, voxels;
    unsigned long long tile_pairs, tile_records;         // coarse raster
    unsigned long long list_fragments, fragment_records; // A-buffer
    unsigned long long list_voxels;
    unsigned long long filtered, kept; // of listed fragments: those that the shader discards, and all others
    unsigned int index_error;
    unsigned int num_items, num_splits, num_images; // tile split
    unsigned int next_item;                         // fine raster
    unsigned int num_ordered[5];                    // fragment order: order_lists
    unsigned long long longest_run;                 // of those, fragments of a voxel that no block takes
    struct {
        unsigned long long split, lengths[4];
        unsigned long long set_up; // of what is split, what all its pieces need
        [[nodiscard]] VOXELPIPE_HD bool are_none() const {
            return (split | lengths[0] | lengths[1] | lengths[2] | lengths[3]) == 0;
        }
        // How many there are that a first kernel by itself would be left with at its end, or ~0 where some are more
        // than little work for one thread. Thin tiny ones wait for others of their warp only.
        [[nodiscard]] VOXELPIPE_HD unsigned long long num_deferred(coverage rule) const {
            if ((split | lengths[2] | lengths[3]) != 0) return ~0ull;
            return rule == coverage::thin ? lengths[1] : lengths[0] + lengths[1];
        }
    } deferred; // direct raster, of one draw: deferred_triangles

    // See capacities: 0 where the windows put all voxels in order, 1 where a block takes the longest that they leave.
    [[nodiscard]] VOXELPIPE_HD unsigned long long longest_ordered() const {
        return longest_run != 0 ? longest_run : (num_ordered[0] | num_ordered[1] | num_ordered[2]) != 0 ? 1 : 0;
    }
};

// How many elements the arrays of a call have. What does not fit is counted, not written.
struct capacities {
    unsigned long long tile_pairs, tile_records, fragments, fragment_records;
    // What a call is launched without, for the one before it hardly needed that: kernels for voxels of more fragments,
    // and a second kernel of a draw.
    unsigned long long longest_ordered = ~0ull;
    unsigned long long skips_deferred_pass =
        0; // or 1: the first kernel does it all. As wide as the rest, see call_bytes
};

// Whether triangles were handed on to a kernel that has not been launched.
[[nodiscard]] VOXELPIPE_HD inline bool misses_deferred(const pipeline_state& s, const capacities& c) {
    return c.skips_deferred_pass != 0 && !s.deferred.are_none();
}
// Whether the call must not write anything: a bad index, or something that did not fit.
[[nodiscard]] VOXELPIPE_HD inline bool has_failed(const pipeline_state& s, const capacities& c) {
    return s.index_error != 0 || s.tile_pairs > c.tile_pairs || s.tile_records > c.tile_records ||
           s.list_fragments > c.fragments || s.fragment_records > c.fragment_records ||
           s.longest_ordered() > c.longest_ordered || misses_deferred(s, c);
}

} // namespace voxelpipe::device
