// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The crossing of a triangle with the row along x that ends at a point: the rule of solids (docs/design.md, "Solids")
// for points anywhere, not only at the centres of voxels.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::core {

// What the triangle adds to the winding number of the point, moved by (e, e^2, e^3): 1 where the row from below enters
// through it, -1 where it leaves, 0 otherwise. Positions up to 2^40: edge functions need 84 bits, the plane 126.
[[nodiscard]] VOXELPIPE_HD inline int crossing_below(const snapped_position& a, const snapped_position& b,
                                                     const snapped_position& c, const snapped_position& p) {
    // On an edge through the point, the sign of the edge function is that of its coefficient of y, then of z. An edge
    // along x gives none, and no crossing: the triangle's projection is a line then.
    const auto side = [&](const snapped_position& from, const snapped_position& to) {
        const std::int64_t dy = to.y - from.y, dz = to.z - from.z;
        const int128 at = static_cast<int128>(dy) * (p.z - from.z) - static_cast<int128>(dz) * (p.y - from.y);
        if (at != 0) return at > 0 ? 1 : -1;
        if (dz != 0) return dz < 0 ? 1 : -1;
        return dy > 0 ? 1 : dy < 0 ? -1 : 0;
    };
    const int first = side(a, b);
    if (first == 0 || side(b, c) != first || side(c, a) != first) return 0;
    const std::int64_t e1[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    const std::int64_t e2[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
    const auto cross = [&](int i, int j) {
        return static_cast<int128>(e1[i]) * e2[j] - static_cast<int128>(e1[j]) * e2[i];
    };
    const int128 over = cross(1, 2) * (p.x - a.x) + cross(2, 0) * (p.y - a.y) + cross(0, 1) * (p.z - a.z);
    // The normal's x has the sign `first`. In the plane the row has crossed it: e lies along x.
    return (first > 0 ? over >= 0 : over <= 0) ? -first : 0;
}

} // namespace voxelpipe::core
