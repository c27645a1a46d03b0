// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Random triangles whose bounding box is a few voxels a side: vertices on voxel faces and edges, repeated vertices,
// triangles without area, slivers, and triangles far smaller than a voxel.

#include <voxelpipe/core/small_triangle.hpp>

#include <algorithm>
#include <cstdint>
#include <random>

namespace unit {

// q: vertices in units of 2^-fraction voxel. lo: lowest voxel of the box. last: highest voxel, relative to lo.
struct boxed_triangle {
    std::int32_t q[3][3], lo[3];
    int last[3];

    [[nodiscard]] int wide() const { return (last[0] != 0) + (last[1] != 0) + (last[2] != 0); }
    // Along one axis. False if the box is longer than `max_voxels` voxels.
    bool find_box(int k, int fraction, int max_voxels = 2) {
        lo[k] = (voxelpipe::core::min3(q[0][k], q[1][k], q[2][k]) - 1) >> fraction;
        last[k] = (voxelpipe::core::max3(q[0][k], q[1][k], q[2][k]) >> fraction) - lo[k];
        return last[k] < max_voxels;
    }
    [[nodiscard]] voxelpipe::core::small_triangle relative(int fraction) const {
        voxelpipe::core::small_triangle t{};
        for (int v = 0; v < 3; ++v)
            for (int k = 0; k < 3; ++k) t.p[v][k] = q[v][k] - (lo[k] << fraction);
        return t;
    }
};

struct boxed_triangles {
    std::mt19937_64 random{20261122};
    int fraction = 14;

    std::int32_t number(std::int64_t lo, std::int64_t hi) {
        return static_cast<std::int32_t>(std::uniform_int_distribution(lo, hi)(random));
    }
    // Makes a triangle of at most `max_voxels` voxels a side. False if it turned out larger.
    bool triangle(int max_voxels, boxed_triangle& t) {
        const std::int64_t one = std::int64_t{1} << fraction;
        const std::int64_t sizes[] = {max_voxels * one, (max_voxels - 1) * one, one / 2, one / 20 + 4, one / 500 + 4};
        const std::int64_t size = sizes[number(0, 4)];
        const bool on_faces = number(0, 2) == 0, around_a_corner = number(0, 3) == 0;
        for (int k = 0; k < 3; ++k) {
            const std::int64_t corner = (5 + number(0, 3)) * one,
                               low = around_a_corner ? corner - number(0, size)
                                                     : corner + number(0, max_voxels * one - size);
            for (int v = 0; v < 3; ++v) {
                std::int64_t q = low + number(0, size);
                if (on_faces && number(0, 4) == 0) q = (q + one / 2) / one * one;
                if (v > 0 && number(0, 20) == 0) q = t.q[v - 1][k];
                t.q[v][k] = static_cast<std::int32_t>(q);
            }
        }
        if (number(0, 15) == 0) std::copy(t.q[0], t.q[0] + 3, t.q[1]);
        bool fits = true;
        for (int k = 0; k < 3; ++k) {
            fits = t.find_box(k, fraction, max_voxels) && fits;
        }
        return fits;
    }
};

} // namespace unit
