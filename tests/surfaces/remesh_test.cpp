// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// remesh: bad meshes become closed manifolds, crossings are exact, creases and corners are kept, signs are those of
// solids. VOXELPIPE_TEST_SCALE (environment variable) from 20 on takes
// all bad models, on all grids.
#include "surface_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace {

using namespace surface_tests;

vp::grid unit_grid(int n) { return vp::fit(vp::bounding_box{glm::dvec3(0.0), glm::dvec3(1.0)}, glm::ivec3(n)); }

// The signs that remesh takes, and a level.
std::vector<vp::remesh_options> ways() {
    using options = vp::remesh_options;
    return {options{},
            options{.rule = vp::fill_rule::even_odd},
            options{.rule = vp::fill_rule::positive},
            options{.repair = vp::repair::close_holes},
            options{.repair = vp::repair::exterior},
            options{.repair = vp::repair::exterior, .closing = 1},
            options{.repair = vp::repair::vote},
            options{.repair = vp::repair::winding},
            options{.level = 0.04}};
}

// 1,000 models by each sign, at each place, on grids of 32 and 64 a side: by default a twentieth of the models, each
// by every sign at one place on one grid; below 1 a fifth of these.
TEST(Remesh, BadModelsBecomeClosedManifolds) {
    const double scale = tests::test_scale();
    const bool is_whole = scale >= 20;
    vp::cpu_backend backend{2};
    std::uint64_t faces = 0, made = 0, cones = 0, moved = 0;
    const auto models = static_cast<std::uint32_t>(50 * std::clamp(scale, 0.2, 20.0));
    for (std::uint32_t seed = 0; seed < models; ++seed) {
        const host_mesh m = bad_model(seed);
        std::uint32_t way = 0;
        for (vp::remesh_options o : ways()) {
            ++way;
            for (std::uint32_t place = 0; place < 3; ++place)
                for (const int n : {32, 64}) {
                    if (!is_whole && (place != (seed + way) % 3 || (n == 64) != (seed % 8 == 0))) continue;
                    o.place = static_cast<vp::place>(place);
                    o.embedded = o.place == vp::place::sharp;
                    const host_surface s = remesh(backend, m, unit_grid(n), o);
                    ASSERT_TRUE(s.is_closed_manifold()) << "model " << seed << ", way " << way << ", place " << place
                                                        << ", grid " << n << ": " << s.status.message();
                    ASSERT_EQ(s.status.surface.intersecting_pairs, 0u) << "model " << seed << ", way " << way;
                    faces += s.triangles.size();
                    made += s.status.surface.made_crossings;
                    cones += s.status.surface.cone_crossings;
                    moved += s.status.surface.moved_vertices;
                }
        }
    }
    EXPECT_GT(faces, 1000u * models);
    EXPECT_GT(made, 0u);
    EXPECT_GT(cones, 0u);
    EXPECT_GT(moved, 0u);
}

