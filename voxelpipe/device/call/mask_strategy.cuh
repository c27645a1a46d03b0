// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Strategy occupancy_mask: the raster sets a bit for each touched voxel; last passes fill all targets from these bits.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/raster/mask_sink.cuh>
#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/device/targets/fill_from_mask.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

template <class Call>
struct mask_strategy {
    const Call& call;
    word* mask; // first in the call's memory after the state: both are zero on entry
    vertex_positions positions;
    deferred_triangles deferred;

    mask_strategy(const Call& c, arena& memory)
        : call(c), mask(memory.take<word>(mask_target::map::elements(c.plan.g.extent))),
          positions(vertex_positions::take(memory, Call::shades_in_raster ? 0 : c.max_pass_vertices())),
          deferred(deferred_triangles::take(memory, c.max_pass_triangles())) {}

    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) const {
        call.raster_draws(positions, state, stream, [&](const auto& d, const auto& source, bool is_first) {
            using source_type = std::remove_cvref_t<decltype(source)>;
            const auto num_vertices = Call::num_source_vertices(d.mesh);
            const raster_call<Rule, source_type, mask_output> raster{
                call.raster_input_of(d, source),
                {mask, call.plan.g.extent, num_vertices, state, false},
                deferred.with(state)};
            launch_raster(raster, state, stage::fine_raster, stream, is_first, call.plan.limits.deferred);
            end_stage(call.clock, &stage_times::fine_raster);
        });
        fill_from_mask(mask, call.plan.fb, call.track(), call.draws[0].fragment_shader.values,
                       call.plan.options.count_voxels, state, call.plan.limits, stream);
        end_stage(call.clock, &stage_times::tile_resolve);
    }
};

} // namespace voxelpipe::device
