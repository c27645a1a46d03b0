// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Size classes of triangles: what a triangle costs, and who draws it.

#include <voxelpipe/device/scene/triangle_source.cuh>

namespace voxelpipe::device {

inline constexpr int raster_threads = 128; // of a block
inline constexpr int raster_warps = raster_threads / 32;
// Longest side of a bounding box that is drawn without a loop (raster_tiny).
template <coverage Rule>
inline constexpr int max_tiny_side = Rule == coverage::thin ? 2 : 3;
inline constexpr int max_short_side = 8; // longest side of a box whose rows fit a byte
inline constexpr int max_long_side = 16; // longest side of a box whose rows fit 16 bits
inline constexpr int max_cells = 1024;   // most voxels of a box that one thread draws
inline constexpr int small_cells = 27;   // most voxels of size_class::thread
inline constexpr int small_columns = 12; // the same for thin coverage, in columns of voxels
inline constexpr int max_columns = 192;  // thin: most columns that one thread draws

// Classes of triangles by the cost of their bounding boxes. Larger ones are split into work items
// (split_triangles.cuh).
struct size_class {
    enum : int {
        tiny,         // one thread, without a loop (raster_tiny)
        thread,       // one thread
        thread_heavy, // one thread, much work: drawn apart from the others, so that lanes of a warp finish together
        warp_group,   // group_lanes lanes
        count
    };
};

// Classifies a triangle by its cost: voxels of its bounding box, or for thin coverage the most columns that it can
// touch. `most`: the box's longest side.
template <coverage Rule>
[[nodiscard]] __device__ VOXELPIPE_INLINE int size_class_of(const int32_triangle& r, int most) {
    constexpr bool thin = Rule == coverage::thin;
    if (most <= max_tiny_side<Rule>) return size_class::tiny;
    const int x = r.last[0] + 1, y = r.last[1] + 1, z = r.last[2] + 1;
    const int cost = thin ? core::max3(x * y, y * z, z * x) : x * y * z;
    if (cost <= (thin ? small_columns : small_cells) && (thin || most <= max_short_side)) return size_class::thread;
    return cost <= (thin ? max_columns : max_cells) && (thin || most <= max_long_side) ? size_class::thread_heavy
                                                                                       : size_class::warp_group;
}

} // namespace voxelpipe::device
