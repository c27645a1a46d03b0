// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The two passes that draw in tiles, for voxelize and for other drivers. A coarse pass (coarse raster, tile sort, tile
// split) turns triangles into work items; a fine pass (fine raster, tile resolve) draws these into the targets of a
// framebuffer. The result of a coarse pass depends on triangles, coverage and tile size alone: it serves any number of
// fine passes, each with its own shaders and targets. Nothing here waits or allocates.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/tiles/tile_resolve.cuh>
#include <voxelpipe/device/tiles/tile_split.cuh>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace voxelpipe::device {

// ---- images of target groups ----------------------------------------------------------------------------------------

template <int Log2Size, class Framebuffer, std::size_t... I>
tile_image<Log2Size, Framebuffer, I...> image_type(std::index_sequence<I...>);

// The image of a group in a tile of 2^Log2Size voxels a side.
template <int Log2Size, class Framebuffer, int Group>
using group_image =
    decltype(image_type<Log2Size, Framebuffer>(typename target_groups<Framebuffer>::template indices<Group>{}));

// Words of the largest image of a framebuffer's groups; 0 if none is drawn in tiles.
template <int Log2Size, class Framebuffer>
[[nodiscard]] constexpr int max_image_words() {
    int most = 0;
    [&]<int... G>(std::integer_sequence<int, G...>) {
        ((most = group_image<Log2Size, Framebuffer, G>::words > most ? group_image<Log2Size, Framebuffer, G>::words
                                                                     : most),
         ...);
    }
    (std::make_integer_sequence<int, target_groups<Framebuffer>::num_groups()>{});
    return most;
}

// ---- the coarse pass ------------------------------------------------------------------------------------------------

// Arrays of a coarse pass, and memory for the images of split tiles, which the fine passes use one after the other.
// Uses limits.tile_pairs and limits.tile_records.
struct tile_memory {
    core::tile_grid tiles;
    cell_buffers cells{};
    std::uint32_t *keys[2], *primitives[2];
    split_buffers split{};
    word* images;
    int bits;      // of a tile's number
    void* storage; // of the sort
    std::size_t storage_bytes;

    // image_words: max_image_words of the fine passes to come.
    tile_memory(arena& memory, const core::tile_grid& tiles_, const capacities& limits, int image_words,
                std::uint32_t pairs_per_item)
        : tiles(tiles_), bits(key_bits(tiles_.count())) {
        for (int i = 0; i < 2; ++i) {
            keys[i] = memory.take<std::uint32_t>(limits.tile_pairs);
            primitives[i] = memory.take<std::uint32_t>(limits.tile_pairs);
        }
        cells.records = memory.take<chunk_record>(limits.tile_records);
        cells.record_capacity = limits.tile_records;
        const std::uint64_t num_images = max_images(limits.tile_pairs, pairs_per_item);
        split.pairs_per_item = pairs_per_item;
        split.items = memory.take<work_item>(max_items(limits.tile_pairs, tiles.count(), pairs_per_item));
        split.splits = memory.take<split_tile>(num_images);
        images = memory.take<word>(num_images * static_cast<std::uint64_t>(image_words));
        storage_bytes = sort_bytes<std::uint32_t>(limits.tile_pairs, bits);
        storage = memory.take<std::byte>(storage_bytes);
    }
};

// Output of a coarse pass for fine passes: sorted pairs and work items. Their numbers are in the state.
struct tile_work {
    const std::uint32_t* tile_numbers = nullptr; // of the sorted pairs
    fine_raster_input in{nullptr, nullptr, nullptr, {glm::ivec3(1), 3}, false, false, false};
    const split_tile* splits = nullptr;
};

// Counts triangles in the state, which must be zero before.
template <coverage Rule>
[[nodiscard]] tile_work coarse_pass(const geometry& geo, const tile_memory& m, pipeline_state* state,
                                    const capacities& limits, cudaStream_t stream, stage_clock* clock = nullptr);

// ---- a fine pass ----------------------------------------------------------------------------------------------------

// The counters of the state that a fine pass adds to. Of several passes over the same triangles, one counts the
// fragments.
struct pass_counters {
    bool fragments = true;
    bool voxels = true;
};

// Draws the targets of one group.
template <coverage Rule, tuning::fine_raster_policy Policy, int Group, class Scene, class Framebuffer>
void draw_group(const Scene& s, const Framebuffer& fb, const tile_work& work, const pass_counters& counted,
                pipeline_state* state, const capacities& limits, cudaStream_t stream, stage_clock* clock) {
    using image = group_image<Policy.log2_tile_size, Framebuffer, Group>;
    fine_raster_input in = work.in;
    in.count_fragments = Group == 0 && counted.fragments;
    in.count_voxels = Group == 0 && counted.voxels;
    in.track = in.count_voxels || image::has_atomic || image::has_winner;
    draw_tiles<Rule, image, Policy.threads_per_block, Policy.min_blocks_per_sm>(s, fb, in, work.splits, state, limits,
                                                                                Policy.blocks_per_sm, stream, clock);
}

// Draws the work items into all targets except those that are folded in order (fragments/fold.cuh), group by group.
// Cleared targets already hold their clear values (targets/clear_target.cuh). The policy's tile size must be that of
// the coarse pass.
template <coverage Rule, tuning::fine_raster_policy Policy, class Scene, class Framebuffer>
void fine_pass(const Scene& s, const Framebuffer& fb, const tile_work& work, const pass_counters& counted,
               pipeline_state* state, const capacities& limits, cudaStream_t stream, stage_clock* clock = nullptr) {
    [&]<int... G>(std::integer_sequence<int, G...>) {
        (draw_group<Rule, Policy, G>(s, fb, work, counted, state, limits, stream, clock), ...);
    }
    (std::make_integer_sequence<int, target_groups<Framebuffer>::num_groups()>{});
}

} // namespace voxelpipe::device
