// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Insides: the oracle, the table of fill rules, theorems, closed formulas, extents, and inputs that other
// voxelizers are known to get wrong.

#include "solid_support.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace solids {
namespace {

using rule = vp::fill_rule;
using extent_of = vp::solid_extent;

constexpr rule all_rules[]{rule::even_odd, rule::nonzero, rule::positive};

TEST(SolidRules, EverySolidIsTheOracles) {
    splitmix64 random(11);
    for (int round = 0; round < 40; ++round) {
        const glm::ivec3 e(1 + static_cast<int>(random.below(40)), 1 + static_cast<int>(random.below(9)),
                           1 + static_cast<int>(random.below(9)));
        const mesh m = random_bodies(random, 9, 1 + static_cast<int>(random.below(6)));
        const vp::grid g = unit_grid(e);
        const auto windings = oracle_windings(m, g, skew);
        std::int64_t greatest = 0;
        for (const std::int64_t w : windings) greatest = std::max(greatest, w < 0 ? -w : w);
        for (const rule r : all_rules) {
            const solid s = library_solid(m, g, {.rule = r});
            ASSERT_EQ(s.voxels, accepted(windings, r)) << "round " << round << " rule " << static_cast<int>(r);
            EXPECT_EQ(s.status.solid.open_rows, 0u);
            EXPECT_EQ(s.status.solid.max_winding, r == rule::even_odd ? 0u : static_cast<std::uint64_t>(greatest));
        }
    }
}

TEST(SolidRules, OpenMeshesFollowRowsAlongXAndOpenRowsAreCounted) {
    splitmix64 random(12);
    for (int round = 0; round < 40; ++round) {
        mesh m = random_bodies(random, 8, 3);
        for (int i = 0; i < 3; ++i)
            m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(random.below(m.triangles.size())));
        const vp::grid g = unit_grid({9, 8, 7});
        const auto below = oracle_windings(m, g, along_rows), above = oracle_windings(m, g, {1, 0, 0});
        std::uint64_t odd = 0, unbalanced = 0;
        for (int z = 0; z < 7; ++z)
            for (int y = 0; y < 8; ++y) {
                const auto sum = below[index(g.extent, 0, y, z)] - above[index(g.extent, 0, y, z)];
                odd += sum % 2 != 0 ? 1 : 0;
                unbalanced += sum != 0 ? 1 : 0;
            }
        for (const rule r : all_rules) {
            const solid s = library_solid(m, g, {.rule = r});
            ASSERT_EQ(s.voxels, accepted(below, r)) << "round " << round << " rule " << static_cast<int>(r);
            EXPECT_EQ(s.status.solid.open_rows, r == rule::even_odd ? odd : unbalanced);
        }
    }
}

// ---- the table of docs/design.md, "Solids" --------------------------------------------------------------------------

const vp::grid table_grid = unit_grid({20, 16, 16});
const mesh large = box({2, 2, 2}, {14, 14, 14});
const mesh small = box({5, 5, 5}, {9, 9, 9});
const mesh beside = box({10, 5, 5}, {18, 9, 9}); // reaches out of `large`

mesh both(mesh a, const mesh& b) { return a.add(b); }
voxel_set of(const mesh& m, rule r) { return library_solid(m, table_grid, {.rule = r}).voxels; }
voxel_set of(const mesh& a, const mesh& b, const vp::solid_options& o) {
    return library_solid({a, b}, table_grid, o).voxels;
}
const voxel_set& nothing() {
    static const voxel_set s(index(table_grid.extent, 0, 0, 16));
    return s;
}

TEST(SolidTable, NestedShellTheInnerOneInverted) {
    const mesh m = both(large, small.inside_out());
    const voxel_set cavity = without(of(large, rule::nonzero), of(small, rule::nonzero));
    for (const rule r : all_rules) EXPECT_EQ(of(m, r), cavity);
    EXPECT_EQ(of(large, small.inside_out(), vp::each_draw), of(large, rule::nonzero));
}

