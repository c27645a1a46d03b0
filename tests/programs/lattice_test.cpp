// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The tessellator's definition, in exact rationals, for every triple of levels up to 12.

#include <voxelpipe/core/lattice.hpp>

#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <set>
#include <tuple>

namespace {

using namespace voxelpipe::core;

// All coordinates are multiples of 1 / (n lcm of levels) of the patch: integers in that unit.
struct plane_point {
    std::int64_t w1, w2;
    friend auto operator<=>(const plane_point&, const plane_point&) = default;
};

plane_point place(const lattice_point& p, std::int64_t unit, int n) {
    const plane_point corners[3] = {{0, 0}, {unit, 0}, {0, unit}};
    switch (p.kind) {
    case lattice_point::corner:
        return corners[p.which];
    case lattice_point::edge: {
        const plane_point &a = corners[p.which], &b = corners[(p.which + 1) % 3];
        return {a.w1 + (b.w1 - a.w1) * p.a / p.b, a.w2 + (b.w2 - a.w2) * p.a / p.b};
    }
    default:
        return {unit * p.a / n, unit * p.b / n};
    }
}
std::int64_t doubled_area(const plane_point& a, const plane_point& b, const plane_point& c) {
    return (b.w1 - a.w1) * (c.w2 - a.w2) - (b.w2 - a.w2) * (c.w1 - a.w1);
}

TEST(Lattice, NumbersAreFoundInEveryRow) {
    for (int row = 0; row <= max_tessellation_level; ++row)
        for (const int column : {0, row / 2, row}) {
            const lattice_index at = lattice_index::of(lattice_index{row, column}.number());
            EXPECT_TRUE(at.row == row && at.column == column) << row << " " << column;
            if (row == max_tessellation_level) continue;
            const lattice_index p = lattice_triangle_of(static_cast<std::uint32_t>(row * row + 2 * column)).p[0];
            EXPECT_TRUE(p.row == row && p.column == column) << row << " " << column;
        }
}

TEST(Lattice, CoversThePatchOnceForEveryLevelUpTo12) {
    for (int l0 = 1; l0 <= 12; ++l0)
        for (int l1 = 1; l1 <= 12; ++l1)
            for (int l2 = 1; l2 <= 12; ++l2) {
                const lattice patch(l0, l1, l2);
                const int n = patch.size(), levels[3] = {l0, l1, l2};
                const std::int64_t unit =
                    std::lcm<std::int64_t>(std::lcm<std::int64_t>(l0, l1), std::lcm<std::int64_t>(l2, n));
                std::int64_t area = 0;
                std::uint32_t left_out = 0;
                std::set<std::tuple<int, std::int64_t, std::int64_t>> on_edges; // and where
                std::set<std::array<plane_point, 2>> sides;
                for (std::uint32_t i = 0; i < patch.num_triangles(); ++i) {
                    const lattice_triangle t = lattice_triangle_of(i);
                    if (patch.is_left_out(t)) {
                        ++left_out;
                        continue;
                    }
                    plane_point p[3];
                    for (int k = 0; k < 3; ++k) {
                        const lattice_point at = patch.point(t.p[k]);
                        p[k] = place(at, unit, n);
                        if (at.kind == lattice_point::edge) on_edges.emplace(at.which, at.a, at.b);
                        ASSERT_EQ(lattice_index::of(t.p[k].number()).row, t.p[k].row);
                        ASSERT_EQ(lattice_index::of(t.p[k].number()).column, t.p[k].column);
                        ASSERT_LT(t.p[k].number(), patch.num_points());
                    }
                    const std::int64_t here = doubled_area(p[0], p[1], p[2]);
                    ASSERT_GE(here, 0) << l0 << l1 << l2 << " triangle " << i;
                    area += here;
                    // Each directed side once: a side of two triangles has two directions.
                    for (int k = 0; k < 3; ++k) ASSERT_TRUE(sides.insert({p[k], p[(k + 1) % 3]}).second);
                }
                EXPECT_EQ(area, unit * unit) << l0 << ' ' << l1 << ' ' << l2;
                EXPECT_EQ(left_out, patch.num_left_out()) << l0 << ' ' << l1 << ' ' << l2;
                EXPECT_EQ(lattice::unpack(patch.packed()).packed(), patch.packed());
                EXPECT_EQ(lattice::unpack(patch.packed()).size(), n);
                // Every point of every edge, and no other.
                EXPECT_EQ(on_edges.size(), static_cast<std::size_t>(l0 + l1 + l2 - 3));
                for (const auto& [e, k, of] : on_edges) EXPECT_EQ(of, levels[e]);
                // Inside, sides meet their opposites; on an edge they have none.
                std::size_t alone = 0;
                for (const auto& s : sides) alone += sides.count({s[1], s[0]}) == 0 ? 1 : 0;
                EXPECT_EQ(alone, static_cast<std::size_t>(l0 + l1 + l2)) << l0 << ' ' << l1 << ' ' << l2;
            }
}

// The number of triangles that are left out, for levels beyond those above.
TEST(Lattice, CountsWhatItLeavesOut) {
    for (const auto& l : {std::array{1, 1, 1},
                          {2, 1, 1},
                          {1, 2, 1},
                          {1, 1, 2},
                          {64, 1, 1},
                          {1, 63, 64},
                          {101, 37, 2},
                          {1024, 1, 1023},
                          {1, 1, 1024},
                          {512, 1024, 3}}) {
        const lattice patch(l[0], l[1], l[2]);
        std::uint32_t left_out = 0;
        for (std::uint32_t i = 0; i < patch.num_triangles(); ++i)
            left_out += patch.is_left_out(lattice_triangle_of(i)) ? 1 : 0;
        EXPECT_EQ(left_out, patch.num_left_out());
    }
}

// Rows hold 2 r + 1 triangles from the side of v1, wound as the patch.
TEST(Lattice, NumbersRowsFromV0) {
    const lattice patch(5, 5, 5);
    for (int r = 0; r < 5; ++r)
        for (int i = 0; i <= 2 * r; ++i) {
            const lattice_triangle t = lattice_triangle_of(static_cast<std::uint32_t>(r * r + i));
            int lowest = 99, column = 99;
            for (const lattice_index& p : t.p) {
                lowest = std::min(lowest, p.row);
                column = std::min(column, p.column);
            }
            EXPECT_EQ(lowest, r);
            EXPECT_EQ(column, i / 2);
        }
    EXPECT_EQ(lattice_triangle_of(0).p[1].column, 0); // v1's side
    EXPECT_EQ(patch.point({5, 0}).which, 1);
    EXPECT_EQ(patch.point({5, 5}).which, 2);
    EXPECT_EQ(lattice_triangle_of(1023 * 1023 + 2 * 1023).p[2].column, 1024);
}

} // namespace
