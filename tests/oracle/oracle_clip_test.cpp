// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The oracle's separating axes against a second exact method that has nothing in common with them: the triangle is
// clipped against the faces of the box in rational coordinates, and they meet if anything is left.

#include "oracle.hpp"
#include "triangles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace oracle {
namespace {

// A cut adds as many bits as a coordinate has, so six cuts of 41-bit coordinates stay below 64 * 45 bits. An overflow
// would throw.
using big = wide_int<64>;

// Homogeneous: the position is (x, y, z) / w with w > 0.
struct rational_point {
    std::array<big, 3> x;
    big w;
};
using polygon = std::vector<rational_point>;

// The part of a convex polygon (or segment, or point) on the closed side sign * (x[axis] - bound) >= 0.
polygon clip(const polygon& in, std::size_t axis, std::int64_t bound, int sign) {
    polygon out;
    const auto distance = [&](const rational_point& p) {
        const big d = p.x[axis] - big(bound) * p.w;
        return sign > 0 ? d : -d;
    };
    for (std::size_t n = 0; n < in.size(); ++n) {
        const rational_point& a = in[n];
        const rational_point& b = in[(n + 1) % in.size()];
        const big da = distance(a), db = distance(b);
        if (da.sign() >= 0) out.push_back(a);
        if (da.sign() * db.sign() < 0) { // the point where (a * db - b * da) / (db - da) is on the plane
            const big s = da.sign() > 0 ? da : -da;
            const big r = db.sign() > 0 ? db : -db;
            rational_point cut;
            for (std::size_t c = 0; c < 3; ++c) cut.x[c] = a.x[c] * r + b.x[c] * s;
            cut.w = a.w * r + b.w * s;
            out.push_back(cut);
        }
    }
    return out;
}

polygon as_polygon(const snapped_triangle& t) {
    polygon p;
    for (const auto& v : t.v) p.push_back({{big(v[0]), big(v[1]), big(v[2])}, big(1)});
    return p;
}

bool meets_by_clipping(int fraction, const snapped_triangle& t, const std::array<int, 3>& lo,
                       const std::array<int, 3>& hi, int first_axis, int axes) {
    polygon p = as_polygon(t);
    for (int n = 0; n < axes; ++n) {
        const auto axis = static_cast<std::size_t>((first_axis + n) % 3);
        p = clip(p, axis, std::int64_t{lo[axis]} << fraction, 1);
        p = clip(p, axis, std::int64_t{hi[axis]} << fraction, -1);
    }
    return !p.empty();
}

// Boxes where an answer is in doubt: round the vertices, the centroid, and points along the edges.
std::array<int, 3> doubtful_box(splitmix64& random, int fraction, const snapped_triangle& t) {
    const double a = random.one_in(3) ? 0.0 : random.unit();
    const double b = random.one_in(3) ? 1.0 - a : random.unit() * (1.0 - a);
    std::array<int, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double x = a * static_cast<double>(t.v[0][axis]) + b * static_cast<double>(t.v[1][axis]) +
                         (1.0 - a - b) * static_cast<double>(t.v[2][axis]);
        const double voxels = std::clamp(std::floor(std::ldexp(x, -fraction)), -1e4, 1e4);
        at[axis] = static_cast<int>(voxels) + static_cast<int>(random.between(-1, 1));
    }
    return at;
}

TEST(OracleClip, SeparatingAxesAgreeWithClippingOnEveryClass) {
    splitmix64 random(21);
    for (const triangle_class kind : all_triangle_classes) {
        int met = 0, missed = 0;
        for (const test_grid& where : test_grids()) {
            const int fraction = fraction_bits(where.g);
            for (int n = 0; n < 60; ++n) {
                const world_triangle w = make_triangle(random, where, kind);
                const snapped_triangle t = snap(where.g, w.v);
                if (t.dropped) continue;
                for (int box = 0; box < 6; ++box) {
                    const std::array<int, 3> lo = doubtful_box(random, fraction, t);
                    std::array<int, 3> hi = lo;
                    for (int& x : hi)
                        x += box == 0 ? static_cast<int>(random.between(0, 5)) : 1; // one of six of any size
                    const bool clipped = meets_by_clipping(fraction, t, lo, hi, static_cast<int>(random.below(3)), 3);
                    ASSERT_EQ(box_meets_triangle(fraction, t, lo, hi), clipped)
                        << name(kind) << " in " << where.name << ", box " << lo[0] << ' ' << lo[1] << ' ' << lo[2];
                    ++(clipped ? met : missed);
                }
            }
        }
        if (kind == triangle_class::dropped) continue;
        EXPECT_GT(met, 300) << name(kind); // the boxes were really in doubt
        EXPECT_GT(missed, 100) << name(kind);
    }
}