TEST(SolidTable, NestedShellTheSameWay) {
    const mesh m = both(large, small);
    EXPECT_EQ(of(m, rule::even_odd), without(of(large, rule::nonzero), of(small, rule::nonzero)));
    EXPECT_EQ(of(m, rule::nonzero), of(large, rule::nonzero));
    EXPECT_EQ(of(m, rule::positive), of(large, rule::nonzero));
    EXPECT_EQ(library_solid(m, table_grid, vp::each_draw).voxels, of(m, rule::even_odd));
    EXPECT_EQ(of(large, small, vp::each_draw), of(large, rule::nonzero));
}

TEST(SolidTable, TwoPartsOverlapTheSameWay) {
    const mesh m = both(large, beside);
    const voxel_set a = of(large, rule::nonzero), b = of(beside, rule::nonzero);
    ASSERT_NE(exclusive(a, b), united(a, b));
    EXPECT_EQ(of(m, rule::even_odd), exclusive(a, b));
    EXPECT_EQ(of(m, rule::nonzero), united(a, b));
    EXPECT_EQ(of(m, rule::positive), united(a, b));
    EXPECT_EQ(of(large, beside, vp::each_draw), united(a, b));
    EXPECT_EQ(library_solid(m, table_grid, vp::each_draw).voxels, exclusive(a, b));
    EXPECT_EQ(of(large, beside, {.rule = rule::even_odd}), exclusive(a, b)) << "bodies::call takes draws together";
}

TEST(SolidTable, TwoPartsOverlapOneInsideOut) {
    const mesh m = both(large, beside.inside_out());
    const voxel_set a = of(large, rule::nonzero), b = of(beside, rule::nonzero);
    EXPECT_EQ(of(m, rule::even_odd), exclusive(a, b));
    EXPECT_EQ(of(m, rule::nonzero), exclusive(a, b));
    EXPECT_EQ(of(m, rule::positive), without(a, b));
    EXPECT_EQ(library_solid(m, table_grid, vp::each_draw).voxels, exclusive(a, b));
    EXPECT_EQ(of(large, beside.inside_out(), vp::each_draw), united(a, b));
}

TEST(SolidTable, AWholePartTwice) {
    const mesh m = both(large, large);
    EXPECT_EQ(of(m, rule::even_odd), nothing());
    EXPECT_EQ(of(m, rule::nonzero), of(large, rule::nonzero));
    EXPECT_EQ(of(m, rule::positive), of(large, rule::nonzero));
    EXPECT_EQ(library_solid(m, table_grid, vp::each_draw).voxels, nothing());
    EXPECT_EQ(of(large, large, vp::each_draw), of(large, rule::nonzero)) << "in separate draws";
}

TEST(SolidTable, ASingleFaceTwiceIsAnOpenMeshUnderEveryRule) {
    mesh m = large;
    m.triangles.push_back(m.triangles[8]); // of the face x = 2, in which rows along x start
    EXPECT_GT(library_solid(m, table_grid, {.rule = rule::even_odd}).status.solid.open_rows, 0u);
    EXPECT_GT(library_solid(m, table_grid, {.rule = rule::nonzero}).status.solid.open_rows, 0u);
    EXPECT_GT(library_solid(m, table_grid, {.rule = rule::positive}).status.solid.open_rows, 0u);
    EXPECT_GT(library_solid(m, table_grid, vp::each_draw).status.solid.open_rows, 0u);
}

TEST(SolidTable, AnInsideOutPart) {
    const mesh m = large.inside_out();
    EXPECT_EQ(of(m, rule::even_odd), of(large, rule::nonzero));
    EXPECT_EQ(of(m, rule::nonzero), of(large, rule::nonzero));
    EXPECT_EQ(of(m, rule::positive), nothing());
    EXPECT_EQ(library_solid(m, table_grid, vp::each_draw).voxels, of(large, rule::nonzero));
}

// ---- theorems -------------------------------------------------------------------------------------------------------

TEST(SolidTheorems, EvenOddOfADisjointUnionIsTheExclusiveOr) {
    splitmix64 random(13);
    for (int round = 0; round < 20; ++round) {
        const mesh a = random_bodies(random, 9, 2), b = random_bodies(random, 9, 2);
        const vp::grid g = unit_grid({10, 9, 8});
        const auto set = [&](const mesh& m) { return library_solid(m, g, {.rule = rule::even_odd}).voxels; };
        EXPECT_EQ(set(both(a, b)), exclusive(set(a), set(b)));
    }
}

