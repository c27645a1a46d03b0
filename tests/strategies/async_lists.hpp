// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Asynchronous calls: captured ones, and those into fragment lists, in the caller's memory with a guard behind it,
// against cpu_backend.

#include "captured_graph.hpp"
#include "device_test.hpp"

#include <voxelpipe/device/abuffer_async.cuh>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace device_test {

// `parts`: the mesh of each draw.
template <class Payload, class FragmentShader>
void expect_lists(const std::vector<mesh_data>& parts, const vp::grid& g, const FragmentShader& fs,
                  const call_options& options, const vp::host_abuffer<Payload>& lists, const vp::status& s) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    vp::cpu_backend cpu;
    vp::abuffer<vp::cpu_backend, Payload> expected{cpu};
    std::vector<draw_type> draws;
    for (const mesh_data& m : parts) draws.push_back({{m.positions, m.triangles}, {}, fs});
    const vp::status reference = vp::voxelize(cpu, std::span<const draw_type>(draws), g, expected, options);
    ASSERT_TRUE(reference.ok()) << reference.message();
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GT(lists.voxels.size(), 0u);
    expect_same_counts(reference.counts, s.counts);
    expect_same_on_host(expected.to_host(cpu), lists);
}

// Memory followed by a pattern that must stay. The memory itself is not initialised, so that initcheck finds reads of
// unwritten memory.
struct guarded_memory {
    static constexpr std::size_t guard = 1 << 16;
    std::size_t bytes;
    vp::cuda_backend::buffer<unsigned char> memory;

    guarded_memory(vp::cuda_backend& be, std::size_t bytes_) : bytes(bytes_), memory(be, bytes_ + guard) {
        EXPECT_EQ(cudaMemsetAsync(memory.data() + bytes, 0x5a, guard, be.stream), cudaSuccess);
    }
    void expect_untouched_behind(vp::cuda_backend& be) const {
        std::vector<unsigned char> host(guard);
        EXPECT_EQ(cudaMemcpyAsync(host.data(), memory.data() + bytes, guard, cudaMemcpyDeviceToHost, be.stream),
                  cudaSuccess);
        EXPECT_EQ(cudaStreamSynchronize(be.stream), cudaSuccess);
        for (std::size_t i = 0; i < guard; ++i) ASSERT_EQ(host[i], 0x5a) << i;
    }
};

// An asynchronous call of several draws on its own stream.
template <class Payload, class FragmentShader>
class list_call {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;

public:
    list_call(std::vector<mesh_data> parts, const vp::grid& g, const FragmentShader& fs, vp::coverage rule,
              bool lists_fragments = false)
        : parts_(std::move(parts)), grid_(g), shader_(fs), options_{rule} {
        for (const mesh_data& m : parts_) meshes_.emplace_back(backend_, m.positions, m.triangles);
        for (const auto& m : meshes_) draws_.push_back({m.view(), {}, shader_});
        const vp::workspace_limits limits{0, 0, 1 << 17, 1 << 16, lists_fragments};
        const std::size_t bytes = vp::workspace_bytes(draws(), grid_, lists_, options_, limits);
        EXPECT_GT(bytes, 0u);
        memory_ = std::make_unique<guarded_memory>(backend_, bytes);
        workspace_ = {const_cast<unsigned char*>(memory_->memory.data()), bytes, limits};
    }
    void launch() {
        const vp::status s = vp::voxelize_async(backend_, draws(), grid_, lists_, options_, workspace_);
        ASSERT_TRUE(s.ok()) << s.message();
    }
    void expect_the_cpus() {
        const vp::status s = vp::read_status(backend_, workspace_);
        expect_lists<Payload>(parts_, grid_, shader_, options_, lists_.to_host(backend_), s);
        memory_->expect_untouched_behind(backend_);
    }

private:
    [[nodiscard]] std::span<const draw_type> draws() const { return draws_; }

    stream_owner owner_;
    vp::cuda_backend backend_{owner_.stream};
    std::vector<mesh_data> parts_;
    vp::grid grid_;
    FragmentShader shader_;
    vp::voxelize_options options_;
    std::vector<vp::mesh<vp::cuda_backend>> meshes_;
    std::vector<draw_type> draws_;
    vp::abuffer_view<Payload> lists_;
    std::unique_ptr<guarded_memory> memory_;
    vp::workspace_view workspace_;
};

} // namespace device_test
