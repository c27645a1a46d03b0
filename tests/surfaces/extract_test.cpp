// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// extract: closed manifolds, exact positions, order, borders, components, fields, bad input.
#include "surface_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

namespace {

using namespace surface_tests;

TEST(Extract, RandomVolumesAreClosedManifolds) {
    vp::cpu_backend backend{1};
    std::mt19937 random(1);
    std::size_t triangles = 0;
    for (int k = 0; k < 600; ++k) {
        const auto side = [&] { return 1 + static_cast<int>(random() % (k % 20 == 0 ? 40 : 9)); };
        const int x = side(), y = side(), z = side();
        const bit_volume v = random_volume(random, glm::ivec3(x, y, z), 0.3 + 0.1 * (k % 5));
        const auto place = static_cast<vp::place>(k % 3);
        const host_surface s = extract_bits(backend, v, {.place = place, .quads = k % 7 == 0});
        ASSERT_TRUE(s.is_closed_manifold()) << k;
        triangles += s.triangles.size();
    }
    EXPECT_GT(triangles, 200000u);
}

TEST(Extract, VerticesOfOneVoxelLieWhereTheDefinitionSays) {
    vp::cpu_backend backend{1};
    bit_volume v(glm::ivec3(1));
    v.set(0, 0, 0);
    const host_surface mean = extract_bits(backend, v), corner = extract_bits(backend, v, {.place = vp::place::corner});
    ASSERT_EQ(mean.vertices.size(), 8u);
    ASSERT_EQ(mean.triangles.size(), 12u);
    for (unsigned i = 0; i < 8; ++i) {
        const auto& m = mean.vertices[i];
        const auto& c = corner.vertices[i];
        for (int a = 0; a < 3; ++a) {
            const bool high = (i >> a & 1) != 0;
            EXPECT_EQ(m.cell[a], high ? 0 : -1);
            // The mean of 1, 1 and 1/2, or of 0, 0 and 1/2, times 65536, rounded half up.
            EXPECT_EQ(m.q[a], high ? 10923 : 54613);
            EXPECT_EQ(c.q[a], 32768);
            EXPECT_EQ(vp::position(corner.samples, c)[a], high ? 1.0 : 0.0); // the voxel's corner
        }
    }
    EXPECT_EQ(mean.status.surface.components, 1u);
    // Fronts face outward: the volume is that of the voxel.
    double volume = 0;
    for (const glm::uvec3& t : corner.triangles) {
        const glm::dvec3 a = vp::position(corner.samples, corner.vertices[t.x]),
                         b = vp::position(corner.samples, corner.vertices[t.y]),
                         c = vp::position(corner.samples, corner.vertices[t.z]);
        volume += (a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x)) / 6;
    }
    EXPECT_DOUBLE_EQ(volume, 1.0);
}

// Vertices by cell, then sheet; quads by lower sample, then axis, from the lowest cell on, fronts outward.
TEST(Extract, OrderIsDefined) {
    vp::cpu_backend backend{2};
    std::mt19937 random(2);
    for (int k = 0; k < 20; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(5 + 7 * k, 6, 5), 0.5);
        const host_surface s = extract_bits(backend, v, {.quads = true});
        const auto rank = [](const vp::surface_vertex& p) { return std::tuple(p.cell.z, p.cell.y, p.cell.x, p.sheet); };
        for (std::size_t i = 1; i < s.vertices.size(); ++i) {
            const auto &a = s.vertices[i - 1], &b = s.vertices[i];
            ASSERT_LT(rank(a), rank(b));
            ASSERT_EQ(b.sheet, a.cell == b.cell ? a.sheet + 1 : 0);
        }
        std::size_t at = 0;
        for (int z = -1; z < v.extent.z; ++z)
            for (int y = -1; y < v.extent.y; ++y)
                for (int x = -1; x < v.extent.x; ++x)
                    for (int axis = 0; axis < 3; ++axis) {
                        const bool low = v.at(x, y, z), high = v.at(x + (axis == 0), y + (axis == 1), z + (axis == 2));
                        if (low == high) continue;
                        ASSERT_LT(at, s.quads.size());
                        const glm::uvec4 q = s.quads[at++];
                        // The cells around the edge, counter-clockwise seen from its upper end.
                        glm::ivec3 b(0), d(0);
                        b[(axis + 1) % 3] = 1;
                        d[(axis + 2) % 3] = 1;
                        const glm::ivec3 here(x, y, z);
                        const std::array<glm::ivec3, 4> round{here - b - d, here - d, here, here - b};
                        const std::array<std::uint32_t, 4> index{q.x, q.y, q.z, q.w};
                        for (std::size_t i = 0; i < 4; ++i)
                            ASSERT_EQ(s.vertices[index[i]].cell, round[low ? i : (4 - i) % 4]);
                    }
        EXPECT_EQ(at, s.quads.size());
        // Triangles 2 i and 2 i + 1 are quad i, and the first index is the lowest cell's.
        const host_surface t = extract_bits(backend, v);
        ASSERT_EQ(t.triangles.size(), 2 * s.quads.size());
        for (std::size_t i = 0; i < s.quads.size(); ++i) {
            const glm::uvec4 q = s.quads[i];
            const glm::uvec3 a = t.triangles[2 * i], b = t.triangles[2 * i + 1];
            const auto length = [&](std::uint32_t m, std::uint32_t n) {
                std::int64_t sum = 0;
                for (int c = 0; c < 3; ++c) {
                    const std::int64_t along = (s.vertices[m].cell[c] - s.vertices[n].cell[c]) * std::int64_t{65536} +
                                               s.vertices[m].q[c] - s.vertices[n].q[c];
                    sum += along * along;
                }
                return sum;
            };
            if (length(q.x, q.z) <= length(q.y, q.w)) {
                ASSERT_EQ(a, glm::uvec3(q.x, q.y, q.z));
                ASSERT_EQ(b, glm::uvec3(q.x, q.z, q.w));
            } else {
                ASSERT_EQ(a, glm::uvec3(q.x, q.y, q.w));
                ASSERT_EQ(b, glm::uvec3(q.y, q.z, q.w));
            }
        }
    }
}

