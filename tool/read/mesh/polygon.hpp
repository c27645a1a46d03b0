// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Polygons -> triangles.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace voxelize {

// The triangles of a polygon of n >= 3 corners, as numbers of its corners: always n - 2, or 0 where n < 3, each wound
// as the polygon is. Concave polygons are cut by their ears in the plane of their area; where none is found (crossing
// edges, corners at one place, positions that are not finite), the rest is a fan. The result is valid until the next
// call.
class polygon_cutter {
public:
    [[nodiscard]] std::span<const glm::uvec3> cut(std::span<const glm::dvec3> corners);

private:
    void cut_ears(std::uint32_t n);

    std::vector<glm::uvec3> triangles_;
    std::vector<glm::dvec2> flat_;               // the corners in their plane
    std::vector<std::uint32_t> reflex_;          // corners at which the polygon is concave
    std::vector<std::uint32_t> next_, previous_; // corners that are not cut off
};

} // namespace voxelize
