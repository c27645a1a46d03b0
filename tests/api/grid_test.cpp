// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Grids: three ways to fit one around positions, world coordinates and voxels, crops and what is said of bad ones.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace {

namespace vp = voxelpipe;
using unit::backend_type;

const std::vector<glm::vec3> corners{{-2, 1, 5}, {6, 3, 6}, {0, 2, 5.5f}};

TEST(Bounds, AreOfTheFinitePositions) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    std::vector<glm::vec3> p = corners;
    p.insert(p.end(), {{nan, 100, 100}, {-100, inf, 0}});
    const vp::bounding_box box = vp::bounds(p);
    EXPECT_EQ(box, (vp::bounding_box{{-2, 1, 5}, {6, 3, 6}}));
    EXPECT_TRUE(vp::bounds(std::vector<glm::vec3>{{nan, 0, 0}}).empty());
    EXPECT_TRUE(vp::bounds(std::vector<glm::vec3>{}).empty());
    EXPECT_EQ(vp::fit(std::vector<glm::vec3>{{nan, 0, 0}}, {4, 4, 4}).voxel_size, glm::dvec3(1));
}

TEST(Bounds, OfPositionsInTheMemoryOfABackend) {
    backend_type backend = unit::make_backend();
    const vp::mesh mesh{backend, corners, std::vector<glm::uvec3>{{0, 1, 2}}};
    EXPECT_EQ(vp::bounds(backend, mesh.view().positions), vp::bounds(corners));
    EXPECT_EQ(vp::fit(vp::bounds(backend, mesh.view().positions), {9, 8, 7}), vp::fit(corners, {9, 8, 7}));
}

TEST(Fit, LongestGivesTheOtherAxesAsFewAsHoldTheBox) {
    const vp::grid g = vp::fit_longest(vp::bounds(corners), 80);
    EXPECT_EQ(g.extent, glm::ivec3(80, 20, 10));
    EXPECT_DOUBLE_EQ(g.voxel_size.x, 8 * 1.0002 / 80);
    EXPECT_EQ(g.voxel_size.x, g.voxel_size.y);
    const glm::dvec3 first = g.to_voxels({-2, 1, 5}), last = g.to_voxels({6, 3, 6});
    for (int a = 0; a < 3; ++a) {
        EXPECT_GT(first[a], 0.0);
        EXPECT_LT(last[a], g.extent[a]);
        EXPECT_NEAR(first[a] + last[a], g.extent[a], 1e-9); // centred
    }
    EXPECT_EQ(vp::fit_longest(vp::bounds(corners), 30).extent, glm::ivec3(30, 8, 4));
    EXPECT_EQ(vp::fit_longest({{0, 0, 0}, {1, 0, 0}}, 16).extent, glm::ivec3(16, 1, 1));
    EXPECT_EQ(vp::fit_longest({}, 16).extent, glm::ivec3(16));
    EXPECT_EQ(vp::validate(vp::fit_longest(vp::bounds(corners), 0)).code, vp::status_code::bad_extent);
    EXPECT_EQ(vp::validate(vp::fit_longest(vp::bounds(corners), -3)).code, vp::status_code::bad_extent);
}

TEST(Fit, ByVoxelSizeLiesOnTheLatticeAndHoldsTheBox) {
    const vp::grid g = vp::fit_voxel_size({{0, 0, 0}, {0.6f, 0.3f, 1.0}}, 0.1);
    EXPECT_EQ(g.extent, glm::ivec3(6, 3, 10));
    EXPECT_EQ(g.origin, glm::dvec3(0));
    const vp::grid h = vp::fit_voxel_size({{-1.05, 2.0, -0.5}, {1.05, 2.0, 0.5}}, {0.5, 0.25, 0.125}, 2);
    EXPECT_EQ(h.extent, glm::ivec3(6 + 4, 1 + 4, 8 + 4));
    EXPECT_EQ(h.origin, glm::dvec3(-1.5 - 1.0, 2.0 - 0.5, -0.5 - 0.25));
    EXPECT_EQ(vp::fit_voxel_size({{0, 0, 0}, {1.01, 1.0001, 1}}, 1.0).extent, glm::ivec3(2, 2, 1));
    EXPECT_EQ(vp::fit_voxel_size({}, 1.0).extent, glm::ivec3(1));
    for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_FALSE(vp::validate(vp::fit_voxel_size({{0, 0, 0}, {1, 1, 1}}, bad)).ok());
    EXPECT_EQ(vp::validate(vp::fit_voxel_size({{0, 0, 0}, {1, 1, 1}}, 1e-9)).code, vp::status_code::extent_too_large);
}

