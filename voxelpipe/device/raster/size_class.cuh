// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Classes of triangles by what they cost, and the sizes that part them.

#include <voxelpipe/device/scene/triangle_source.cuh>

namespace voxelpipe::device {

inline constexpr int raster_threads = 128; // of a block
inline constexpr int raster_warps = raster_threads / 32;
// A bounding box of so many voxels a side is done without a loop over it (raster_tiny).
template <coverage Rule>
inline constexpr int most_tiny_side = Rule == coverage::thin ? 2 : 3;
inline constexpr int most_side = 8;       // a bounding box of so many voxels a side has rows of a byte
inline constexpr int most_long_side = 16; // one has rows of 16 bits
inline constexpr int most_cells = 1024;   // one of so many voxels is one thread's work
inline constexpr int small_cells = 27;    // one of so many voxels waits apart from the larger ones
inline constexpr int small_columns = 12;  // the same for thin coverage, in columns of voxels
inline constexpr int most_columns = 192;  // thin: one thread's work

// By what bounding boxes hold: what raster_tiny takes; one thread's work; the same, but much; several lanes' work.
enum triangle_kind : int { tiny_triangles, small_triangles, large_triangles, medium_triangles, num_triangle_kinds };

// What a triangle costs: voxels of its bounding box, or for thin coverage the columns that it can touch at most.
// `most`: the box's longest side.
template <coverage Rule>
[[nodiscard]] __device__ VOXELPIPE_INLINE int kind_of(const near_triangle& r, int most) {
    constexpr bool thin = Rule == coverage::thin;
    if (most <= most_tiny_side<Rule>) return tiny_triangles;
    const int x = r.last[0] + 1, y = r.last[1] + 1, z = r.last[2] + 1;
    const int cost = thin ? core::max3(x * y, y * z, z * x) : x * y * z;
    if (cost <= (thin ? small_columns : small_cells) && (thin || most <= most_side)) return small_triangles;
    return cost <= (thin ? most_columns : most_cells) && (thin || most <= most_long_side) ? large_triangles
                                                                                          : medium_triangles;
}

} // namespace voxelpipe::device
