// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Open meshes that repair::winding has to judge.

#include "solid_support.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace solids {
inline constexpr vp::solid_options by_winding{.repair = vp::repair::winding};

inline mesh less_triangles(const mesh& m, splitmix64& random, int count) {
    mesh r = m;
    for (int i = 0; i < count && !r.triangles.empty(); ++i)
        r.triangles.erase(r.triangles.begin() + static_cast<std::ptrdiff_t>(random.below(r.triangles.size())));
    return r;
}
// The faces whose middle is below `z`.
inline mesh below(const mesh& m, float z) {
    mesh r{m.positions, {}};
    for (const glm::uvec3& t : m.triangles)
        if (m.positions[t.x].z + m.positions[t.y].z + m.positions[t.z].z < 3.0f * z) r.triangles.push_back(t);
    return r;
}
inline const mesh sides = box({3.25f, 3.5f, 4.0f}, {11.25f, 12.5f, 10.0f}); // two pass through centres of unit voxels
inline mesh less_faces(mesh m, std::vector<std::size_t> faces) {
    std::sort(faces.rbegin(), faces.rend());
    for (const std::size_t f : faces) {
        const auto at = m.triangles.begin() + static_cast<std::ptrdiff_t>(2 * f);
        m.triangles.erase(at, at + 2);
    }
    return m;
}
inline mesh soup(splitmix64& random, int count, float extent) {
    mesh r;
    for (int i = 0; i < count; ++i) {
        for (int n = 0; n < 3; ++n) {
            const auto at = [&] { return static_cast<float>(random.uniform(0.0, extent)); };
            r.positions.push_back({at(), at(), at()});
        }
        const auto first = static_cast<std::uint32_t>(3 * i);
        r.triangles.push_back({first, first + 1, first + 2});
    }
    return r;
}

} // namespace solids
