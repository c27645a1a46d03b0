// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distances of any points, sparse framebuffers, and reading a field.

#include "distance_support.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace distances {
namespace {

struct at_points {
    std::vector<float> distances;
    std::vector<std::int64_t> nearest;
    vp::status status;
};
at_points library_points(const std::vector<mesh>& draws, const vp::grid& g, const std::vector<glm::vec3>& points,
                         const vp::distance_options& options = {}) {
    vp::cpu_backend backend(2);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, vp::distance>> all;
    for (const mesh& m : draws) all.push_back({m.view(), {}, {}});
    at_points r{std::vector<float>(points.size()), std::vector<std::int64_t>(points.size()), {}};
    r.status = vp::distance_at(backend, std::span<const vp::draw<vp::mesh_view<>, vp::passthrough, vp::distance>>(all),
                               g, {points.data(), points.size()}, {r.distances.data(), r.nearest.data()}, options);
    return r;
}

TEST(DistanceAt, SamplesOfAGridHaveTheirDistances) {
    splitmix64 random(21);
    const std::int64_t n = unit::cases(100) / 50;
    for (std::int64_t i = 0; i < n; ++i) {
        const vp::grid g = solids::unit_grid({13, 12, 11});
        const std::vector<mesh> draws{solids::random_bodies(random, 11, 3), solids::tube({3, 2, 2}, {9, 9, 9}, 1.5f),
                                      solids::sphere({6, 6, 6}, 4.5f, 3)};
        std::vector<glm::vec3> points;
        for (int z = 0; z < 11; ++z)
            for (int y = 0; y < 12; ++y)
                for (int x = 0; x < 13; ++x) points.emplace_back(glm::vec3(glm::ivec3(x, y, z)) + 0.5f);
        for (const vp::fill_rule rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive})
            for (const vp::bodies bodies : {vp::bodies::call, vp::bodies::draw})
                for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::winding}) {
                    if (repair == vp::repair::winding && rule == vp::fill_rule::even_odd) continue;
                    const vp::distance_options o{
                        .band = vp::band::whole, .rule = rule, .bodies = bodies, .repair = repair};
                    const field f = library_field(draws, g, o);
                    const at_points p = library_points(draws, g, points, o);
                    ASSERT_TRUE(p.status.ok());
                    ASSERT_EQ(p.distances, f.distances);
                    ASSERT_EQ(p.nearest, f.nearest);
                }
    }
}

// Points anywhere, also far outside of the grid, against exact fractions.
TEST(DistanceAt, PointsAnywhereHaveTheNearestFloat) {
    splitmix64 random(22);
    const vp::grid g = solids::unit_grid({16, 16, 16});
    const mesh m = solids::random_bodies(random, 14, 3);
    const vp::core::snap_transform snap = vp::core::make_snap_transform(g);
    std::vector<glm::vec3> points;
    for (int i = 0; i < 60; ++i) {
        const double size = i % 3 == 0 ? 16.0 : i % 3 == 1 ? 100.0 : 1e6;
        points.emplace_back(static_cast<float>(random.uniform(-size, size)),
                            static_cast<float>(random.uniform(-size, size)),
                            static_cast<float>(random.uniform(-size, size)));
    }
    const at_points found = library_points({m}, g, points);
    const oracle::distance_oracle exact({1.0, 1.0, 1.0}, g.fraction());
    const auto lattice = [&](glm::vec3 p) {
        const vp::core::snapped_position s = vp::core::snap(snap, p.x, p.y, p.z);
        return oracle::lattice_point{s.x, s.y, s.z};
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
        oracle::exact_square least;
        for (const glm::uvec3& t : m.triangles) {
            const oracle::exact_square s = exact.square(
                {lattice(m.positions[t.x]), lattice(m.positions[t.y]), lattice(m.positions[t.z])}, lattice(points[i]));
            if (least.denominator.sign() == 0 || oracle::is_less(s, least)) least = s;
        }
        ASSERT_TRUE(exact.is_nearest_float(least, std::abs(found.distances[i]))) << i;
    }
}

TEST(DistanceAt, BadPointsAreCounted) {
    const vp::grid g = solids::unit_grid({8, 8, 8});
    const std::vector<glm::vec3> points{{1, 1, 1}, {NAN, 0, 0}, {1e9f, 0, 0}, {0, INFINITY, 0}, {4, 4, 4}};
    const at_points p = library_points({solids::box({2, 2, 2}, {6, 6, 6})}, g, points);
    ASSERT_TRUE(p.status.ok());
    EXPECT_EQ(p.status.distance.bad_points, 3u);
    EXPECT_EQ(p.distances[0], std::sqrt(3.0f));
    EXPECT_EQ(p.distances[4], -2.0f);
    for (const std::size_t i : {1u, 2u, 3u}) {
        EXPECT_TRUE(std::isnan(p.distances[i]));
        EXPECT_EQ(p.nearest[i], -1);
    }
    const at_points nothing = library_points({mesh{}}, g, points);
    EXPECT_EQ(nothing.distances[0], std::numeric_limits<float>::infinity());
    EXPECT_EQ(nothing.nearest[0], -1);
    using enum vp::repair;
    for (const vp::repair repair : {exterior, vote})
        EXPECT_EQ(library_points({mesh{}}, g, points, {.repair = repair}).status.code,
                  vp::status_code::bad_distance_options);
    EXPECT_EQ(library_points({mesh{}}, g, points, {.rule = vp::fill_rule::even_odd, .repair = winding}).status.code,
              vp::status_code::bad_solid_options);
}

