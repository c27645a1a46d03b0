// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Meshes with holes: cones against a second way to make them, the flood and the vote against plain ones over bytes.

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

mesh without_triangles(mesh m, std::vector<std::size_t> which) {
    std::sort(which.rbegin(), which.rend());
    for (const std::size_t i : which) m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(i));
    return m;
}
mesh with_holes(splitmix64& random, mesh m, std::size_t count) {
    for (std::size_t i = 0; i < count && m.triangles.size() > 1; ++i)
        m = without_triangles(m, {static_cast<std::size_t>(random.below(m.triangles.size()))});
    return m;
}

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

// ---- exterior -------------------------------------------------------------------------------------------------------

// Over bytes, voxel by voxel.
voxel_set plain_interior(const voxel_set& cover, glm::ivec3 e, int closing) {
    const int ring = closing + 1;
    const glm::ivec3 padded = e + 2 * ring;
    const auto inside = [&](glm::ivec3 p) {
        return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < padded.x && p.y < padded.y && p.z < padded.z;
    };
    const auto at = [&](glm::ivec3 p) { return index(padded, p.x, p.y, p.z); };
    const auto for_each = [&](glm::ivec3 from, glm::ivec3 to, auto&& visit) {
        for (int z = from.z; z <= to.z; ++z)
            for (int y = from.y; y <= to.y; ++y)
                for (int x = from.x; x <= to.x; ++x) visit(glm::ivec3(x, y, z));
    };
    voxel_set walls(at(padded - 1) + 1), reached(walls.size()), grown(walls.size());
    for_each(glm::ivec3(0), e - 1, [&](glm::ivec3 p) {
        if (cover[index(e, p.x, p.y, p.z)] != 0)
            for_each(p + ring - closing, p + ring + closing, [&](glm::ivec3 q) { walls[at(q)] = 1; });
    });
    std::vector<glm::ivec3> stack{glm::ivec3(0)};
    reached[0] = 1;
    while (!stack.empty()) {
        const glm::ivec3 p = stack.back();
        stack.pop_back();
        for (int a = 0; a < 3; ++a)
            for (const int step : {-1, 1}) {
                glm::ivec3 q = p;
                q[a] += step;
                if (!inside(q) || walls[at(q)] != 0 || reached[at(q)] != 0) continue;
                reached[at(q)] = 1;
                stack.push_back(q);
            }
    }
    for_each(glm::ivec3(0), padded - 1, [&](glm::ivec3 p) {
        if (reached[at(p)] != 0)
            for_each(p - closing, p + closing, [&](glm::ivec3 q) {
                if (inside(q)) grown[at(q)] = 1;
            });
    });
    voxel_set result(cover.size());
    for_each(glm::ivec3(0), e - 1,
             [&](glm::ivec3 p) { result[index(e, p.x, p.y, p.z)] = grown[at(p + ring)] == 0 ? 1 : 0; });
    return result;
}

vp::solid_options exterior(int closing, vp::bodies body = vp::bodies::call) {
    return {.bodies = body, .repair = vp::repair::exterior, .closing = closing};
}

TEST(Exterior, IsAPlainFloodOverBytesWithAnyClosing) {
    splitmix64 random(41);
    const int rounds = std::max(8, oracle::repeats(24));
    std::size_t hidden = 0;
    for (int round = 0; round < rounds; ++round) {
        const glm::ivec3 e(1 + static_cast<int>(random.below(80)), 1 + static_cast<int>(random.below(20)),
                           1 + static_cast<int>(random.below(20)));
        const mesh m = with_holes(random, random_bodies(random, 20, 4), random.below(3));
        const vp::grid g = unit_grid(e);
        const int closing = round % 4;
        const voxel_set cover = library_cover(m, g);
        const voxel_set expected = plain_interior(cover, e, closing);
        const solid s = library_solid(m, g, exterior(closing));
        ASSERT_EQ(s.voxels, expected) << "round " << round;
        EXPECT_EQ(without(cover, s.voxels), voxel_set(cover.size())) << "what is touched is inside";
        hidden += count(s.voxels) - count(cover);
    }
    EXPECT_GT(hidden, 40u * static_cast<unsigned>(rounds));
}