TEST(OracleClip, WholeSetsAgreeOnSmallGrids) {
    splitmix64 random(22);
    for (const triangle_class kind : all_triangle_classes) {
        for (const std::size_t which : {3u, 5u}) {
            const test_grid& where = test_grids()[which];
            const int fraction = fraction_bits(where.g);
            for (int n = 0; n < 12; ++n) {
                const world_triangle w = make_triangle(random, where, kind);
                const snapped_triangle t = snap(where.g, w.v);
                std::vector<voxel> expected;
                if (!t.dropped)
                    for (int k = 0; k < where.g.extent[2]; ++k)
                        for (int j = 0; j < where.g.extent[1]; ++j)
                            for (int i = 0; i < where.g.extent[0]; ++i)
                                if (meets_by_clipping(fraction, t, {i, j, k}, {i + 1, j + 1, k + 1}, 0, 3))
                                    expected.push_back({i, j, k});
                ASSERT_TRUE(conservative(where.g, t) == expected) << name(kind) << " in " << where.name;
            }
        }
    }
}

// Thin the long way: the triangle clipped to each column's closed square, the depth as a fraction compared with the
// voxel's bottom and top.
TEST(OracleClip, ThinAgreesWithClippedColumns) {
    splitmix64 random(23);
    const int of_each = test_scale() < 1 ? 2 : 6;
    long fragments = 0;
    for (const triangle_class kind : all_triangle_classes) {
        for (const test_grid& where : test_grids()) {
            if (!where.dense) continue;
            const int fraction = fraction_bits(where.g);
            for (int n = 0; n < of_each; ++n) {
                const world_triangle world = make_triangle(random, where, kind);
                const snapped_triangle t = snap(where.g, world.v);
                const std::vector<voxel> found = thin(where.g, t);
                if (t.dropped) {
                    EXPECT_TRUE(found.empty());
                    continue;
                }
                const int axis = dominant_axis(t);
                if (axis < 0) {
                    EXPECT_TRUE(found.empty());
                    continue;
                }
                const auto w = static_cast<std::size_t>(axis);
                const auto u = (w + 1) % 3, v = (w + 2) % 3;
                std::vector<voxel> expected;
                std::array<int, 3> at{};
                for (at[u] = 0; at[u] < where.g.extent[u]; ++at[u])
                    for (at[v] = 0; at[v] < where.g.extent[v]; ++at[v]) {
                        std::array<int, 3> hi = {at[0] + 1, at[1] + 1, at[2] + 1};
                        if (!meets_by_clipping(fraction, t, at, hi, static_cast<int>(u), 2)) continue;
                        // Depth from the exact barycentrics, a third formula for it.
                        const auto b = barycentrics(where.g, t, {at[0], at[1], at[2]});
                        big numerator = 0;
                        for (std::size_t vertex = 0; vertex < 3; ++vertex)
                            numerator = numerator + big(b[vertex].numerator.to_int128()) * big(t.v[vertex][axis]);
                        big denominator = big(b[0].denominator.to_int128()).shifted_left(fraction);
                        if (denominator.sign() < 0) numerator = -numerator, denominator = -denominator;
                        for (at[w] = 0; at[w] < where.g.extent[w]; ++at[w]) {
                            const bool above_bottom = numerator >= big(at[w]) * denominator;
                            const bool below_top = numerator < big(at[w] + 1) * denominator;
                            if (above_bottom && below_top) expected.push_back({at[0], at[1], at[2]});
                        }
                        at[w] = 0;
                    }
                std::sort(expected.begin(), expected.end());
                ASSERT_TRUE(found == expected) << name(kind) << " in " << where.name;
                fragments += static_cast<long>(found.size());
            }
        }
    }
    EXPECT_GT(fragments, 5000 * of_each / 6);
}

} // namespace
} // namespace oracle
