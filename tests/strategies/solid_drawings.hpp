// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes and drawings for the tests of solids on a GPU: each drawing runs on both backends, which must give the same
// bytes and counters.

#include "device_test.hpp"

#include <voxelpipe/solid/device/solid_async.cuh>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <string>
#include <vector>

// Tells the order of fragments.
struct solids_in_order {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 7; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return a * 31u + b; }
};

namespace device_test {

// ---- meshes ---------------------------------------------------------------------------------------------------------

inline void add_quad(mesh_data& m, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d, bool is_inverted) {
    add_triangle(m, a, is_inverted ? c : b, is_inverted ? b : c);
    add_triangle(m, a, is_inverted ? d : c, is_inverted ? c : d);
}
// A box, its fronts outside.
inline void add_box(mesh_data& m, glm::vec3 lo, glm::vec3 hi, bool is_inverted = false) {
    const auto corner = [&](int i) {
        return glm::vec3((i & 1) != 0 ? hi.x : lo.x, (i & 2) != 0 ? hi.y : lo.y, (i & 4) != 0 ? hi.z : lo.z);
    };
    const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : faces) add_quad(m, corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]), is_inverted);
}
inline void add_octahedron(mesh_data& m, glm::vec3 centre, float radius, bool is_inverted = false) {
    for (int i = 0; i < 8; ++i) {
        const glm::vec3 s((i & 1) != 0 ? -1.0f : 1.0f, (i & 2) != 0 ? -1.0f : 1.0f, (i & 4) != 0 ? -1.0f : 1.0f);
        const glm::vec3 x = centre + glm::vec3(s.x * radius, 0, 0), y = centre + glm::vec3(0, s.y * radius, 0),
                        z = centre + glm::vec3(0, 0, s.z * radius);
        const bool swap = (s.x * s.y * s.z < 0) != is_inverted;
        add_triangle(m, x, swap ? z : y, swap ? y : z);
    }
}
// Boxes and octahedra with corners on multiples of half a voxel, so that faces, edges and corners meet centres; some
// are inside out, some stand twice, some overlap, some reach out of the grid.
inline mesh_data tied_bodies(float size, int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    mesh_data m;
    const auto half_voxels = [&](float low, float high) {
        return std::round(std::uniform_real_distribution<float>(2 * low, 2 * high)(random)) / 2;
    };
    for (int i = 0; i < count; ++i) {
        const glm::vec3 at(half_voxels(-0.2f * size, size), half_voxels(-0.2f * size, size),
                           half_voxels(-0.2f * size, size));
        const bool is_inverted = i % 4 == 3;
        for (int twice = 0; twice < (i % 11 == 10 ? 2 : 1); ++twice) {
            if (i % 2 == 0)
                add_box(m, at,
                        at + glm::vec3(half_voxels(0.5f, 0.4f * size), half_voxels(0.5f, 0.4f * size),
                                       half_voxels(0.5f, 0.4f * size)),
                        is_inverted);
            else
                add_octahedron(m, at, half_voxels(0.5f, 0.4f * size), is_inverted);
        }
    }
    return m;
}
// A closed ball of many triangles.
inline mesh_data ball(glm::vec3 centre, float radius, int rings) {
    mesh_data m;
    const int sides = 2 * rings;
    const auto point = [&](int ring, int side) {
        if (ring == 0) return centre + glm::vec3(0, 0, radius);
        if (ring == rings) return centre - glm::vec3(0, 0, radius);
        const float a = 3.14159265f * static_cast<float>(ring) / static_cast<float>(rings),
                    b = 6.2831853f * static_cast<float>(side % sides) / static_cast<float>(sides);
        return centre + radius * glm::vec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    };
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < sides; ++s) {
            if (r != 0) add_triangle(m, point(r, s), point(r + 1, s), point(r, s + 1));
            if (r + 1 != rings) add_triangle(m, point(r, s + 1), point(r + 1, s), point(r + 1, s + 1));
        }
    return m;
}

// ---- what is drawn --------------------------------------------------------------------------------------------------

