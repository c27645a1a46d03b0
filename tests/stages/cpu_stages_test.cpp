// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// cpu_ref/stages.hpp: the output of each stage against the oracle, for a whole grid and a crop that cuts tiles, both
// coverages, and tiles of 8, 16 and 32 voxels.

#include "api_model.hpp"

#include <cpu_ref/stages.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>

namespace {

namespace vp = voxelpipe;
namespace stages = voxelpipe::cpu_stages;
using stages::tile_pair;

const glm::ivec3 extent{75, 66, 58};
constexpr int tile_sizes[] = {3, 4, 5}; // log2

// ---- the scene: two draws whose shaders move the mesh and discard some fragments ----

struct moved {
    glm::vec3 by;
    glm::vec3 operator()(const vp::vertex<>& v) const { return v.position + by; }
};

bool is_kept(std::uint32_t primitive, glm::ivec3 voxel) { return unit::mark(primitive, voxel) % 5 != 0; }
struct discards_some {
    auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.primitive).discard_if(!is_kept(f.primitive, f.voxel));
    }
};
using draw = vp::draw<vp::mesh_view<>, moved, discards_some>;

// The tile faces of part and whole differ, because the part does not begin at a multiple of a tile.
const glm::ivec3 part_begin{9, 16, 5}, part_size{53, 41, 44};

void add_triangle(unit::small_mesh& m, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
    const auto n = static_cast<std::uint32_t>(m.positions.size());
    m.positions.insert(m.positions.end(), {a, b, c});
    m.triangles.emplace_back(n, n + 1, n + 2);
}

// Triangles on the borders of tiles, of zero area, too large, too far away, or not finite.
void add_odd_triangles(unit::small_mesh& m) {
    for (const glm::vec3 begin : {glm::vec3(0.0f), glm::vec3(part_begin)})
        for (const float n : {8.0f, 16.0f, 32.0f}) { // tile faces of the whole and of the part
            const glm::vec3 o = begin + n;
            add_triangle(m, o, o + glm::vec3(n, 0, 0), o + glm::vec3(0, n, 0)); // in a plane of faces
            add_triangle(m, o, o + glm::vec3(n, n, 0), o + glm::vec3(0, n, n)); // through corners
            add_triangle(m, o, o, o);                                           // a point on a corner
            add_triangle(m, o, o + n, o);                                       // a diagonal
            add_triangle(m, o, o + glm::vec3(0, 0, n), o + glm::vec3(0, 0, 3)); // along an edge of tiles
            add_triangle(m, o + 0.25f, o + glm::vec3(0.5f, 0.25f, 0.75f), o + glm::vec3(0.25f, 0.75f, n)); // thin, long
        }
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    const glm::vec3 o(20.0f);
    add_triangle(m, o, {nan, 20, 20}, {20, 30, 20});
    add_triangle(m, {20, -infinity, 20}, o, {20, 30, 20});
    add_triangle(m, o, {20, 20, 1e30f}, {20, 30, 20});
    add_triangle(m, {1000, 0, 0}, {1001, 0, 0}, {1000, 1, 0});
    add_triangle(m, {-20, -20, -20}, {-10, -20, -20}, {-15, -1, -1});
    add_triangle(m, {-500, -400, -300}, {600, 100, 90}, {30, 700, 200}); // through the whole grid
    add_triangle(m, {-5000, 31, -5000}, {7000, 34, -5000}, {30, 33, 9000});
}

struct scene {
    std::vector<unit::small_mesh> meshes; // as drawn
    std::vector<unit::small_mesh> shaded; // after the vertex shaders
    std::vector<draw> draws;
    vp::grid whole = unit::unit_grid(extent), part;

    scene() {
        whole.origin = {4, -8, 2};
        part = whole.crop(part_begin, part_size);
        meshes = {unit::make_mesh(1, 45, extent), unit::make_mesh(2, 30, extent)};
        add_odd_triangles(meshes[0]);
        const moved shaders[] = {{{4, -8, 2}}, {{5.25f, -7, 1.5f}}};
        for (std::size_t d = 0; d < 2; ++d) {
            shaded.push_back(meshes[d]);
            for (glm::vec3& p : shaded[d].positions) p = p + shaders[d].by;
            draws.push_back({meshes[d].view(), shaders[d], {}});
        }
    }
    scene(const scene&) = delete; // the draws point into it
    scene& operator=(const scene&) = delete;

    [[nodiscard]] std::span<const draw> view() const { return draws; }
};

// ---- the model of the coarse raster, in the oracle's units ----

oracle::grid as_oracle(const vp::grid& g) {
    oracle::grid out{};
    for (int a = 0; a < 3; ++a) {
        out.origin[a] = g.origin[a];
        out.voxel_size[a] = g.voxel_size[a];
        out.extent[a] = g.whole_extent()[a];
    }
    return out;
}

