// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distances as part of the pipeline: fragments, targets, draws, instances, bad input.

#include "distance_support.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace distances {
namespace {

struct position_varyings {
    glm::vec3 position;
};
struct position_shader {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<position_varyings> operator()(const Vertex& v) const {
        return {v.position, {v.position}};
    }
};
// The closest point twice, by varyings and by offset, and the rest of a fragment.
struct everything_shader {
    VOXELPIPE_HD vp::output<glm::vec3, glm::vec3, glm::vec4, glm::vec4>
    operator()(const vp::distance_fragment<position_varyings>& f) const {
        return vp::outputs(f.varyings.position, f.to_closest, glm::vec4(f.normal, static_cast<float>(f.side)),
                           glm::vec4(glm::vec3(f.voxel), f.distance))
            .discard_if(!f.in_band);
    }
};

TEST(DistancePipeline, FragmentsTellTheClosestPoint) {
    const mesh m = solids::sphere({8.0f, 8.25f, 7.75f}, 5.0f, 2);
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid({16, 16, 16});
    vp::framebuffer<vp::cpu_backend, vp::target<glm::vec3, vp::blend::replace>,
                    vp::target<glm::vec3, vp::blend::replace>, vp::target<glm::vec4, vp::blend::replace>,
                    vp::target<glm::vec4, vp::blend::replace>>
        fb(backend, g.extent);
    const vp::status s =
        vp::voxelize_distance(backend, m.view(), g, position_shader{}, everything_shader{}, fb, {.band = 2.5});
    ASSERT_TRUE(s.ok());
    EXPECT_EQ(s.counts.fragments, s.distance.band_samples);
    EXPECT_EQ(s.counts.fragments + s.counts.fragments_discarded, 16u * 16 * 16);
    EXPECT_EQ(s.counts.voxels, s.counts.fragments);
    EXPECT_EQ(s.counts.triangles_drawn, m.triangles.size());
    const auto closest = vp::get<0>(fb).to_host(backend), to = vp::get<1>(fb).to_host(backend);
    const auto normal = vp::get<2>(fb).to_host(backend), place = vp::get<3>(fb).to_host(backend);
    std::uint64_t seen = 0;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) {
                const std::size_t i = solids::index(g.extent, x, y, z);
                if (normal[i] == glm::vec4(0.0f)) continue; // cleared
                ++seen;
                const glm::vec3 centre =
                    glm::vec3(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) + 0.5f;
                for (int k = 0; k < 3; ++k) {
                    ASSERT_NEAR(closest[i][k], centre[k] + to[i][k], 1e-5f);
                    ASSERT_EQ(place[i][k], centre[k] - 0.5f);
                }
                const float distance = place[i].w,
                            along = normal[i].x * to[i].x + normal[i].y * to[i].y + normal[i].z * to[i].z;
                ASSERT_NEAR(std::sqrt(to[i].x * to[i].x + to[i].y * to[i].y + to[i].z * to[i].z), std::abs(distance),
                            1e-6f);
                // On a convex body the sample lies in front of the nearest face iff it is outside.
                ASSERT_EQ(normal[i].w, distance < 0.0f ? -1.0f : 1.0f);
                ASSERT_EQ(along<0.0f, distance> 0.0f);
            }
    EXPECT_EQ(seen, s.counts.fragments);
}

// A shader of its own a draw; the nearest of equals is the lowest primitive, whatever the order.
struct label_shader {
    std::uint32_t label;
    template <class Varyings>
    VOXELPIPE_HD vp::output<std::uint32_t> operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.in_band ? 100 * label + 10 * f.draw + f.instance : 7u);
    }
};

TEST(DistancePipeline, DrawsAndInstancesLabelTheNearestPart) {
    const mesh left = solids::box({1, 1, 1}, {3, 7, 7}), right = solids::box({9, 1, 1}, {11, 7, 7});
    vp::cpu_backend backend(2);
    const vp::grid g = solids::unit_grid({12, 8, 8});
    struct shift {
        VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
            return {v.position.x, v.position.y, v.position.z + 100.0f * static_cast<float>(v.instance)};
        }
    };
    vp::mesh_view<> twice = right.view();
    twice.copies.count = 2;
    const std::vector<vp::draw<vp::mesh_view<>, shift, label_shader>> draws{{left.view(), {}, {1}}, {twice, {}, {2}}};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::add>> fb(backend, g.extent);
    ASSERT_TRUE(vp::voxelize_distance(backend, draws, g, fb, {.band = vp::band::whole}).ok());
    const auto labels = vp::get<0>(fb).to_host(backend);
    for (int x = 0; x < 12; ++x) EXPECT_EQ(labels[solids::index(g.extent, x, 4, 4)], x < 6 ? 100u : 210u) << x;
    // Loads add: the same again doubles.
    vp::get<0>(fb).load();
    ASSERT_TRUE(vp::voxelize_distance(backend, draws, g, fb, {.band = vp::band::whole}).ok());
    EXPECT_EQ(vp::get<0>(fb).to_host(backend)[solids::index(g.extent, 11, 4, 4)], 420u);
}

