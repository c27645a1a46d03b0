// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Surfaces of sparse framebuffers: those of the same bits made dense, byte for byte, in memory by the surface.

#include "sparse_support.hpp"
#include "value_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace surface_tests;

vp::grid part_of_a_grid(const glm::ivec3& extent, const glm::ivec3& begin) {
    vp::grid whole = grid_of(glm::ivec3(extent.x + begin.x, extent.y + begin.y, extent.z + begin.z));
    return whole.crop(begin, extent);
}

} // namespace

TEST(SparseSurfaces, OfRandomBitsAreTheDenseOnes) {
    vp::cpu_backend backend{2};
    std::mt19937 random(1);
    for (int k = 0; k < 12; ++k) {
        const auto side = [&] { return 1 + static_cast<int>(random() % 19); };
        const int x = side(), y = side(), z = side();
        const glm::ivec3 begin(k % 3 * 3, k % 5, k % 2 * 8);
        const vp::grid g = part_of_a_grid(glm::ivec3(x, y, z), begin);
        const bit_volume v = random_volume(random, g.extent, 0.1 + 0.2 * (k % 5));
        const both_surfaces s = extract_solid(backend, cubes(v, g), g,
                                              {.border = k % 4 == 1 ? vp::border::open : vp::border::closed,
                                               .quads = k % 3 == 0,
                                               .min_component = k % 5 == 2 ? 9u : 0u});
        EXPECT_TRUE(s.are_the_same()) << k;
        EXPECT_EQ(s.voxels, static_cast<std::uint64_t>(std::count(v.inside.begin(), v.inside.end(), true)));
        EXPECT_TRUE(k % 4 == 1 || s.sparse.is_closed_manifold()) << k;
    }
}

// Boxes on the borders of bricks: faces of tiles without a brick beside them; and bodies whose inside is tiles.
TEST(SparseSurfaces, OfTilesAreTheDenseOnes) {
    vp::cpu_backend backend{2};
    const vp::grid g = part_of_a_grid(glm::ivec3(72, 67, 75), glm::ivec3(5, 8, 0));
    const auto at = [&](double x, double y, double z) { return glm::vec3(g.to_world(glm::dvec3(x, y, z))); };
    std::vector<host_mesh> models;
    for (const double side : {8.0, 16.0, 32.0, 40.0})
        models.push_back(box(at(3, 8, 16), at(3 + side, 8 + side, 16 + side)));
    models.push_back(box(at(-20, -20, -20), at(100, 100, 100))); // beyond the grid
    models.push_back(ball(at(36, 33, 37), 30.0f, 3));
    models.push_back(ball(at(36, 33, 37), 44.0f, 3));
    models.back().add(ball(at(36, 33, 37), 17.0f, 3)); // still inside
    models.push_back(box(at(3, 8, 16), at(35, 40, 48)));
    models.back().add(box(at(35, 40, 48), at(51, 56, 64))); // two that share a corner
    std::uint64_t tiles = 0;
    for (std::size_t i = 0; i < models.size(); i += tests::is_slow_build() ? 3 : 1) {
        const both_surfaces s = extract_solid(backend, models[i], g, {.embedded = i == 5});
        EXPECT_TRUE(s.are_the_same()) << i;
        EXPECT_TRUE(s.sparse.is_closed_manifold()) << i;
        EXPECT_GT(s.sparse.vertices.size(), 300u);
        EXPECT_GT(s.tiles, 0u) << i;
        tiles += s.tiles;
    }
    EXPECT_GT(tiles, 100u);
}

TEST(SparseSurfaces, OfNothingAreEmpty) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_of(glm::ivec3(9));
    const vp::sparse_framebuffer<vp::cpu_backend, bit_target> bricks(backend, g.extent);
    vp::surface<vp::cpu_backend> s(backend);
    EXPECT_TRUE(vp::extract(backend, bricks, g, s).ok());
    EXPECT_EQ(s.vertices.size(), 0u);
}

