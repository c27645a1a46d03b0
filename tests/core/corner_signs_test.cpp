// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage by the signs at a box's inner corners against coverage in integers (small_triangle.hpp, which
// small_triangle_test compares with the general path). Boxes of up to 3 voxels a side, vertices on voxel faces and
// edges, repeated vertices, triangles without area. Also how often the signs are certain.

#include "boxed_triangles.hpp"
#include "test_support.hpp"

#include <voxelpipe/core/corner_signs.hpp>
#include <voxelpipe/core/slim_box.hpp>
#include <voxelpipe/core/small_conservative.hpp>

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <utility>

namespace {

using namespace voxelpipe::core;
using unit::boxed_triangle;
using unit::boxed_triangles;
using rows = std::map<std::pair<int, int>, std::uint32_t>; // by y and z

rows by_integers(const boxed_triangle& t, int fraction, const small_box& box) {
    rows out;
    small_conservative(t.relative(fraction), fraction).rows<false>(box, [&](int y, int z, std::uint32_t bits) {
        if (bits != 0) out[{y, z}] = bits;
    });
    return out;
}

TEST(CornerSigns, OfTwoVoxelsASideAreTheGeneralSet) {
    boxed_triangles g;
    int compared = 0, sure = 0, cubes = 0, sure_cubes = 0, quads = 0, partly = 0;
    for (const int fraction : {12, 13, 14, 15, 16}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(60000); ++i) {
            boxed_triangle t{};
            if (!g.triangle(2, t)) continue;
            ++compared;
            std::uint32_t expected = 0;
            for (const auto& [at, bits] : by_integers(t, fraction, {{0, 0, 0}, {t.last[0], t.last[1], t.last[2]}}))
                expected |= bits << (2 * at.first + 4 * at.second);
            const sure_bits cube = cube_bits_by_signs(t.q, t.lo, t.last, fraction);
            if (t.wide() < 2) {
                ASSERT_EQ(cube_of(t.last), expected) << "fraction " << fraction << ", triangle " << i;
                ASSERT_TRUE(cube.sure);
            }
            if (t.wide() == 3) {
                ++cubes;
                if (cube.sure) ++sure_cubes;
            }
            if (t.wide() == 2) {
                const sure_bits quad = quad_bits_by_signs(t.q, t.lo, t.last, fraction);
                ASSERT_EQ(quad.sure, cube.sure);
                if (quad.sure) {
                    ++quads;
                    ASSERT_EQ(quad.bits, expected) << "fraction " << fraction << ", triangle " << i;
                }
            }
            if (!cube.sure) continue;
            ++sure;
            if (cube.bits != cube_of(t.last)) ++partly;
            ASSERT_EQ(cube.bits, expected) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(60000));
    EXPECT_GT(sure, compared / 10 * 8);
    EXPECT_GT(partly, compared / 20);
    EXPECT_GT(quads, compared / 20);
    EXPECT_GT(sure_cubes, cubes / 10 * 6);
    EXPECT_GT(cubes, compared / 20);
}

TEST(CornerSigns, OfThreeVoxelsASideAreTheGeneralSet) {
    boxed_triangles g;
    int compared = 0, sure = 0, full = 0;
    for (const int fraction : {12, 13, 14, 15, 16}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(60000); ++i) {
            boxed_triangle t{};
            if (!g.triangle(3, t)) continue;
            ++compared;
            const ruled_out out = rule_out_by_signs(t.q, t.lo, t.last, fraction);
            if (!out.sure) continue;
            ++sure;
            if (t.last[0] == 2 && t.last[1] == 2 && t.last[2] == 2) ++full;
            small_box box{{0, 0, 0}, {t.last[0], t.last[1], t.last[2]}}; // sometimes only a part of it
            if (g.number(0, 3) == 0)
                for (int k = 0; k < 3; ++k) {
                    box.lo[k] = g.number(0, t.last[k]);
                    box.hi[k] = g.number(box.lo[k], t.last[k]);
                }
            rows found;
            rows_of_three(out, box, [&](int y, int z, std::uint32_t bits) { found[{y, z}] = bits; });
            ASSERT_EQ(found, by_integers(t, fraction, box)) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(60000));
    EXPECT_GT(sure, compared / 10 * 8);
    EXPECT_GT(full, compared / 100);
}

TEST(CornerSigns, OfThreeVoxelsAlongOneAxisAreTheGeneralSet) {
    boxed_triangles g;
    int compared = 0, sure = 0, partly = 0, lines = 0, flat[3] = {}, full[3] = {};
    for (const int fraction : {12, 13, 14, 15, 16}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(200000); ++i) {
            boxed_triangle t{};
            if (!g.triangle(3, t) || !is_slim(t.last)) continue;
            ++compared;
            const slim_rows slim = slim_rows_by_signs(t.q, t.lo, t.last, fraction);
            if (slim.bits == 0) {
                ASSERT_GT(t.wide(), 1);
                continue;
            }
            ++sure;
            const int axis = t.last[0] == 2 ? 0 : t.last[1] == 2 ? 1 : 2;
            if (t.last[axis] == 2) ++(t.wide() == 1 ? lines : t.wide() == 2 ? flat[axis] : full[axis]);
            ASSERT_EQ(slim.along_y, axis == 1 && t.last[1] == 2);
            if (std::popcount(slim.bits) < (t.last[0] + 1) * (t.last[1] + 1) * (t.last[2] + 1)) ++partly;
            rows found;
            for (int row = 0; row < 8; ++row) {
                const std::uint32_t bits = slim.bits >> 4 * row & 15u;
                if (bits != 0) found[slim.along_y ? std::pair(row / 2, row % 2) : std::pair(row % 2, row / 2)] = bits;
            }
            const rows expected = by_integers(t, fraction, {{0, 0, 0}, {t.last[0], t.last[1], t.last[2]}});
            ASSERT_EQ(found, expected) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(60000));
    EXPECT_GT(sure, compared / 10 * 8);
    EXPECT_GT(partly, compared / 20);
    EXPECT_GT(lines, compared / 200);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GT(flat[axis], compared / 200);
        EXPECT_GT(full[axis], compared / 200);
    }
}

// All vertices and edges lie on the grid, so rounding would decide. The signs must say that they are not certain.
TEST(CornerSigns, AreUncertainIfAnEdgeMeetsACorner) {
    constexpr int fraction = 14;
    constexpr std::int32_t one = 1 << fraction;
    const int last[3] = {1, 1, 1};
    const std::int32_t lo[3] = {0, 0, 0};
    const std::int32_t through_the_centre[3][3] = {
        {one / 2, one / 2, one / 2}, {one * 3 / 2, one * 3 / 2, one * 3 / 2}, {one / 2, one * 3 / 2, one}};
    EXPECT_FALSE(cube_bits_by_signs(through_the_centre, lo, last, fraction).sure);
    EXPECT_FALSE(rule_out_by_signs(through_the_centre, lo, last, fraction).sure);
    const std::int32_t without_area[3][3] = {
        {one / 2, one / 3, one / 4}, {one * 3 / 2, one * 4 / 3, one * 5 / 4}, {one, one * 5 / 6, one * 3 / 4}};
    EXPECT_FALSE(cube_bits_by_signs(without_area, lo, last, fraction).sure);
}

} // namespace
