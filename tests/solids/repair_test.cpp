// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Meshes with holes: cones against a second way to make them.

#include "solid_support.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace solids {
namespace {

using extent_of = vp::solid_extent;

constexpr vp::solid_options closing_holes{.repair = vp::repair::close_holes};

// ---- close_holes ----------------------------------------------------------------------------------------------------

TEST(CloseHoles, ABoxWithoutALidIsClosedByAConeInThePlaneOfTheLid) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    const mesh whole = box({2, 3, 4}, {12, 13, 14});
    const voxel_set truth = library_solid(whole, g).voxels;
    for (std::size_t face = 0; face < 6; ++face) {
        const mesh open = without_triangles(whole, {2 * face, 2 * face + 1});
        const solid s = library_solid(open, g, closing_holes);
        EXPECT_EQ(s.voxels, truth) << "face " << face;
        EXPECT_EQ(s.status.solid.open_rows, 0u);
        EXPECT_EQ(s.status.solid.hole_edges, 4u);
        EXPECT_EQ(s.status.solid.holes, 1u);
        EXPECT_EQ(s.status.solid.cones, 1u);
        EXPECT_EQ(s.status.counts.triangles_in, 10u) << "cones are not counted";
        EXPECT_EQ(s.status.counts.triangles_drawn, 10u);
        const solid outer = library_solid(open, g, {.extent = extent_of::outer, .repair = vp::repair::close_holes});
        EXPECT_EQ(outer.voxels, united(truth, library_cover(whole, g))) << "the cone belongs to the cover";
    }
    const mesh bare = without_triangles(whole, {0, 1, 2, 3});
    const solid s = library_solid(bare, g, closing_holes);
    EXPECT_EQ(s.voxels, truth);
    EXPECT_EQ(s.status.solid.holes, 2u);
    const solid closed = library_solid(whole, g, closing_holes);
    EXPECT_EQ(closed.voxels, truth);
    EXPECT_EQ(closed.status.solid.hole_edges, 0u);
}

TEST(CloseHoles, OnlyHolesUpToTheGreatestNumberOfEdgesAreClosed) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    const mesh m = without_triangles(box({2, 3, 4}, {12, 13, 14}), {0, 1, 2}); // of four edges and of three
    for (const std::uint64_t most : {2u, 3u, 4u}) {
        vp::solid_options o = closing_holes;
        o.max_hole_edges = most;
        const solid s = library_solid(m, g, o);
        EXPECT_EQ(s.status.solid.holes, 2u);
        EXPECT_EQ(s.status.solid.hole_edges, 7u);
        EXPECT_EQ(s.status.solid.cones, most - 2u);
    }
}

TEST(CloseHoles, VerticesAreWeldedByPositionAcrossTheDrawsOfABody) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    const mesh whole = box({2, 3, 4}, {12, 13, 14});
    std::vector<mesh> draws(3); // each triangle by itself, dealt to three draws
    for (std::size_t i = 0; i < whole.triangles.size(); ++i) {
        mesh t;
        for (int n = 0; n < 3; ++n) t.positions.push_back(whole.positions[whole.triangles[i][n]]);
        t.triangles = {{0, 1, 2}};
        draws[i % 3].add(t);
    }
    const solid together = library_solid(draws, g, closing_holes);
    EXPECT_EQ(together.status.solid.hole_edges, 0u);
    EXPECT_EQ(together.voxels, library_solid(whole, g).voxels);
    vp::solid_options each = closing_holes;
    each.bodies = vp::bodies::draw;
    const solid apart = library_solid(draws, g, each);
    EXPECT_GT(apart.status.solid.hole_edges, 12u) << "each draw closes its own holes";
    EXPECT_EQ(apart.status.solid.open_rows, 0u);
}

TEST(CloseHoles, DroppedTrianglesAreHolesAndTheMultiplicityOfEdgesCounts) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    mesh m = box({2, 3, 4}, {12, 13, 14});
    const voxel_set truth = library_solid(m, g).voxels;
    mesh nan = m;
    nan.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
    nan.triangles[5].y = 8;
    const solid s = library_solid(nan, g, closing_holes);
    EXPECT_EQ(s.voxels, truth);
    EXPECT_EQ(s.status.solid.hole_edges, 3u);
    EXPECT_EQ(s.status.counts.triangles_nonfinite, 1u);
    m.triangles.push_back(m.triangles[8]);
    m.triangles.push_back(m.triangles[8]); // the face three times
    const solid t = library_solid(m, g, closing_holes);
    EXPECT_EQ(t.status.solid.hole_edges, 6u);
    EXPECT_EQ(t.status.solid.holes, 1u);
    EXPECT_EQ(t.status.solid.open_rows, 0u);
    EXPECT_EQ(t.voxels, truth);
}

