// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage by the signs at a box's inner corners against coverage in integers (small_triangle.hpp, which its own test
// compares with the general path): boxes of up to 2 and up to 3 voxels a side, vertices on voxel faces and edges,
// repeated vertices, triangles without area, and how often the signs are sure.

#include "test_support.hpp"

#include <voxelpipe/core/corner_signs.hpp>
#include <voxelpipe/core/small_conservative.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

namespace {

using namespace voxelpipe::core;
using rows = std::map<std::pair<int, int>, std::uint32_t>; // by y and z

struct boxed_triangle {
    std::int32_t q[3][3], lo[3];
    int last[3];

    [[nodiscard]] int wide() const { return (last[0] != 0) + (last[1] != 0) + (last[2] != 0); }
    [[nodiscard]] small_conservative exact(int fraction) const {
        small_triangle t{};
        for (int v = 0; v < 3; ++v)
            for (int k = 0; k < 3; ++k) t.p[v][k] = q[v][k] - (lo[k] << fraction);
        return {t, fraction};
    }
};

struct generator {
    std::mt19937_64 random{20261122};
    int fraction = 14;

    std::int32_t number(std::int64_t lo, std::int64_t hi) {
        return static_cast<std::int32_t>(std::uniform_int_distribution(lo, hi)(random));
    }
    // A triangle of at most `most` voxels a side; false where this one is larger.
    bool triangle(int most, boxed_triangle& t) {
        const std::int64_t one = std::int64_t{1} << fraction;
        const std::int64_t sizes[] = {most * one, (most - 1) * one, one / 2, one / 20 + 4, one / 500 + 4};
        const std::int64_t size = sizes[number(0, 4)];
        const bool on_faces = number(0, 2) == 0, around_a_corner = number(0, 3) == 0;
        for (int k = 0; k < 3; ++k) {
            const std::int64_t corner = (5 + number(0, 3)) * one,
                               low = around_a_corner ? corner - number(0, size) : corner + number(0, most * one - size);
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
            t.lo[k] = (min3(t.q[0][k], t.q[1][k], t.q[2][k]) - 1) >> fraction;
            t.last[k] = (max3(t.q[0][k], t.q[1][k], t.q[2][k]) >> fraction) - t.lo[k];
            fits = fits && t.last[k] < most;
        }
        return fits;
    }
};

rows by_integers(const boxed_triangle& t, int fraction, const small_box& box) {
    rows out;
    t.exact(fraction).rows<false>(box, [&](int y, int z, std::uint32_t bits) {
        if (bits != 0) out[{y, z}] = bits;
    });
    return out;
}

TEST(CornerSigns, TwoVoxelsASide) {
    generator g;
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

TEST(CornerSigns, ThreeVoxelsASide) {
    generator g;
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
            small_box box{{0, 0, 0}, {t.last[0], t.last[1], t.last[2]}}; // or a part of it
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

// What rounding decides is not decided: every vertex and edge on the grid.
TEST(CornerSigns, NotSureWhereAnEdgeMeetsACorner) {
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