// Every crossing against integers of this test: which triangle the edge meets, and where.
TEST(Remesh, VerticesAreTheMeansOfExactCrossings) {
    vp::cpu_backend backend{2};
    std::mt19937 random(11);
    constexpr int n = 8;
    vp::grid g = grid_of(glm::ivec3(n));
    const std::int64_t unit = std::int64_t{1} << g.fraction();
    for (int k = 0; k < 12; ++k) {
        const auto real = [&](float low, float high) {
            return low + (high - low) * static_cast<float>(random() % 100003) / 100003.0f;
        };
        const glm::vec3 centre(real(3.5f, 4.5f), real(3.5f, 4.5f), real(3.5f, 4.5f));
        const host_mesh m = k % 2 == 0 ? octahedron(centre, real(2.0f, 3.2f)) : ball(centre, real(1.5f, 3.0f), 1);
        const host_surface s = remesh(backend, m, g, {.place = vp::place::mean});
        ASSERT_TRUE(s.is_closed_manifold());
        EXPECT_EQ(s.status.surface.made_crossings, 0u);
        std::vector<std::array<std::int64_t, 3>> p;
        for (const glm::vec3& v : m.positions)
            p.push_back({std::llrint(v.x * static_cast<double>(unit)), std::llrint(v.y * static_cast<double>(unit)),
                         std::llrint(v.z * static_cast<double>(unit))});
        // t of the edge along an axis from a sample, in units of 2^-24; -1 if none crosses it, or two.
        const auto crossing = [&](const glm::ivec3& from, int axis) {
            std::int64_t t = -1;
            int crossings = 0;
            const auto u = static_cast<std::size_t>((axis + 1) % 3), v = static_cast<std::size_t>((axis + 2) % 3),
                       w = static_cast<std::size_t>(axis);
            const std::array<std::int64_t, 3> c{from.x * unit + unit / 2, from.y * unit + unit / 2,
                                                from.z * unit + unit / 2};
            for (const glm::uvec3& i : m.triangles) {
                const auto &a = p[i.x], &b = p[i.y], &d = p[i.z];
                const auto side = [&](const auto& from_, const auto& to) {
                    return static_cast<vp::int128>(to[u] - from_[u]) * (c[v] - from_[v]) -
                           static_cast<vp::int128>(to[v] - from_[v]) * (c[u] - from_[u]);
                };
                const vp::int128 e0 = side(a, b), e1 = side(b, d), e2 = side(d, a);
                if ((e0 == 0 || e1 == 0 || e2 == 0) && (e0 >= 0) + (e1 >= 0) + (e2 >= 0) != 0) {
                    EXPECT_FALSE(e0 >= 0 && e1 >= 0 && e2 >= 0) << "a tie, which this test does not decide";
                }
                if (!((e0 > 0 && e1 > 0 && e2 > 0) || (e0 < 0 && e1 < 0 && e2 < 0))) continue;
                // Depth by barycentrics: (e1 a + e2 b + e0 d) / area.
                const vp::int128 area = e0 + e1 + e2;
                vp::int128 top = e1 * a[w] + e2 * b[w] + e0 * d[w] - area * c[w], bottom = area * unit;
                if (bottom < 0) {
                    top = -top;
                    bottom = -bottom;
                }
                if (top < 0 || top > bottom) continue;
                ++crossings; // two where the body's tip lies between two samples
                t = static_cast<std::int64_t>(((top << 25) + bottom) / (2 * bottom));
            }
            return crossings % 2 == 1 ? t : -1;
        };
        for (const vp::surface_vertex& v : s.vertices) { // a convex body passes each of its cells in one sheet
            std::array<std::int64_t, 3> sum{};
            std::int64_t count = 0;
            for (int axis = 0; axis < 3; ++axis)
                for (int i = 0; i < 4; ++i) {
                    glm::ivec3 at = v.cell;
                    at[(axis + 1) % 3] += i & 1;
                    at[(axis + 2) % 3] += i >> 1;
                    const std::int64_t t = crossing(at, axis);
                    if (t < 0) continue;
                    ++count;
                    for (int a = 0; a < 3; ++a)
                        sum[static_cast<std::size_t>(a)] +=
                            a == axis ? t : static_cast<std::int64_t>(at[a] - v.cell[a]) << 24;
                }
            ASSERT_GE(count, 3);
            for (int a = 0; a < 3; ++a) {
                const std::int64_t q = (2 * sum[static_cast<std::size_t>(a)] + 256 * count) / (512 * count);
                ASSERT_EQ(v.q[a], std::clamp<std::int64_t>(q, 1, 65535));
            }
        }
    }
}

// Distance of a world position from the surface of a box.
double box_distance(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
    double inside = 1e9;
    std::array<double, 3> out{};
    for (int a = 0; a < 3; ++a) {
        inside = std::min({inside, std::abs(p[a] - low[a]), std::abs(high[a] - p[a])});
        out[static_cast<std::size_t>(a)] = std::max({low[a] - p[a], p[a] - high[a], 0.0});
    }
    const double outside = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    return outside > 0 ? outside : inside;
}

