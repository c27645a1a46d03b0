// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile split: runs of equal tile -> work items of at most `pairs_per_item` pairs. A tile with more pairs becomes
// several items (the paper's virtual tiles), each with its own image, which tile_resolve merges. Runs on the device.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

namespace voxelpipe::device {

inline constexpr std::uint32_t no_image = 0xffffffffu;

struct work_item {
    std::uint32_t tile, first, count;
    std::uint32_t image; // of a split tile; no_image otherwise
};
struct split_tile {
    std::uint32_t tile, first_image, num_images;
};

// Most images of a split tile that warps resolve without waiting for each other.
inline constexpr std::uint32_t max_narrow_split = 32;

struct split_buffers {
    work_item* items;
    split_tile* splits;
    std::uint32_t pairs_per_item;
};

// Upper bounds, for allocation: one item per occupied tile, plus the items of split tiles, each more than half full.
[[nodiscard]] inline std::uint64_t max_images(std::uint64_t pair_capacity, std::uint32_t pairs_per_item) {
    return 2 * pair_capacity / pairs_per_item + 1;
}
[[nodiscard]] inline std::uint64_t max_items(std::uint64_t pair_capacity, std::uint64_t num_tiles,
                                             std::uint32_t pairs_per_item) {
    return (num_tiles < pair_capacity ? num_tiles : pair_capacity) + max_images(pair_capacity, pairs_per_item);
}

// Divides the runs of sorted keys, state->tile_pairs of them, into work items.
VOXELPIPE_DECLARES_KERNELS void tile_split(const std::uint32_t* keys, const split_buffers& out, pipeline_state* state,
                                           const capacities& limits, cudaStream_t stream);

// Resets the item counter, for the fine raster of another group of targets.
VOXELPIPE_DECLARES_KERNELS void restart_items(pipeline_state* state, cudaStream_t stream);

} // namespace voxelpipe::device
