// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of slabs: a mesh with triangles on, beside and across the borders of slabs, shaders that see
// every number and varying, targets of every kind, and their comparison.

#include "api_model.hpp"

#include <voxelpipe/slabs/stream.hpp>

#include <gtest/gtest.h>

#include <cstring>

namespace slab_scene {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;
using backend_type = vp::cpu_backend;

inline const glm::ivec3 extent{37, 33, 42}; // 42 = 2 x 3 x 7 layers

// Vertices have a colour. Besides random triangles: faces in the planes between layers, a sub-voxel unit before and
// behind them, through the layers along every axis, outside, of no area, and not finite.
struct colored_mesh : unit::small_mesh {
    std::vector<glm::vec3> colors;
    [[nodiscard]] vp::mesh_view<glm::vec3> with_colors() const {
        return {positions, triangles, vp::core::make_pack(vp::array_view<const glm::vec3>(colors))};
    }
};
inline colored_mesh make_scene() {
    colored_mesh m{unit::make_mesh(11, 160, extent), {}};
    const auto add = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        const auto n = static_cast<std::uint32_t>(m.positions.size());
        for (const glm::vec3& p : {a, b, c}) m.positions.push_back(p);
        m.triangles.emplace_back(n, n + 1, n + 2);
    };
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (int z = 0; z <= extent.z; z += 3) {
        for (const float d : {0.0f, 0x1p-16f, -0x1p-16f}) {
            const auto at = static_cast<float>(z) + d;
            add({3, 4, at}, {20.5f, 6, at}, {9, 28, at});
            add({at, 3, 4}, {at, 20, 5}, {at, 7, 30});
        }
        add({5, 5, static_cast<float>(z) - 2.5f}, {6, 30, static_cast<float>(z)},
            {30, 7, static_cast<float>(z) + 9.0f});
    }
    add({-9, 5, 5}, {-5, 9, 9}, {-7, 30, 30});
    add({4, 4, 4}, {8, 8, 8}, {12, 12, 12});
    add({nan, 4, 4}, {8, 8, 8}, {12, 1, 12});
    add({4, 4, 1e30f}, {8, 8, 8}, {12, 1, 12});
    add({1, 1, -80}, {2, 30, 100}, {30, 2, 100});
    unit::splitmix64 random(5);
    for (std::size_t i = 0; i < m.positions.size(); ++i)
        m.colors.emplace_back(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1));
    return m;
}

struct varyings {
    glm::vec3 color;
};
struct moved {
    glm::vec3 by{0.25f, 0, 0.125f};
    template <class Vertex>
    vp::vertex_output<varyings> operator()(const Vertex& v) const {
        return {v.position + by, {vp::get<0>(v)}};
    }
};

struct folded {
    std::uint64_t chain;
    bool operator==(const folded&) const = default;
};
struct chain { // changes with the order
    static constexpr bool order_free = false;
    folded identity() const { return {0xcbf29ce484222325u}; }
    folded combine(folded a, folded b) const { return {(a.chain ^ b.chain) * 0x100000001b3u}; }
};

// The inputs of a fragment of the whole call: numbers, voxel, colours, normal.
inline std::uint64_t mark_of(const vp::fragment<varyings>& f) {
    std::uint64_t m = unit::mark(f.primitive ^ f.triangle << 3 ^ f.draw << 7 ^ f.instance << 9, f.voxel);
    const float sees[] = {f.varyings.color.x, f.normal.z, f.vertex_varyings[2]->color.y, f.barycentric.x};
    for (const float value : sees) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, 4);
        m = (m ^ bits) * 0x9e3779b97f4a7c15u;
    }
    return m ^ m >> 31;
}
inline float float_of(std::uint64_t m) { return static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-10f; }

struct all_kinds {
    auto operator()(const vp::fragment<varyings>& f) const {
        const std::uint64_t m = mark_of(f);
        return vp::outputs((m >> 20 & 3u) != 0, f.primitive, float_of(m), f.varyings.color,
                           static_cast<std::int16_t>(m), vp::half(float_of(m) * 0x1p-14f), m, folded{m})
            .discard_if(m % 5 == 0);
    }
};
struct payload {
    auto operator()(const vp::fragment<varyings>& f) const {
        return vp::outputs(mark_of(f)).discard_if(f.primitive % 9 == 4);
    }
};

template <template <class, class...> class Framebuffer>
using all_targets =
    Framebuffer<backend_type, vp::target<vp::bit, vp::blend::bit_xor>, vp::target<std::uint32_t, vp::blend::replace>,
                vp::target<float, vp::blend::add>, vp::target<glm::vec3, vp::blend::max, vp::layout::planar>,
                vp::target<std::int16_t, vp::blend::min, vp::layout::tiled>, vp::target<vp::half, vp::blend::add>,
                vp::target<std::uint64_t, vp::blend::count>, vp::target<folded, chain>>;
using dense = all_targets<vp::framebuffer>;
using sparse = all_targets<vp::sparse_framebuffer>;
inline constexpr std::size_t num_targets = 8;

template <class Part>
struct host_of;
template <class... Targets>
struct host_of<vp::sparse_framebuffer<backend_type, Targets...>> {
    using type = vp::host_sparse<Targets...>;
};
using host_sparse = typename host_of<sparse>::type;

// True if a slab's targets are the whole's at its place.
inline void expect_crop(backend_type& backend, const dense& whole, const vp::grid& whole_grid, const vp::grid& part,
                        const dense& slab) {
    vp::core::for_each_index<num_targets>([&]<std::size_t I>() {
        const auto a = vp::get<I>(whole).to_host_target(backend), b = vp::get<I>(slab).to_host_target(backend);
        const glm::ivec3 from = part.offset - whole_grid.offset;
        int wrong = 0;
        unit::for_each_voxel(part.extent, [&](int x, int y, int z) {
            const auto e = a(from.x + x, from.y + y, from.z + z), g = b(x, y, z);
            if (!vp::core::is_same_value(e, g)) ++wrong;
        });
        EXPECT_EQ(wrong, 0) << "target " << I << " of the slab at " << from.x << ' ' << from.y << ' ' << from.z;
    });
}

template <class Payload>
void expect_equal(const vp::host_abuffer<Payload>& a, const vp::host_abuffer<Payload>& b) {
    EXPECT_EQ(a.voxels, b.voxels);
    EXPECT_EQ(a.offsets, b.offsets);
    EXPECT_EQ(a.primitives, b.primitives);
    if constexpr (!std::is_void_v<Payload>) {
        EXPECT_EQ(a.payloads, b.payloads);
    }
    EXPECT_EQ(a.extent, b.extent);
}

} // namespace slab_scene
