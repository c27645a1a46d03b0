// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Places the grid, from the user's request and the bounds of the model.

#include "scene.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/grid.hpp>

#include <glm/glm.hpp>

#include <optional>
#include <stdexcept>
#include <string>

namespace voxelize {

// Exactly one of four ways:
//   resolution                     that many cubic voxels along the longest side of the model, centred
//   box                            that many along each axis, cubic, as small as the model allows, centred
//   voxel_size                     voxels of that size on the lattice of its multiples: those that the model's box
//   spans origin, voxel_size, extent     as given
// All but the last leave `padding` voxels on every side in which nothing is drawn; with resolution and box they are
// among the number asked for.
// With voxel_size a face of the box in a plane of the lattice ends there, and rounding noise does not count: 6 voxels
// of 0.1 for 0.60000002. Conservative fragments in the layer beyond, which the box only touches, are cropped. Thin
// fragments of a face in a plane lie in the voxel above it, so thin coverage gets that layer too.
struct grid_request {
    std::optional<int> resolution;
    std::optional<glm::ivec3> box;
    int padding = 0;
    std::optional<glm::dvec3> voxel_size;
    std::optional<glm::dvec3> origin;
    std::optional<glm::ivec3> extent;
    voxelpipe::coverage coverage = voxelpipe::coverage::conservative; // with voxel_size: see above
};

// A request that names no grid: contradictory, or with more voxels than there can be.
struct grid_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct bounding_box {
    glm::dvec3 low{0.0};
    glm::dvec3 high{0.0};
    bool empty = true;

    [[nodiscard]] bool holds(const bounding_box& other) const {
        return other.empty || (!empty && glm::all(glm::lessThanEqual(low, other.low)) &&
                               glm::all(glm::greaterThanEqual(high, other.high)));
    }
    void include(const bounding_box& other) {
        if (other.empty) return;
        low = empty ? other.low : glm::min(low, other.low);
        high = empty ? other.high : glm::max(high, other.high);
        empty = false;
    }
};

// The box around all corners of the scene's triangles, in world space and in double. Positions that are not finite are
// left out. THREADS <= 0 takes one for each core.
[[nodiscard]] bounding_box bounds_of(const scene& model, int threads = 0);

// The origin of positions that are rounded to float for the library to snap: the world's own
// origin, as long as a float there is no coarser than the grid's sub-voxel lattice at any corner of the grid; otherwise
// the grid's lowest corner. So no precision is lost at any distance, and models near the origin are drawn by their
// world positions.
[[nodiscard]] glm::dvec3 reference_point(const voxelpipe::grid& grid);

// One line where the model's own floats are so far apart that its surface may be off by more than an eighth of a voxel,
// with the figures of the worst mesh; empty where they are not. Nothing that the tool does can bring the digits back.
[[nodiscard]] std::string precision_warning(const scene& model, const voxelpipe::grid& grid);

// Throws grid_error.
[[nodiscard]] voxelpipe::grid place_grid(const grid_request& request, const bounding_box& bounds);

} // namespace voxelize