// Voxels that exist and are not set are outside.
TEST(SparseSurfaces, BitsThatAreNotSetAreOutside) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_of(glm::ivec3(20));
    const host_mesh m = ball(glm::vec3(10), 7.3f, 2);
    const vp::mesh<vp::cpu_backend> mesh{backend, m.positions, m.triangles};
    const auto parity = [](const vp::fragment<>& f) { return vp::outputs(f.voxel.x % 3 != 0); };
    vp::sparse_framebuffer<vp::cpu_backend, bit_target> bricks(backend, g.extent);
    vp::framebuffer<vp::cpu_backend, bit_target> bits(backend, g.extent);
    vp::voxelize(backend, mesh, g, vp::passthrough{}, parity, bricks).or_throw();
    vp::voxelize(backend, mesh, g, vp::passthrough{}, parity, bits).or_throw();
    vp::surface<vp::cpu_backend> a(backend), b(backend);
    const vp::status of_a = vp::extract(backend, bricks, g, a), of_b = vp::extract(backend, bits, g, b);
    EXPECT_TRUE(to_host(backend, a, of_a).has_same_arrays(to_host(backend, b, of_b)));
    EXPECT_GT(a.vertices.size(), 500u);
}

TEST(SparseSurfaces, RefuseWhatHasNoMeaning) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_of(glm::ivec3(9));
    vp::sparse_framebuffer<vp::cpu_backend, bit_target> bricks(backend, g.extent);
    vp::surface<vp::cpu_backend> s(backend);
    EXPECT_EQ(vp::extract(backend, bricks, g, s, {.level = 1.0}).code, vp::status_code::bad_surface_options);
    EXPECT_EQ(vp::extract(backend, bricks, grid_of(glm::ivec3(8)), s).code, vp::status_code::extent_mismatch);
    vp::get<0>(bricks).clear(true); // everything that does not exist would be inside
    const host_mesh m = ball(glm::vec3(4), 2.0f, 1);
    const vp::mesh<vp::cpu_backend> mesh{backend, m.positions, m.triangles};
    vp::voxelize(backend, mesh, g, vp::passthrough{}, vp::constant(false), bricks).or_throw();
    EXPECT_EQ(vp::extract(backend, bricks, g, s).code, vp::status_code::bad_surface_options);
}

TEST(SparseSurfaces, OfBadModelsAreTheDenseOnes) {
    vp::cpu_backend backend{2};
    for (std::uint32_t seed = 0; seed < (tests::is_slow_build() ? 1u : 8u); ++seed) {
        const host_mesh m = bad_model(seed);
        const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
        for (const vp::remesh_options& o :
             {vp::remesh_options{}, vp::remesh_options{.rule = vp::fill_rule::even_odd, .quads = true},
              vp::remesh_options{.repair = vp::repair::close_holes, .embedded = true},
              vp::remesh_options{.repair = vp::repair::exterior, .closing = 1, .min_component = 9},
              vp::remesh_options{.place = vp::place::corner, .repair = vp::repair::vote},
              vp::remesh_options{.sample = vp::sample::corner, .bodies = vp::bodies::draw},
              vp::remesh_options{.level = 0.05}, vp::remesh_options{.level = -0.05},
              vp::remesh_options{.sample = vp::sample::corner, .repair = vp::repair::exterior, .level = 0.3}}) {
            const host_surface sparse = remesh_sparse(backend, m, g, o), dense = remesh(backend, m, g, o);
            EXPECT_TRUE(sparse.status.ok()) << sparse.status.message();
            EXPECT_TRUE(sparse.has_same_arrays(dense)) << seed << " " << static_cast<int>(o.repair) << " " << o.level;
            vp::counters counts = dense.status.counts;
            if (o.level != 0.0) counts.fragments = sparse.status.counts.fragments; // of the band alone
            EXPECT_EQ(sparse.status.counts, counts);
            EXPECT_EQ(sparse.status.solid, dense.status.solid);
        }
    }
}

