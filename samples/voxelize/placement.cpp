// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "placement.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace voxelize {

namespace {

// Keeps surfaces that lie in the faces of the bounding box off the grid's border, where rounding would decide whether
// they are inside: a ten-thousandth of the longest side.
constexpr double margin = 1e-4;

[[noreturn]] void too_many_voxels(double count, int axis) {
    throw grid_error("the grid would have " + std::to_string(static_cast<long long>(std::fmin(count, 9e18))) +
                     " voxels along " + "xyz"[axis] + ", the most is " + std::to_string(voxelpipe::grid::max_extent));
}

voxelpipe::grid fit_resolution(int resolution, int padding, const bounding_box& bounds) {
    const int inner = resolution - 2 * padding;
    if (inner < 1)
        throw grid_error("--padding " + std::to_string(padding) + " leaves nothing of --resolution " +
                         std::to_string(resolution));
    const glm::dvec3 size = bounds.high - bounds.low;
    const double longest = std::max({size.x, size.y, size.z});
    const double voxel = longest > 0 ? longest * (1 + 2 * margin) / inner : 1.0;
    voxelpipe::grid grid;
    grid.voxel_size = glm::dvec3(voxel);
    for (int axis = 0; axis < 3; ++axis) {
        const double wanted = std::ceil((size[axis] + 2 * margin * longest) / voxel);
        grid.extent[axis] = static_cast<int>(std::clamp(wanted, 1.0, static_cast<double>(inner))) + 2 * padding;
        grid.origin[axis] = std::fma(-0.5 * grid.extent[axis], voxel, 0.5 * bounds.low[axis] + 0.5 * bounds.high[axis]);
    }
    return grid;
}

voxelpipe::grid fit_voxel_size(const glm::dvec3& voxel, int padding, const bounding_box& bounds) {
    voxelpipe::grid grid;
    grid.voxel_size = voxel;
    for (int axis = 0; axis < 3; ++axis) {
        const double first = std::floor(bounds.low[axis] / voxel[axis]) - padding;
        const double last = std::max(std::ceil(bounds.high[axis] / voxel[axis]) + padding, first + 1 + 2 * padding);
        if (!(last - first <= voxelpipe::grid::max_extent)) too_many_voxels(last - first, axis);
        grid.extent[axis] = static_cast<int>(last - first);
        grid.origin[axis] = first * voxel[axis];
    }
    return grid;
}

} // namespace

bounding_box bounds_of(const scene& model) {
    bounding_box box;
    for (const primitive& part : model.primitives) {
        for (const glm::uvec3& corners : part.triangles) {
            for (int i = 0; i < 3; ++i) {
                const glm::dvec3 p = part.positions[corners[i]];
                if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
                box.low = box.empty ? p : glm::min(box.low, p);
                box.high = box.empty ? p : glm::max(box.high, p);
                box.empty = false;
            }
        }
    }
    return box;
}

voxelpipe::grid place_grid(const grid_request& request, const bounding_box& bounds) {
    if (request.padding < 0) throw grid_error("--padding cannot be negative");
    voxelpipe::grid grid;
    if (request.origin || request.extent) {
        if (!request.origin || !request.extent || !request.voxel_size)
            throw grid_error("an exact grid needs all three of --origin, --voxel-size and --extent");
        if (request.resolution || request.padding != 0)
            throw grid_error("--resolution and --padding do not go with --origin and --extent");
        grid.origin = *request.origin;
        grid.voxel_size = *request.voxel_size;
        grid.extent = *request.extent;
    } else if (request.resolution && request.voxel_size) {
        throw grid_error("--resolution and --voxel-size do not go together");
    } else if (request.voxel_size) {
        for (int axis = 0; axis < 3; ++axis)
            if (!((*request.voxel_size)[axis] > 0)) throw grid_error("--voxel-size must be positive");
        grid = fit_voxel_size(*request.voxel_size, request.padding, bounds);
    } else {
        const int resolution = request.resolution.value_or(128);
        if (resolution < 1) throw grid_error("--resolution must be at least 1");
        if (resolution > voxelpipe::grid::max_extent) too_many_voxels(resolution, 0);
        grid = fit_resolution(resolution, request.padding, bounds);
    }
    if (const voxelpipe::status status = voxelpipe::validate(grid); !status.ok())
        throw grid_error(std::string("the grid is not usable: ") + voxelpipe::to_string(status.code));
    return grid;
}

} // namespace voxelize
