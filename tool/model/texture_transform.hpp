// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Texture coordinates as a material moves them.

#include <glm/vec2.hpp>

#include <array>
#include <cmath>

namespace voxelize {

// u' = m[0] u + m[1] v + m[2],  v' = m[3] u + m[4] v + m[5]
using texture_transform = std::array<double, 6>;
inline constexpr texture_transform no_texture_transform{1, 0, 0, 0, 1, 0};

[[nodiscard]] inline glm::vec2 transformed(const texture_transform& m, double u, double v) {
    return {static_cast<float>(std::fma(m[0], u, std::fma(m[1], v, m[2]))),
            static_cast<float>(std::fma(m[3], u, std::fma(m[4], v, m[5])))};
}

} // namespace voxelize