TEST(Exterior, FindsItsWayThroughACorridorOfManyTurns) {
    // A maze of plates with gaps at alternating ends: the flood has to turn at each.
    mesh m = box({1, 1, 1}, {63, 31, 31});
    for (int i = 0; i < 10; ++i) {
        const float x = 5.0f + 5.5f * static_cast<float>(i);
        m.add(i % 2 == 0 ? box({x, 1, 1}, {x + 0.2f, 27, 31}) : box({x, 5, 1}, {x + 0.2f, 31, 31}));
    }
    const vp::grid g = unit_grid({64, 32, 32});
    EXPECT_EQ(library_solid(m, g, exterior(0)).voxels, voxel_set(64 * 32 * 32, 1)) << "sealed";
    mesh open = without_triangles(m, {8}); // half of the face at x = 1
    const voxel_set s = library_solid(open, g, exterior(0)).voxels;
    EXPECT_EQ(s, plain_interior(library_cover(open, g), g.extent, 0));
    EXPECT_EQ(s[index(g.extent, 60, 16, 16)], 0) << "the last chamber is reached";
}

TEST(Exterior, RunsAlongATunnelOfManyWordsFromEitherEnd) {
    const vp::grid g = unit_grid({300, 6, 6});
    const mesh tunnel = box({1.5f, 1.5f, 1.5f}, {298.5f, 4.5f, 4.5f});
    EXPECT_EQ(library_solid(tunnel, g, exterior(0)).voxels[index(g.extent, 150, 3, 3)], 1) << "closed at both ends";
    for (const std::vector<std::size_t>& end : {std::vector<std::size_t>{8, 9}, {10, 11}}) {
        const mesh open = without_triangles(tunnel, end);
        const voxel_set s = library_solid(open, g, exterior(0)).voxels;
        for (int x = 3; x < 297; ++x) EXPECT_EQ(s[index(g.extent, x, 3, 3)], 0) << x;
        EXPECT_EQ(s, plain_interior(library_cover(open, g), g.extent, 0));
    }
}

TEST(Exterior, ClosingSealsGapsAndAMeshThatLeavesTheGridIsFloodedThere) {
    const vp::grid g = unit_grid({20, 20, 20});
    const std::size_t middle = index(g.extent, 10, 10, 10);
    // The lid below has a slit of some two voxels.
    mesh slit = without_triangles(box({4, 4, 4}, {16, 16, 16}), {0, 1});
    slit.add(box({4, 4, 4}, {16, 8.6f, 4}));
    slit.add(box({4, 11.4f, 4}, {16, 16, 4}));
    EXPECT_EQ(library_solid(slit, g, exterior(0)).voxels[middle], 0);
    EXPECT_EQ(library_solid(slit, g, exterior(1)).voxels[middle], 1);
    const mesh leaving = box({4, 4, 4}, {40, 16, 16});
    EXPECT_EQ(library_solid(leaving, g, exterior(0)).voxels[middle], 0) << "open where it leaves the grid";
    EXPECT_EQ(library_solid(leaving, unit_grid({48, 20, 20}), exterior(0)).voxels[index({48, 20, 20}, 10, 10, 10)], 1);
}

TEST(Exterior, EachDrawByItself) {
    const vp::grid g = unit_grid({40, 20, 20});
    splitmix64 random(42);
    const std::vector<mesh> draws{random_bodies(random, 18, 2), random_bodies(random, 18, 2)};
    vp::cpu_backend be{2};
    vp::abuffer<vp::cpu_backend, void> lists{be};
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const std::vector<draw> list{{draws[0].view(), {}, {}}, {draws[1].view(), {}, {}}};
    ASSERT_TRUE(vp::voxelize_solid(be, list, g, lists, exterior(1, vp::bodies::draw)).ok());
    const auto host = lists.to_host(be);
    for (std::uint32_t d = 0; d < 2; ++d) {
        voxel_set got(index(g.extent, 0, 0, 20));
        for (const auto& [voxel, fragments] : host)
            for (const auto [number, value] : fragments)
                if (number == d) got[index(g.extent, voxel.x, voxel.y, voxel.z)] = 1;
        EXPECT_EQ(got, plain_interior(library_cover(draws[d], g), g.extent, 1)) << d;
    }
}

