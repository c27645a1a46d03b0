// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The baseline of solids: one thread; each triangle's crossings with the rows of its bounding box, and every voxel
// behind a crossing flipped at once. It shares snapping and the rule for ties with the library, so it gives the same
// sets; it sorts nothing and has no prefix over words.

#include "mesh_data.hpp"

#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/solid/core/crossing.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace bench::baseline {

namespace vp = voxelpipe;

// Even-odd, into bits in rows along x.
inline void solid_bits(const mesh_data& mesh, const vp::grid& g, std::vector<std::uint32_t>& words) {
    using map = vp::core::storage_map<vp::bit, vp::layout::linear>;
    std::fill(words.begin(), words.end(), 0u);
    const vp::core::snap_transform snap = vp::core::make_snap_transform(g);
    std::vector<vp::core::snapped_position> positions;
    positions.reserve(mesh.positions.size());
    for (const glm::vec3& p : mesh.positions) positions.push_back(vp::core::snap(snap, p.x, p.y, p.z));
    const vp::core::voxel_box whole{{{0, 0, 0}}, {{g.extent.x - 1, g.extent.y - 1, g.extent.z - 1}}};
    for (const glm::uvec3& t : mesh.triangles) {
        const auto &a = positions[t.x], &b = positions[t.y], &c = positions[t.z];
        if (!vp::core::is_drawable(a) || !vp::core::is_drawable(b) || !vp::core::is_drawable(c)) continue;
        vp::core::for_each_crossing<0, vp::core::centre_offset<>>(
            a, b, c, snap.fraction, vp::core::rows_within<0>(a, b, c, snap.fraction, whole),
            [&](std::int64_t y, std::int64_t z, std::int64_t first, int) {
                std::uint32_t* const row =
                    words.data() + map::cell(g.extent, 0, static_cast<int>(y), static_cast<int>(z));
                for (auto x = static_cast<int>(std::max<std::int64_t>(first, 0)); x < g.extent.x; ++x)
                    row[x / 32] ^= 1u << (x % 32);
            });
    }
}

} // namespace bench::baseline
