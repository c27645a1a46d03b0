// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Refinement and subdivision: a voxel's closed box is the union of the eight half as large, and a triangle the union of
// the four between the midpoints of its edges, so coverage may not change.
//
// Both grids of a refinement must snap positions alike. Beyond 256 voxels, F falls by one when the extent doubles. Then
// scale = 2^F / voxel_size is the same number at N and 2N, and all fixed-point positions are equal. Up to 256 voxels, F
// stays 16 and positions at 2N have one more bit, so there the property is tested on positions on the lattice of N.

#include "properties.hpp"

namespace properties {
namespace {

grid doubled(const grid& g) {
    grid fine = g;
    for (int axis = 0; axis < 3; ++axis) {
        fine.extent[axis] *= 2;
        fine.voxel_size[axis] *= 0.5;
    }
    return fine;
}

voxels coarsened(voxels fine) {
    for (voxel& v : fine) v = {v.i / 2, v.j / 2, v.k / 2};
    std::sort(fine.begin(), fine.end());
    fine.erase(std::unique(fine.begin(), fine.end()), fine.end());
    return fine;
}

void expect_refines(const grid& g, const std::vector<world_triangle>& triangles, std::string_view where) {
    const auto coarse = library_sets(g, triangles, vp::coverage::conservative);
    const auto fine = library_sets(doubled(g), triangles, vp::coverage::conservative);
    std::size_t total = 0;
    for (std::size_t n = 0; n < triangles.size(); ++n) {
        ASSERT_TRUE(coarse[n] == coarsened(fine[n])) << where << ' ' << oracle::describe(g, triangles[n]);
        total += coarse[n].size();
    }
    EXPECT_GT(total, triangles.size() / 3) << where;
}

TEST(Refinement, ConservativeIsTheOrOfEightAtTwiceTheResolutionForAnyPosition) {
    splitmix64 random(51);
    for (const grid& g :
         {grid{{0.1, -3.3, 17}, {0.01, 0.013, 0.0071}, {150, 97, 256}},
          grid{{-1, -1, -1}, {0.003, 0.003, 0.003}, {300, 511, 130}}, grid{{5, 5, 5}, {0.7, 0.7, 0.7}, {129, 1, 129}},
          grid{{-2, 0, 1e3}, {0.001, 0.002, 0.0005}, {1023, 40, 600}}}) {
        ASSERT_EQ(oracle::fraction_bits(doubled(g)), oracle::fraction_bits(g) - 1);
        const test_grid where = {g, "refined", false, false};
        auto triangles = all_kinds(random, where, scaled(200));
        for (int n = 0; n < (oracle::test_scale() < 1 ? 1 : 3); ++n)
            triangles.push_back(oracle::make_triangle(random, where, triangle_class::large));
        for (const world_triangle& t : triangles) { // the premise: equal fixed-point positions
            const snapped_triangle coarse = oracle::snap(g, t.v);
            ASSERT_EQ(coarse.dropped, oracle::snap(doubled(g), t.v).dropped);
            if (!coarse.dropped) {
                ASSERT_TRUE(same_units(oracle::snap(doubled(g), t.v), coarse.v));
            }
        }
        expect_refines(g, triangles, "any position");
    }
}

TEST(Refinement, ConservativeIsTheOrOfEightOnTheLatticeOfSmallGrids) {
    splitmix64 random(52);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.exact || !where.dense) continue;
        ASSERT_EQ(oracle::fraction_bits(doubled(where.g)), oracle::fraction_bits(where.g));
        std::vector<world_triangle> exact;
        for (world_triangle t : all_kinds(random, where, scaled(200))) {
            if (!make_exact(where.g, 1, t)) continue;
            const snapped_triangle coarse = oracle::snap(where.g, t.v), fine = oracle::snap(doubled(where.g), t.v);
            if (fine.dropped) continue; // the limit of 2^40 units is half as far away
            for (int n = 0; n < 3; ++n)
                for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(fine.v[n][axis], 2 * coarse.v[n][axis]);
            exact.push_back(t);
        }
        EXPECT_GT(exact.size(), 12u * static_cast<unsigned>(scaled(200)));
        expect_refines(where.g, exact, where.name);
    }
}

class Subdivision : public ::testing::TestWithParam<vp::coverage> {};

std::vector<world_triangle> split(const world_triangle& t) {
    float m[3][3]; // m[n]: middle of the edge from vertex n
    for (int n = 0; n < 3; ++n)
        for (int axis = 0; axis < 3; ++axis) m[n][axis] = 0.5f * t.v[n][axis] + 0.5f * t.v[(n + 1) % 3][axis];
    const auto make = [](const float(&a)[3], const float(&b)[3], const float(&c)[3]) {
        return world_triangle{{{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}}};
    };
    return {make(t.v[0], m[0], m[2]), make(m[0], t.v[1], m[1]), make(m[2], m[1], t.v[2]), make(m[0], m[1], m[2])};
}

// Holds for thin coverage as well: the four triangles have one plane and one normal direction, hence the same axis and
// depths.
TEST_P(Subdivision, AtExactMidpointsKeepsTheVoxels) {
    splitmix64 random(53);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.exact) continue;
        std::vector<world_triangle> whole, parts;
        for (world_triangle t : all_kinds(random, where, scaled(200))) {
            if (!make_exact(where.g, 4, t)) continue; // two levels of midpoints are on the lattice
            std::vector<world_triangle> pieces;
            for (const world_triangle& quarter : split(t))
                for (const world_triangle& piece : split(quarter)) pieces.push_back(piece);
            const snapped_triangle snapped = oracle::snap(where.g, t.v);
            bool exact = true; // far outside, floats may be too coarse for the midpoints
            for (const world_triangle& quarter : split(t))
                for (int n = 0; n < 3; ++n)
                    for (int axis = 0; axis < 3; ++axis) {
                        const std::int64_t sum = snapped.v[n][axis] + snapped.v[(n + 1) % 3][axis];
                        exact = exact && oracle::snap(where.g, split(t)[3].v).v[n][axis] * 2 == sum;
                        const snapped_triangle q = oracle::snap(where.g, quarter.v);
                        const std::int64_t quarter_sum = q.v[n][axis] + q.v[(n + 1) % 3][axis];
                        exact = exact && oracle::snap(where.g, split(quarter)[3].v).v[n][axis] * 2 == quarter_sum;
                    }
            if (!exact) continue;
            whole.push_back(t);
            parts.insert(parts.end(), pieces.begin(), pieces.end());
        }
        EXPECT_GT(whole.size(), 10u * static_cast<unsigned>(scaled(200))) << where.name;
        const auto expected = library_sets(where.g, whole, GetParam());
        const auto found = library_sets(where.g, parts, GetParam());
        for (std::size_t n = 0; n < whole.size(); ++n) {
            voxels all;
            for (std::size_t piece = 16 * n; piece < 16 * n + 16; ++piece)
                all.insert(all.end(), found[piece].begin(), found[piece].end());
            std::sort(all.begin(), all.end());
            all.erase(std::unique(all.begin(), all.end()), all.end());
            ASSERT_TRUE(all == expected[n]) << where.name << ' ' << oracle::describe(where.g, whole[n]);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(BothRules, Subdivision, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         rule_of);

} // namespace
} // namespace properties
