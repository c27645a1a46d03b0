// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A connected component of voxels, as label (label.hpp) lists them.

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe {

// The voxel (i, j, k) of a grid of nx * ny * nz has the number i + nx * (j + ny * k).
struct voxel_component {
    std::int64_t name;    // the lowest number of its voxels, which is their label
    std::uint64_t voxels; // 1 or more
    glm::ivec3 min;       // lowest voxel of its bounding box
    glm::ivec3 max;       // highest voxel of its bounding box, which belongs to the box
    friend bool operator==(const voxel_component&, const voxel_component&) = default;
};

} // namespace voxelpipe
