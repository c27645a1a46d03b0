// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"
#include "framebuffer_cell.cuh"

namespace bench::gpu {

namespace {

// Lists of primitive numbers. The lists are let go and made anew by every call, as vp::voxelize does.
class abuffer_cell : public prepared_cell {
public:
    abuffer_cell(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule)
        : session_(s), backend_(s.stream()), draw_{view(mesh, backend_), {}, vp::constant(true)},
          grid_(grid), options_{rule}, lists_(backend_) {}

    vp::counters call() override {
        const vp::status s = vp::voxelize(backend_, draws(), grid_, lists_, options_);
        check(s);
        return s.counts;
    }
    void set_times(vp::stage_times* times) override { backend_.times = times; }

    bool prepare_async() override {
        const std::uint64_t fragments = lists_.num_fragments();
        vp::workspace_limits limits = vp::workspace_limits::for_triangles(draw_.mesh.triangles.size());
        limits.fragments = fragments + fragments / 16 + 1024;
        limits.orders_long_voxels = limits.expects_deferred = false; // unless there are some
        for (int tries = 0; tries < 5; ++tries) {
            workspace_memory_ = {};
            session_.trim();
            const std::size_t bytes = vp::workspace_bytes(draws(), grid_, async_lists_, options_, limits);
            workspace_memory_ = device_array<std::byte>(bytes);
            workspace_ = {workspace_memory_.data(), bytes, limits};
            call_async();
            if (vp::read_status(backend_, workspace_, &limits).ok()) return true;
        }
        return false;
    }
    void call_async() override {
        check(vp::voxelize_async(backend_, draws(), grid_, async_lists_, options_, workspace_));
    }
    std::uint64_t async_differences() override {
        vp::list_counts counts{};
        check(cudaMemcpyAsync(&counts, async_lists_.counts, sizeof(counts), cudaMemcpyDeviceToHost, backend_.stream),
              "counts");
        check(cudaStreamSynchronize(backend_.stream), "counts");
        if (counts.voxels != lists_.num_voxels() || counts.fragments != lists_.num_fragments()) return counts.fragments;
        const auto differ = [&](const auto* a, const auto& b) {
            return count_differences(backend_.stream, reinterpret_cast<const std::uint32_t*>(a),
                                     reinterpret_cast<const std::uint32_t*>(b.data()),
                                     b.size() * sizeof(*a) / sizeof(std::uint32_t));
        };
        return differ(async_lists_.voxels, lists_.voxels) + differ(async_lists_.offsets, lists_.offsets) +
               differ(async_lists_.primitives, lists_.primitives);
    }

private:
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    [[nodiscard]] std::span<const draw_type> draws() const { return {&draw_, 1}; }

    session& session_;
    vp::cuda_backend backend_;
    draw_type draw_;
    vp::grid grid_;
    vp::voxelize_options options_;
    vp::abuffer<vp::cuda_backend> lists_;
    vp::abuffer_view<> async_lists_;
    device_array<std::byte> workspace_memory_;
    vp::workspace_view workspace_;
};

} // namespace

cell_pointer make_abuffer(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule) {
    return std::make_unique<abuffer_cell>(s, mesh, grid, rule);
}

} // namespace bench::gpu
