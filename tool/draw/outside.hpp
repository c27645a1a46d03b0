// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// From which of the grid's six sides each voxel is seen: what --target color-outer goes by. A side sees an occupied
// voxel if no occupied voxel lies between the two along the axis, so the ends of the columns tell all.

#include "model/volume.hpp"

#include <voxelpipe/config.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelize {

// The first and the last occupied voxel of a column; of an empty column, first > last.
struct column_ends {
    std::int32_t first = INT32_MAX, last = -1;

    void add(std::int32_t voxel) {
        first = std::min(first, voxel);
        last = std::max(last, voxel);
    }
};

// The columns of a box of the grid along each axis, as the shaders see them. Memory of the backend, not owned. Voxels
// are numbered as in the whole grid.
struct column_view {
    glm::ivec3 low{0}, extent{0}; // of the box
    // Along x: by y and z, along y: by x and z, along z: by x and y; the first of the two varies fastest.
    const column_ends* along[3] = {};

    [[nodiscard]] VOXELPIPE_HD std::size_t column(int axis, const glm::ivec3& voxel) const {
        const int u = axis == 0 ? 1 : 0;
        const int v = axis == 2 ? 1 : 2;
        return static_cast<std::size_t>(voxel[v] - low[v]) * static_cast<std::size_t>(extent[u]) +
               static_cast<std::size_t>(voxel[u] - low[u]);
    }
    // A bit for each side that sees an occupied voxel of the box: bit 2 a for the low and bit 2 a + 1 for the high side
    // of axis a. 0 if none does.
    [[nodiscard]] VOXELPIPE_HD unsigned sides_that_see(const glm::ivec3& voxel) const {
        unsigned sides = 0;
        for (int a = 0; a < 3; ++a) {
            const column_ends ends = along[a][column(a, voxel)];
            sides |= (voxel[a] == ends.first ? 1U : 0U) << 2 * a | (voxel[a] == ends.last ? 2U : 0U) << 2 * a;
        }
        return sides;
    }
};

// The same in host memory.
struct column_table {
    glm::ivec3 low{0}, extent{0};
    std::array<std::vector<column_ends>, 3> along;

    [[nodiscard]] column_view view() const {
        return {low, extent, {along[0].data(), along[1].data(), along[2].data()}};
    }
};

// The columns of a whole volume. LOW: its first voxel in the whole grid. BITS is a bit channel of V.
[[nodiscard]] column_table columns_of(const volume& v, const channel& bits, const glm::ivec3& low, int threads);

} // namespace voxelize