TEST(World, VoxelsAndPositionsGoBothWays) {
    vp::grid g;
    g.origin = {10, -20, 30};
    g.voxel_size = {0.5, 2, 0.25};
    g.extent = {8, 9, 10};
    EXPECT_EQ(g.voxel_center({0, 0, 0}), glm::dvec3(10.25, -19, 30.125));
    EXPECT_EQ(g.to_world({8, 9, 10}), glm::dvec3(14, -2, 32.5));
    EXPECT_EQ(g.to_voxels({14, -2, 32.5}), glm::dvec3(8, 9, 10));
    EXPECT_EQ(g.voxel_at({10.5, -20, 30.24}), glm::ivec3(1, 0, 0)); // a face belongs to the upper voxel
    EXPECT_EQ(g.voxel_at({9.9, -20, 30}), glm::ivec3(-1, 0, 0));
    EXPECT_FALSE(g.contains(g.voxel_at({9.9, -20, 30})));
    EXPECT_TRUE(g.contains({7, 8, 9}));
    EXPECT_FALSE(g.contains({7, 9, 9}));
    const vp::grid part = g.crop({2, 3, 4}, {4, 4, 4}).crop({1, 1, 1}, {2, 2, 2});
    EXPECT_EQ(part.uncropped(), g.crop({0, 0, 0}, {8, 9, 10}));
    EXPECT_EQ(part.voxel_center({1, 0, 1}), g.voxel_center({4, 4, 6}));
    EXPECT_EQ(part.voxel_at(g.voxel_center({4, 4, 6})), glm::ivec3(1, 0, 1));
    EXPECT_EQ(part.to_world({0, 0, 0}), part.part_origin());
}

// The centre of each fragment's voxel by uncropped(), in a shader, is that of the same voxel of the part.
struct centres {
    vp::grid whole;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(whole.voxel_center(f.voxel)); }
};

TEST(World, OfAFragmentInAShader) {
    backend_type backend = unit::make_backend();
    vp::grid g;
    g.origin = {-1.25, 0.1, 7};
    g.voxel_size = {0.3, 0.7, 0.11};
    g.extent = {20, 20, 20};
    const vp::grid part = g.crop({2, 1, 3}, {9, 17, 11});
    const vp::mesh mesh{backend, std::vector<glm::vec3>{{-1, 0.5f, 7}, {4, 3, 9}, {0, 12, 8}},
                        std::vector<glm::uvec3>{{0, 1, 2}}};
    vp::abuffer<backend_type, glm::dvec3> lists{backend};
    vp::voxelize(backend, mesh, part, vp::passthrough{}, centres{part.uncropped()}, lists).or_throw();
    const auto host = lists.to_host(backend);
    EXPECT_GT(host.voxels.size(), 20u);
    for (const auto& [voxel, fragments] : host)
        for (const auto& [primitive, centre] : fragments) EXPECT_EQ(centre, part.voxel_center(voxel));
}

TEST(Crop, OutsideItsGridIsABadCrop) {
    vp::grid g;
    g.extent = {8, 8, 8};
    EXPECT_TRUE(vp::validate(g.crop({4, 0, 0}, {4, 8, 8})).ok());
    EXPECT_EQ(vp::validate(g.crop({4, 0, 0}, {8, 8, 8})).code, vp::status_code::bad_crop);
    EXPECT_EQ(vp::validate(g.crop({-1, 0, 0}, {4, 4, 4})).code, vp::status_code::bad_crop);
    EXPECT_EQ(vp::validate(g.crop({1, 1, 1}, {4, 0, 4})).code, vp::status_code::bad_extent);
}

} // namespace
