// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Size classes of triangles: what a triangle costs, and who draws it.

#include <voxelpipe/device/scene/int32_triangle.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

namespace voxelpipe::device {

inline constexpr int raster_warps = tuning::raster_threads / 32; // of a block
inline constexpr int max_short_side = 8;                         // longest side of a box whose rows fit a byte
inline constexpr int max_long_side = 16;                         // longest side of a box whose rows fit 16 bits

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
    if (most <= tuning::max_tiny_side<Rule>) return size_class::tiny;
    const int x = r.last[0] + 1, y = r.last[1] + 1, z = r.last[2] + 1;
    const int cost = thin ? core::max3(x * y, y * z, z * x) : x * y * z;
    if (cost <= (thin ? tuning::small_columns : tuning::small_cells) && (thin || most <= max_short_side))
        return size_class::thread;
    return cost <= (thin ? tuning::max_columns : tuning::max_cells) && (thin || most <= max_long_side)
               ? size_class::thread_heavy
               : size_class::warp_group;
}

} // namespace voxelpipe::device