TEST(Extract, OpenBordersLeaveOutFacesThatReachBeyondTheGrid) {
    vp::cpu_backend backend{2};
    std::mt19937 random(3);
    for (int k = 0; k < 20; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(7, 6, 5), 0.6);
        const host_surface closed = extract_bits(backend, v, {.quads = true}),
                           open = extract_bits(backend, v, {.border = vp::border::open, .quads = true});
        std::vector<std::array<vp::surface_vertex, 4>> expected, found;
        const auto corners = [](const host_surface& s, const glm::uvec4& q) {
            return std::array<vp::surface_vertex, 4>{s.vertices[q.x], s.vertices[q.y], s.vertices[q.z],
                                                     s.vertices[q.w]};
        };
        for (const glm::uvec4& q : closed.quads) {
            const auto all = corners(closed, q);
            const bool within = std::all_of(all.begin(), all.end(), [&](const vp::surface_vertex& p) {
                return p.cell.x >= 0 && p.cell.y >= 0 && p.cell.z >= 0 && p.cell.x < 6 && p.cell.y < 5 && p.cell.z < 4;
            });
            if (within) expected.push_back(all);
        }
        for (const glm::uvec4& q : open.quads) found.push_back(corners(open, q));
        EXPECT_EQ(found, expected);
        const verdict j = open.judge_quads();
        EXPECT_EQ(j.unused_vertices, 0u);
        EXPECT_EQ(j.bad_edges, 0u);
        EXPECT_GT(j.boundary_edges, 0u);
        EXPECT_EQ(open.status.surface.components, j.components);
    }
}

TEST(Extract, SmallComponentsAreLeftOutAndCounted) {
    vp::cpu_backend backend{2};
    bit_volume v(glm::ivec3(40, 9, 9));
    v.set(2, 2, 2);                                   // 8 vertices
    for (int x = 6; x < 9; ++x) v.set(x, 4, 4);       // 16
    for (int x = 12; x < 38; ++x) v.set(x, x % 2, 5); // 6-connected components of one voxel each
    const host_surface all = extract_bits(backend, v), large = extract_bits(backend, v, {.min_component = 16});
    EXPECT_TRUE(all.is_closed_manifold());
    EXPECT_TRUE(large.is_closed_manifold());
    EXPECT_EQ(large.status.surface.components, 1u);
    EXPECT_EQ(large.vertices.size(), 16u);
    EXPECT_EQ(large.status.surface.components + large.status.surface.components_left_out,
              all.status.surface.components);
    EXPECT_EQ(all.status.surface.components, 28u);
    bit_volume bar(v.extent);
    for (int x = 6; x < 9; ++x) bar.set(x, 4, 4);
    EXPECT_EQ(extract_bits(backend, bar).vertices, large.vertices);
    EXPECT_EQ(extract_bits(backend, bar).triangles, large.triangles);
}

