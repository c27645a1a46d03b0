// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Strategies sorted_reduce and sorted_fold: the raster lists (voxel, primitive) pairs, and a sort groups them by voxel.
// Then they are shaded and blended, in any order (reduce) or by ascending primitive (fold).

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/fold.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/device/fragments/segmented_reduce.cuh>
#include <voxelpipe/device/fragments/shade_lists.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/device/targets/tracked_clear.cuh>

#include <bit>
#include <cstdint>
#include <utility>

namespace voxelpipe::device {

// Appends the fragments of all draws to two arrays.
template <coverage Rule, class Call>
void list_draws(const Call& call, const typename Call::scene_type& s, const vertex_positions& positions,
                const deferred_triangles& deferred, std::uint32_t* voxels, std::uint32_t* primitives,
                sort_preparation preparation, pipeline_state* state, cudaStream_t stream) {
    draw_geometry geometry{{}, positions, 0, 0};
    for (const auto& d : call.draws) {
        const auto num_triangles = static_cast<std::uint32_t>(d.mesh.num_triangles());
        geometry = geometry_from(d.mesh, geometry.positions, geometry.first_primitive);
        if (num_triangles != 0) {
            if (geometry.first_primitive != 0)
                check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
            const raster_input<stored_source> in{{geometry}, num_triangles, s.geo.snap.fraction, call.plan.g.extent};
            list_raster<Rule>(in, geometry.num_vertices, geometry.first_primitive, deferred.with(state), voxels,
                              primitives, preparation, state, call.plan.limits, stream);
            preparation.is_wanted = false;
        }
        geometry.positions = geometry.positions.from(geometry.num_vertices);
        geometry.first_primitive += num_triangles;
    }
}

template <class Call>
struct reduce_strategy {
    using ends_type = run_ends<voxel_cells<typename Call::framebuffer_type>>;

    const Call& call;
    typename Call::scene_buffers buffers;
    sort_pairs pairs;
    sort_memory sort;
    deferred_triangles deferred;
    ends_type ends;

    reduce_strategy(const Call& c, arena& memory)
        : call(c), buffers(memory, c.draws), pairs(sort_pairs::take(memory, c.plan.limits.fragments)),
          sort(sort_memory::take(memory, c.plan.limits.fragments,
                                 static_cast<int>(std::bit_width(num_voxels(c.plan.g) - 1)))),
          deferred(deferred_triangles::take(memory, c.max_triangles())),
          ends(ends_type::take(memory, c.plan.limits.fragments)) {}

    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) const {
        const auto& limits = call.plan.limits;
        const typename Call::scene_type s = buffers.shade(call.draws, call.plan.g, stream);
        end_stage(call.clock, &stage_times::vertex_shade);
        sort_preparation preparation;
        preparation.is_wanted = preparation.sorts = true;
        preparation.sort = sort;
        preparation.capacity = limits.fragments;
        list_draws<Rule>(call, s, buffers.positions, deferred, pairs.keys[0], pairs.values[0], preparation, state,
                         stream);
        end_stage(call.clock, &stage_times::fine_raster);
        const int at = sort_fragments(pairs, sort_count{state, limits}, limits.fragments, sort, stream);
        end_stage(call.clock, &stage_times::tile_sort);
        const auto tracking = call.track();
        call.clear_targets(tracking, state, stream);
        mark_voxels(tracking, pairs.keys[at], &state->list_fragments, limits.fragments, state, limits, stream);
        resolve_fragments(s, call.plan.fb, {pairs.keys[at], pairs.values[at]}, ends, call.plan.options.count_voxels,
                          state, limits, stream);
        end_stage(call.clock, &stage_times::tile_resolve);
    }
};

template <class Call>
struct fold_strategy {
    using values = typename Call::values;
    using scene_type = typename Call::scene_type;

    const Call& call;
    list_buffers<std::uint32_t, values> lists;
    typename Call::scene_buffers buffers;
    deferred_triangles deferred;
    order_memory order;
    std::uint32_t* spare;
    values* payloads;

    fold_strategy(const Call& c, arena& memory)
        : call(c),
          lists(take_lists<std::uint32_t, values>(memory, num_voxels(c.plan.g), c.plan.limits.fragments, true)),
          buffers(memory, c.draws), deferred(deferred_triangles::take(memory, c.max_triangles())),
          order(order_memory::take(memory, c.plan.limits.fragments)),
          spare(memory.take<std::uint32_t>(c.plan.limits.fragments)),
          payloads(memory.take<values>(c.plan.limits.fragments)) {}

    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) {
        const auto& limits = call.plan.limits;
        const scene_type s = buffers.shade(call.draws, call.plan.g, stream);
        end_stage(call.clock, &stage_times::vertex_shade);
        list_draws<Rule>(call, s, buffers.positions, deferred, lists.keys[0], lists.values[0],
                         prepare_lists(lists, {}, order.tiles, limits), state, stream);
        filter_lists(s, lists, state, limits, stream);
        end_stage(call.clock, &stage_times::fine_raster);
        fragment_lists<std::uint32_t, values> sorted =
            sort_unordered(lists, order, {}, call.plan.num_primitives, spare, state, limits, stream, call.clock);
        launch_behind(shade_lists_kernel<all_values, scene_type, values>, fill_device(limits.fragments),
                      threads_per_block, stream, stage::abuffer_emit, s, sorted, payloads, state, limits);
        end_stage(call.clock, &stage_times::abuffer_emit);
        sorted.payloads = payloads;
        sorted.payloads_in_order = true;
        const auto tracking = call.track();
        call.clear_targets(tracking, state, stream);
        mark_voxels(tracking, sorted.voxels, &state->list_voxels, limits.fragments, state, limits, stream);
        fold_lists(sorted, call.plan.fb, call.plan.options.count_voxels, state, limits,
                   std::make_index_sequence<Call::groups::count>{}, stream, call.clock);
    }
};

} // namespace voxelpipe::device