// Bits, planes and sums: every kind of target has one fragment a sample.
struct kinds_shader {
    template <class Varyings>
    VOXELPIPE_HD vp::output<bool, glm::vec3, float> operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.inside, glm::vec3(f.distance), f.distance);
    }
};
TEST(DistancePipeline, TargetsOfEveryKindGetOneFragmentASample) {
    const mesh m = solids::sphere({18.0f, 8.0f, 8.0f}, 6.5f, 2);
    vp::cpu_backend backend(3);
    const vp::grid g = solids::unit_grid({35, 17, 16});
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_xor>,
                    vp::target<glm::vec3, vp::blend::min, vp::layout::planar>, vp::target<float, vp::blend::add>>
        fb(backend, g.extent);
    const vp::status s = vp::voxelize_distance(backend, m.view(), g, vp::passthrough{}, kinds_shader{}, fb);
    ASSERT_TRUE(s.ok());
    const field f = library_field(m, g);
    const auto sums = vp::get<2>(fb).to_host(backend);
    EXPECT_EQ(sums, f.distances);
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 17; ++y)
            for (int x = 0; x < 35; ++x) {
                const float d = f.distances[f.index(x, y, z)];
                ASSERT_EQ(vp::get<0>(fb).view()(x, y, z), d < 0.0f);
                ASSERT_EQ(vp::get<1>(fb).view()(x, y, z), glm::vec3(std::min(d, vp::get<1>(fb).view().clear_value.x)));
            }
}

TEST(DistancePipeline, BadInputIsCountedOrRefused) {
    const vp::grid g = solids::unit_grid({8, 8, 8});
    mesh m = solids::box({2, 2, 2}, {6, 6, 6});
    const field clean = library_field(m, g);
    // Triangles that are NaN or too far are counted and left out.
    m.add({{{NAN, 0, 0}, {1, 1, 1}, {2, 0, 0}}, {{0, 1, 2}}});
    m.add({{{1e30f, 0, 0}, {1, 1, 1}, {2, 0, 0}}, {{0, 1, 2}}});
    m.add({{{5000, 0, 0}, {5001, 1, 1}, {5002, 0, 0}}, {{0, 1, 2}}});
    const field f = library_field(m, g);
    EXPECT_EQ(f.distances, clean.distances);
    EXPECT_EQ(f.status.counts.triangles_nonfinite, 1u);
    EXPECT_EQ(f.status.counts.triangles_too_far, 1u);
    EXPECT_EQ(f.status.counts.triangles_outside, 1u);
    EXPECT_EQ(f.status.counts.triangles_in, m.triangles.size());

    // An empty mesh gives plus the band everywhere and says so.
    const field empty = library_field(mesh{}, g, {.band = 2.5});
    ASSERT_TRUE(empty.status.nothing_drawn());
    EXPECT_EQ(empty.distances, std::vector<float>(512, 2.5f));
    EXPECT_EQ(empty.nearest, std::vector<std::int64_t>(512, -1));
    EXPECT_EQ(library_field(mesh{}, g, {.band = vp::band::whole}).distances,
              std::vector<float>(512, std::numeric_limits<float>::infinity()));

    const auto code = [&](const vp::distance_options& o) { return library_field(m, g, o).status.code; };
    for (const double width : {0.0, -1.0, static_cast<double>(NAN), static_cast<double>(INFINITY), 1e-60, 1e60})
        EXPECT_EQ(code({.band = width}), vp::status_code::bad_distance_options) << width;
    using enum vp::distance_sign;
    EXPECT_EQ(code({.sign = none, .rule = vp::fill_rule::positive}), vp::status_code::bad_distance_options);
    EXPECT_EQ(code({.sign = none, .repair = vp::repair::vote}), vp::status_code::bad_distance_options);
    EXPECT_EQ(code({.rule = vp::fill_rule::even_odd, .repair = vp::repair::vote}), vp::status_code::bad_solid_options);
    EXPECT_EQ(code({.repair = vp::repair::exterior, .closing = -1}), vp::status_code::bad_solid_options);
    m.triangles.push_back({0, 1, 1000});
    const field bad = library_field(m, g);
    EXPECT_EQ(bad.status.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.status.triangle, m.triangles.size() - 1);

    vp::grid huge = g;
    huge.voxel_size = glm::dvec3(1e40);
    EXPECT_EQ(library_field(m, huge).status.code, vp::status_code::bad_voxel_size);
}

} // namespace
} // namespace distances
