// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of device stages: one draw on both backends, memory for a stage's arrays, and a shader whose
// values show each fragment.

#include "cells.hpp"

#include <cpu_ref/stages.hpp>

#include <algorithm>
#include <span>

namespace stage_test {

using namespace device_test;
namespace blend = voxelpipe::blend;
namespace device = voxelpipe::device;
namespace reference = voxelpipe::cpu_stages;

template <class T>
std::vector<T> copy_back(const T* from, std::size_t count) {
    std::vector<T> host(count);
    cudaMemcpy(host.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost);
    return host;
}

// One draw on both backends.
template <class FragmentShader>
struct stages {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    using scene_memory = device::scene_memory<vp::mesh_view<>, vp::passthrough, FragmentShader>;

    mesh_data data;
    vp::grid g;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    vp::mesh<vp::cuda_backend> d_mesh;
    vp::mesh<vp::cpu_backend> h_mesh;
    draw_type d_draw, h_draw;
    vp::cpu::execution how{2, nullptr, nullptr};

    stages(mesh_data m, const vp::grid& g_, const FragmentShader& fs)
        : data(std::move(m)), g(g_), d_mesh(gpu, data.positions, data.triangles),
          h_mesh(cpu, data.positions, data.triangles), d_draw{d_mesh.view(), {}, fs}, h_draw{h_mesh.view(), {}, fs} {}
    stages(const stages&) = delete; // the backends must not move
    stages& operator=(const stages&) = delete;

    [[nodiscard]] std::span<const draw_type> on_device() const { return {&d_draw, 1}; }
    [[nodiscard]] std::span<const draw_type> on_host() const { return {&h_draw, 1}; }
    [[nodiscard]] std::uint32_t num_triangles() const { return static_cast<std::uint32_t>(data.triangles.size()); }
};

// Device memory for the stages' arrays.
struct stage_memory {
    vp::cuda_backend::buffer<std::byte> block;
    device::arena memory{block.data()};
    device::pipeline_state* state = memory.take<device::pipeline_state>(1);

    stage_memory(vp::cuda_backend& gpu, const device::pipeline_state& start) : block(gpu, std::size_t{256} << 20) {
        EXPECT_EQ(cudaMemcpyAsync(state, &start, sizeof(start), cudaMemcpyHostToDevice, gpu.stream), cudaSuccess);
    }
    // After the stages.
    [[nodiscard]] device::pipeline_state end(const vp::cuda_backend& gpu) const {
        EXPECT_LT(memory.used(), block.size());
        EXPECT_EQ(cudaStreamSynchronize(gpu.stream), cudaSuccess);
        return copy_back(state, 1)[0];
    }
};

// A fragment's values depend on its primitive; whether it is kept depends on its voxel too.
struct marked {
    VOXELPIPE_HD static auto of(std::uint32_t primitive) {
        return vp::outputs(vp::exact::mul(0.1f, static_cast<float>(primitive % 13u)), true, 0u, primitive);
    }
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h =
            mix_bits(f.primitive * 31u + static_cast<std::uint32_t>(f.voxel.x + 1009 * f.voxel.y + 20011 * f.voxel.z));
        return of(f.primitive).discard_if(h % 5 == 4);
    }
};

using sum = vp::target<float, blend::add>;
using bits = vp::target<vp::bit, blend::bit_or>;
using counts = vp::target<std::uint32_t, blend::count>;
using last = vp::target<std::uint32_t, blend::replace>;
template <class Backend>
using marked_targets = vp::framebuffer<Backend, sum, bits, counts, last>;

// The fragments of all work items, sorted by voxel and primitive.
template <class FragmentShader>
std::vector<reference::covered_voxel> fragments_of(const stages<FragmentShader>& s, vp::coverage rule, int log2_size,
                                                   const std::vector<reference::tile_pair>& pairs,
                                                   const std::vector<reference::tile_range>& items) {
    std::vector<reference::covered_voxel> all;
    for (const reference::tile_range& item : items) {
        const auto part = reference::fragments(s.on_host(), s.g, rule, log2_size, pairs, item);
        all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end());
    return all;
}

inline void clear_targets(const marked_targets<vp::cuda_backend>::view_type& fb, const device::pipeline_state* state,
                          const device::capacities& limits, cudaStream_t stream) {
    device::clear_target(vp::get<0>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<1>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<2>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<3>(fb.targets), state, limits, stream);
}

inline constexpr vp::tuning::fine_raster_policy policy{128, 3, 2, 0};

template <class T>
vp::cuda_backend::buffer<T> to_device(vp::cuda_backend& gpu, const std::vector<T>& host) {
    return {gpu, vp::array_view<const T>(host.data(), host.size())};
}

} // namespace stage_test
