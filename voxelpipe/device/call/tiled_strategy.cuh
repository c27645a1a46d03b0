// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Strategy tiled: the pipeline of the paper (section 4). Vertex shade, coarse raster, tile sort and tile split turn
// triangles into work items; fine raster draws these in shared memory, and tile resolve writes the targets. Targets
// whose blend depends on the order are folded from lists of fragments, which are counted before they are written.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/fold.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/device/targets/tracked_clear.cuh>
#include <voxelpipe/device/tiles/tile_passes.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>
#include <voxelpipe/voxelize.hpp>

#include <cstdint>
#include <optional>

namespace voxelpipe::device {

// Key: voxel id in the lists of ordered targets.
template <class Call, class Key>
struct tiled_strategy {
    using framebuffer_type = typename Call::framebuffer_type;
    using groups = typename Call::groups;
    using values = typename Call::values;
    static constexpr bool has_tiles = groups::num_groups() > 0;

    const Call& call;
    typename Call::scene_buffers buffers;
    std::optional<tile_memory> tiles;
    list_buffers<Key, values> lists{};
    std::optional<list_memory> list_scratch;

    tiled_strategy(const Call& c, arena& memory) : call(c), buffers(memory, c.draws) {
        constexpr int log2_size = Call::policy.log2_tile_size;
        const auto& limits = c.plan.limits;
        if constexpr (has_tiles)
            tiles.emplace(memory, core::tile_grid(c.plan.g.extent, log2_size), limits,
                          max_image_words<log2_size, framebuffer_type>(),
                          tuning::default_pairs_per_item(limits.tile_pairs));
        if constexpr (groups::has_ordered) {
            lists = take_lists<Key, values>(memory, num_voxels(c.plan.g), limits.fragments);
            list_scratch.emplace(memory, c.plan.num_primitives, limits.fragment_records);
        }
    }

    template <coverage Rule>
    void launch(pipeline_state* state, cudaStream_t stream) {
        const capacities& limits = call.plan.limits;
        const voxelize_options& options = call.plan.options;
        const typename Call::scene_type s = buffers.shade(call.draws, call.plan.g, stream, core::arms_of(options.rule));
        end_stage(call.clock, &stage_times::vertex_shade);
        tile_work work;
        if constexpr (has_tiles) work = coarse_pass<Rule>(s.geo, *tiles, state, limits, stream, call.clock);
        fragment_lists<Key, values> ordered{};
        if constexpr (groups::has_ordered)
            ordered = build_lists<Rule, all_values>(s, lists, list_scratch->with(state), state, limits, !has_tiles,
                                                    stream, call.clock);
        call.clear_targets({}, state, stream);
        // Fragments and voxels are counted once: by the lists, if there are any.
        if constexpr (has_tiles)
            fine_pass<Rule, Call::policy>(s, call.plan.fb, work,
                                          {!groups::has_ordered, !groups::has_ordered && options.count_voxels}, state,
                                          limits, stream, call.clock);
        if constexpr (groups::has_ordered)
            fold_ordered(ordered, call.plan.fb, options.count_voxels, state, limits, stream, call.clock);
    }
};

} // namespace voxelpipe::device
