// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Points and lines that the tests of both backends share.

#include "api_model.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace elements {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;

// Vertices of segments of every size and direction in and around a grid: among them points, axis-parallel ones, ends on
// voxel faces and corners, NaN, infinite, far away, and across the whole grid.
inline std::vector<glm::vec3> make_vertices(std::uint64_t seed, int segments, glm::ivec3 extent) {
    unit::splitmix64 random(seed);
    std::vector<glm::vec3> p;
    for (int i = 0; i < segments; ++i) {
        const double size = std::ldexp(1.0, static_cast<int>(random.between(-2, 6)));
        glm::vec3 a, b;
        for (int k = 0; k < 3; ++k) {
            a[k] = static_cast<float>(random.uniform(-2.0, extent[k] + 2.0));
            b[k] = a[k] + static_cast<float>(random.uniform(-size, size));
            if (i % 5 == 1) {
                a[k] = std::round(a[k]);
                b[k] = std::round(b[k]);
            }
            if (i % 5 == 2) a[k] = std::round(2.0f * a[k]) * 0.5f;
            if (i % 7 == 3 && k != i % 3) b[k] = a[k];
        }
        if (i % 11 == 4) b = a;
        if (i % 13 == 5) b = a + std::round(b.x - a.x) * glm::vec3(1.0f, -1.0f, 1.0f);
        if (i % 41 == 6) b.y = std::numeric_limits<float>::quiet_NaN();
        if (i % 43 == 7) a.z = 1e30f;
        if (i % 47 == 8) b.x = a.x + 900000.0f; // 128 bits
        p.push_back(a);
        p.push_back(b);
    }
    return p;
}

struct spot {
    float along;
    vp::flat<std::uint32_t> vertex;
};
// Copies are moved apart.
struct place {
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        const auto s = static_cast<float>(v.instance);
        return vp::vertex_output{glm::vec3(vp::exact::fma(2.5f, s, v.position.x), v.position.y, v.position.z),
                                 spot{v.position.x, {v.index}}};
    }
};
struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<spot>& f) const {
        return vp::outputs(glm::uvec4(f.triangle, f.instance, f.primitive, f.varyings.vertex.value), f.barycentric.y,
                           (f.primitive & 1u) != 0)
            .discard_if(f.primitive % 6 == 5);
    }
};
struct payload {
    glm::vec3 barycentric, normal;
    float along, clamped;
    std::uint32_t triangle, draw, axis, front;
};
struct payload_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<spot>& f) const {
        return vp::outputs(payload{f.barycentric, f.normal, f.varyings.along, f.clamped_varyings().along, f.triangle,
                                   f.draw, static_cast<std::uint32_t>(f.axis), f.front_facing ? 1u : 0u});
    }
};

using ids = vp::target<glm::uvec4, blend::replace>;
using sums = vp::target<float, blend::add>;
using bits = vp::target<vp::bit, blend::bit_xor>;

struct results {
    vp::counters counts;
    std::vector<glm::uvec4> ids;
    std::vector<float> sums, sparse_sums;
    std::vector<std::uint32_t> bits, primitives;
    std::vector<std::uint64_t> voxels, keys;
    std::vector<payload> payloads;
};

template <class Backend, class View>
results draw_all(Backend& backend, const View& view, const vp::grid& grid, const vp::program_options& options) {
    results r;
    vp::framebuffer<Backend, elements::ids, elements::sums, elements::bits> fb{backend, grid.extent};
    vp::status s = vp::voxelize(backend, view, grid, place{}, shader{}, fb, options);
    EXPECT_TRUE(s.ok()) << s.message();
    r.counts = s.counts;
    r.ids = vp::get<0>(fb).to_host(backend);
    r.sums = vp::get<1>(fb).to_host(backend);
    r.bits = vp::get<2>(fb).to_host(backend);
    vp::abuffer<Backend, payload> lists(backend);
    s = vp::voxelize(backend, view, grid, place{}, payload_shader{}, lists, options);
    EXPECT_TRUE(s.ok()) << s.message();
    r.voxels = lists.voxels.to_host(backend);
    r.primitives = lists.primitives.to_host(backend);
    r.payloads = lists.payloads.to_host(backend);
    vp::sparse_framebuffer<Backend, elements::ids, elements::sums, elements::bits> sparse(backend, grid.extent);
    s = vp::voxelize(backend, view, grid, place{}, shader{}, sparse, options);
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, r.counts);
    r.keys = sparse.to_host(backend).keys;
    r.sparse_sums = vp::get<1>(sparse.to_host(backend).values);
    return r;
}
inline void expect_same(const results& a, const results& b) {
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_TRUE(unit::same_bytes(a.ids, b.ids));
    EXPECT_TRUE(unit::same_bytes(a.sums, b.sums));
    EXPECT_TRUE(unit::same_bytes(a.bits, b.bits));
    EXPECT_EQ(a.voxels, b.voxels);
    EXPECT_EQ(a.primitives, b.primitives);
    EXPECT_TRUE(unit::same_bytes(a.payloads, b.payloads));
    EXPECT_EQ(a.keys, b.keys);
    EXPECT_TRUE(unit::same_bytes(a.sparse_sums, b.sparse_sums));
}

} // namespace elements
