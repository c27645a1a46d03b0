// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A prepared cell that draws into one render target. Mostly voxels are not counted (voxelize_options::count_voxels), as
// no other program's figure includes that; fragments are.

#include "cells.hpp"
#include "one_thread_a_triangle.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <optional>

namespace bench::gpu {

// out_of_memory as the exception that a benchmark may skip a cell by.
inline void check(const vp::status& s) {
    if (s.code == vp::status_code::out_of_memory) throw out_of_device_memory(s.message());
    s.or_throw();
}

// With its indices looked at, as vp::mesh does where it is made.
[[nodiscard]] inline vp::mesh_view<> view(const resident_mesh& m, vp::cuda_backend& backend) {
    vp::mesh_view<> v{{m.positions.data(), m.positions.size()}, {m.triangles.data(), m.triangles.size()}};
    v.checked = vp::check_indices(backend, v.triangles);
    return v;
}

// Baseline: which of its outputs stands beside the target.
template <class Target, class VertexShader, class FragmentShader>
class framebuffer_cell : public prepared_cell {
    using draw_type = vp::draw<vp::mesh_view<>, VertexShader, FragmentShader>;

public:
    framebuffer_cell(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                     const FragmentShader& shader, std::optional<baseline_output> baseline, bool count_voxels = false,
                     bool tracks = false)
        : session_(s), backend_(s.stream()), draw_{view(mesh, backend_), {}, shader},
          grid_(grid), options_{rule, count_voxels}, framebuffer_(backend_, grid.extent), baseline_(baseline) {
        if (tracks) framebuffer_.track_changes(backend_);
    }

    vp::counters call() override {
        const vp::status s = vp::voxelize(backend_, draws(), grid_, framebuffer_, options_);
        check(s);
        return s.counts;
    }
    void set_times(vp::stage_times* times) override { backend_.times = times; }

    bool prepare_async() override {
        vp::workspace_limits limits = vp::workspace_limits::for_triangles(draw_.mesh.triangles.size());
        limits.lists_fragments = true;
        limits.expects_deferred = false; // unless there are some
        for (int tries = 0; tries < 5; ++tries) {
            workspace_memory_ = {};
            session_.trim();
            const std::size_t bytes = vp::workspace_bytes(draws(), grid_, framebuffer_.view(), options_, limits);
            workspace_memory_ = device_array<std::byte>(bytes);
            workspace_ = {workspace_memory_.data(), bytes, limits};
            call_async();
            const bool expected_deferred = limits.expects_deferred;
            if (vp::read_status(backend_, workspace_, &limits).ok() && limits.expects_deferred == expected_deferred)
                return true;
        }
        return false;
    }
    void call_async() override {
        check(vp::voxelize_async(backend_, draws(), grid_, framebuffer_.view(), options_, workspace_));
    }

    bool prepare_baseline() override {
        if (!baseline_) return false;
        baseline_words_ = device_array<std::uint32_t>(Target::map::elements(grid_.extent));
        return true;
    }
    void call_baseline() override {
        voxelize_baseline(session_.stream(), draw_.mesh, grid_, options_.rule, *baseline_, baseline_words_.data(),
                          baseline_words_.size());
    }
    std::uint64_t differences() override {
        static_assert(sizeof(typename Target::element_type) == sizeof(std::uint32_t));
        const void* const ours = vp::get<0>(framebuffer_).view().elements;
        return count_differences(session_.stream(), static_cast<const std::uint32_t*>(ours), baseline_words_.data(),
                                 baseline_words_.size());
    }

private:
    [[nodiscard]] std::span<const draw_type> draws() const { return {&draw_, 1}; }

    session& session_;
    vp::cuda_backend backend_;
    draw_type draw_;
    vp::grid grid_;
    vp::voxelize_options options_;
    vp::framebuffer<vp::cuda_backend, Target> framebuffer_;
    device_array<std::byte> workspace_memory_;
    vp::workspace_view workspace_;
    std::optional<baseline_output> baseline_;
    device_array<std::uint32_t> baseline_words_;
};

} // namespace bench::gpu
