// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Programs and calls that the tests of tessellation and geometry programs share, on either backend.

#include "api_model.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <vector>

namespace programs {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;

struct surface {
    glm::vec3 normal;
    glm::vec2 uv;
};
using vertex = vp::vertex_output<surface>;

// A normal and texture coordinates for a mesh without attributes.
struct add_surface {
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        const float i = static_cast<float>(v.index % 7) - 3.0f, j = static_cast<float>(v.index % 5) - 2.0f;
        return vp::vertex_output{v.position, surface{{vp::exact::div(i, 4.0f), vp::exact::div(j, 3.0f), 0.5f},
                                                     {vp::exact::div(i, 7.0f), v.position.y}}};
    }
};

// Edges as long as `step`, displaced along the normal by a function of the position.
struct waves {
    static constexpr int max_level = 64;
    float step, amount;
    VOXELPIPE_HD int edge_level(const vertex& a, const vertex& b) const {
        return vp::level_by_length(a.position, b.position, step, max_level);
    }
    VOXELPIPE_HD vertex operator()(const vp::patch_point<surface>& p) const {
        const glm::vec3 at = p.position();
        const float x = 0.25f * at.x; // exact
        const float height = vp::exact::mul(amount, x - std::floor(x));
        return {vp::exact::along(at, p.mix(&surface::normal), height), p.varyings()};
    }
};

// A triangle becomes its two sides, moved apart along the first normal; triangles of odd number have one.
struct prism {
    float height;
    VOXELPIPE_HD auto operator()(const vp::triangle<surface>& t) const {
        vp::triangles<2, surface> out;
        out.add(t.vertices[0], t.vertices[1], t.vertices[2]);
        if (t.number % 2 == 0) {
            vertex moved[3];
            for (int i = 0; i < 3; ++i)
                moved[i] = {vp::exact::along(t.vertices[i].position, t.vertices[0].varyings.normal, height),
                            t.vertices[i].varyings};
            out.add(moved[0], moved[2], moved[1]);
        }
        if (t.number % 5 == 0) out.count = 0;
        return out;
    }
};

struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        return vp::outputs(glm::uvec4(f.instance, f.triangle, f.primitive, f.draw), f.varyings.uv.x,
                           (f.primitive & 1u) != 0)
            .discard_if(f.primitive % 7 == 0);
    }
};
struct ids_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        return vp::outputs(glm::uvec4(f.draw, f.triangle, f.primitive, f.instance));
    }
};

using ids = vp::target<glm::uvec4, blend::replace>;
using sums = vp::target<float, blend::add>;
using bits = vp::target<vp::bit, blend::bit_xor>;
template <class Backend>
using framebuffer_of = vp::framebuffer<Backend, ids, sums, bits>;

// Results of a call in a framebuffer, lists, a sparse framebuffer and, with a constant shader, in bits.
struct results {
    vp::counters counts, of_constants;
    std::vector<glm::uvec4> ids, payloads;
    std::vector<float> sums;
    std::vector<std::uint32_t> parities, constants, primitives;
    std::vector<std::uint64_t> voxels, keys;
    std::vector<float> sparse_sums;
};

template <class Backend, class Draw>
results draw_with(Backend& backend, const vp::grid& grid, const Draw& draw) {
    results r;
    framebuffer_of<Backend> fb{backend, grid.extent};
    vp::status s = draw(shader{}, fb);
    EXPECT_TRUE(s.ok()) << s.message();
    r.counts = s.counts;
    EXPECT_EQ(r.counts.triangles_in, r.counts.triangles_dropped() + r.counts.triangles_zero_area +
                                         r.counts.triangles_outside + r.counts.triangles_drawn);
    r.ids = vp::get<0>(fb).to_host(backend);
    r.sums = vp::get<1>(fb).to_host(backend);
    r.parities = vp::get<2>(fb).to_host(backend);
    vp::abuffer<Backend, glm::uvec4> lists(backend);
    s = draw(ids_shader{}, lists);
    EXPECT_TRUE(s.ok()) << s.message();
    r.voxels = lists.voxels.to_host(backend);
    r.primitives = lists.primitives.to_host(backend);
    r.payloads = lists.payloads.to_host(backend);
    vp::sparse_framebuffer<Backend, programs::ids, programs::sums, programs::bits> sparse(backend, grid.extent);
    s = draw(shader{}, sparse);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, r.counts);
    const auto host = sparse.to_host(backend);
    r.keys = host.keys;
    r.sparse_sums = vp::get<1>(host.values);
    vp::framebuffer<Backend, vp::target<vp::bit, blend::bit_or>> occupied{backend, grid.extent};
    s = draw(vp::constant(true), occupied);
    EXPECT_TRUE(s.ok()) << s.message();
    r.of_constants = s.counts;
    r.constants = vp::get<0>(occupied).to_host(backend);
    return r;
}
// Known: the coverage, if only one is to be compiled.
template <vp::coverage... Known, class Backend, class Amplify>
results draw_all(Backend& backend, const unit::small_mesh& m, const vp::grid& grid, const Amplify& amplify,
                 const vp::program_options& options) {
    const vp::mesh<Backend> mesh(backend, m.positions, m.triangles);
    return draw_with(backend, grid, [&](const auto& fs, auto& out) {
        return vp::voxelize<Known...>(backend, mesh, grid, add_surface{}, amplify, fs, out, options);
    });
}
template <class Backend>
results draw_plain(Backend& backend, const unit::small_mesh& m, const vp::grid& grid, vp::coverage rule) {
    const vp::mesh<Backend> mesh(backend, m.positions, m.triangles);
    return draw_with(backend, grid, [&](const auto& fs, auto& out) {
        return vp::voxelize(backend, mesh, grid, add_surface{}, fs, out, rule);
    });
}
inline void expect_same(const results& a, const results& b) {
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_EQ(a.of_constants, b.of_constants);
    EXPECT_TRUE(unit::same_bytes(a.ids, b.ids));
    EXPECT_TRUE(unit::same_bytes(a.sums, b.sums));
    EXPECT_TRUE(unit::same_bytes(a.parities, b.parities));
    EXPECT_EQ(a.voxels, b.voxels);
    EXPECT_EQ(a.primitives, b.primitives);
    EXPECT_TRUE(unit::same_bytes(a.payloads, b.payloads));
    EXPECT_EQ(a.keys, b.keys);
    EXPECT_TRUE(unit::same_bytes(a.sparse_sums, b.sparse_sums));
    EXPECT_TRUE(unit::same_bytes(a.constants, b.constants));
}

} // namespace programs
