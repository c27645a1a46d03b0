// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Positions that cannot be drawn, and the warning about them.

#include <glm/vec3.hpp>

#include <cmath>

namespace voxelize {

// True if no coordinate is NaN or infinite.
[[nodiscard]] inline bool is_finite(const glm::vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Follows the number of such vertices, each of which counts once for each primitive that has it.
inline constexpr const char* not_finite = "vertices at positions that are not finite: their triangles will be dropped";

} // namespace voxelize
