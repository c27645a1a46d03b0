// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A closed box, for tests of solids.

#include "api_model.hpp"

#include <cstdint>

namespace unit {

// Adds a box of two triangles a side.
inline void add_box(small_mesh& m, const glm::vec3& low, const glm::vec3& high) {
    const auto first = static_cast<std::uint32_t>(m.positions.size());
    for (int i = 0; i < 8; ++i)
        m.positions.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                                 (i & 4) != 0 ? high.z : low.z);
    constexpr unsigned faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (const auto& f : faces) m.triangles.emplace_back(first + f[0], first + f[1], first + f[2]);
}

} // namespace unit
