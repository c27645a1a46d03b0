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
        : backend_(s.stream()), mesh_(view(mesh, backend_)), grid_(grid), rule_(rule), lists_(backend_) {}

    vp::counters call() override {
        const vp::status s = vp::voxelize(backend_, mesh_, grid_, vp::passthrough{}, vp::constant(true), lists_, rule_);
        check(s);
        return s.counts;
    }
    void set_times(vp::stage_times* times) override { backend_.times = times; }

private:
    vp::cuda_backend backend_;
    vp::mesh_view<> mesh_;
    vp::grid grid_;
    vp::coverage rule_;
    vp::abuffer<vp::cuda_backend> lists_;
};

} // namespace

cell_pointer make_abuffer(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule) {
    return std::make_unique<abuffer_cell>(s, mesh, grid, rule);
}

} // namespace bench::gpu
