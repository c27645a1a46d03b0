// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the voxels lie: from what the user asks for and the bounds of the model to a grid.

#include "scene.hpp"

#include <voxelpipe/grid.hpp>

#include <glm/glm.hpp>

#include <optional>
#include <stdexcept>

namespace voxelize {

// Exactly one of three ways:
//   resolution                     that many cubic voxels along the longest side of the model, centred
//   voxel_size                     voxels of that size on the lattice of its multiples, as many as the model needs
//   origin, voxel_size, extent     as given
// The first two leave `padding` voxels free on every side; with resolution they are among the number asked for.
struct grid_request {
    std::optional<int> resolution;
    int padding = 0;
    std::optional<glm::dvec3> voxel_size;
    std::optional<glm::dvec3> origin;
    std::optional<glm::ivec3> extent;
};

// A request that names no grid: contradictory, or with more voxels than there can be.
struct grid_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct bounding_box {
    glm::dvec3 low{0.0};
    glm::dvec3 high{0.0};
    bool empty = true;
};

// Of the corners of the scene's triangles; those with a position that is not finite are left out.
[[nodiscard]] bounding_box bounds_of(const scene& model);

// Throws grid_error.
[[nodiscard]] voxelpipe::grid place_grid(const grid_request& request, const bounding_box& bounds);

} // namespace voxelize