TEST(Remesh, BoxesKeepTheirCornersAndCreases) {
    vp::cpu_backend backend{2};
    const vp::grid g = grid_of(glm::ivec3(16));
    for (int k = 0; k < 20; ++k) {
        const float shift = 0.137f * static_cast<float>(k);
        const glm::vec3 low(2.3f + shift, 3.1f + 0.5f * shift, 2.7f), high(9.9f + shift, 11.6f, 12.2f + 0.3f * shift);
        const host_surface sharp = remesh(backend, box(low, high), g),
                           mean = remesh(backend, box(low, high), g, {.place = vp::place::mean});
        ASSERT_TRUE(sharp.is_closed_manifold());
        EXPECT_EQ(sharp.status.surface.made_crossings, 0u);
        EXPECT_EQ(sharp.vertices.size(), mean.vertices.size()); // one topology
        double worst = 0, worst_mean = 0;
        for (std::size_t i = 0; i < sharp.vertices.size(); ++i) {
            worst = std::max(worst, box_distance(vp::position(g, sharp.vertices[i]), low, high));
            worst_mean = std::max(worst_mean, box_distance(vp::position(g, mean.vertices[i]), low, high));
        }
        // Each of its corners has a vertex.
        for (int c = 0; c < 8; ++c) {
            const glm::dvec3 corner((c & 1) != 0 ? high.x : low.x, (c & 2) != 0 ? high.y : low.y,
                                    (c & 4) != 0 ? high.z : low.z);
            double nearest = 1e9;
            for (const auto& v : sharp.vertices) {
                const glm::dvec3 p = vp::position(g, v);
                nearest = std::min(nearest, std::hypot(p.x - corner.x, p.y - corner.y, p.z - corner.z));
            }
            EXPECT_LT(nearest, 0.003) << k;
        }
        EXPECT_LT(worst, 0.002) << k;
        EXPECT_GT(worst_mean, 0.05) << k;
    }
}

TEST(Remesh, BallsLieWithinTheSagittaOfACell) {
    vp::cpu_backend backend{2};
    for (const int n : {24, 48}) {
        const vp::grid g = unit_grid(n);
        const host_mesh m = ball(glm::vec3(0.5f), 0.4f, 5);
        const double h = g.voxel_size.x;
        for (const vp::place place : {vp::place::mean, vp::place::sharp}) {
            const host_surface s = remesh(backend, m, g, {.place = place});
            ASSERT_TRUE(s.is_closed_manifold());
            EXPECT_EQ(s.judge_triangles().euler, 2);
            for (const auto& v : s.vertices) {
                const glm::dvec3 p = vp::position(g, v);
                const double r = std::hypot(p.x - 0.5, p.y - 0.5, p.z - 0.5);
                // The faces of the ball lie 2e-4 within it.
                ASSERT_NEAR(r, 0.4, h * h / (2 * 0.4) + 2.5e-4);
            }
        }
    }
}

TEST(Remesh, SignsAreThoseOfSolids) {
    vp::cpu_backend backend{2};
    host_mesh m = box(glm::vec3(0.1f), glm::vec3(0.6f));
    m.add(box(glm::vec3(0.4f), glm::vec3(0.9f)));
    const auto volume = [&](const vp::remesh_options& o) {
        const host_surface s = remesh(backend, m, unit_grid(20), o);
        EXPECT_TRUE(s.is_closed_manifold());
        double sum = 0;
        for (const glm::uvec3& t : s.triangles) {
            const glm::dvec3 a = vp::position(s.samples, s.vertices[t.x]), b = vp::position(s.samples, s.vertices[t.y]),
                             c = vp::position(s.samples, s.vertices[t.z]);
            sum += (a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x)) / 6;
        }
        return std::pair(sum, s.status.surface);
    };
    const auto [joined, joined_counts] = volume({});
    EXPECT_NEAR(joined, 0.242, 1e-3); // 2 / 8 - 0.2^3
    EXPECT_EQ(joined_counts.made_crossings, 0u);
    const auto [holed, holed_counts] = volume({.rule = vp::fill_rule::even_odd});
    EXPECT_NEAR(holed, 0.234, 2e-3); // the overlap is a hole
    EXPECT_EQ(holed_counts.made_crossings, 0u);
    // Each draw by itself: two draws are one mesh by parts.
    const vp::mesh<vp::cpu_backend> first{backend, box(glm::vec3(0.1f), glm::vec3(0.6f)).positions,
                                          box(glm::vec3(0.1f), glm::vec3(0.6f)).triangles},
        second{backend, box(glm::vec3(0.4f), glm::vec3(0.9f)).positions,
               box(glm::vec3(0.4f), glm::vec3(0.9f)).triangles};
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>;
    const std::vector<draw> draws{{first.view(), {}, {}}, {second.view(), {}, {}}};
    vp::surface<vp::cpu_backend> s(backend);
    const vp::status status =
        vp::remesh(backend, draws, unit_grid(20), s, {.rule = vp::fill_rule::even_odd, .bodies = vp::bodies::draw});
    const host_surface each = to_host(backend, s, status), call = remesh(backend, m, unit_grid(20));
    EXPECT_EQ(status.surface.made_crossings, 0u);
    EXPECT_TRUE(each.has_same_arrays(call));
}

