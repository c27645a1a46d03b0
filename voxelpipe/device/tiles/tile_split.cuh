// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile split: runs of equal tile -> work items of at most `pairs_per_item` pairs. A tile with more becomes several
// items (the paper's virtual tiles), each with an image of its own that tile_resolve merges. All on the device.

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

// Item is work_item: kernels in headers are templates, so that any number of translation units may hold them.
template <class Item = work_item>
struct split_buffers {
    Item* items;
    split_tile* splits;
    std::uint32_t pairs_per_item;
};

// Upper bounds, for allocation: an item per occupied tile, and the items of split tiles, each more than half full.
[[nodiscard]] inline std::uint64_t max_images(std::uint64_t pair_capacity, std::uint32_t pairs_per_item) {
    return 2 * pair_capacity / pairs_per_item + 1;
}
[[nodiscard]] inline std::uint64_t max_items(std::uint64_t pair_capacity, std::uint64_t num_tiles,
                                             std::uint32_t pairs_per_item) {
    return (num_tiles < pair_capacity ? num_tiles : pair_capacity) + max_images(pair_capacity, pairs_per_item);
}

template <class Item>
__global__ void tile_split_kernel(const std::uint32_t* keys, split_buffers<Item> out, pipeline_state* state,
                                  capacities limits) {
    if (has_failed(*state, limits)) return;
    const auto num_pairs = static_cast<std::uint32_t>(state->tile_pairs);
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= num_pairs) return;
    const std::uint32_t tile = keys[i];
    if (i != 0 && keys[i - 1] == tile) return;
    // First position after the run: doubling steps from its start, then halving.
    const auto first = static_cast<std::uint32_t>(i);
    std::uint64_t lo = first, step = 1;
    while (lo + step < num_pairs && keys[lo + step] == tile) {
        lo += step;
        step *= 2;
    }
    std::uint64_t hi = lo + step < num_pairs ? lo + step : num_pairs;
    while (hi - lo > 1) {
        const std::uint64_t middle = lo + (hi - lo) / 2;
        if (keys[middle] == tile)
            lo = middle;
        else
            hi = middle;
    }
    const auto count = static_cast<std::uint32_t>(hi - first);
    const std::uint32_t parts = (count + out.pairs_per_item - 1) / out.pairs_per_item;
    const std::uint32_t at = atomicAdd(&state->num_items, parts);
    if (parts == 1) {
        out.items[at] = {tile, first, count, no_image};
        return;
    }
    const std::uint32_t image = atomicAdd(&state->num_images, parts);
    out.splits[atomicAdd(&state->num_splits, 1u)] = {tile, image, parts};
    const std::uint32_t each = (count + parts - 1) / parts;
    for (std::uint32_t p = 0; p < parts; ++p) {
        const std::uint32_t begin = p * each < count ? p * each : count;
        const std::uint32_t end = begin + each < count ? begin + each : count;
        out.items[at + p] = {tile, first + begin, end - begin, image + p};
    }
}

inline void tile_split(const std::uint32_t* keys, const split_buffers<>& out, pipeline_state* state,
                       const capacities& limits, cudaStream_t stream) {
    tile_split_kernel<<<num_blocks(limits.tile_pairs), threads_per_block, 0, stream>>>(keys, out, state, limits);
    check(cudaGetLastError(), stage::tile_split);
}

} // namespace voxelpipe::device
