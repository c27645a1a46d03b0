// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes, shaders and calls for the tests of distances on a GPU: each call runs on both backends, which must give the
// same bytes and counters.

#include "device_test.hpp"
#include "solid_drawings.hpp"

#include <voxelpipe/distance/device/distance_at.cuh>
#include <voxelpipe/distance/device/sparse_distance.cuh>

#include <cpu_ref/distance/distance_at.hpp>
#include <cpu_ref/distance/sparse_distance.hpp>

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
// For sparse framebuffers, with a discard.
struct sparse_shader {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        return vp::outputs(f.distance, f.primitive, f.inside).discard_if(f.voxel.x % 7 == 3 && f.voxel.y % 3 == 1);
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
    if constexpr (requires { fb.view().targets; })
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

// Everything of a sparse framebuffer, after a call and after one that loads what it left.
inline void expect_same_bricks(const std::vector<mesh_data>& meshes, const vp::grid& g, const vp::distance_options& o) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const glm::ivec3 extent = vp::core::sample_grid(g, o.sample).extent;
    using float_target = vp::target<float, vp::blend::add>;
    using id_target = vp::target<std::uint32_t, vp::blend::max>;
    using bit_target = vp::target<vp::bit, vp::blend::bit_or>;
    vp::sparse_framebuffer<vp::cpu_backend, float_target, id_target, bit_target> a(cpu, extent);
    vp::sparse_framebuffer<vp::cuda_backend, float_target, id_target, bit_target> b(gpu, extent);
    for (const bool again : {false, true}) {
        const vp::status expected = draw(cpu, meshes, g, sparse_shader{}, a, o, false);
        expect_same_status(expected, draw(gpu, meshes, g, sparse_shader{}, b, o, false));
        ASSERT_TRUE(expected.ok()) << expected.message();
        const auto x = a.to_host(cpu);
        const auto y = b.to_host(gpu);
        EXPECT_GT(x.keys.size(), 0u);
        device_test::expect_same_bytes(x.keys, y.keys, "keys");
        device_test::expect_same_bytes(x.masks, y.masks, "masks");
        device_test::expect_same_bytes(x.offsets, y.offsets, "offsets");
        vp::core::for_each_index<3>([&]<std::size_t I>() {
            device_test::expect_same_bytes(vp::get<I>(x.values), vp::get<I>(y.values), again ? "loaded" : "cleared");
            vp::get<I>(a).load();
            vp::get<I>(b).load();
        });
    }
}

// Points in and around the grid, at vertices, not finite and far away.
inline void expect_same_points(const std::vector<mesh_data>& meshes, const vp::grid& g, int count,
                               const vp::distance_options& o) {
    std::mt19937 random(17);
    std::uniform_real_distribution<float> unit(-0.3f, 1.3f);
    std::vector<glm::vec3> points;
    for (int i = 0; i < count; ++i) {
        glm::vec3 p = glm::vec3(unit(random), unit(random), unit(random)) * glm::vec3(g.extent);
        if (i % 5 == 0) p = glm::round(p * 2.0f) * 0.5f;
        if (i % 31 == 3) p.y = std::numeric_limits<float>::quiet_NaN();
        if (i % 31 == 7) p.x = 1e30f;
        if (i % 31 == 9) p *= 1000.0f;
        points.push_back(p);
    }
    for (const mesh_data& m : meshes)
        for (std::size_t i = 0; i < m.positions.size(); i += 7) points.push_back(m.positions[i]);
    const auto run = [&](auto& be, std::vector<float>& distances, std::vector<std::int64_t>& nearest) {
        using backend = std::remove_cvref_t<decltype(be)>;
        std::vector<vp::mesh<backend>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
        using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::distance>;
        std::vector<draw_type> draws;
        for (const auto& m : on_backend) draws.push_back({m.view(), {}, {}});
        using points_view = vp::array_view<const glm::vec3>;
        const typename backend::template buffer<glm::vec3> at(be, points_view(points.data(), points.size()));
        typename backend::template buffer<float> d(be, points.size());
        typename backend::template buffer<std::int64_t> n(be, points.size());
        const vp::status s =
            vp::distance_at(be, std::span<const draw_type>(draws), g, at.view(), {d.data(), n.data()}, o);
        distances = d.to_host(be);
        nearest = n.to_host(be);
        return s;
    };
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    std::vector<float> x, y;
    std::vector<std::int64_t> nx, ny;
    const vp::status expected = run(cpu, x, nx);
    expect_same_status(expected, run(gpu, y, ny));
    ASSERT_TRUE(expected.ok()) << expected.message();
    device_test::expect_same_bytes(x, y, "distances");
    device_test::expect_same_bytes(nx, ny, "nearest");
}

} // namespace distance_drawings