TEST(SolidTheorems, NonzeroDoesNotChangeWhenAMeshAndItsInverseAreAdded) {
    splitmix64 random(14);
    for (int round = 0; round < 20; ++round) {
        const mesh a = random_bodies(random, 9, 2), b = random_bodies(random, 9, 2);
        const vp::grid g = unit_grid({10, 9, 8});
        EXPECT_EQ(library_solid(both(both(a, b), b.inside_out()), g).voxels, library_solid(a, g).voxels);
    }
}

TEST(SolidTheorems, NeitherFacesSplitAtLatticePointsNorTheOrderOfTrianglesMatter) {
    splitmix64 random(15);
    for (int round = 0; round < 20; ++round) {
        const mesh m = random_bodies(random, 9, 4);
        const vp::grid g = unit_grid({10, 9, 8});
        const solid plain = library_solid(m, g);
        const mesh split = split_at_lattice_points(m);
        ASSERT_GT(split.triangles.size(), m.triangles.size());
        EXPECT_EQ(library_solid(split, g).voxels, plain.voxels);
        mesh shuffled = m;
        for (std::size_t i = shuffled.triangles.size(); i > 1; --i)
            std::swap(shuffled.triangles[i - 1], shuffled.triangles[random.below(i)]);
        const solid other = library_solid(shuffled, g);
        EXPECT_EQ(other.voxels, plain.voxels);
        EXPECT_EQ(other.status.solid, plain.status.solid);
        // Vertices in another order that keeps the front.
        for (glm::uvec3& t : shuffled.triangles) t = {t.y, t.z, t.x};
        EXPECT_EQ(library_solid(shuffled, g).voxels, plain.voxels);
    }
}

TEST(SolidTheorems, OuterContainsCentreContainsInnerAndTheirDifferenceIsTheCover) {
    splitmix64 random(16);
    for (int round = 0; round < 12; ++round) {
        const mesh m = random_bodies(random, 34, 3);
        const vp::grid g = unit_grid({40, 37, 35});
        for (const rule r : all_rules) {
            const voxel_set centre = library_solid(m, g, {.rule = r}).voxels;
            const voxel_set outer = library_solid(m, g, {.rule = r, .extent = extent_of::outer}).voxels;
            const voxel_set inner = library_solid(m, g, {.rule = r, .extent = extent_of::inner}).voxels;
            const voxel_set cover = library_cover(m, g);
            EXPECT_EQ(without(centre, outer), voxel_set(centre.size()));
            EXPECT_EQ(without(inner, centre), voxel_set(centre.size()));
            EXPECT_EQ(outer, united(centre, cover));
            EXPECT_EQ(inner, without(centre, cover));
            EXPECT_EQ(without(outer, inner), cover);
        }
    }
}