// ---- vote -----------------------------------------------------------------------------------------------------------

voxel_set plain_vote(const mesh& m, const vp::grid& g) {
    std::vector<int> balance(index(g.extent, 0, 0, g.extent.z));
    for (int axis = 0; axis < 3; ++axis) {
        std::array<int, 3> low{}, high{};
        low[static_cast<std::size_t>(axis)] = -1;
        high[static_cast<std::size_t>(axis)] = 1;
        const auto below = oracle_windings(m, g, low), above = oracle_windings(m, g, high);
        for (std::size_t i = 0; i < balance.size(); ++i)
            if ((below[i] - above[i]) % 2 == 0) balance[i] += below[i] % 2 != 0 ? 1 : -1; // else its row is open
    }
    voxel_set s;
    for (const int b : balance) s.push_back(b > 0 ? 1 : 0);
    return united(s, library_cover(m, g));
}

TEST(Vote, IsTheMajorityOfTheClosedRowsOfThreeAxes) {
    splitmix64 random(51);
    const vp::solid_options vote{.repair = vp::repair::vote};
    const int rounds = std::max(8, oracle::repeats(24));
    bool differs = false;
    for (int round = 0; round < rounds; ++round) {
        const mesh m = with_holes(random, random_bodies(random, 20, 3), random.below(4));
        const vp::grid g = unit_grid({70, 18, 17});
        const voxel_set expected = plain_vote(m, g);
        const solid s = library_solid(m, g, vote);
        ASSERT_EQ(s.voxels, expected) << "round " << round;
        const solid plain = library_solid(m, g, {.rule = vp::fill_rule::even_odd, .extent = extent_of::outer});
        EXPECT_EQ(s.status.solid.open_rows, plain.status.solid.open_rows);
        EXPECT_EQ(s.status.solid.crossings, plain.status.solid.crossings);
        if (plain.status.solid.open_rows == 0) continue;
        differs = differs || s.voxels != plain.voxels;
        const glm::ivec3 begin(31, 3, 2), size(20, 9, 11); // a crop is the crop of the whole
        const solid part = library_solid(m, g.crop(begin, size), vote);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    ASSERT_EQ(part.voxels[index(size, x, y, z)],
                              s.voxels[index(g.extent, x + begin.x, y + begin.y, z + begin.z)]);
    }
    EXPECT_TRUE(differs);
    const mesh closed = random_bodies(random, 20, 3);
    const vp::grid g = unit_grid({22, 21, 20});
    EXPECT_EQ(library_solid(closed, g, vote).voxels,
              library_solid(closed, g, {.rule = vp::fill_rule::even_odd, .extent = extent_of::outer}).voxels);
}

TEST(Vote, TrianglesAreOutsideIffTheyMissTwoIntervals) {
    mesh m = box({20, 1, 1}, {30, 5, 5}); // misses x alone
    m.add(box({1, 20, 1}, {5, 30, 5}));   // misses y alone
    m.add(box({1, 20, 20}, {5, 30, 30})); // misses y and z
    const solid s = library_solid(m, unit_grid(glm::ivec3(8)), {.repair = vp::repair::vote});
    EXPECT_EQ(s.status.counts.triangles_outside, 12u);
    EXPECT_EQ(s.status.counts.triangles_drawn, 24u);
    EXPECT_EQ(count(s.voxels), 0u);
}

TEST(Vote, AndExteriorNameTrianglesWithBadIndices) {
    for (const vp::repair repair : {vp::repair::vote, vp::repair::exterior, vp::repair::close_holes}) {
        vp::cpu_backend be{2};
        mesh m = box({1, 1, 1}, {6, 6, 6});
        m.triangles[3].y = 99;
        const vp::grid g = unit_grid(glm::ivec3(8));
        vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{be, g.extent};
        const vp::status s =
            vp::voxelize_solid(be, m.view(), g, vp::passthrough{}, vp::constant(true), fb, {.repair = repair});
        EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
        EXPECT_EQ(s.triangle, 3u);
    }
}

} // namespace
} // namespace solids
