// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers on the device and on the CPU, side by side, with a target for each kind of blend.

#include "api_model.hpp"
#include "box_mesh.hpp"
#include "device_test.hpp"
#include "subset_meshes.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;

namespace sparse_values { // named: nvcc warns of members of unnamed ones that the host does not use

struct record {
    std::uint64_t chain;
    std::uint32_t fragments, last;
    bool operator==(const record&) const = default;
};
struct chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD record identity() const { return {0xcbf29ce484222325u, 0, 0xffffffffu}; }
    VOXELPIPE_HD record combine(record a, record b) const {
        return {(a.chain ^ b.chain) * 0x100000001b3u, a.fragments + b.fragments, b.last};
    }
};
} // namespace sparse_values

namespace sparse_pairs {

using sparse_values::chain;

// Writes `mesh`, moved, over the positions that a captured call reads, and returns it.
[[nodiscard]] inline unit::small_mesh move_mesh(vp::cuda_backend& be, const vp::mesh<vp::cuda_backend>& on_device,
                                                unit::small_mesh mesh, const glm::vec3& by) {
    for (glm::vec3& p : mesh.positions) p += by;
    EXPECT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(on_device.view().positions.data()), mesh.positions.data(),
                              mesh.positions.size() * sizeof(glm::vec3), cudaMemcpyDefault, be.stream),
              cudaSuccess);
    return mesh;
}
using sparse_values::record;

struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = unit::mark(f.primitive, f.voxel);
        const auto number = static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-10f;
        return vp::outputs((m >> 20 & 3u) != 0, f.primitive, number, glm::dvec2(number, f.barycentric.x),
                           static_cast<std::int16_t>(m), vp::half(number * 0x1p-14f), m, record{m, 1, f.primitive})
            .discard_if(m % 3 == 0);
    }
};
// The same of a solid's fragments.
struct solid_shader {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        vp::fragment<> g{};
        g.primitive = f.draw * 31 + static_cast<std::uint32_t>(f.winding);
        g.voxel = f.voxel;
        return shader{}(g);
    }
};
template <class Backend>
using framebuffer =
    vp::sparse_framebuffer<Backend, vp::target<vp::bit, blend::bit_xor>, vp::target<std::uint32_t, blend::replace>,
                           vp::target<float, blend::add>, vp::target<glm::dvec2, blend::add, vp::layout::planar>,
                           vp::target<std::int16_t, blend::add_saturate>, vp::target<vp::half, blend::min>,
                           vp::target<std::uint64_t, blend::count>, vp::target<record, chain>>;

// Every blend whose value follows from the number of fragments of one value.
template <class Backend>
using constant_framebuffer =
    vp::sparse_framebuffer<Backend, vp::target<vp::bit, blend::bit_or>, vp::target<vp::bit, blend::bit_xor>,
                           vp::target<float, blend::add>, vp::target<std::uint32_t, blend::count>,
                           vp::target<glm::u8vec4, blend::replace, vp::layout::planar>,
                           vp::target<std::int16_t, blend::max>, vp::target<std::uint64_t, blend::add>>;
const auto constant_shader =
    vp::constant(true, true, 0.1f, 0u, glm::u8vec4(1, 2, 3, 4), std::int16_t{-5}, std::uint64_t{7});

template <template <class> class Framebuffer, std::size_t Targets>
struct any_pair {
    vp::cuda_backend device;
    vp::cpu_backend host{2};
    Framebuffer<vp::cuda_backend> on_device;
    Framebuffer<vp::cpu_backend> on_host;
    bool draws_some = false; // a third of each mesh, as a subset that knows its numbers
    explicit any_pair(const glm::ivec3& extent) : on_device(device, extent), on_host(host, extent) {}

    template <class F>
    void prepare(const F& f) {
        f(on_device);
        f(on_host);
    }
    template <class Shader = shader>
    void draw(const std::vector<unit::small_mesh>& meshes, const vp::grid& grid, vp::coverage rule, const char* what,
              const Shader& shade = {}) {
        std::vector<vp::mesh<vp::cuda_backend>> owners;
        std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> there, here;
        std::vector<device_test::some_triangles<vp::cuda_backend>> some_there;
        std::vector<device_test::some_triangles<vp::cpu_backend>> some_here;
        owners.reserve(meshes.size());
        for (const auto& m : meshes) {
            owners.emplace_back(device, m.positions, m.triangles);
            there.push_back({owners.back().view(), {}, shade});
            here.push_back({m.view(), {}, shade});
            if (!draws_some) continue;
            some_there.emplace_back(device, m.triangles);
            some_here.emplace_back(host, m.triangles);
            there.back().mesh = some_there.back().of(there.back().mesh);
            here.back().mesh = some_here.back().of(here.back().mesh);
        }
        const vp::status a = vp::voxelize(device, there, grid, on_device, rule);
        const vp::status b = vp::voxelize(host, here, grid, on_host, rule);
        ASSERT_TRUE(a.ok() && b.ok()) << what << ": " << a.message() << "; " << b.message();
        EXPECT_EQ(a.counts, b.counts) << what;
        compare(what);
    }
    template <class Shader = solid_shader>
    void draw_solid(const std::vector<unit::small_mesh>& meshes, const vp::grid& grid, const vp::solid_options& options,
                    const char* what, const Shader& shade = {}) {
        std::vector<vp::mesh<vp::cuda_backend>> owners;
        std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> there, here;
        owners.reserve(meshes.size());
        for (const auto& m : meshes) {
            owners.emplace_back(device, m.positions, m.triangles);
            there.push_back({owners.back().view(), {}, shade});
            here.push_back({m.view(), {}, shade});
        }
        const vp::status a = vp::voxelize_solid(device, there, grid, on_device, options);
        const vp::status b = vp::voxelize_solid(host, here, grid, on_host, options);
        ASSERT_TRUE(a.ok() && b.ok()) << what << ": " << a.message() << "; " << b.message();
        EXPECT_EQ(a.counts, b.counts) << what;
        EXPECT_EQ(a.solid, b.solid) << what;
        compare(what);
    }
    void compare(const char* what) {
        const auto a = on_device.to_host(device);
        const auto b = on_host.to_host(host);
        EXPECT_EQ(a.keys, b.keys) << what;
        EXPECT_TRUE(a.masks == b.masks) << what;
        EXPECT_EQ(a.offsets, b.offsets) << what;
        EXPECT_EQ(a.tiles, b.tiles) << what;
        EXPECT_EQ(on_device.num_voxels(), on_host.num_voxels()) << what;
        vp::core::for_each_index<Targets>([&]<std::size_t I>() {
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.values), vp::get<I>(b.values))) << what << ", target " << I;
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.sums), vp::get<I>(b.sums))) << what << ", sums of " << I;
        });
    }
};
// The same call on both; compares everything that comes of it.
using pair = any_pair<framebuffer, 8>;
using constant_pair = any_pair<constant_framebuffer, 7>;

template <class Framebuffer>
struct result_of;
template <class Backend, class... Targets>
struct result_of<vp::sparse_framebuffer<Backend, Targets...>> {
    using type = vp::sparse_result<Targets...>;
};

} // namespace sparse_pairs
