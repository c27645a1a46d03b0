// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes, shaders and calls for the tests of distances on a GPU: each call runs on both backends, which must give the
// same bytes and counters.

#include "device_test.hpp"
#include "solid_drawings.hpp"

#include <voxelpipe/distance/device/distance.cuh>

#include <cpu_ref/distance/voxelize_distance.hpp>

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace distance_drawings {

namespace vp = voxelpipe;
using device_test::append;
using device_test::mesh_data;

[[nodiscard]] inline vp::grid unit_grid(const glm::ivec3& extent) { return device_test::box_grid(extent); }

// The thinnest lattice needles, points and segments, with samples beyond their tips.
[[nodiscard]] inline mesh_data needles(const glm::ivec3& extent, int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    mesh_data m;
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    const float step = 1.0f / 4096.0f; // of positions
    for (int i = 0; i < count; ++i) {
        const auto point = [&] { return glm::vec3(unit(random), unit(random), unit(random)) * glm::vec3(extent); };
        const auto lattice = [&](glm::vec3 p) {
            for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] / step) * step;
            return p;
        };
        const glm::vec3 a = lattice(point()), b = lattice(a + (point() - a) * (i % 3 == 0 ? 0.05f : 0.4f));
        glm::vec3 c = lattice(a + (b - a) * unit(random));
        if (i % 4 == 1) c[i % 3] += step;
        if (i % 7 == 2) c = a;
        device_test::add_triangle(m, a, i % 11 == 3 ? a : b, i % 11 == 3 ? a : c);
    }
    return m;
}

// Distance and primitive; -1 beyond the band.
struct nearest_shader {
    template <class Varyings>
    VOXELPIPE_HD vp::output<float, std::int64_t> operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.distance, f.in_band ? std::int64_t{f.primitive} : std::int64_t{-1});
    }
};
// All that a fragment has, and a discard.
struct everything {
    std::uint32_t id;
    float scale;
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto hash = static_cast<std::uint32_t>(f.voxel.x * 73 + f.voxel.y * 179 + f.voxel.z * 283) +
                          1000u * f.draw + id + f.triangle * 7 + f.instance;
        return vp::outputs(scale * f.distance, std::int64_t{f.primitive} * (f.in_band ? 3 : 1) + (f.inside ? 1 : 0),
                           f.in_band, f.barycentric, f.to_closest, f.normal, hash, f.side)
            .discard_if(hash % 13 == 5);
    }
};

template <class Backend>
using one_target = vp::framebuffer<Backend, vp::target<float, vp::blend::replace>>;
template <class Backend>
using two_targets =
    vp::framebuffer<Backend, vp::target<float, vp::blend::replace>, vp::target<std::int64_t, vp::blend::replace>>;
template <class Backend>
using every_target =
    vp::framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::replace>,
                    vp::target<vp::bit, vp::blend::bit_xor, vp::layout::tiled>,
                    vp::target<glm::vec3, vp::blend::add, vp::layout::planar>,
                    vp::target<glm::vec3, vp::blend::replace>,
                    vp::target<glm::vec3, vp::blend::replace, vp::layout::tiled>,
                    vp::target<std::uint32_t, solids_in_order>, vp::target<std::int32_t, vp::blend::max>>;

template <class Framebuffer>
inline constexpr std::size_t num_targets =
    std::remove_cvref_t<decltype(std::declval<Framebuffer&>().view())>::num_targets;

inline void expect_same_status(const vp::status& a, const vp::status& b) {
    ASSERT_EQ(a.code, b.code) << b.message();
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_EQ(a.solid, b.solid);
    EXPECT_EQ(a.distance, b.distance);
}

template <class Backend, class Framebuffer, class Shader>
vp::status draw(Backend& be, const std::vector<mesh_data>& meshes, const vp::grid& g, const Shader& shader,
                Framebuffer& fb, const vp::distance_options& o, bool again) {
    std::vector<vp::mesh<Backend>> on_backend;
    for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
    for (const auto& m : on_backend) draws.push_back({m.view(), {}, shader});
    vp::status s = vp::voxelize_distance(be, draws, g, fb, o);
    if (!s.ok() || !again) return s;
    vp::core::for_each_index<num_targets<Framebuffer>>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
    return vp::voxelize_distance(be, draws, g, fb, o);
}

template <template <class> class Framebuffer, class Shader>
void expect_same(const std::vector<mesh_data>& meshes, const vp::grid& g, const Shader& shader,
                 const vp::distance_options& o, vp::status_code code = vp::status_code::ok) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const glm::ivec3 extent = vp::core::sample_grid(g, o.sample).extent;
    for (const bool again : {false, true}) {
        Framebuffer<vp::cpu_backend> a(cpu, extent);
        Framebuffer<vp::cuda_backend> b(gpu, extent);
        const vp::status expected = draw(cpu, meshes, g, shader, a, o, again);
        expect_same_status(expected, draw(gpu, meshes, g, shader, b, o, again));
        EXPECT_EQ(expected.code, code);
        if (!expected.ok()) return;
        vp::core::for_each_index<num_targets<Framebuffer<vp::cpu_backend>>>([&]<std::size_t I>() {
            const std::string what = "target " + std::to_string(I);
            device_test::expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
        });
    }
}

} // namespace distance_drawings
