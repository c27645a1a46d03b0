// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Random triangles for the tests of coverage in 32 bits, and the voxels that coverage.hpp gives, which the oracle
// checks.

#include "test_support.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/small_triangle.hpp>

#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <tuple>

namespace random_triangles {

using namespace voxelpipe::core;
using voxels = std::set<std::tuple<int, int, int>>;

struct generator {
    std::mt19937_64 random{20261121};
    int fraction = 14;

    std::int64_t number(std::int64_t lo, std::int64_t hi) { return std::uniform_int_distribution(lo, hi)(random); }

    // A vertex in a box of `size` units at `corner`; some coordinates lie on voxel faces.
    snapped_position vertex(const snapped_position& corner, std::int64_t size) {
        const auto one = [&](std::int64_t at) {
            std::int64_t q = at + number(0, size);
            if (number(0, 5) == 0) q = (q + (std::int64_t{1} << (fraction - 1))) >> fraction << fraction;
            return q;
        };
        return {one(corner.x), one(corner.y), one(corner.z)};
    }

    void triangle(snapped_position (&v)[3]) {
        const std::int64_t size = number(0, std::int64_t{1} << number(2, std::min(small_edge_bits - 1, fraction + 5)));
        const std::int64_t far = std::int64_t{1} << 24;
        const snapped_position corner{number(-far, far), number(-far, far), number(-far, far)};
        for (auto& p : v) p = vertex(corner, size);
        switch (number(0, 9)) {
        case 0: // a segment
            v[2] = v[0];
            break;
        case 1: // collinear
            v[2] = {v[0].x + 2 * (v[1].x - v[0].x), v[0].y + 2 * (v[1].y - v[0].y), v[0].z + 2 * (v[1].z - v[0].z)};
            break;
        case 2: // in an axis plane
            v[1].y = v[2].y = v[0].y;
            break;
        case 3: // a needle
            v[2] = {v[1].x + number(-1, 1), v[1].y + number(-1, 1), v[1].z + number(-1, 1)};
            break;
        case 4: // a point
            v[1] = v[2] = v[0];
            break;
        default:
            break;
        }
    }
};

template <span_rule Rule>
voxels by_the_general_path(const snapped_position (&v)[3], int fraction, const voxel_box& clip) {
    voxels out;
    rasterize<Rule>(v[0], v[1], v[2], fraction, clip,
                    [&](const auto& t, std::int64_t u, std::int64_t w, std::int64_t w0, std::int64_t w1) {
                        for (std::int64_t d = w0; d <= w1; ++d) {
                            const auto p = to_xyz(t.axis, u, w, d);
                            out.insert({static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                        }
                    });
    return out;
}

} // namespace random_triangles