TEST(SolidTheorems, MeshesWithoutVolumeHaveNoCentreVoxels) {
    const vp::grid g = unit_grid({8, 8, 8});
    mesh sheet; // both sides of a square, on the centres of a layer of voxels
    sheet.positions = {{1, 1, 2.5f}, {7, 1, 2.5f}, {7, 7, 2.5f}, {1, 7, 2.5f}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
    mesh upright = sheet; // the same across the rows
    for (glm::vec3& p : upright.positions) p = {p.z, p.y, p.x};
    for (const mesh& m : {sheet, upright}) {
        const solid s = library_solid(m, g);
        EXPECT_EQ(count(s.voxels), 0u);
        EXPECT_EQ(s.status.solid.open_rows, 0u);
        EXPECT_EQ(library_solid(m, g, {.extent = extent_of::outer}).voxels, library_cover(m, g));
    }
    mesh flat = box({2, 2, 2}, {6, 6, 2}); // zero height: lids that cancel, sides of no area
    EXPECT_EQ(count(library_solid(flat, g).voxels), 0u);
}

// ---- closed formulas ------------------------------------------------------------------------------------------------

// Voxels i of n whose moved centre is in [low, high]: low <= i + 1/2 < high.
int centres(float low, float high, int n) {
    int k = 0;
    for (int i = 0; i < n; ++i) k += low <= static_cast<float>(i) + 0.5f && static_cast<float>(i) + 0.5f < high ? 1 : 0;
    return k;
}

TEST(SolidFormulas, BoxesWithFacesOnCentresAndOnVoxelFaces) {
    splitmix64 random(17);
    const glm::ivec3 e(40, 12, 11);
    for (int round = 0; round < 60; ++round) {
        glm::vec3 low(0), high(0);
        std::size_t expected = 1;
        for (int a = 0; a < 3; ++a) {
            low[a] = static_cast<float>(random.between(-4, 2 * e[a])) / 2.0f;
            high[a] = low[a] + static_cast<float>(random.between(0, 2 * e[a])) / 2.0f;
            expected *= static_cast<std::size_t>(centres(low[a], high[a], e[a]));
        }
        EXPECT_EQ(count(library_solid(box(low, high), unit_grid(e)).voxels), expected) << "round " << round;
    }
}

TEST(SolidFormulas, OctahedraTubesAndNestedShells) {
    const glm::ivec3 e(24, 24, 24);
    const vp::grid g = unit_grid(e);
    // Radius and centre on the lattice of centres, so that faces, edges and corners pass through centres. A moved
    // centre is within iff x + y + z and its mirrors are below r, or equal to r and moved inward: first the sign of x
    // decides, where it is 0 that of y, then z.
    for (const glm::vec3 c : {glm::vec3(12.5f), glm::vec3(12.0f), glm::vec3(11.5f, 12.0f, 12.5f)})
        for (const float r : {1.0f, 3.5f, 8.0f, 11.0f}) {
            std::size_t expected = 0;
            for (int z = 0; z < e.z; ++z)
                for (int y = 0; y < e.y; ++y)
                    for (int x = 0; x < e.x; ++x) {
                        bool inside = true;
                        for (int mirror = 0; mirror < 8; ++mirror) {
                            const glm::vec3 n((mirror & 1) != 0 ? -1 : 1, (mirror & 2) != 0 ? -1 : 1,
                                              (mirror & 4) != 0 ? -1 : 1);
                            const glm::vec3 p = glm::vec3(x, y, z) + 0.5f - c;
                            const float beyond = n.x * p.x + n.y * p.y + n.z * p.z - r;
                            inside = inside && (beyond < 0 || (beyond == 0 && n.x < 0));
                        }
                        expected += inside ? 1 : 0;
                    }
            EXPECT_EQ(count(library_solid(octahedron(c, r), g).voxels), expected) << r;
        }
    const solid pipe = library_solid(tube({4, 4.5f, 2}, {14, 14.5f, 20.5f}, 2), g);
    EXPECT_EQ(count(pipe.voxels), (10u * 10 - 6 * 6) * 18);
    EXPECT_EQ(pipe.status.solid.open_rows, 0u);
    mesh shells;
    std::size_t expected = 0;
    for (int i = 0; i < 5; ++i) {
        const float d = 2.0f * static_cast<float>(i);
        const mesh b = box(glm::vec3(1.5f + d), glm::vec3(22.5f - d));
        shells.add(i % 2 == 0 ? b : b.inside_out());
        const auto side = static_cast<std::size_t>(21 - 4 * i);
        expected += i % 2 == 0 ? side * side * side : 0;
        expected -= i % 2 == 0 ? 0 : side * side * side;
    }
    EXPECT_EQ(count(library_solid(shells, g).voxels), expected);
}

// ---- reports about other voxelizers ---------------------------------------------------------------------------------

TEST(SolidReports, ATetrahedronIsFilledWhateverTheOrderOfItsVertices) {
    const glm::vec3 v[4] = {{1, 1, 1}, {14, 2, 3}, {3, 13, 2}, {4, 5, 15}};
    const vp::grid g = unit_grid(glm::ivec3(16));
    voxel_set first;
    int order[4] = {0, 1, 2, 3};
    do {
        mesh m;
        for (const int i : order) m.positions.push_back(v[i]);
        m.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
        const voxel_set s = library_solid(m, g).voxels;
        if (first.empty()) first = s;
        EXPECT_GT(count(s), 100u);
        EXPECT_EQ(s, first);
    } while (std::next_permutation(order, order + 4));
}

TEST(SolidReports, TwoTubesOneInTheOther) {
    const vp::grid g = unit_grid({24, 24, 24});
    const mesh outside = tube({1, 1, 2}, {23, 23, 22}, 3), within = tube({6, 6, 2}, {18, 18, 22}, 3);
    const solid s = library_solid({outside, within}, g);
    EXPECT_EQ(count(s.voxels), (22u * 22 - 16 * 16 + 12 * 12 - 6 * 6) * 20);
    EXPECT_EQ(s.voxels[index(g.extent, 12, 12, 12)], 0) << "the bore stays open";
    EXPECT_EQ(s.voxels[index(g.extent, 5, 12, 12)], 0) << "so does the gap between the tubes";
}

TEST(SolidReports, OverlappingPartsStaySolid) {
    const vp::grid g = unit_grid({24, 16, 16});
    mesh parts;
    for (int i = 0; i < 5; ++i) parts.add(sphere({5.0f + 3.5f * static_cast<float>(i), 8, 8}, 4, 3));
    const solid s = library_solid(parts, g);
    for (int x = 2; x < 22; ++x) EXPECT_EQ(s.voxels[index(g.extent, x, 8, 8)], 1) << x;
    EXPECT_GT(s.status.solid.max_winding, 1u);
}

TEST(SolidReports, ACubeOfEightVoxelsIsEightByEightByEight) {
    const std::vector<glm::vec3> corners = {{0, 0, 0}, {0.8f, 0.8f, 0.8f}};
    const vp::grid g = vp::fit_voxel_size(vp::bounds(corners), 0.1);
    ASSERT_EQ(g.extent, glm::ivec3(8));
    EXPECT_EQ(count(library_solid(box(corners[0], corners[1]), g).voxels), 512u);
    // Moved by any part of a voxel it is eight voxels wide all the same.
    for (int i = 0; i < 16; ++i) {
        const glm::vec3 by = glm::vec3(1, 2, 3) * (static_cast<float>(i) / 16.0f) + 1.0f;
        const solid s = library_solid(box(by, by + 8.0f), unit_grid(glm::ivec3(16)));
        EXPECT_EQ(count(s.voxels), 512u) << i;
    }
}

TEST(SolidReports, AGapThinnerThanAVoxelDoesNotJoinWhatItSeparates) {
    const vp::grid g = unit_grid({32, 16, 16});
    const mesh a = sphere({8, 8, 8}, 6.9f, 4), b = sphere({21.95f, 8, 8}, 6.9f, 4); // a gap of 0.15
    mesh together = a;
    together.add(b);
    const voxel_set left = library_solid(a, g).voxels, right = library_solid(b, g).voxels;
    EXPECT_EQ(count(united(left, right)), count(left) + count(right));
    EXPECT_EQ(library_solid(together, g).voxels, united(left, right));
    EXPECT_EQ(library_solid(together, g, {.rule = rule::even_odd}).voxels, united(left, right));
}

TEST(SolidReports, RowsAlongEdgesAndThroughVerticesLeaveNoStreaks) {
    // Vertices, edges and faces on centres: rows run along edges and faces and through vertices.
    const vp::grid g = unit_grid({20, 20, 20});
    const mesh m = box({4.5f, 4.5f, 4.5f}, {12.5f, 12.5f, 12.5f});
    const solid s = library_solid(m, g);
    EXPECT_EQ(count(s.voxels), 512u);
    for (int z = 0; z < 20; ++z)
        for (int y = 0; y < 20; ++y) EXPECT_EQ(s.voxels[index(g.extent, 19, y, z)], 0);
    mesh spindle = octahedron(glm::vec3(10.5f), 7.0f); // tips and edges through centres of rows
    const solid t = library_solid(spindle, g);
    EXPECT_EQ(t.voxels, accepted(oracle_windings(spindle, g, skew), rule::nonzero));
    EXPECT_EQ(t.status.solid.open_rows, 0u);
}

} // namespace
} // namespace solids