// The cones a second way: edges in a map by snapped position, components by repeated merging of sets.
struct second_way {
    std::vector<oracle::snapped_triangle> closed; // the mesh with its cones
    std::uint64_t edges = 0, holes = 0;

    second_way(const mesh& m, const vp::grid& g) : closed(snap(m, g)) {
        using point = std::array<std::int64_t, 3>;
        std::map<std::pair<point, point>, std::int64_t> sum; // of p -> q with p < q
        for (const auto& t : closed) {
            if (t.dropped) continue;
            for (int n = 0; n < 3; ++n) {
                const auto at = [&](int i) { return point{t.v[i][0], t.v[i][1], t.v[i][2]}; };
                const point p = at(n), q = at((n + 1) % 3);
                if (p < q) ++sum[{p, q}];
                if (q < p) --sum[{q, p}];
            }
        }
        std::vector<std::set<point>> components;
        for (const auto& [edge, n] : sum) {
            if (n == 0) continue;
            edges += static_cast<std::uint64_t>(n < 0 ? -n : n);
            std::set<point> joined{edge.first, edge.second};
            for (auto i = components.begin(); i != components.end();) {
                if (i->count(edge.first) + i->count(edge.second) != 0) {
                    joined.insert(i->begin(), i->end());
                    i = components.erase(i);
                } else {
                    ++i;
                }
            }
            components.push_back(joined);
        }
        holes = components.size();
        for (const auto& c : components) {
            const auto m_ = static_cast<std::int64_t>(c.size());
            point apex{};
            for (std::size_t a = 0; a < 3; ++a) {
                std::int64_t s = 0;
                for (const point& p : c) s += p[a];
                const std::int64_t n = 2 * s + m_, d = 2 * m_;
                apex[a] = n >= 0 ? n / d : -((-n + d - 1) / d);
            }
            for (const auto& [edge, n] : sum) {
                if (n == 0 || c.count(edge.first) == 0) continue;
                for (std::int64_t i = 0; i < (n < 0 ? -n : n); ++i) {
                    const point &p = n > 0 ? edge.second : edge.first, &q = n > 0 ? edge.first : edge.second;
                    oracle::snapped_triangle t{};
                    for (int a = 0; a < 3; ++a) {
                        t.v[0][a] = p[static_cast<std::size_t>(a)];
                        t.v[1][a] = q[static_cast<std::size_t>(a)];
                        t.v[2][a] = apex[static_cast<std::size_t>(a)];
                    }
                    closed.push_back(t);
                }
            }
        }
    }
};

TEST(CloseHoles, AnyMeshBecomesClosedAndTheOracleAgreesInASkewDirection) {
    splitmix64 random(31);
    for (int round = 0; round < 40; ++round) {
        const mesh m = with_holes(random, random_bodies(random, 9, 3), 1 + random.below(6));
        const vp::grid g = unit_grid({11, 10, 9});
        const second_way expected(m, g);
        const oracle::winding_oracle oracle(16, expected.closed, skew);
        const solid s = library_solid(m, g, closing_holes);
        EXPECT_EQ(s.status.solid.open_rows, 0u);
        EXPECT_EQ(s.status.solid.hole_edges, expected.edges);
        EXPECT_EQ(s.status.solid.holes, expected.holes);
        for (int z = 0; z < 9; ++z)
            for (int y = 0; y < 10; ++y)
                for (int x = 0; x < 11; ++x)
                    ASSERT_EQ(s.voxels[index(g.extent, x, y, z)], oracle.winding({x, y, z}) != 0 ? 1 : 0)
                        << "round " << round << " at " << x << ' ' << y << ' ' << z;
        // A crop closes the same holes.
        const glm::ivec3 begin(3, 2, 4), size(5, 7, 4);
        const solid part = library_solid(m, g.crop(begin, size), closing_holes);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    ASSERT_EQ(part.voxels[index(size, x, y, z)],
                              s.voxels[index(g.extent, x + begin.x, y + begin.y, z + begin.z)]);
    }
}

TEST(CloseHoles, ASphereThatLostManyTrianglesIsNearlyWhole) {
    splitmix64 random(32);
    const vp::grid g = unit_grid(glm::ivec3(64));
    const mesh whole = sphere({32, 32, 32}, 28.3f, 5);
    const mesh open = with_holes(random, whole, whole.triangles.size() / 20);
    const voxel_set truth = library_solid(whole, g).voxels;
    const solid closed = library_solid(open, g, closing_holes), left = library_solid(open, g);
    EXPECT_GT(left.status.solid.open_rows, 50u);
    EXPECT_EQ(closed.status.solid.open_rows, 0u);
    EXPECT_LT(count(exclusive(closed.voxels, truth)), count(truth) / 1000);
    EXPECT_GT(count(exclusive(left.voxels, truth)), count(truth) / 100);
}

} // namespace
} // namespace solids