// Levels deep inside of tiles, and beyond the faces of the grid.
TEST(SparseSurfaces, OfLevelsAreTheDenseOnes) {
    vp::cpu_backend backend{2};
    const vp::grid g = grid_of(glm::ivec3(56));
    host_mesh m = ball(glm::vec3(28), 26.5f, 3);
    m.add(box(glm::vec3(-9, 20, 20), glm::vec3(12, 36, 36)));
    for (const double level : {-9.0, 1.5, -0.25, 6.0}) {
        if (tests::is_slow_build() && level == 1.5) break;
        const host_surface sparse = remesh_sparse(backend, m, g, {.level = level}),
                           dense = remesh(backend, m, g, {.level = level});
        EXPECT_TRUE(sparse.has_same_arrays(dense)) << level;
        EXPECT_TRUE(sparse.is_closed_manifold());
        EXPECT_GT(sparse.vertices.size(), 3000u);
    }
}

// Nothing has the size of the grid, nor of its faces: 2^54 samples, 2^36 rows.
TEST(SparseSurfaces, OfLargeGridsTakeMemoryByTheSurface) {
    vp::cpu_backend backend{2};
    const vp::grid large = grid_of(glm::ivec3(1 << 18)), small = grid_of(glm::ivec3(40));
    const glm::vec3 far(131000, 4096, 262000);
    host_mesh m = ball(glm::vec3(20), 17.25f, 2), moved = m;
    for (glm::vec3& p : moved.positions) p = glm::vec3(p.x + far.x, p.y + far.y, p.z + far.z);
    for (glm::vec3& p : m.positions) // rounded as the moved ones are
        p = glm::vec3(p.x + far.x - far.x, p.y + far.y - far.y, p.z + far.z - far.z);
    const host_surface a = remesh_sparse(backend, moved, large), b = remesh(backend, m, small);
    EXPECT_TRUE(a.is_closed_manifold());
    EXPECT_EQ(a.status.surface.made_crossings, 0u);
    ASSERT_EQ(a.vertices.size(), b.vertices.size());
    EXPECT_EQ(a.triangles, b.triangles);
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
        EXPECT_EQ(a.vertices[i].cell.x, b.vertices[i].cell.x + 131000);
        EXPECT_EQ(a.vertices[i].cell.z, b.vertices[i].cell.z + 262000);
        EXPECT_EQ(a.vertices[i].sheet, b.vertices[i].sheet);
    }
    const vp::mesh<vp::cpu_backend> mesh{backend, moved.positions, moved.triangles};
    vp::sparse_framebuffer<vp::cpu_backend, bit_target> bricks(backend, large.extent);
    vp::voxelize_solid(backend, mesh, large, vp::passthrough{}, vp::constant(true), bricks).or_throw();
    vp::surface<vp::cpu_backend> s(backend);
    EXPECT_TRUE(vp::extract(backend, bricks, large, s).ok());
    EXPECT_EQ(s.vertices.size(), a.vertices.size());
}

TEST(SparseSurfaces, HaveTheValuesOfTheDenseOnes) {
    vp::cpu_backend backend{2};
    const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
        const host_mesh model = bad_model(seed);
        const vp::mesh<vp::cpu_backend> m{backend, model.positions, model.triangles};
        const vp::draw<vp::mesh_view<>, place_shader, value_shader> d{m.view(), {}, {1}};
        const std::vector draws{d};
        for (const double level : {0.0, 0.06}) {
            vp::surface<vp::cpu_backend, glm::vec3, std::uint32_t, std::uint32_t, glm::vec3> s(backend);
            const vp::status status = vp::remesh_sparse(backend, draws, g, s, {.level = level});
            const host_values sparse{to_host(backend, s, status), vp::get<0>(s).to_host(backend),
                                     vp::get<1>(s).to_host(backend), vp::get<2>(s).to_host(backend),
                                     vp::get<3>(s).to_host(backend)};
            EXPECT_GT(sparse.at.size(), 100u);
            EXPECT_TRUE(sparse.has_same_arrays(remesh_with_values(backend, model, g, {.level = level}, {1})));
        }
    }
}
