// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Repairs that decide voxels: the flood and the vote against plain ones over bytes, with their cover and without.

#include "../oracle/link_oracle.hpp"
#include "solid_support.hpp"

#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace solids {
namespace {

using extent_of = vp::solid_extent;

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

vp::solid_options without_cover(vp::solid_options o) {
    o.with_cover = false;
    return o;
}

// The interior of a flood without the touched voxels whose centre sees that of a voxel, one or two away along an axis,
// that the flood reaches and no triangle touches, by signed volumes.
voxel_set plain_sides(const mesh& m, const vp::grid& g, int closing) {
    const glm::ivec3 e = g.extent;
    std::vector<oracle::lattice_triangle> triangles;
    for (const oracle::snapped_triangle& t : snap(m, g)) {
        oracle::lattice_triangle l{};
        for (std::size_t n = 0; n < 3; ++n)
            for (std::size_t a = 0; a < 3; ++a) l[n][a] = t.v[n][a];
        triangles.push_back(l);
    }
    const voxel_set cover = library_cover(m, g), interior = plain_interior(cover, e, closing);
    voxel_set result = interior;
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y)
            for (int x = 0; x < e.x; ++x) {
                const std::size_t at = index(e, x, y, z);
                if (cover[at] == 0) continue;
                for (int k = 0; k < 6 && result[at] != 0; ++k) {
                    std::array<int, 3> step{};
                    step[static_cast<std::size_t>(k / 2)] = k % 2 == 0 ? -1 : 1;
                    glm::ivec3 from(x, y, z);
                    for (int away = 1; away <= 2 && result[at] != 0; ++away) {
                        const bool is_crossed = std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) {
                            return oracle::cross_link(t, g.fraction(), {from.x, from.y, from.z}, step).is_crossed;
                        });
                        if (is_crossed) break;
                        from += glm::ivec3(step[0], step[1], step[2]);
                        const bool is_beyond =
                            glm::any(glm::lessThan(from, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(from, e));
                        const std::size_t to = is_beyond ? 0 : index(e, from.x, from.y, from.z);
                        if (is_beyond || (cover[to] == 0 && interior[to] == 0)) result[at] = 0;
                    }
                }
            }
    return result;
}

TEST(Exterior, WithoutItsCoverACentreThatSeesTheOutsideIsOutside) {
    splitmix64 random(43);
    const int rounds = std::max(8, oracle::repeats(24));
    std::size_t dropped = 0, kept = 0;
    for (int round = 0; round < rounds; ++round) {
        const glm::ivec3 e(1 + static_cast<int>(random.below(70)), 1 + static_cast<int>(random.below(20)),
                           1 + static_cast<int>(random.below(20)));
        const mesh m = with_holes(random, random_bodies(random, 20, 3), random.below(4));
        const vp::grid g = unit_grid(e);
        const int closing = round % 3;
        const solid s = library_solid(m, g, exterior(closing)),
                    bare = library_solid(m, g, without_cover(exterior(closing)));
        ASSERT_EQ(bare.voxels, plain_sides(m, g, closing)) << "round " << round;
        EXPECT_EQ(bare.status.solid, s.status.solid);
        EXPECT_EQ(bare.status.counts.triangles_drawn, s.status.counts.triangles_drawn);
        dropped += count(s.voxels) - count(bare.voxels);
        kept += count(bare.voxels);
    }
    EXPECT_GT(dropped, 40u * static_cast<unsigned>(rounds));
    EXPECT_GT(kept, 40u * static_cast<unsigned>(rounds));
}

// Of a closed body the voxels whose centres are inside are left, and perhaps some outside ones that touched neighbours
// surround. Of a plane none is left, however it lies: each of its voxels sees the side on which its centre lies.
TEST(Exterior, WithoutItsCoverBodiesHaveTheirCentresAndSheetsVanish) {
    const vp::grid g = unit_grid(glm::ivec3(40));
    const mesh body = sphere({20, 20, 20}, 13.7f, 4);
    const voxel_set truth = library_solid(body, g).voxels, whole = library_solid(body, g, exterior(0)).voxels,
                    bare = library_solid(body, g, without_cover(exterior(0))).voxels;
    EXPECT_EQ(count(without(truth, bare)), 0u);
    EXPECT_LT(500 * count(without(bare, truth)), count(without(whole, truth))) << count(without(bare, truth));
    splitmix64 random(44);
    for (int i = 0; i < 20; ++i) {
        const auto number = [&](float low, float high) {
            return low + (high - low) * static_cast<float>(random.below(1000)) / 1000.0f;
        };
        // A plane of any direction, in a rectangle that reaches over the grid's sides.
        glm::vec3 a(number(-1, 1), number(-1, 1), number(-1, 1)), b(number(-1, 1), number(-1, 1), number(-1, 1));
        const glm::vec3 middle(number(15, 25), number(15, 25), number(15, 25));
        a *= 60.0f;
        b *= 60.0f;
        mesh sheet;
        sheet.positions = {middle - a - b, middle + a - b, middle + a + b, middle - a + b};
        sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
        const std::size_t touched = count(library_solid(sheet, g, exterior(0)).voxels);
        EXPECT_EQ(count(library_solid(sheet, g, without_cover(exterior(0))).voxels), 0u) << touched;
    }
}

TEST(Exterior, OnlyFloodsAndVotesCanBeWithoutTheirCover) {
    vp::cpu_backend be{1};
    const mesh m = box({1, 1, 1}, {6, 6, 6});
    const vp::grid g = unit_grid(glm::ivec3(8));
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{be, g.extent};
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::winding}) {
        const vp::status s = vp::voxelize_solid(be, m.view(), g, vp::passthrough{}, vp::constant(true), fb,
                                                without_cover({.repair = repair}));
        EXPECT_EQ(s.code, vp::status_code::bad_solid_options);
    }
    const std::vector<std::uint64_t> bits(64, 0);
    vp::solid_slab slab;
    slab.inside = bits.data();
    vp::solid_options of_slab = without_cover(exterior(0));
    of_slab.slab = &slab;
    EXPECT_EQ(vp::voxelize_solid(be, m.view(), g, vp::passthrough{}, vp::constant(true), fb, of_slab).code,
              vp::status_code::bad_solid_options);
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

voxel_set plain_majority(const mesh& m, const vp::grid& g) {
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
    return s;
}

TEST(Vote, IsTheMajorityOfTheClosedRowsOfThreeAxes) {
    splitmix64 random(51);
    const vp::solid_options vote{.repair = vp::repair::vote};
    const int rounds = std::max(8, oracle::repeats(24));
    bool differs = false;
    for (int round = 0; round < rounds; ++round) {
        const mesh m = with_holes(random, random_bodies(random, 20, 3), random.below(4));
        const vp::grid g = unit_grid({70, 18, 17});
        const voxel_set majority = plain_majority(m, g);
        const solid s = library_solid(m, g, vote), bare = library_solid(m, g, without_cover(vote));
        ASSERT_EQ(s.voxels, united(majority, library_cover(m, g))) << "round " << round;
        ASSERT_EQ(bare.voxels, majority) << "round " << round;
        EXPECT_EQ(bare.status.solid, s.status.solid);
        EXPECT_EQ(bare.status.counts.triangles_drawn, s.status.counts.triangles_drawn);
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