TEST(DistanceSparse, HoldsTheBandOfTheDenseField) {
    splitmix64 random(23);
    for (int i = 0; i < 4; ++i) {
        const vp::grid whole = solids::unit_grid({45, 37, 29});
        const vp::grid g = i == 3 ? whole.crop({5, 9, 3}, {33, 21, 19}) : whole;
        mesh m = solids::random_bodies(random, 27, 4);
        m.add(solids::sphere({20, 18, 14}, 9.0f, 2));
        const vp::distance_options o{.band = i == 2 ? vp::band::whole : vp::band(2.0),
                                     .sample = i == 1 ? vp::sample::corner : vp::sample::centre};
        const field f = library_field(m, g, o);
        vp::cpu_backend backend(2);
        vp::sparse_framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>,
                               vp::target<std::int64_t, vp::blend::replace>>
            sparse(backend, f.extent);
        vp::get<0>(sparse).clear(2.0f);
        vp::get<1>(sparse).clear(-1);
        const vp::status s =
            vp::voxelize_distance(backend, m.view(), g, vp::passthrough{}, nearest_shader{}, sparse, o);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.distance.band_samples, f.status.distance.band_samples);
        EXPECT_EQ(sparse.num_voxels(), f.status.distance.band_samples);
        EXPECT_EQ(s.counts.fragments, s.distance.band_samples);
        EXPECT_EQ(s.solid, f.status.solid);
        const auto host = sparse.to_host(backend);
        for (int z = 0; z < f.extent.z; ++z)
            for (int y = 0; y < f.extent.y; ++y)
                for (int x = 0; x < f.extent.x; ++x) {
                    const std::size_t at = f.index(x, y, z);
                    const bool in = f.nearest[at] >= 0;
                    ASSERT_EQ(host.contains({x, y, z}), in);
                    ASSERT_EQ(vp::get<0>(host)(x, y, z), in ? f.distances[at] : 2.0f);
                    ASSERT_EQ(vp::get<1>(host)(x, y, z), f.nearest[at]);
                }
    }
}

// A plane's field is linear, so it is read without an error that shows.
TEST(DistanceRay, ReadsValuesAndGradients) {
    const mesh m = solids::box({-50, -50, -50}, {50, 50, 6.25f});
    vp::cpu_backend backend(2);
    vp::grid g = solids::unit_grid({12, 12, 12});
    for (const vp::sample where : {vp::sample::centre, vp::sample::corner}) {
        vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(
            backend, vp::core::sample_grid(g, where).extent);
        ASSERT_TRUE(vp::voxelize_distance(backend, m.view(), g, vp::passthrough{}, vp::distance{}, fb,
                                          {.band = vp::band::whole, .sample = where})
                        .ok());
        const vp::distance_samples f = vp::samples_of(vp::get<0>(fb).view(), g, where);
        EXPECT_NEAR(f({3.3, 4.4, 7.5}), 1.25f, 1e-5f);
        EXPECT_NEAR(f({3.3, 4.4, 2.0}), -4.25f, 1e-5f);
        const glm::vec3 n = f.gradient({3.3, 4.4, 7.9});
        EXPECT_NEAR(n.x, 0.0f, 1e-5f);
        EXPECT_NEAR(n.y, 0.0f, 1e-5f);
        EXPECT_NEAR(n.z, 1.0f, 1e-5f);
        // Down along z to the level 1, and from the inside up to the surface.
        const vp::distance_hit down = vp::trace(f, {5.0, 5.0, 30.0}, {0.0, 0.0, -1.0}, 100.0, 1.0f);
        ASSERT_TRUE(down.hit);
        EXPECT_NEAR(down.t, 22.75f, 1e-4f);
        const vp::distance_hit up = vp::trace(f, {5.0, 5.0, 1.0}, {0.0, 0.0, 1.0}, 100.0);
        ASSERT_TRUE(up.hit);
        EXPECT_NEAR(up.t, 5.25f, 1e-4f);
        EXPECT_NEAR(up.gradient.z, 1.0f, 1e-4f);
        EXPECT_FALSE(vp::trace(f, {5.0, 5.0, 30.0}, {0.0, 0.0, 1.0}, 100.0).hit);
        EXPECT_FALSE(vp::trace(f, {5.0, 5.0, 30.0}, {0.0, 0.0, -1.0}, 10.0).hit);
        EXPECT_FALSE(vp::trace(f, {-5.0, 5.0, 8.0}, {0.0, 1.0, 0.0}, 100.0).hit);
    }
}

TEST(DistanceRay, MeetsASphereWhereItLies) {
    const mesh m = solids::sphere({16, 16, 16}, 9.0f, 4);
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid({32, 32, 32});
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb(backend, g.extent);
    ASSERT_TRUE(vp::voxelize_distance(backend, m.view(), g, vp::passthrough{}, vp::distance{}, fb).ok());
    const vp::distance_samples f = vp::samples_of(vp::get<0>(fb).view(), g);
    splitmix64 random(24);
    for (int i = 0; i < 200; ++i) {
        glm::dvec3 from(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const double length = std::sqrt(from.x * from.x + from.y * from.y + from.z * from.z);
        if (length < 0.1) continue;
        from = from / length;
        const vp::distance_hit hit = vp::trace(f, glm::dvec3(16.0) + 25.0 * from, -from, 100.0);
        ASSERT_TRUE(hit.hit);
        ASSERT_NEAR(hit.t, 16.0f, 0.1f);
        // A cell's slope along an axis is that of its middle: off by half a voxel over the radius an axis at most.
        ASSERT_GT(hit.gradient.x * from.x + hit.gradient.y * from.y + hit.gradient.z * from.z, 0.93);
    }
}

} // namespace
} // namespace distances
