// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Slabs of surfaces: one after the other they are the whole, byte for byte; and what a slab refuses.

#include "slab_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

using namespace surface_tests;

namespace {

const std::vector<std::vector<int>> divisions{{17}, {1, 16}, {8, 9}, {16, 1}, {1, 1, 1, 2, 3, 9}, {5, 1, 1, 1, 9}};

template <class T>
void expect_the_whole(const vp::extract_options& o) {
    vp::cpu_backend backend{2};
    std::mt19937 random(4);
    const vp::grid g = grid_of(glm::ivec3(35, 6, 17));
    for (int k = 0; k < 4; ++k) {
        const std::vector<float> values = slab_values<T>(random, g.extent, 0.3 + 0.1 * k);
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
            EXPECT_TRUE(joined.status.ok());
            EXPECT_EQ(joined.vertices, whole.vertices);
            EXPECT_EQ(joined.triangles, whole.triangles);
            EXPECT_EQ(joined.quads, whole.quads);
        }
    }
}

} // namespace

TEST(SurfaceSlabs, OfBitsAreTheWhole) {
    expect_the_whole<vp::bit>({});
    expect_the_whole<vp::bit>({.place = vp::place::corner, .quads = true});
}

TEST(SurfaceSlabs, OfFieldsAreTheWhole) { expect_the_whole<float>({.level = 0.1}); }

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
