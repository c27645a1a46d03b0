// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Signs: those of an oracle that follows skew rays, and those of voxelize_solid.

#include "distance_support.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace distances {
namespace {

// A mesh moved half a voxel up has the other's corners at the centres.
TEST(DistanceSign, IsThatOfSkewRaysOnClosedMeshes) {
    splitmix64 random(11);
    const std::int64_t n = unit::cases(100) * 4 / 10;
    for (std::int64_t i = 0; i < n; ++i) {
        SCOPED_TRACE(i);
        const vp::grid g = solids::unit_grid({9, 8, 7});
        const mesh m = solids::random_bodies(random, 8, 4);
        for (const vp::sample where : {vp::sample::centre, vp::sample::corner}) {
            const field f = library_field(m, g, {.band = vp::band::whole, .sample = where});
            ASSERT_TRUE(f.status.ok());
            EXPECT_EQ(f.status.solid.open_rows, 0u);
            // Both grids have 2^16 steps a voxel, so half a voxel moves nothing but the mesh.
            const mesh seen = where == vp::sample::corner ? m.moved(glm::vec3(0.5f)) : m;
            const std::vector<std::int64_t> windings =
                solids::oracle_windings(seen, solids::unit_grid(f.extent), {3, -7, 5});
            for (std::size_t s = 0; s < windings.size(); ++s) {
                ASSERT_EQ(std::signbit(f.distances[s]), windings[s] != 0 && f.distances[s] != 0.0f) << s;
            }
        }
    }
}

// Every rule, both kinds of bodies and every repair, at centres and at corners: minus exactly where the solid of a grid
// with these centres has a voxel.
TEST(DistanceSign, IsTheSolidsUnderEveryRuleAndRepair) {
    splitmix64 random(12);
    const std::int64_t n = unit::cases(100) / 50;
    for (std::int64_t i = 0; i < n; ++i) {
        const vp::grid g = solids::unit_grid({22, 21, 20});
        const std::vector<mesh> draws{solids::random_bodies(random, 18, 3), solids::random_bodies(random, 18, 3),
                                      solids::tube({3, 4, 5}, {9, 12, 15}, 1.25f)};
        std::vector<vp::distance_options> all;
        for (const vp::fill_rule rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive})
            for (const vp::bodies bodies : {vp::bodies::call, vp::bodies::draw})
                for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes})
                    all.push_back({.rule = rule, .bodies = bodies, .repair = repair});
        all.push_back({.repair = vp::repair::exterior, .closing = 2});
        all.push_back({.repair = vp::repair::vote});
        for (const vp::bodies bodies : {vp::bodies::call, vp::bodies::draw})
            all.push_back({.bodies = bodies, .repair = vp::repair::winding});
        all.push_back({.rule = vp::fill_rule::positive, .repair = vp::repair::winding});
        for (const vp::distance_options& o : all) {
            vp::solid_options same = vp::core::sign_options(o);
            same.count_voxels = true;
            for (const vp::sample where : {vp::sample::centre, vp::sample::corner}) {
                vp::distance_options there = o;
                there.sample = where;
                const field f = library_field(draws, g, there);
                ASSERT_TRUE(f.status.ok()) << f.status.message();
                const vp::grid samples = where == vp::sample::corner ? g.at_corners() : g;
                const solids::solid s = solids::library_solid(draws, samples, same);
                ASSERT_EQ(f.distances.size(), s.voxels.size());
                for (std::size_t v = 0; v < s.voxels.size(); ++v)
                    ASSERT_EQ(std::signbit(f.distances[v]), s.voxels[v] != 0 && f.distances[v] != 0.0f);
                EXPECT_EQ(f.status.solid, s.status.solid);
            }
        }
    }
}

// Walls of half a voxel and less between two centres, and parallel walls close to each other.
TEST(DistanceSign, ThinAndCloseWallsKeepTheirSides) {
    mesh m = solids::box({2.0f, 2.0f, 4.45f}, {14.0f, 14.0f, 4.55f});
    m.add(solids::box({2.0f, 2.0f, 4.56f}, {14.0f, 14.0f, 4.9f}));
    m.add(solids::box({2.0f, 2.0f, 8.0f}, {14.0f, 14.0f, 8.4f}));
    const field f = library_field(m, solids::unit_grid({16, 16, 12}), {.band = vp::band::whole});
    for (int z = 0; z < 12; ++z)
        for (int x = 3; x < 13; ++x) EXPECT_EQ(f.distances[f.index(x, 7, z)] < 0.0f, z == 4) << z;
}

// A sample in front of a surface is not negative for the voxel that the surface touches, and a sheet has no inside.
TEST(DistanceSign, FloodsAndVotesDecideAtTheSample) {
    const vp::grid g = solids::unit_grid(glm::ivec3(24));
    const mesh ball = solids::sphere({12, 12, 12}, 8.3f, 4);
    const field truth = library_field(ball, g);
    std::size_t touched = 0;
    const solids::voxel_set cover = solids::library_cover(ball, g);
    for (const vp::repair repair : {vp::repair::exterior, vp::repair::vote}) {
        const field f = library_field(ball, g, {.repair = repair});
        std::size_t other = 0;
        for (std::size_t v = 0; v < cover.size(); ++v) {
            if (f.distances[v] != truth.distances[v]) ++other;
            touched += cover[v] != 0 && f.distances[v] > 0.0f ? 1 : 0;
        }
        // Those of a flood that touched neighbours surround stay inside.
        EXPECT_LE(other, repair == vp::repair::vote ? 0u : solids::count(cover) / 20);
    }
    EXPECT_GT(touched, solids::count(cover) / 2) << "outside, in touched voxels";
    mesh sheet;
    sheet.positions = {{3, 3, 12.3f}, {21, 3, 12.3f}, {21, 21, 12.3f}, {3, 21, 12.3f}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const vp::repair repair : {vp::repair::exterior, vp::repair::vote})
        for (const float d : library_field(sheet, g, {.repair = repair}).distances) ASSERT_FALSE(std::signbit(d));
}

TEST(DistanceSign, ZeroIsPositive) {
    const field f = library_field(solids::box({1.5f, 1.5f, 1.5f}, {4.5f, 4.5f, 4.5f}), solids::unit_grid({6, 6, 6}));
    int zeros = 0;
    for (const float d : f.distances)
        if (d == 0.0f) {
            EXPECT_FALSE(std::signbit(d));
            ++zeros;
        }
    EXPECT_EQ(zeros, 4 * 4 * 4 - 2 * 2 * 2);
}

} // namespace
} // namespace distances