// All that a solid's fragment has, and a discard.
struct everything {
    std::uint32_t id;
    float scale;
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto hash =
            static_cast<std::uint32_t>(f.voxel.x * 73 + f.voxel.y * 179 + f.voxel.z * 283) + 1000u * f.draw + id;
        return vp::outputs(scale * static_cast<float>(f.voxel.x - f.voxel.z), f.winding, hash, (hash & 3u) != 0,
                           glm::vec3(static_cast<float>(f.winding), static_cast<float>(f.draw), scale), hash, hash,
                           static_cast<std::int32_t>(f.winding))
            .discard_if(hash % 13 == 5);
    }
};
template <class Backend>
using everything_targets =
    vp::framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::replace>,
                    vp::target<std::uint32_t, vp::blend::min, vp::layout::tiled>,
                    vp::target<vp::bit, vp::blend::bit_xor, vp::layout::tiled>,
                    vp::target<glm::vec3, vp::blend::add, vp::layout::planar>,
                    vp::target<std::uint32_t, solids_in_order>, vp::target<std::uint16_t, vp::blend::count>,
                    vp::target<std::int32_t, vp::blend::max>>;
template <class Backend>
using bit_target = vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>>;

enum class loading { clear, load, some_off };

template <template <class> class Framebuffer, class VertexShader, class SolidShader>
struct drawing {
    std::vector<mesh_data> meshes;
    std::vector<VertexShader> vertex_shaders;
    std::vector<SolidShader> shaders;

    template <class Backend>
    vp::status draw(Backend& be, Framebuffer<Backend>& fb, const vp::grid& g, const vp::solid_options& options,
                    loading how) const {
        std::vector<vp::mesh<Backend>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
        using draw_type = vp::draw<vp::mesh_view<>, VertexShader, SolidShader>;
        std::vector<draw_type> draws;
        for (std::size_t i = 0; i < meshes.size(); ++i)
            draws.push_back(
                {on_backend[i].view(), vertex_shaders[i % vertex_shaders.size()], shaders[i % shaders.size()]});
        vp::status s = vp::voxelize_solid(be, draws, g, fb, options);
        if (!s.ok() || how == loading::clear) return s;
        vp::core::for_each_index<Framebuffer<Backend>::view_type::num_targets>([&]<std::size_t I>() {
            if (how == loading::some_off && I % 2 == 1)
                vp::get<I>(fb).off();
            else
                vp::get<I>(fb).load();
        });
        if (draws.size() > 1) draws.pop_back(); // other values than those that are there
        return vp::voxelize_solid(be, draws, g, fb, options);
    }
    void expect_same(const vp::grid& g, const vp::solid_options& options, loading how = loading::clear) const {
        vp::cpu_backend cpu;
        vp::cuda_backend gpu;
        Framebuffer<vp::cpu_backend> a{cpu, g.extent};
        Framebuffer<vp::cuda_backend> b{gpu, g.extent};
        const vp::status sa = draw(cpu, a, g, options, how), sb = draw(gpu, b, g, options, how);
        ASSERT_TRUE(sa.ok()) << sa.message();
        ASSERT_TRUE(sb.ok()) << sb.message();
        EXPECT_NE(sa.solid.crossings + sa.counts.fragments, 0u); // not of nothing
        expect_same_counts(sa.counts, sb.counts);
        EXPECT_EQ(sa.solid, sb.solid) << "open rows " << sa.solid.open_rows << " " << sb.solid.open_rows
                                      << ", crossings " << sa.solid.crossings << " " << sb.solid.crossings
                                      << ", winding " << sa.solid.max_winding << " " << sb.solid.max_winding;
        vp::core::for_each_index<Framebuffer<vp::cpu_backend>::view_type::num_targets>([&]<std::size_t I>() {
            const std::string what = "target " + std::to_string(I);
            expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
        });
    }
};
using drawing_of_everything = drawing<everything_targets, shift, everything>;
using drawing_of_bits = drawing<bit_target, vp::passthrough, vp::constant_output<bool>>;

