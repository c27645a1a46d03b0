// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree whose equal subtrees are stored once, as host and device read it.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/octree_view.hpp>

#include <cstdint>

namespace voxelpipe {

// Reads a graph in host or device memory; does not own it.
struct octree_dag_view {
    int num_levels = 0;                                    // the root is node 0 of level num_levels
    const std::uint8_t* masks[octree_view::max_levels]{};  // of level l at [l - 1]; as octree_view's
    const std::uint32_t* first[octree_view::max_levels]{}; // place of a node's first child in `children`; not level 1
    const std::uint32_t* children[octree_view::max_levels]{}; // numbers of nodes of the level below; not level 1

    // True if a voxel exists, in the numbers of the whole grid; false outside.
    [[nodiscard]] VOXELPIPE_HD bool contains(const glm::ivec3& voxel) const {
        if (num_levels == 0) return false;
        for (int a = 0; a < 3; ++a)
            if (voxel[a] < 0 || voxel[a] >> num_levels != 0) return false;
        std::uint32_t n = 0;
        for (int l = num_levels;; --l) {
            const auto c = static_cast<unsigned>((voxel.x >> (l - 1) & 1) | (voxel.y >> (l - 1) & 1) << 1 |
                                                 (voxel.z >> (l - 1) & 1) << 2);
            const unsigned mask = masks[l - 1][n];
            if (mask == 0) return true; // a tile
            if ((mask >> c & 1u) == 0) return false;
            if (l == 1) return true;
            n = children[l - 1][first[l - 1][n] + core::count_ones(mask & ((1u << c) - 1))];
        }
    }
};

} // namespace voxelpipe
