// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage of small triangles in 32 bits against the general path of coverage.hpp (which the oracle decides about),
// over triangles of every size that the small path takes: random, on voxel faces and edges, thin needles, without area.

#include "test_support.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/small_triangle.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <set>
#include <tuple>

namespace {

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
        const std::int64_t size = number(0, std::int64_t{1} << number(2, small_edge_bits - 1));
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

bool make_small(const snapped_position (&v)[3], int fraction, const voxel_box& box, small_triangle& t) {
    const int most = small_voxels(fraction);
    for (int k = 0; k < 3; ++k)
        if (box.hi[k] - box.lo[k] >= most) return false;
    for (int i = 0; i < 3; ++i) {
        const std::int64_t q[3] = {v[i].x, v[i].y, v[i].z};
        for (int k = 0; k < 3; ++k) t.p[i][k] = static_cast<std::int32_t>(q[k] - (box.lo[k] << fraction));
    }
    return true;
}

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

TEST(SmallTriangle, ConservativeRowsAreTheGeneralSet) {
    generator g;
    int compared = 0;
    std::uint64_t covered = 0;
    for (const int fraction : {12, 13, 14, 15, 16}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(40000); ++i) {
            snapped_position v[3];
            g.triangle(v);
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            small_triangle t{};
            if (!make_small(v, fraction, box, t)) continue;
            ++compared;
            const small_conservative s(t, fraction);
            voxels rows;
            const int last = static_cast<int>(box.hi[0] - box.lo[0]);
            const int from = static_cast<int>(g.number(0, last)); // a part of a row is that part of the row
            for (int z = 0; z <= box.hi[2] - box.lo[2]; ++z)
                for (int y = 0; y <= box.hi[1] - box.lo[1]; ++y) {
                    const std::uint32_t whole = s.row(0, last, y, z);
                    ASSERT_EQ(s.row(from, last, y, z), whole >> from);
                    for (int x = 0; x < 32; ++x)
                        if (((whole >> x) & 1u) != 0)
                            rows.insert({static_cast<int>(box.lo[0]) + x, static_cast<int>(box.lo[1]) + y,
                                         static_cast<int>(box.lo[2]) + z});
                }
            const voxels expected = by_the_general_path<span_rule::conservative>(v, fraction, box);
            covered += expected.size();
            ASSERT_EQ(rows, expected) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(100000));
    EXPECT_GT(covered, static_cast<std::uint64_t>(compared));
}

TEST(SmallTriangle, ThinColumnsAreTheGeneralSet) {
    generator g;
    int compared = 0;
    for (const int fraction : {12, 13, 14, 15, 16}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(40000); ++i) {
            snapped_position v[3];
            g.triangle(v);
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            small_triangle t{};
            if (!make_small(v, fraction, box, t)) continue;
            const auto setup = setup_triangle<span_rule::thin, std::int64_t>(v[0], v[1], v[2], fraction);
            const triple<std::int64_t> normal = small_normal(t),
                                       turned = to_uvw(setup.axis, normal[0], normal[1], normal[2]);
            for (int k = 0; k < 3; ++k) ASSERT_EQ(turned[k], setup.normal[k]);
            if (setup.zero_area) continue;
            ++compared;
            const small_thin s(t, normal, setup.axis, fraction);
            const auto last = to_uvw(s.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
            const auto origin = to_uvw(s.axis, box.lo[0], box.lo[1], box.lo[2]);
            voxels rows;
            const int from = static_cast<int>(g.number(0, last[0]));
            for (int row = 0; row <= last[1]; ++row) {
                std::set<std::pair<int, int>> part;
                s.row(from, static_cast<int>(last[0]), row, [&](int u, int w) { part.insert({u, w}); });
                s.row(0, static_cast<int>(last[0]), row, [&](int u, int w) {
                    EXPECT_EQ(part.count({u, w}), u >= from ? 1u : 0u);
                    const auto p = to_xyz(s.axis, origin[0] + u, origin[1] + row, origin[2] + w);
                    rows.insert({static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                });
            }
            voxel_box wide = box; // the depth may leave the bounding box
            for (int k = 0; k < 3; ++k) {
                wide.lo[k] -= 2;
                wide.hi[k] += 2;
            }
            ASSERT_EQ(rows, by_the_general_path<span_rule::thin>(v, fraction, wide))
                << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(80000));
}

TEST(SmallTriangle, NearPositionsSnapAsAllDo) {
    generator g;
    const snap_transform t{
        {-1.25, 3.5, 0.1}, {16384.0 / 0.013, 16384.0 / 0.017, 16384.0 / 0.3}, {0, 5 << 14, 900 << 14}, 14};
    std::uniform_real_distribution<float> place(-40.0f, 40.0f);
    for (int i = 0; i < unit::cases(100000); ++i) {
        const float x = place(g.random), y = place(g.random), z = place(g.random) * 20;
        std::int32_t q[3];
        ASSERT_TRUE(snap_near(t, x, y, z, q));
        const snapped_position p = snap(t, x, y, z);
        ASSERT_EQ(q[0], p.x);
        ASSERT_EQ(q[1], p.y);
        ASSERT_EQ(q[2], p.z);
    }
    std::int32_t q[3];
    EXPECT_FALSE(snap_near(t, std::numeric_limits<float>::quiet_NaN(), 0, 0, q));
    EXPECT_FALSE(snap_near(t, 0, std::numeric_limits<float>::infinity(), 0, q));
    EXPECT_FALSE(snap_near(t, 0, 0, -1e30f, q));
    EXPECT_FALSE(snap_near(t, 1000.0f, 0, 0, q)); // 1.26e9 units
}

} // namespace