TEST(Remesh, HolesAreClosedByConesWithTheirPlanes) {
    vp::cpu_backend backend{2};
    host_mesh m = box(glm::vec3(0.13f), glm::vec3(0.81f));
    m.triangles.resize(10); // without a face
    const host_surface s = remesh(backend, m, unit_grid(20), {.repair = vp::repair::close_holes});
    EXPECT_TRUE(s.is_closed_manifold());
    EXPECT_GT(s.status.surface.cone_crossings, 50u);
    EXPECT_EQ(s.status.surface.made_crossings, 0u);
    for (const auto& v : s.vertices)
        EXPECT_LT(box_distance(vp::position(s.samples, v), glm::dvec3(0.13f), glm::dvec3(0.81f)),
                  0.002 * s.samples.voxel_size.x);
    EXPECT_NE(std::find(s.sources.begin(), s.sources.end(), ~0u), s.sources.end()); // a cone is no primitive
    // Holes of more edges stay open.
    const host_surface open =
        remesh(backend, m, unit_grid(20), {.repair = vp::repair::close_holes, .max_hole_edges = 3});
    EXPECT_EQ(open.status.surface.cone_crossings, 0u);
}

// The box without two sides that meet: the surface is bent where the cone has an edge, and neither bulges out.
TEST(Remesh, WindingNumbersCloseHolesSmoothly) {
    vp::cpu_backend backend{2};
    host_mesh m = box(glm::vec3(0.13f), glm::vec3(0.81f));
    m.triangles.erase(m.triangles.begin(), m.triangles.begin() + 2);
    m.triangles.resize(8);
    const host_surface s = remesh(backend, m, unit_grid(20), {.repair = vp::repair::winding}),
                       cone = remesh(backend, m, unit_grid(20), {.repair = vp::repair::close_holes});
    EXPECT_TRUE(s.is_closed_manifold());
    EXPECT_GT(s.status.surface.made_crossings, 0u) << "where neither mesh nor cone is";
    EXPECT_NE(s.vertices.size(), cone.vertices.size());
    EXPECT_EQ(
        remesh(backend, m, unit_grid(20), {.rule = vp::fill_rule::even_odd, .repair = vp::repair::winding}).status.code,
        vp::status_code::bad_solid_options);
}

TEST(Remesh, CrossingsThatNobodyHasAreCounted) {
    vp::cpu_backend backend{2};
    host_mesh m = box(glm::vec3(0.13f), glm::vec3(0.81f));
    m.triangles.resize(8); // without the faces at the ends of x, so that rows along x do not enter
    m.add(box(glm::vec3(0.85f), glm::vec3(0.95f)));
    const host_surface s = remesh(backend, m, unit_grid(20), {.repair = vp::repair::exterior, .closing = 0});
    EXPECT_TRUE(s.is_closed_manifold());
    EXPECT_GT(s.status.surface.made_crossings, 0u);
}

// Duplicates, and folds that cross an edge several times: the middle one of the changes.
TEST(Remesh, SeveralCrossingsOfAnEdgeGiveTheMiddleOne) {
    vp::cpu_backend backend{2};
    const vp::grid g = grid_of(glm::ivec3(8));
    host_mesh m = box(glm::vec3(1.2f, 1.2f, 1.2f), glm::vec3(6.3f));
    m.add(host_mesh(m)); // nonzero: each face twice changes the verdict once
    const host_surface twice = remesh(backend, m, g), once = remesh(backend, box(glm::vec3(1.2f), glm::vec3(6.3f)), g);
    EXPECT_EQ(twice.vertices, once.vertices);
    EXPECT_EQ(twice.triangles, once.triangles);
    // Three nested boxes whose upper faces lie between two samples: by even_odd the middle one is the surface.
    host_mesh three = box(glm::vec3(1.2f), glm::vec3(6.3f, 6.3f, 5.6f));
    three.add(box(glm::vec3(1.2f), glm::vec3(6.3f, 6.3f, 5.9f)));
    three.add(box(glm::vec3(1.2f), glm::vec3(6.3f, 6.3f, 6.2f)));
    const host_surface nested = remesh(backend, three, g, {.rule = vp::fill_rule::even_odd});
    ASSERT_TRUE(nested.is_closed_manifold());
    double top = 0;
    for (const auto& v : nested.vertices) top = std::max(top, vp::position(g, v).z);
    EXPECT_NEAR(top, 5.9, 0.002);
}

