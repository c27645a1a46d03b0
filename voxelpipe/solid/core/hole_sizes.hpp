// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The holes of a body, one by one: how wide they are in voxels, and whether a flood has gone through. On the host.

#include <voxelpipe/solid/core/bit_grid.hpp>
#include <voxelpipe/solid/core/holes.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe::core {

// One component of the boundary.
struct hole {
    // The way across, in voxels, rounded up, from 1 to 2^31: the second of the three extents of its bounding box. A
    // slit's is its narrow side.
    std::uint32_t width = 0;
    std::uint32_t apex = 0;                // number of its cone's apex
    std::span<const glm::uvec3> triangles; // of its cone: two vertices of the boundary, and the apex

    // True if a voxel on a line from the apex to a vertex of the boundary is not in `kept`. What lies beyond that grid
    // does not count.
    [[nodiscard]] bool is_entered(const hole_cones& body, int fraction, const bit_grid& kept) const {
        const snapped_position& a = body.positions[apex];
        for (const glm::uvec3& t : triangles) {
            const snapped_position& b = body.positions[t.x];
            const std::int64_t d[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
            std::int64_t longest = 0;
            for (const std::int64_t c : d) longest = std::max(longest, c < 0 ? -c : c);
            // Half voxels apart; holes beyond the widest grid are looked at more coarsely.
            const std::int64_t steps = std::clamp<std::int64_t>((longest >> (fraction - 1)) + 1, 1, 1 << 12);
            for (std::int64_t i = 0; i <= steps; ++i)
                if (is_missing({a.x + d[0] * i / steps, a.y + d[1] * i / steps, a.z + d[2] * i / steps}, fraction,
                               kept))
                    return true;
        }
        return false;
    }

private:
    [[nodiscard]] static bool is_missing(const snapped_position& p, int fraction, const bit_grid& kept) {
        const glm::ivec3 e = kept.extent();
        const std::int64_t x = p.x >> fraction, y = p.y >> fraction, z = p.z >> fraction;
        if (x < 0 || y < 0 || z < 0 || x >= e.x || y >= e.y || z >= e.z) return false;
        return (kept.row(static_cast<int>(y), static_cast<int>(z))[x / 64] >> (x % 64) & 1) == 0;
    }
};

// Calls visit(hole) for each hole that has a cone. fraction: bits of a voxel in positions.
template <class Visit>
void for_each_hole(const hole_cones& body, int fraction, const Visit& visit) {
    std::vector<glm::uvec3> sorted = body.triangles;
    std::stable_sort(sorted.begin(), sorted.end(), [](const glm::uvec3& a, const glm::uvec3& b) { return a.z < b.z; });
    for (std::size_t first = 0; first < sorted.size();) {
        std::size_t last = first;
        std::array<std::int64_t, 3> low{}, high{};
        for (; last < sorted.size() && sorted[last].z == sorted[first].z; ++last)
            for (const std::uint32_t v : {sorted[last].x, sorted[last].y}) {
                const snapped_position& p = body.positions[v];
                const std::array<std::int64_t, 3> at{p.x, p.y, p.z};
                const bool is_first = last == first && v == sorted[first].x;
                for (std::size_t a = 0; a < 3; ++a) {
                    low[a] = is_first ? at[a] : std::min(low[a], at[a]);
                    high[a] = is_first ? at[a] : std::max(high[a], at[a]);
                }
            }
        std::array<std::int64_t, 3> size{};
        for (std::size_t a = 0; a < 3; ++a) size[a] = high[a] - low[a];
        std::sort(size.begin(), size.end());
        const std::int64_t voxels = (size[1] + (std::int64_t{1} << fraction) - 1) >> fraction;
        visit(hole{static_cast<std::uint32_t>(std::clamp<std::int64_t>(voxels, 1, std::int64_t{1} << 31)),
                   sorted[first].z, std::span<const glm::uvec3>(sorted).subspan(first, last - first)});
        first = last;
    }
}

} // namespace voxelpipe::core
