// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Surfaces on the device: the bytes and counters of cpu_backend.

#include "../surfaces/slab_support.hpp"
#include "../surfaces/sparse_support.hpp"
#include "../surfaces/stream_support.hpp"
#include "../surfaces/value_support.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/surfaces/device/sparse_surfaces.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <utility>

using namespace surface_tests;

namespace {

void expect_same(const host_mesh& m, const vp::grid& g, const vp::remesh_options& o) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const host_surface a = remesh(gpu, m, g, o), b = remesh(cpu, m, g, o);
    EXPECT_TRUE(a.status.ok()) << a.status.message();
    EXPECT_TRUE(a.has_same_arrays(b)) << a.vertices.size() << " and " << b.vertices.size() << " vertices";
    EXPECT_TRUE(a.is_closed_manifold());
    EXPECT_EQ(a.status.counts, b.status.counts);
    EXPECT_EQ(a.status.solid, b.status.solid);
}

} // namespace

TEST(DeviceSurfaces, OfBitsHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    std::mt19937 random(1);
    for (int k = 0; k < 12; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(3 + 9 * (k % 5), 4 + k, 7), 0.3 + 0.04 * k);
        for (const vp::extract_options& o :
             {vp::extract_options{}, vp::extract_options{.place = vp::place::corner, .quads = true},
              vp::extract_options{.border = vp::border::open, .min_component = 12, .embedded = true}}) {
            const host_surface a = extract_bits(gpu, v, o), b = extract_bits(cpu, v, o);
            EXPECT_TRUE(a.status.ok());
            EXPECT_TRUE(a.has_same_arrays(b)) << k;
        }
    }
}

// Rows of more than 32 words, rows that end with a word, several blocks of words, and blocks with so many vertices that
// they are not joined in shared memory; surfaces of one block and of none.
TEST(DeviceSurfaces, OfBitsOfManyWordsHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    std::mt19937 random(11);
    std::uint64_t components = 0;
    for (const auto& [extent, density] :
         {std::pair{glm::ivec3(1100, 4, 5), 0.02}, std::pair{glm::ivec3(1024, 3, 4), 0.1},
          std::pair{glm::ivec3(2049, 2, 1), 0.5}, std::pair{glm::ivec3(64, 20, 19), 0.5},
          std::pair{glm::ivec3(96, 24, 17), 0.97}, std::pair{glm::ivec3(33, 9, 8), 0.0}}) {
        const bit_volume v = random_volume(random, extent, density);
        for (const vp::extract_options& o :
             {vp::extract_options{}, vp::extract_options{.place = vp::place::sharp, .quads = true}}) {
            const host_surface a = extract_bits(gpu, v, o), b = extract_bits(cpu, v, o);
            EXPECT_TRUE(a.status.ok());
            EXPECT_TRUE(a.has_same_arrays(b)) << extent.x;
            components += a.status.surface.components;
        }
    }
    EXPECT_GT(components, 500u);
}

TEST(DeviceSurfaces, OfFieldsHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    std::mt19937 random(2);
    const vp::grid g = grid_of(glm::ivec3(37, 9, 8));
    std::vector<float> values(37 * 9 * 8);
    for (float& f : values) f = static_cast<float>(random() % 2001) / 1000.0f - 1.0f;
    values[77] = std::nanf("");
    values[200] = -INFINITY;
    for (const double level : {0.0, 0.3}) {
        const host_surface a = extract_field(gpu, values, g, {.level = level}),
                           b = extract_field(cpu, values, g, {.level = level});
        EXPECT_TRUE(a.status.ok());
        EXPECT_TRUE(a.has_same_arrays(b));
        EXPECT_EQ(a.status.surface.nan_samples, 1u);
    }
}

TEST(DeviceSurfaces, OfBadModelsHaveTheBytesOfTheCpu) {
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
        const host_mesh m = bad_model(seed);
        const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
        expect_same(m, g, {});
        expect_same(m, g, {.place = vp::place::mean, .rule = vp::fill_rule::even_odd, .quads = true});
        expect_same(m, g, {.repair = vp::repair::close_holes});
        if (seed < 2) {
            expect_same(m, g, {.repair = vp::repair::exterior, .min_component = 9});
            expect_same(m, g, {.place = vp::place::corner, .repair = vp::repair::vote});
            expect_same(m, g, {.repair = vp::repair::winding});
            expect_same(m, g, {.sample = vp::sample::corner, .bodies = vp::bodies::draw});
            expect_same(m, g, {.level = 0.05});
            expect_same(m, g, {.min_component = 9, .embedded = true});
        }
    }
}

TEST(DeviceSurfaces, EmbeddedOnesHaveTheBytesOfTheCpu) {
    std::uint64_t rounds = 0;
    for (std::uint32_t seed = 0; seed < 2; ++seed) {
        const host_mesh m = needles(seed);
        const vp::grid g = grid_around_models(glm::ivec3(13, 12, 14));
        expect_same(m, g, {.embedded = true});
        expect_same(m, g, {.quads = true, .embedded = true});
        vp::cuda_backend gpu;
        rounds += remesh(gpu, m, g, {.embedded = true}).status.surface.embed_rounds;
    }
    EXPECT_GT(rounds, 0u);
}

