// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Surfaces of streams: the pieces of a mesh that comes in chunks, and is drawn slab by slab, are the arrays of one
// call.

#include "stream_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <stdexcept>

using namespace surface_tests;

namespace {

// Two bodies that cross the borders of slabs, one with a hole, and a part above and beside the grid.
host_mesh stream_scene() {
    host_mesh m = ball(glm::vec3(0.45f, 0.5f, 0.55f), 0.37f, 3);
    m.add(box(glm::vec3(0.1f, 0.2f, 0.05f), glm::vec3(0.9f, 0.4f, 0.95f)));
    m.add(ball(glm::vec3(-0.6f, 0.5f, 1.5f), 0.3f, 2));
    m.triangles.erase(m.triangles.begin() + 31);
    return m;
}

// The pieces of every way to cut, against one call; slow builds take one way. how: of the draws.
template <class Options>
void expect_every_cut(const host_mesh& m, const vp::grid& g, const vp::extract_options& o, const Options& how) {
    vp::cpu_backend backend{2};
    const host_surface whole = without_components(extract_drawn(backend, m, g, o, how));
    EXPECT_TRUE(whole.status.ok()) << whole.status.message();
    EXPECT_GT(whole.vertices.size(), 500u);
    for (const int num_slabs : {5, 1, 2, g.extent.z}) {
        if (tests::is_slow_build() && num_slabs != 5) break;
        const streamed_surface found = stream_surface(backend, m, g, o, how, {.num_slabs = num_slabs});
        EXPECT_TRUE(found.surface.status.ok()) << found.surface.status.message();
        EXPECT_TRUE(found.surface.has_same_arrays(whole)) << num_slabs << " slabs";
        EXPECT_EQ(found.surface.status.counts, whole.status.counts);
        EXPECT_EQ(found.surface.status.solid, whole.status.solid);
        EXPECT_EQ(found.pieces, num_slabs == g.extent.z ? num_slabs - 2 : num_slabs);
    }
    if (tests::is_slow_build()) return;
    // So little memory that slabs are cut to single layers, and no further.
    const streamed_surface cut =
        stream_surface(backend, m, g, o, how, {.memory = 4'000, .num_slabs = 1, .voxel_bytes = 8});
    EXPECT_TRUE(cut.surface.has_same_arrays(whole));
    EXPECT_EQ(cut.pieces, g.extent.z - 2);
}

} // namespace

TEST(StreamedSurfaces, OfSolidsAreTheWhole) {
    const host_mesh m = stream_scene();
    const vp::grid g = grid_around_models(glm::ivec3(37, 30, 33));
    for (const vp::repair repair :
         {vp::repair::none, vp::repair::close_holes, vp::repair::vote, vp::repair::exterior, vp::repair::winding}) {
        vp::solid_options how;
        how.repair = repair;
        expect_every_cut(m, g, {}, how);
    }
    vp::solid_options even_odd;
    even_odd.rule = vp::fill_rule::even_odd;
    expect_every_cut(m, g.crop({3, 2, 4}, {30, 25, 21}), {.place = vp::place::corner, .quads = true}, even_odd);
}

TEST(StreamedSurfaces, OfDistancesAreTheWhole) {
    const host_mesh m = stream_scene();
    const vp::grid g = grid_around_models(glm::ivec3(24, 22, 25));
    expect_every_cut(m, g, {}, vp::distance_options{});
    expect_every_cut(m, g, {.level = 0.05}, vp::distance_options{.repair = vp::repair::close_holes});
    expect_every_cut(m, g, {.level = -0.04, .quads = true}, vp::distance_options{.band = vp::band::whole});
    expect_every_cut(m, g, {.level = 0.03}, vp::distance_options{.sign = vp::distance_sign::none});
}

TEST(StreamedSurfaces, OfNothingAreEmpty) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_around_models(glm::ivec3(6));
    const streamed_surface solid = stream_surface(backend, {}, g, {}, vp::solid_options{}, {.num_slabs = 2}),
                           level = stream_surface(backend, {}, g, {.level = 0.2}, vp::distance_options{}, {});
    for (const streamed_surface* s : {&solid, &level}) {
        EXPECT_TRUE(s->surface.status.ok());
        EXPECT_TRUE(s->surface.vertices.empty());
        EXPECT_GT(s->pieces, 0);
    }
}

TEST(StreamedSurfaces, RefuseWhatTheyCannot) {
    vp::cpu_backend backend{1};
    const host_mesh m = ball(glm::vec3(0.5f), 0.3f, 1);
    const vp::grid g = grid_around_models(glm::ivec3(9));
    const auto code = [&](const vp::extract_options& o, int axis = 2) {
        return stream_surface(backend, m, g, o, vp::solid_options{}, {.num_slabs = 2}, axis).surface.status.code;
    };
    constexpr auto bad = vp::status_code::bad_surface_options;
    EXPECT_EQ(code({}), vp::status_code::ok);
    EXPECT_EQ(code({.level = 0.1}), bad);
    EXPECT_EQ(code({.border = vp::border::open}), bad);
    EXPECT_EQ(code({.min_component = 2}), bad);
    EXPECT_EQ(code({.embedded = true}), bad);
    EXPECT_EQ(code({}, 1), vp::status_code::bad_crop);
    // What the sink throws reaches the caller.
    vp::slabs::stream stream(backend, g, vp::passthrough{}, {.is_solid = true});
    stream.add({m.positions, m.triangles}).or_throw();
    const auto sink = [](const auto&, const auto&) { throw std::runtime_error("full"); };
    EXPECT_THROW((void)vp::slabs::extract_solid(stream, sink), std::runtime_error);
}

// Layers that a program draws itself.
TEST(SurfaceLayers, TakeWhatFits) {
    vp::cpu_backend backend{1};
    const vp::grid g = grid_of(glm::ivec3(3, 3, 6));
    using field = vp::target<float, vp::blend::replace>;
    std::vector<float> values(3 * 3 * 6, 1.0f);
    values[4] = -1.0f;
    values[4 + 9 * 3] = std::nanf("");
    int pieces = 0;
    const auto sink = [&](const vp::surface_slab& slab, const auto& s) {
        ++pieces;
        EXPECT_EQ(s.samples, g);
        EXPECT_EQ(s.vertices.size(), slab.first == 0 ? 8u : 0u);
    };
    vp::surface_layers<vp::cpu_backend, float> layers(backend, g);
    const auto add = [&](const glm::ivec3& extent) {
        return layers.add(vp::target_view<field>{values.data() + 9 * layers.num_layers(), extent}, sink).code;
    };
    EXPECT_EQ(add({3, 3, 2}), vp::status_code::ok); // none is complete
    EXPECT_EQ(pieces, 0);
    EXPECT_EQ(add({3, 3, 5}), vp::status_code::extent_mismatch);
    EXPECT_EQ(add({3, 2, 1}), vp::status_code::extent_mismatch);
    EXPECT_EQ(add({3, 3, 0}), vp::status_code::extent_mismatch);
    EXPECT_EQ(layers.add(vp::target_view<field>{nullptr, {3, 3, 1}}, sink).code, vp::status_code::null_view);
    EXPECT_EQ(layers.num_layers(), 2);
    EXPECT_EQ(add({3, 3, 3}), vp::status_code::ok);
    EXPECT_EQ(pieces, 1);
    EXPECT_EQ(layers.counts().nan_samples, 0u); // in a layer that is not complete
    EXPECT_EQ(add({3, 3, 1}), vp::status_code::ok);
    EXPECT_EQ(pieces, 2);
    EXPECT_EQ(layers.counts().nan_samples, 1u);
    EXPECT_EQ(layers.counts().vertices, 8u);
    EXPECT_EQ(add({3, 3, 1}), vp::status_code::extent_mismatch);
}