inline constexpr vp::fill_rule all_rules[] = {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive};
inline constexpr vp::bodies all_bodies[] = {vp::bodies::call, vp::bodies::draw};
inline constexpr vp::solid_extent all_extents[] = {vp::solid_extent::centre, vp::solid_extent::outer,
                                                   vp::solid_extent::inner};

template <class F>
inline void for_all_options(F&& f) {
    for (const auto rule : all_rules)
        for (const auto of : all_bodies)
            for (const auto extent : all_extents) {
                SCOPED_TRACE("rule " + std::to_string(static_cast<int>(rule)) + ", bodies " +
                             std::to_string(static_cast<int>(of)) + ", extent " +
                             std::to_string(static_cast<int>(extent)));
                f(vp::solid_options{.rule = rule, .bodies = of, .extent = extent});
            }
}

// Three draws that overlap: bodies with ties, a ball, and triangles that close nothing, NaN and far ones among them.
inline std::vector<mesh_data> three_meshes() {
    return {tied_bodies(24.0f, 12, 5), ball({14.3f, 11.2f, 12.7f}, 9.4f, 7), mixed_triangles(300, 24.0f, 3)};
}

struct id_of_fragment {
    std::uint32_t id;
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto hash = static_cast<std::uint32_t>(f.voxel.x * 3 + f.voxel.y * 5 + f.voxel.z * 7 + f.winding) + id;
        return vp::outputs(hash * 16 + f.draw).discard_if(hash % 7 == 3);
    }
};

template <class Payload, class SolidShader>
inline void expect_same_lists(const std::vector<mesh_data>& meshes, const SolidShader& shader, const vp::grid& g,
                              const vp::solid_options& options) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::abuffer<vp::cpu_backend, Payload> a{cpu};
    vp::abuffer<vp::cuda_backend, Payload> b{gpu};
    const auto draw = [&](auto& be, auto& lists) {
        using backend = std::remove_cvref_t<decltype(be)>;
        std::vector<vp::mesh<backend>> on_backend;
        for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
        std::vector<vp::draw<vp::mesh_view<>, shift, SolidShader>> draws;
        for (const auto& m : on_backend) draws.push_back({m.view(), {0.125f}, shader});
        return vp::voxelize_solid(be, draws, g, lists, options);
    };
    const vp::status sa = draw(cpu, a), sb = draw(gpu, b);
    ASSERT_TRUE(sa.ok()) << sa.message();
    ASSERT_TRUE(sb.ok()) << sb.message();
    expect_same_counts(sa.counts, sb.counts);
    EXPECT_EQ(sa.solid, sb.solid);
    expect_same_on_host(a.to_host(cpu), b.to_host(gpu));
}

// Without every n-th triangle.
inline mesh_data with_holes(mesh_data m, std::size_t n) {
    std::vector<glm::uvec3> kept;
    for (std::size_t i = 0; i < m.triangles.size(); ++i)
        if (i % n != n - 1) kept.push_back(m.triangles[i]);
    m.triangles = kept;
    return m;
}
// The same with vertices that neighbours share.
inline mesh_data welded(const mesh_data& m) {
    mesh_data w;
    for (const glm::uvec3& t : m.triangles) {
        glm::uvec3 to;
        for (int k = 0; k < 3; ++k) {
            const auto at = std::find(w.positions.begin(), w.positions.end(), m.positions[t[k]]);
            to[k] = static_cast<std::uint32_t>(at - w.positions.begin());
            if (at == w.positions.end()) w.positions.push_back(m.positions[t[k]]);
        }
        w.triangles.push_back(to);
    }
    return w;
}
// Two broken balls and broken boxes; the first one's vertices are shared.
inline std::vector<mesh_data> broken_meshes() {
    return {welded(with_holes(ball({14.3f, 11.2f, 12.7f}, 9.4f, 7), 9)),
            with_holes(ball({20.0f, 13.5f, 10.0f}, 6.1f, 5), 11), with_holes(tied_bodies(24.0f, 7, 5), 13)};
}

} // namespace device_test
