// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Thin coverage of boxes of up to two voxels a side in floats against the same in integers, which small_triangle_test
// compares with the general path. Also how often the floats are certain, for difficult triangles and for a mesh's.

#include "boxed_triangles.hpp"
#include "test_support.hpp"

#include <voxelpipe/core/thin_cube.hpp>

#include <gtest/gtest.h>

#include <cstdint>

namespace {

using namespace voxelpipe::core;
using unit::boxed_triangle;
using unit::boxed_triangles;

struct seen {
    int compared = 0, sure = 0, partly = 0, beyond = 0, by_axis[3] = {};

    void compare(const boxed_triangle& t, int fraction) {
        ++compared;
        bool is_sure = false;
        const thin_cube found = thin_cube_by_signs(t.q, t.lo, t.last, fraction, is_sure);
        const thin_cube expected = thin_cube_by_integers(t.relative(fraction), t.last, fraction);
        if (expected.axis < 0) {
            ASSERT_FALSE(is_sure);
        }
        if (!is_sure) return;
        ++sure;
        ++by_axis[expected.axis];
        ASSERT_EQ(found.axis, expected.axis);
        ASSERT_EQ(found.columns, expected.columns);
        ASSERT_NE(found.columns, 0u);
        const int u = expected.axis == 0 ? 1 : 0, v = expected.axis == 2 ? 1 : 2;
        if (found.columns != quad_of(t.last[u], t.last[v])) ++partly;
        for (int i = 0; i < 4; ++i) {
            if ((found.columns >> i & 1u) == 0) continue;
            ASSERT_EQ(found.depth(i), expected.depth(i)) << "column " << i;
            if (found.depth(i) < 0 || found.depth(i) > t.last[expected.axis]) ++beyond;
        }
    }
};

TEST(ThinCube, CertainFloatsAgreeWithIntegers) {
    boxed_triangles g;
    seen s;
    for (const int fraction : {12, 13, 14, 15, 16, 18, 19}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(100000); ++i) {
            boxed_triangle t{};
            if (g.triangle(2, t)) s.compare(t, fraction);
            ASSERT_FALSE(HasFatalFailure()) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(s.compared, unit::cases(200000));
    EXPECT_GT(s.sure, s.compared / 10 * 6);
    EXPECT_GT(s.partly, s.compared / 20);
    EXPECT_GT(s.beyond, s.compared / 20);
    for (const int n : s.by_axis) EXPECT_GT(n, s.sure / 4);
}

// Triangles of about one voxel and of a tenth, anywhere. An uncertain one costs a whole warp the integer path.
TEST(ThinCube, FloatsAreCertainForNearlyAllTrianglesOfAMesh) {
    boxed_triangles g;
    for (const int fraction : {12, 14, 16, 19})
        for (const int parts : {1, 10}) {
            g.fraction = fraction;
            const std::int64_t one = std::int64_t{1} << fraction;
            seen s;
            for (int i = 0; i < unit::cases(100000); ++i) {
                boxed_triangle t{};
                bool fits = true;
                for (int k = 0; k < 3; ++k) {
                    const std::int64_t low = g.number(8 * one, 9 * one);
                    for (auto& q : t.q) q[k] = static_cast<std::int32_t>(low + g.number(0, one / parts));
                    fits = t.find_box(k, fraction) && fits;
                }
                if (fits) s.compare(t, fraction);
                ASSERT_FALSE(HasFatalFailure()) << "fraction " << fraction << ", triangle " << i;
            }
            EXPECT_GT(s.sure, s.compared / 1000 * 985) << fraction << ", " << parts;
        }
}

} // namespace