TEST(DeviceSurfaces, SlabsHaveTheBytesOfTheWhole) {
    vp::cuda_backend gpu;
    std::mt19937 random(4);
    const vp::grid g = grid_of(glm::ivec3(35, 5, 13));
    const std::vector<float> values = slab_values<float>(random, g.extent, 0.4);
    for (const vp::extract_options& o : {vp::extract_options{}, vp::extract_options{.quads = true}}) {
        const host_surface whole = extract_field(gpu, values, g, o),
                           joined = join_slabs<float>(gpu, values, g, {1, 5, 1, 6}, o);
        EXPECT_TRUE(joined.status.ok());
        EXPECT_EQ(joined.vertices, whole.vertices);
        EXPECT_EQ(joined.triangles, whole.triangles);
        EXPECT_EQ(joined.quads, whole.quads);
    }
}

TEST(DeviceSurfaces, RemeshedSlabsHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const host_mesh m = bad_model(2);
    const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
    for (const vp::remesh_options& o :
         {vp::remesh_options{.repair = vp::repair::close_holes}, vp::remesh_options{.level = 0.05}}) {
        host_values whole = remesh_with_values(cpu, m, g, o);
        whole.mesh = without_components(whole.mesh);
        EXPECT_GT(whole.at.size(), 50u);
        EXPECT_TRUE(join_remeshed(gpu, m, g, {1, 8, 2, 8}, o).has_same_arrays(whole));
    }
}

TEST(DeviceSurfaces, StreamedOnesHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const host_mesh m = ball(glm::vec3(0.5f), 0.37f, 2);
    const vp::grid g = grid_around_models(glm::ivec3(35, 12, 14));
    const auto expect_stream = [&](const vp::extract_options& o, const auto& how) {
        const host_surface whole = without_components(extract_drawn(cpu, m, g, o, how));
        EXPECT_GT(whole.vertices.size(), 200u);
        const streamed_surface found = stream_surface(gpu, m, g, o, how, {.num_slabs = 5});
        EXPECT_TRUE(found.surface.has_same_arrays(whole)) << found.surface.status.message();
        EXPECT_EQ(found.pieces, 4); // the two layers of the first slab wait
    };
    expect_stream({}, vp::solid_options{});
    expect_stream({.level = 0.03}, vp::distance_options{});
}

TEST(DeviceSurfaces, ValuesHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    for (std::uint32_t seed = 0; seed < 2; ++seed) {
        const host_mesh m = bad_model(seed);
        const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
        for (const vp::remesh_options& o :
             {vp::remesh_options{},
              vp::remesh_options{.repair = vp::repair::exterior, .closing = 1, .min_component = 9},
              vp::remesh_options{.repair = vp::repair::close_holes}, vp::remesh_options{.level = 0.05}}) {
            const host_values a = remesh_with_values(gpu, m, g, o, {1}), b = remesh_with_values(cpu, m, g, o, {1});
            EXPECT_TRUE(a.mesh.status.ok()) << a.mesh.status.message();
            EXPECT_GT(a.at.size(), 20u);
            EXPECT_TRUE(a.has_same_arrays(b));
        }
    }
}

TEST(DeviceSurfaces, OfBricksHaveTheBytesOfTheCpu) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    vp::grid whole = grid_of(glm::ivec3(50, 47, 45));
    const vp::grid g = whole.crop(glm::ivec3(5, 8, 3), glm::ivec3(45, 39, 42));
    const auto at = [&](double x, double y, double z) { return glm::vec3(g.to_world(glm::dvec3(x, y, z))); };
    host_mesh m = box(at(3, 8, 13), at(35, 24, 29)); // tiles of 8 and 16 voxels at its faces
    m.add(ball(at(22, 30, 30), 9.0f, 2));
    for (const vp::extract_options& o :
         {vp::extract_options{}, vp::extract_options{.border = vp::border::open, .quads = true, .min_component = 9}}) {
        const both_surfaces a = extract_solid(gpu, m, g, o), b = extract_solid(cpu, m, g, o);
        EXPECT_TRUE(a.are_the_same());
        EXPECT_TRUE(a.sparse.has_same_arrays(b.sparse));
        EXPECT_GT(a.tiles, 2u);
        EXPECT_GT(a.sparse.vertices.size(), 2000u);
    }
    std::mt19937 random(6);
    const bit_volume v = random_volume(random, g.extent, 0.02);
    EXPECT_TRUE(extract_solid(gpu, cubes(v, g), g).are_the_same());
}

TEST(DeviceSurfaces, RemeshedInBricksHaveTheBytesOfTheGrid) {
    vp::cuda_backend gpu;
    for (std::uint32_t seed = 0; seed < 3; ++seed) {
        const host_mesh m = bad_model(seed);
        const vp::grid g = grid_around_models(glm::ivec3(18, 21, 19));
        for (const vp::remesh_options& o :
             {vp::remesh_options{}, vp::remesh_options{.repair = vp::repair::close_holes, .embedded = true},
              vp::remesh_options{.sample = vp::sample::corner, .repair = vp::repair::exterior, .quads = true},
              vp::remesh_options{.level = 0.05}, vp::remesh_options{.level = -0.05}}) {
            const host_surface a = remesh_sparse(gpu, m, g, o), b = remesh(gpu, m, g, o);
            EXPECT_TRUE(a.status.ok()) << a.status.message();
            EXPECT_TRUE(a.has_same_arrays(b)) << seed << " " << o.level;
            EXPECT_EQ(a.status.solid, b.status.solid);
        }
    }
}
