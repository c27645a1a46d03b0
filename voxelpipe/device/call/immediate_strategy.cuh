// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Strategy immediate: the raster blends each fragment into the targets in place. Counted targets get their values in a
// last pass.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/call/immediate_plan.cuh>
#include <voxelpipe/device/raster/mask_sink.cuh>
#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/device/scene/check_indices.cuh>
#include <voxelpipe/device/targets/tracked_clear.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

template <class Call>
struct immediate_strategy {
    using framebuffer_type = typename Call::framebuffer_type;
    using tracking_type = typename Call::tracking_type;

    const Call& call;
    tracking_type tracking;
    bool has_own_marks; // touched chunks are marked for the last pass only, not for the framebuffer's log
    chunk_marks marks;
    vertex_positions positions;
    deferred_triangles deferred;

    immediate_strategy(const Call& c, arena& memory)
        : call(c),
          tracking(c.plan.fb, c.is_tracked(),
                   [&](const auto& t, std::size_t k) { return !c.plan.targets.counts(k) || ends_by_marks(t); }),
          has_own_marks(false), marks(tracking.marks()) {
        core::for_each_index<Call::groups::count>([&]<std::size_t K>() {
            has_own_marks =
                has_own_marks || (c.plan.targets.counts(K) && ends_by_marks(voxelpipe::get<K>(c.plan.fb.targets)));
        });
        has_own_marks = has_own_marks && !is_tracked(); // the log's marks hold the same
        if (has_own_marks) marks = chunk_marks::take(memory, c.plan.g.extent);
        positions = vertex_positions::take(memory, Call::shades_in_raster ? 0 : c.max_pass_vertices());
        deferred = deferred_triangles::take(memory, c.max_pass_triangles());
    }

    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) const {
        if (has_own_marks) check(cudaMemsetAsync(marks.words, 0, marks.rows.num_words() * sizeof(word), stream));
        // Fragments go straight into targets, so a bad index must be found before.
        for (const auto& d : call.draws)
            if (!d.mesh.has_checked_indices())
                check_indices(d.mesh.triangles.data(), d.mesh.triangles.size(), d.mesh.positions.size(), state, stream);
        if (!call.has_checked_indices()) end_stage(call.clock, &stage_times::coarse_raster);
        call.clear_targets(tracking, state, stream);
        // Without a check and a clear these may be the call's first kernels. They may still start early: nobody writes
        // checked indices (mesh_view::checked).
        call.raster_draws(positions, state, stream, [&](const auto& d, const auto& source, bool) {
            raster_draw<Rule>(d, source, state, stream);
        });
        if (call.plan.targets.has_last_pass()) {
            finalize_counts(call.plan.targets, call.plan.fb, call.draws[0].fragment_shader.values, marks, state,
                            call.plan.limits, stream);
            end_stage(call.clock, &stage_times::tile_resolve);
        }
    }

private:
    // A framebuffer with tracked changes has marks in its log.
    [[nodiscard]] bool is_tracked() const { return tracking.marks().words != nullptr; }

    // Rasters one draw, by the most specialised kernels for its targets.
    template <coverage Rule, class Source>
    void raster_draw(const typename Call::draw_type& d, const Source& source, pipeline_state* state,
                     cudaStream_t stream) const {
        using values_type = decltype(d.fragment_shader.values);
        const auto& plan = call.plan;
        const auto raster_into = [&]<class Output>(const Output& output) {
            return raster_call<Rule, Source, Output>{call.raster_input_of(d, source), output, deferred.with(state)};
        };
        const auto draw_into = [&](const auto& output) {
            launch_raster(raster_into(output), state, stage::fine_raster, stream, false, plan.limits.deferred);
            end_stage(call.clock, &stage_times::fine_raster);
        };
        if constexpr (is_mask_itself<framebuffer_type>) {
            const auto& t = voxelpipe::get<0>(plan.fb.targets);
            if (plan.targets.modes.of[0] == immediate_mode::blend && voxelpipe::get<0>(d.fragment_shader.values)) {
                draw_into(mask_output{t.elements, plan.g.extent, call.num_source_vertices(d.mesh), state, true});
                return;
            }
        }
        const framebuffer_output<framebuffer_type, values_type> output{plan.fb, d.fragment_shader.values,
                                                                       plan.targets.modes, marks};
        if constexpr (has_only_values<framebuffer_type>) {
            if (plan.targets.only_blends() && marks.words == nullptr) { // a first pass that asks less of a fragment
                launch_first_pass(raster_into(blended_output<framebuffer_type, values_type>{output}), state,
                                  stage::fine_raster, stream, false);
                launch_deferred_pass(raster_into(output), state, stage::fine_raster, stream);
                end_stage(call.clock, &stage_times::fine_raster);
                return;
            }
        }
        draw_into(output);
    }
};

} // namespace voxelpipe::device