using corner = std::array<int, 3>; // of a box, in voxels of the whole grid

// True if the closed box meets the triangle's plane.
bool plane_meets_box(int fraction, const oracle::snapped_triangle& t, const corner& lo, const corner& hi) {
    const auto n = oracle::normal(t);
    bool above = false, below = false;
    for (unsigned k = 0; k < 8; ++k) {
        oracle::wide distance;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t at = std::int64_t{((k >> a) & 1u) != 0 ? hi[a] : lo[a]} << fraction;
            distance = distance + n[a] * oracle::wide(at - t.v[0][a]);
        }
        above = above || distance.sign() >= 0;
        below = below || distance.sign() <= 0;
    }
    return above && below;
}

struct coarse_model {
    vp::counters counts;
    std::vector<tile_pair> pairs; // by tile, then primitive
    std::size_t in_several_tiles = 0;
};

coarse_model model_of(const scene& s, const vp::grid& g, vp::coverage rule, int log2_tile_size) {
    const oracle::grid og = as_oracle(g);
    const int fraction = oracle::fraction_bits(og);
    const bool thin = rule == vp::coverage::thin;
    coarse_model out;
    std::uint32_t primitive = 0;
    for (const unit::small_mesh& mesh : s.shaded)
        for (const glm::uvec3& index : mesh.triangles) {
            const std::uint32_t id = primitive++;
            ++out.counts.triangles_in;
            float p[3][3];
            bool finite = true;
            for (int k = 0; k < 3; ++k)
                for (int a = 0; a < 3; ++a) {
                    p[k][a] = mesh.positions[index[k]][a];
                    finite = finite && std::isfinite(p[k][a]);
                }
            const oracle::snapped_triangle t = oracle::snap(og, p);
            if (t.dropped) {
                ++(finite ? out.counts.triangles_too_far : out.counts.triangles_nonfinite);
                continue;
            }
            // The reach in voxels of the part. The first and last voxel of the triangle's depth, in voxels of the
            // whole.
            std::int64_t lo[3], hi[3];
            corner first{}, last{};
            bool empty = false;
            for (int a = 0; a < 3; ++a) {
                const auto [low, high] = std::minmax({t.v[0][a], t.v[1][a], t.v[2][a]});
                lo[a] = -((-low) >> fraction) - 1;
                hi[a] = high >> fraction;
                first[static_cast<std::size_t>(a)] = static_cast<int>(lo[a]);
                last[static_cast<std::size_t>(a)] = static_cast<int>(hi[a]) + 1;
                lo[a] = std::max<std::int64_t>(lo[a] - (thin ? 1 : 0) - g.offset[a], 0);
                hi[a] = std::min<std::int64_t>(hi[a] + (thin ? 1 : 0) - g.offset[a], g.extent[a] - 1);
                empty = empty || lo[a] > hi[a];
            }
            if (empty) {
                ++out.counts.triangles_outside;
                continue;
            }
            const int axis = oracle::dominant_axis(t);
            if (thin && axis < 0) {
                ++out.counts.triangles_zero_area;
                continue;
            }
            ++out.counts.triangles_drawn;
            for (int a = 0; a < 3; ++a) {
                lo[a] >>= log2_tile_size;
                hi[a] >>= log2_tile_size;
            }
            const bool one = std::equal(lo, lo + 3, hi);
            out.in_several_tiles += one ? 0 : 1;
            const auto has_work = [&](const corner& from, const corner& to) {
                if (one) return true;
                if (!thin) return oracle::box_meets_triangle(fraction, t, from, to);
                // The tile's column, as deep as the triangle: the column's square against the projected triangle.
                corner column_from = from, column_to = to;
                const auto w = static_cast<std::size_t>(axis);
                column_from[w] = first[w];
                column_to[w] = last[w];
                return oracle::box_meets_triangle(fraction, t, column_from, column_to) &&
                       plane_meets_box(fraction, t, from, to);
            };
            const auto tiles = [&](int a) {
                return static_cast<std::uint64_t>((g.extent[a] + (1 << log2_tile_size) - 1) >> log2_tile_size);
            };
            for (std::int64_t z = lo[2]; z <= hi[2]; ++z)
                for (std::int64_t y = lo[1]; y <= hi[1]; ++y)
                    for (std::int64_t x = lo[0]; x <= hi[0]; ++x) {
                        corner from{}, to{};
                        const std::int64_t at[3] = {x, y, z};
                        for (std::size_t a = 0; a < 3; ++a) {
                            from[a] = static_cast<int>(at[a] << log2_tile_size) + g.offset[static_cast<int>(a)];
                            to[a] = from[a] + (1 << log2_tile_size);
                        }
                        if (!has_work(from, to)) continue;
                        const auto tile =
                            (static_cast<std::uint64_t>(z) * tiles(1) + static_cast<std::uint64_t>(y)) * tiles(0) +
                            static_cast<std::uint64_t>(x);
                        out.pairs.push_back({tile, id});
                    }
        }
    std::sort(out.pairs.begin(), out.pairs.end());
    return out;
}

