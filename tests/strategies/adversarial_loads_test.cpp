// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Adversarial loads give the CPU's bytes: one triangle over the whole grid, millions in one voxel, grid-long slivers,
// zero-area triangles, and mixtures.

#include "cells.hpp"

#include <algorithm>
#include <utility>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using bits = vp::target<vp::bit, blend::bit_or>;
using sum = vp::target<float, blend::add>;

void compare(const mesh_data& m, const vp::grid& g) {
    for (const vp::coverage rule : both_rules) {
        expect_same<bits>(m, g, vp::passthrough{}, vp::constant(true), rule);
        expect_same(tile_targets{}, m, g, vp::passthrough{}, tile_values{}, rule);
    }
}

TEST(AdversarialLoads, OneTriangleOverTheWholeGridGivesTheCpusBytes) {
    mesh_data m;
    add_triangle(m, {-3000.0f, -3000.0f, -100.0f}, {5000.0f, -3000.0f, 1500.0f}, {-3000.0f, 5000.0f, 600.0f});
    for (const vp::coverage rule : both_rules) {
        expect_same<bits>(m, box_grid({1024, 1024, 1024}), vp::passthrough{}, vp::constant(true), rule);
        expect_same_lists<void>(m, box_grid({1024, 1024, 1024}), vp::passthrough{}, vp::constant(true), rule);
    }
    compare(m, box_grid({300, 400, 500}));
}

TEST(AdversarialLoads, TwoMillionTrianglesInOneVoxelGiveTheCpusBytes) {
    const mesh_data m = triangles_in_voxel(2000000, {17.0f, 5.0f, 30.0f}, 50);
    compare(m, box_grid({64, 64, 64}));
    expect_same_lists<void>(m, box_grid({64, 64, 64}), vp::passthrough{}, vp::constant(true),
                            vp::coverage::conservative);
}

// Folds: one voxel of 200,000 fragments, few and many neighbouring voxels of some thousands, and short ones.
TEST(AdversarialLoads, LongVoxelsOfFoldedBlendsGiveTheCpusBytes) {
    mesh_data m = triangles_in_voxel(200000, {17.0f, 5.0f, 30.0f}, 56);
    append(m, mixed_triangles(60000, 64.0f, 57));
    for (std::uint32_t x = 0; x < 60; ++x) // the first voxels of the grid, so that one block gets them
        append(m, triangles_in_voxel(2200, {static_cast<float>(x), 0.0f, 0.0f}, 100 + x));
    for (std::uint32_t x = 0; x < 5; ++x)
        append(m, triangles_in_voxel(4000, {9.0f * static_cast<float>(x), 20.0f, 50.0f}, 200 + x));
    std::mt19937 random(58);
    std::shuffle(m.triangles.begin(), m.triangles.end(), random);
    for (const vp::coverage rule : both_rules) {
        expect_same(folded_targets{}, m, box_grid({64, 64, 64}), vp::passthrough{}, folded_values{}, rule);
        expect_same(folded_targets{}, m, box_grid({64, 64, 64}), vp::passthrough{}, folded_values{}, rule, start::load);
    }
}

TEST(AdversarialLoads, GridLongSliversGiveTheCpusBytes) {
    std::mt19937 random(51);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (int i = 0; i < 100000; ++i) {
        glm::vec3 a(unit(random), unit(random), unit(random)), b(unit(random), unit(random), unit(random));
        a[i % 3] = -0.1f;
        b[i % 3] = 1.1f;
        if (i % 4 != 0) b = glm::vec3(i % 3 == 0 ? b.x : a.x, i % 3 == 1 ? b.y : a.y, i % 3 == 2 ? b.z : a.z);
        const glm::vec3 c = b + glm::vec3(0.001f * unit(random), 0.001f * unit(random), 0.001f * unit(random));
        add_triangle(m, a * 256.0f, b * 256.0f, c * 256.0f);
    }
    compare(m, box_grid({256, 256, 256}));
}

TEST(AdversarialLoads, ThreeMillionZeroAreaTrianglesGiveTheCpusBytes) {
    std::mt19937 random(52);
    std::uniform_real_distribution<float> unit(0.0f, 128.0f);
    mesh_data m;
    for (int i = 0; i < 3000000; ++i) {
        const glm::vec3 a(unit(random), unit(random), unit(random));
        glm::vec3 b = a;
        b[i % 3] += 1.5f;
        add_triangle(m, a, i % 2 == 0 ? a : b, a);
    }
    compare(m, box_grid({128, 128, 128}));
}

// Everything at once, in several orders: order-free blends give one result.
TEST(AdversarialLoads, MixturesInAnyOrderGiveOneResult) {
    mesh_data m = mixed_triangles(200000, 128.0f, 53);
    const vp::grid g = box_grid({128, 128, 128});
    compare(m, g);
    vp::cuda_backend be;
    tile_targets::framebuffer<vp::cuda_backend> shaded{be, g.extent};
    vp::framebuffer<vp::cuda_backend, sum> constant{be, g.extent};
    const auto draw = [&] {
        const vp::mesh mesh{be, m.positions, m.triangles};
        EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, tile_values{}, shaded).ok());
        EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(0.3f), constant).ok());
        return std::pair{vp::get<1>(shaded).to_host(be), vp::get<0>(constant).to_host(be)};
    };
    const auto expected = draw();
    std::mt19937 random(54);
    for (int i = 0; i < 3; ++i) {
        std::shuffle(m.triangles.begin(), m.triangles.end(), random);
        const auto actual = draw();
        expect_same_bytes(expected.first, actual.first, "permuted, in tiles");
        expect_same_bytes(expected.second, actual.second, "permuted, without");
    }
}

} // namespace