TEST(Extract, FieldsCrossEdgesWhereTheyAreTheLevel) {
    vp::cpu_backend backend{2};
    vp::grid g = grid_of(glm::ivec3(4, 3, 3));
    std::vector<float> values(36, 1.0f);
    values[4 + 12 + 1] = -3.0f; // sample (1, 1, 1)
    const host_surface s = extract_field(backend, values, g);
    EXPECT_TRUE(s.is_closed_manifold());
    ASSERT_EQ(s.vertices.size(), 8u);
    // t = 3/4 from the sample: the mean of 1/4, 1 and 1 below it, of 3/4, 0 and 0 above.
    for (const auto& p : s.vertices)
        for (int a = 0; a < 3; ++a) EXPECT_EQ(p.q[a], p.cell[a] == 0 ? 49152 : 16384);
    EXPECT_EQ(s.status.surface.made_crossings, 0u);
    // At another level.
    const host_surface less = extract_field(backend, values, g, {.level = -2.0});
    for (const auto& p : less.vertices)
        for (int a = 0; a < 3; ++a) EXPECT_EQ(p.q[a], p.cell[a] == 0 ? 60075 : 5461); // t = 1/4
    // A distance of exactly the level is outside.
    EXPECT_TRUE(extract_field(backend, values, g, {.level = -3.0}).vertices.empty());
}

TEST(Extract, SamplesThatAreNoNumberAreOutsideAndCounted) {
    vp::cpu_backend backend{2};
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    std::vector<float> values{nan, -1.0f, inf, -inf, nan};
    const host_surface s = extract_field(backend, values, grid_of(glm::ivec3(5, 1, 1)));
    EXPECT_TRUE(s.is_closed_manifold());
    EXPECT_EQ(s.status.surface.nan_samples, 2u);
    EXPECT_EQ(s.status.surface.components, 2u);
    // Beside NaN, between infinities, and at the faces of the grid: 5 of each of the two samples but that beside +inf.
    EXPECT_EQ(s.status.surface.made_crossings, 11u);
}

TEST(Extract, TiledTargetsGiveTheSameSurface) {
    vp::cpu_backend backend{2};
    std::mt19937 random(4);
    const bit_volume v = random_volume(random, glm::ivec3(37, 11, 10), 0.5);
    using tiled = vp::target<vp::bit, vp::blend::bit_or, vp::layout::tiled>;
    vp::framebuffer<vp::cpu_backend, tiled> fb(backend, v.extent);
    for (int z = 0; z < v.extent.z; ++z)
        for (int y = 0; y < v.extent.y; ++y)
            for (int x = 0; x < v.extent.x; ++x) vp::get<0>(fb.view().targets).store(x, y, z, v.at(x, y, z));
    vp::surface<vp::cpu_backend> s(backend);
    const vp::status status = vp::extract(backend, fb, grid_of(v.extent), s);
    EXPECT_TRUE(to_host(backend, s, status).has_same_arrays(extract_bits(backend, v)));
}

TEST(Extract, NothingInsideIsAnEmptySurface) {
    vp::cpu_backend backend{2};
    const host_surface s = extract_bits(backend, bit_volume(glm::ivec3(5, 4, 3)));
    EXPECT_TRUE(s.status.ok());
    EXPECT_TRUE(s.vertices.empty() && s.triangles.empty());
    EXPECT_EQ(s.status.surface, vp::surface_counters{});
}

TEST(Extract, BadArgumentsAreRefusedAndChangeNothing) {
    vp::cpu_backend backend{2};
    using bits = vp::target<vp::bit, vp::blend::replace>;
    bit_volume v(glm::ivec3(2));
    v.set(0, 0, 0);
    const std::vector<std::uint32_t> words = v.words();
    vp::cpu_backend::buffer<std::uint32_t> memory(backend, vp::array_view<const std::uint32_t>(words));
    const vp::target_view<bits> view{memory.data(), v.extent};
    vp::surface<vp::cpu_backend> s(backend);
    ASSERT_TRUE(vp::extract(backend, view, grid_of(v.extent), s).ok());
    const auto code = [&](const vp::target_view<bits>& from, const glm::ivec3& extent, const vp::extract_options& o) {
        return vp::extract(backend, from, grid_of(extent), s, o).code;
    };
    EXPECT_EQ(code(view, v.extent, {.level = 1.0}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code(view, v.extent, {.level = std::numeric_limits<double>::infinity()}),
              vp::status_code::bad_surface_options);
    EXPECT_EQ(code(view, v.extent, {.place = static_cast<vp::place>(3)}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code(view, v.extent, {.border = static_cast<vp::border>(2)}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code(view, glm::ivec3(3), {}), vp::status_code::extent_mismatch);
    EXPECT_EQ(code(view, glm::ivec3(0), {}), vp::status_code::bad_extent);
    EXPECT_EQ(code({nullptr, v.extent}, v.extent, {}), vp::status_code::null_view);
    EXPECT_EQ(s.vertices.size(), 8u);
}

} // namespace
