// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// One policy of the sweep, given by TUNE_THREADS_PER_BLOCK, TUNE_LOG2_TILE_SIZE and TUNE_MIN_BLOCKS_PER_SM: the
// pipelines with a selector that always answers it.

#include "framebuffer_cell.cuh"
#include "policies.hpp"

namespace bench::gpu {

namespace {

struct selector {
    constexpr vp::tuning::fine_raster_policy operator()(int) const {
        return {TUNE_THREADS_PER_BLOCK, TUNE_LOG2_TILE_SIZE, TUNE_MIN_BLOCKS_PER_SM};
    }
};

// One value for all fragments, which the library cannot know: a constant shader would be drawn without tiles, and a
// policy is about tiles.
template <class Value>
struct computed_value {
    Value value;
    VOXELPIPE_HD auto operator()(const vp::fragment<>&) const { return vp::outputs(value); }
};

// voxelize with another selector is the backend's run.
template <class Target, class Value>
class tuned_cell : public prepared_cell {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, computed_value<Value>>;

public:
    tuned_cell(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule, Value value,
               baseline_output baseline)
        : session_(s), backend_(s.stream()), draw_{view(mesh, backend_), {}, {value}},
          grid_(grid), options_{rule, false}, framebuffer_(backend_, grid.extent), baseline_(baseline) {
        backend_.strategy = vp::strategy::tiled;
    }

    vp::counters call() override {
        const vp::status s = backend_.template run<selector>(
            std::span<const draw_type>(&draw_, 1), grid_, framebuffer_.view(), options_, draw_.mesh.triangles.size());
        check(s);
        return s.counts;
    }
    void set_times(vp::stage_times* times) override { backend_.times = times; }
    bool prepare_baseline() override {
        baseline_words_ = device_array<std::uint32_t>(Target::map::elements(grid_.extent));
        return true;
    }
    void call_baseline() override {
        voxelize_baseline(session_.stream(), draw_.mesh, grid_, options_.rule, baseline_, baseline_words_.data(),
                          baseline_words_.size());
    }
    std::uint64_t differences() override {
        const void* const ours = vp::get<0>(framebuffer_).view().elements;
        return count_differences(session_.stream(), static_cast<const std::uint32_t*>(ours), baseline_words_.data(),
                                 baseline_words_.size());
    }

private:
    session& session_;
    vp::cuda_backend backend_;
    draw_type draw_;
    vp::grid grid_;
    vp::voxelize_options options_;
    vp::framebuffer<vp::cuda_backend, Target> framebuffer_;
    baseline_output baseline_;
    device_array<std::uint32_t> baseline_words_;
};

// A lower bound of what a tile takes; what is above it but too much all the same, the launch reports.
constexpr bool may_fit(int bits_per_voxel) {
    return (std::int64_t{bits_per_voxel} << (3 * TUNE_LOG2_TILE_SIZE)) / 8 <= 227 * 1024;
}

std::unique_ptr<prepared_cell> prepare_tuned(session& s, const resident_mesh& mesh, const vp::grid& grid,
                                             vp::coverage rule, tuned_target target) {
    if (target == tuned_target::bits) {
        if constexpr (may_fit(1))
            return std::make_unique<tuned_cell<vp::target<vp::bit, vp::blend::bit_or>, bool>>(s, mesh, grid, rule, true,
                                                                                              baseline_output::bits);
    } else {
        // The sum's wide accumulator: three words.
        if constexpr (may_fit(96))
            return std::make_unique<tuned_cell<vp::target<float, vp::blend::add>, float>>(s, mesh, grid, rule, 1.0f,
                                                                                          baseline_output::sums);
    }
    return nullptr;
}

const add_policy added(policy{TUNE_THREADS_PER_BLOCK, TUNE_LOG2_TILE_SIZE, TUNE_MIN_BLOCKS_PER_SM, prepare_tuned});

} // namespace

} // namespace bench::gpu
