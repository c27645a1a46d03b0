// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Slabs of surfaces: one after the other they are the whole, byte for byte; and what a slab refuses.

#include "slab_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <cmath>

using namespace surface_tests;

namespace {

const std::vector<std::vector<int>> divisions{{17}, {1, 16}, {8, 9}, {16, 1}, {1, 1, 1, 2, 3, 9}, {5, 1, 1, 1, 9}};

template <class T>
void expect_the_whole(const vp::extract_options& o) {
    vp::cpu_backend backend{2};
    std::mt19937 random(4);
    const vp::grid g = grid_of(glm::ivec3(35, 6, 17));
    for (int k = 0; k < 4; ++k) {
        std::vector<float> values = slab_values<T>(random, g.extent, 0.3 + 0.1 * k);
        if (std::is_same_v<T, float>)
            for (std::size_t i = 0; i < values.size(); i += 97) values[i] = std::nanf("");
        host_surface whole;
        if constexpr (std::is_same_v<T, vp::bit>) {
            bit_volume v(g.extent);
            for (std::size_t i = 0; i < values.size(); ++i) v.inside[i] = values[i] != 0;
            whole = extract_bits(backend, v, o);
        } else {
            whole = extract_field(backend, values, g, o);
        }
        ASSERT_TRUE(whole.is_closed_manifold());
        ASSERT_GT(whole.vertices.size(), 1000u);
        for (const std::vector<int>& heights : divisions) {
            const host_surface joined = join_slabs<T>(backend, values, g, heights, o);
            EXPECT_TRUE(joined.has_same_arrays(without_components(whole)));
            EXPECT_EQ(joined.status.surface.made_crossings != 0, (std::is_same_v<T, float>));
        }
    }
}

// The remesh of slabs of these heights, against the whole's.
void expect_the_remesh(const host_mesh& m, const vp::grid& g, const std::vector<int>& heights,
                       const vp::remesh_options& o, const value_shader& shader = {}) {
    vp::cpu_backend backend{2};
    host_values whole = remesh_with_values(backend, m, g, o, shader);
    whole.mesh = without_components(whole.mesh);
    const host_values joined = join_remeshed(backend, m, g, heights, o, shader);
    EXPECT_GT(whole.mesh.vertices.size(), 100u);
    EXPECT_EQ(joined.mesh.vertices, whole.mesh.vertices);
    EXPECT_EQ(joined.mesh.triangles, whole.mesh.triangles);
    EXPECT_EQ(joined.mesh.sources, whole.mesh.sources);
    EXPECT_EQ(joined.mesh.status.surface, whole.mesh.status.surface);
    EXPECT_TRUE(joined.has_same_arrays(whole));
}

} // namespace

TEST(SurfaceSlabs, OfBitsAreTheWhole) {
    expect_the_whole<vp::bit>({});
    expect_the_whole<vp::bit>({.place = vp::place::corner, .quads = true});
}

TEST(SurfaceSlabs, OfFieldsAreTheWhole) { expect_the_whole<float>({.level = 0.1}); }

// Crossings along z are those of all triangles below, cones included.
TEST(SurfaceSlabs, OfRemeshesAreTheWhole) {
    const vp::grid around = grid_around_models(glm::ivec3(24, 23, 27));
    std::uint32_t seed = 0;
    for (const vp::remesh_options& o :
         {vp::remesh_options{}, vp::remesh_options{.rule = vp::fill_rule::even_odd, .quads = true},
          vp::remesh_options{.place = vp::place::mean, .repair = vp::repair::close_holes},
          vp::remesh_options{.repair = vp::repair::vote}, vp::remesh_options{.repair = vp::repair::winding},
          vp::remesh_options{.sample = vp::sample::corner}, vp::remesh_options{.bodies = vp::bodies::draw},
          vp::remesh_options{.level = 0.05},
          vp::remesh_options{.sample = vp::sample::corner, .repair = vp::repair::close_holes, .level = -0.03}}) {
        const int layers = around.extent.z + (o.sample == vp::sample::corner ? 1 : 0);
        for (int k = 0; k < (tests::is_slow_build() ? 1 : 3); ++k) {
            const host_mesh m = bad_model(seed++);
            expect_the_remesh(m, around, {1, 3, 1, 9, layers - 14}, o, value_shader{k == 1 ? 1u : ~0u});
            expect_the_remesh(m, around, {layers}, o);
        }
    }
    // Of a crop, whose vertices have its own cells.
    const vp::grid part = around.crop({2, 1, 4}, {20, 20, 19});
    expect_the_remesh(ball(glm::vec3(0.5f), 0.3f, 2), part, {4, 4, 4, 4, 3}, {});
}