// ---- tests ----

class Stages : public ::testing::TestWithParam<vp::coverage> {};

TEST(StagesOfBoth, VertexShadeSnapsRelativeToThePart) {
    const scene s;
    const oracle::grid og = as_oracle(s.whole);
    const int fraction = oracle::fraction_bits(og);
    for (const vp::grid& g : {s.whole, s.part}) {
        const auto shaded = stages::vertex_shade(s.view(), g);
        ASSERT_EQ(shaded.size(), 2u);
        int dropped = 0;
        for (std::size_t d = 0; d < 2; ++d) {
            const auto& positions = s.shaded[d].positions;
            ASSERT_EQ(shaded[d].size(), positions.size());
            for (std::size_t i = 0; i < positions.size(); ++i) {
                const glm::vec3 p = positions[i];
                const float thrice[3][3] = {{p.x, p.y, p.z}, {p.x, p.y, p.z}, {p.x, p.y, p.z}};
                const oracle::snapped_triangle t = oracle::snap(og, thrice);
                ASSERT_EQ(vp::core::is_drawable(shaded[d][i]), !t.dropped);
                dropped += t.dropped ? 1 : 0;
                if (t.dropped) continue;
                ASSERT_EQ(shaded[d][i].x, t.v[0][0] - (std::int64_t{g.offset.x} << fraction));
                ASSERT_EQ(shaded[d][i].y, t.v[0][1] - (std::int64_t{g.offset.y} << fraction));
                ASSERT_EQ(shaded[d][i].z, t.v[0][2] - (std::int64_t{g.offset.z} << fraction));
            }
        }
        EXPECT_EQ(dropped, 3);
    }
}

TEST_P(Stages, TilePairsAreTheOraclesTiles) {
    const scene s;
    for (const vp::grid& g : {s.whole, s.part})
        for (const int log2_size : tile_sizes) {
            const coarse_model expected = model_of(s, g, GetParam(), log2_size);
            const stages::coarse_output got = stages::tile_pairs(s.view(), g, GetParam(), log2_size);
            ASSERT_EQ(got.code, vp::status_code::ok);
            EXPECT_EQ(got.counts.triangles_in, expected.counts.triangles_in);
            EXPECT_EQ(got.counts.triangles_nonfinite, 2u);
            EXPECT_EQ(got.counts.triangles_too_far, 1u);
            EXPECT_EQ(got.counts.triangles_zero_area, expected.counts.triangles_zero_area);
            EXPECT_EQ(got.counts.triangles_outside, expected.counts.triangles_outside);
            EXPECT_EQ(got.counts.triangles_drawn, expected.counts.triangles_drawn);
            EXPECT_TRUE(std::is_sorted(got.pairs.begin(), got.pairs.end(),
                                       [](const auto& a, const auto& b) { return a.primitive < b.primitive; }));
            const auto sorted = stages::sorted_tile_pairs(got.pairs);
            ASSERT_EQ(sorted.size(), got.pairs.size());
            for (std::size_t i = 1; i < sorted.size(); ++i)
                ASSERT_LT(sorted[i - 1], sorted[i]) << "ascending, each once";
            ASSERT_EQ(sorted.size(), expected.pairs.size());
            for (std::size_t i = 0; i < sorted.size(); ++i) {
                ASSERT_EQ(sorted[i].tile, expected.pairs[i].tile) << "tiles of 2^" << log2_size;
                ASSERT_EQ(sorted[i].primitive, expected.pairs[i].primitive) << "tiles of 2^" << log2_size;
            }
            EXPECT_GT(expected.in_several_tiles, 20u);
            EXPECT_GT(expected.pairs.size(), 2 * expected.in_several_tiles);
        }
}