TEST(Remesh, OrderOfTrianglesChangesSourcesAlone) {
    vp::cpu_backend backend{2}, other{1};
    host_mesh m = ball(glm::vec3(0.5f), 0.4f, 3);
    const host_surface a = remesh(backend, m, unit_grid(24));
    std::reverse(m.triangles.begin(), m.triangles.end());
    const host_surface b = remesh(other, m, unit_grid(24));
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_NE(a.sources, b.sources);
    EXPECT_TRUE(
        std::all_of(a.sources.begin(), a.sources.end(), [&](std::uint32_t p) { return p < m.triangles.size(); }));
}

TEST(Remesh, LevelsGrowBodiesAndMakePlatesOfSheets) {
    vp::cpu_backend backend{2};
    const vp::grid g = unit_grid(32);
    const host_surface grown = remesh(backend, ball(glm::vec3(0.5f), 0.3f, 4), g, {.level = 0.1});
    EXPECT_TRUE(grown.is_closed_manifold());
    EXPECT_EQ(grown.status.surface.made_crossings, 0u);
    for (const auto& v : grown.vertices) {
        const glm::dvec3 p = vp::position(g, v);
        ASSERT_NEAR(std::hypot(p.x - 0.5, p.y - 0.5, p.z - 0.5), 0.4, 4e-3);
    }
    // A sheet encloses nothing; at a level it is a plate.
    host_mesh sheet;
    sheet.positions = {{0.2f, 0.2f, 0.5f}, {0.8f, 0.2f, 0.5f}, {0.8f, 0.8f, 0.5f}, {0.2f, 0.8f, 0.5f}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
    EXPECT_TRUE(remesh(backend, sheet, g).vertices.empty());
    const host_surface plate = remesh(backend, sheet, g, {.level = 0.06});
    EXPECT_TRUE(plate.is_closed_manifold());
    EXPECT_EQ(plate.judge_triangles().euler, 2);
    double low = 1, high = 0;
    for (const auto& v : plate.vertices) {
        low = std::min(low, vp::position(g, v).z);
        high = std::max(high, vp::position(g, v).z);
    }
    EXPECT_NEAR(low, 0.44, 2e-3);
    EXPECT_NEAR(high, 0.56, 2e-3);
}

TEST(Remesh, SamplesAtCornersAreThoseOfTheMovedGrid) {
    vp::cpu_backend backend{2};
    const host_mesh m = octahedron(glm::vec3(0.5f), 0.41f);
    const host_surface s = remesh(backend, m, unit_grid(16), {.sample = vp::sample::corner});
    EXPECT_TRUE(s.is_closed_manifold());
    EXPECT_EQ(s.samples, unit_grid(16).at_corners());
    EXPECT_EQ(s.status.surface.made_crossings, 0u);
    for (const auto& v : s.vertices) {
        const glm::dvec3 p = vp::position(s.samples, v);
        EXPECT_LT(std::abs(std::abs(p.x - 0.5) + std::abs(p.y - 0.5) + std::abs(p.z - 0.5) - 0.41), 0.01);
    }
}

TEST(Remesh, NothingAndBadOptions) {
    vp::cpu_backend backend{2};
    EXPECT_TRUE(remesh(backend, {}, unit_grid(4)).status.ok());
    EXPECT_TRUE(remesh(backend, {}, unit_grid(4)).vertices.empty());
    EXPECT_TRUE(remesh(backend, {}, unit_grid(4), {.level = 0.1}).vertices.empty());
    const host_mesh m = box(glm::vec3(0.2f), glm::vec3(0.7f));
    const auto code = [&](const vp::remesh_options& o) { return remesh(backend, m, unit_grid(4), o).status.code; };
    EXPECT_EQ(code({.place = static_cast<vp::place>(9)}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({.sample = static_cast<vp::sample>(2)}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({.level = std::numeric_limits<double>::quiet_NaN()}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({.closing = -1}), vp::status_code::bad_solid_options);
    host_mesh bad = m;
    bad.triangles[3].y = 77;
    EXPECT_EQ(remesh(backend, bad, unit_grid(4)).status.code, vp::status_code::index_out_of_range);
}

} // namespace