TEST(SurfaceSlabs, OfRemeshesRefuseWhatLooksAtTheWhole) {
    vp::cpu_backend backend{1};
    const host_mesh m = ball(glm::vec3(0.5f), 0.3f, 1);
    const vp::mesh<vp::cpu_backend> mesh{backend, m.positions, m.triangles};
    const vp::grid g = grid_around_models(glm::ivec3(9));
    const auto code = [&](const vp::surface_slab& slab, const vp::remesh_options& o = {}) {
        vp::surface<vp::cpu_backend> s(backend);
        return vp::remesh_slab(backend, mesh, g, vp::passthrough{}, slab, s, o).code;
    };
    constexpr auto bad = vp::status_code::bad_surface_options;
    EXPECT_EQ(code({6, 3}), vp::status_code::ok);
    EXPECT_EQ(code({6, 4}), bad);
    EXPECT_EQ(code({6, 4}, {.sample = vp::sample::corner}), vp::status_code::ok);
    EXPECT_EQ(code({-1, 4}), bad);
    EXPECT_EQ(code({3, 0}), bad);
    EXPECT_EQ(code({3, 3}, {.border = vp::border::open}), bad);
    EXPECT_EQ(code({3, 3}, {.min_component = 2}), bad);
    EXPECT_EQ(code({3, 3}, {.embedded = true}), bad);
    EXPECT_EQ(code({3, 3}, {.repair = vp::repair::exterior}), vp::status_code::crop_without_whole);
    EXPECT_EQ(code({3, 3, 0xfffffff0u}), vp::status_code::too_many_vertices);
}

TEST(SurfaceSlabs, NeedTwoLayersBeyond) {
    vp::surface_slab slab{5, 3};
    EXPECT_EQ(slab.lowest(), 3);
    EXPECT_EQ(slab.needed(20), 7);
    EXPECT_EQ(slab.needed(9), 6);
    slab = {1, 1};
    EXPECT_EQ(slab.lowest(), 0);
    EXPECT_EQ(slab.needed(2), 2);
}

TEST(SurfaceSlabs, RefuseWhatLooksAtTheWhole) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_of(glm::ivec3(4, 4, 9));
    const std::vector<float> values(4 * 4 * 9, 1.0f);
    const auto code = [&](const vp::surface_slab& slab, int layers, const vp::extract_options& o = {}) {
        using field = vp::target<float, vp::blend::replace>;
        std::vector<float> part(values);
        const vp::target_view<field> view{part.data(), glm::ivec3(4, 4, layers)};
        vp::surface<vp::cpu_backend> s(backend);
        return vp::extract_slab(backend, view, g, slab, s, o).code;
    };
    EXPECT_EQ(code({2, 3}, 7), vp::status_code::ok);
    EXPECT_EQ(code({2, 3}, 6), vp::status_code::extent_mismatch);
    EXPECT_EQ(code({2, 8}, 9), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({-1, 3}, 5), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({2, 0}, 4), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({2, 3}, 7, {.border = vp::border::open}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({2, 3}, 7, {.min_component = 1}), vp::status_code::bad_surface_options);
    EXPECT_EQ(code({2, 3}, 7, {.embedded = true}), vp::status_code::bad_surface_options);
    // Indices of the whole have 32 bits.
    vp::surface_slab high{0, 9, 0xfffffffeu};
    std::vector<float> part(values);
    part[17] = -1.0f;
    const vp::target_view<vp::target<float, vp::blend::replace>> view{part.data(), g.extent};
    vp::surface<vp::cpu_backend> s(backend);
    const vp::status status = vp::extract_slab(backend, view, g, high, s);
    EXPECT_EQ(status.code, vp::status_code::too_many_vertices);
    EXPECT_GT(status.surface.vertices, 0xfffffffeu);
}