TEST_P(Stages, RangesAndWorkItemsDivideThePairs) {
    const scene s;
    for (const int log2_size : tile_sizes) {
        const auto sorted =
            stages::sorted_tile_pairs(stages::tile_pairs(s.view(), s.part, GetParam(), log2_size).pairs);
        const auto ranges = stages::tile_ranges(sorted);
        std::uint64_t next = 0, longest = 0;
        for (std::size_t r = 0; r < ranges.size(); ++r) {
            ASSERT_TRUE(r == 0 || ranges[r - 1].tile < ranges[r].tile);
            ASSERT_EQ(ranges[r].first, next);
            ASSERT_GT(ranges[r].last, ranges[r].first);
            next = ranges[r].last;
            ASSERT_LE(next, sorted.size());
            longest = std::max(longest, ranges[r].last - ranges[r].first);
            for (std::uint64_t i = ranges[r].first; i < next; ++i) ASSERT_EQ(sorted[i].tile, ranges[r].tile);
        }
        ASSERT_EQ(next, sorted.size());
        ASSERT_GT(longest, 7u); // some tile is split below
        for (const std::uint64_t most : {std::uint64_t{1}, std::uint64_t{7}, longest - 1, longest, longest + 1}) {
            const auto items = stages::work_items(ranges, most);
            std::size_t i = 0;
            for (const auto& range : ranges) { // its items are contiguous, and all but the last are full
                for (std::uint64_t at = range.first; at < range.last; ++i) {
                    ASSERT_LT(i, items.size());
                    ASSERT_EQ(items[i].tile, range.tile);
                    ASSERT_EQ(items[i].first, at);
                    ASSERT_EQ(items[i].last - items[i].first, std::min(most, range.last - at));
                    at = items[i].last;
                }
            }
            ASSERT_EQ(i, items.size());
            EXPECT_EQ(items.size() == ranges.size(), most >= longest);
        }
    }
    EXPECT_TRUE(stages::tile_ranges({}).empty());
    EXPECT_TRUE(stages::work_items({}, 7).empty());
}

TEST_P(Stages, FragmentsOfAllItemsAreTheOraclesEachOnce) {
    const scene s;
    const auto everywhere = unit::fragments_of(s.whole, GetParam(), s.shaded);
    for (const vp::grid& g : {s.whole, s.part}) {
        std::vector<stages::covered_voxel> expected;
        std::size_t discarded = 0;
        for (const auto& f : everywhere) {
            const glm::ivec3 at = f.voxel - g.offset;
            bool inside = true;
            for (int a = 0; a < 3; ++a) inside = inside && at[a] >= 0 && at[a] < g.extent[a];
            if (!inside) continue;
            if (is_kept(f.primitive, f.voxel))
                expected.push_back({unit::linear(g.extent, at), f.primitive});
            else
                ++discarded;
        }
        std::sort(expected.begin(), expected.end());
        ASSERT_GT(expected.size(), 5000u);
        ASSERT_GT(discarded, 500u);
        for (const int log2_size : tile_sizes) {
            const auto sorted = stages::sorted_tile_pairs(stages::tile_pairs(s.view(), g, GetParam(), log2_size).pairs);
            const auto items = stages::work_items(stages::tile_ranges(sorted), 20);
            std::vector<stages::covered_voxel> all;
            const glm::ivec3 tiles = (g.extent + ((1 << log2_size) - 1)) / (1 << log2_size);
            for (const auto& item : items) {
                const auto some = stages::fragments(s.view(), g, GetParam(), log2_size, sorted, item);
                ASSERT_TRUE(std::is_sorted(some.begin(), some.end()));
                std::set<std::uint32_t> primitives;
                for (std::uint64_t i = item.first; i < item.last; ++i) primitives.insert(sorted[i].primitive);
                for (const auto& f : some) {
                    const auto nx = static_cast<std::uint64_t>(g.extent.x), ny = static_cast<std::uint64_t>(g.extent.y);
                    const glm::ivec3 tile =
                        glm::ivec3(f.voxel % nx, f.voxel / nx % ny, f.voxel / (nx * ny)) / (1 << log2_size);
                    ASSERT_EQ(unit::linear(tiles, tile), item.tile);
                    ASSERT_EQ(primitives.count(f.primitive), 1u);
                }
                all.insert(all.end(), some.begin(), some.end());
            }
            std::sort(all.begin(), all.end());
            ASSERT_EQ(all.size(), expected.size());
            for (std::size_t i = 0; i < all.size(); ++i) {
                ASSERT_EQ(all[i].voxel, expected[i].voxel);
                ASSERT_EQ(all[i].primitive, expected[i].primitive);
            }
        }
    }
}

TEST_P(Stages, AnIndexOutOfRangeGivesNoPairs) {
    for (const std::uint32_t index : {0u, 1u, 0xffffff00u}) { // beyond the last vertex of the second draw
        scene s;
        auto& triangles = s.meshes[1].triangles;
        triangles[triangles.size() / 2].y = static_cast<std::uint32_t>(s.meshes[1].positions.size()) + index;
        for (const int log2_size : tile_sizes) {
            const stages::coarse_output got = stages::tile_pairs(s.view(), s.part, GetParam(), log2_size);
            EXPECT_EQ(got.code, vp::status_code::index_out_of_range);
            EXPECT_TRUE(got.pairs.empty());
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Both, Stages, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

} // namespace
