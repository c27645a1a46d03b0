// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A volume of which only the voxels exist that something was drawn in: the library's bricks of 8^3, and for each
// channel one value a voxel, in the Morton order of the voxels. The inside of a solid may be tiles, whose one value
// each follows.

#include "volume.hpp"

#include <voxelpipe/core/brick_table.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace voxelize {

struct sparse_volume {
    // Extent, origin and voxel size, without channels.
    volume shape;
    std::vector<std::uint64_t> keys;
    std::vector<voxelpipe::brick_mask> masks;
    std::vector<std::uint64_t> offsets;
    std::vector<voxelpipe::brick_tile> tiles;
    // The channel "occupancy", which every voxel here has, holds no data.
    std::vector<channel> channels;

    // Refers to the arrays.
    [[nodiscard]] voxelpipe::brick_table table() const {
        return {keys.data(),
                masks.data(),
                offsets.data(),
                keys.size(),
                glm::ivec3(shape.extent[0], shape.extent[1], shape.extent[2]),
                glm::ivec3(0),
                tiles.data(),
                tiles.size()};
    }
    [[nodiscard]] std::uint64_t num_voxels() const { return table().num_voxels(); }
    // Values of a channel: one a voxel in a brick, then one a tile.
    [[nodiscard]] std::uint64_t num_values() const { return table().num_values(); }
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t bytes = keys.size() * (sizeof(std::uint64_t) + sizeof(voxelpipe::brick_mask)) +
                              offsets.size() * sizeof(std::uint64_t) + tiles.size() * sizeof(voxelpipe::brick_tile);
        for (const channel& c : channels) bytes += c.data.size();
        return bytes;
    }
    [[nodiscard]] const channel* find(std::string_view name) const {
        for (const channel& c : channels)
            if (c.name == name) return &c;
        return nullptr;
    }
};

// The bits of each component of a voxel that does not exist.
[[nodiscard]] std::uint32_t empty_value(const channel& c);

// The dense volume without its memory: channels that read the bricks, as those do that can be streamed. Refers to V and
// to the channels.
[[nodiscard]] volume as_dense(const sparse_volume& v, std::span<const channel> channels);

// One volume of parts of one grid that share no brick; they have the same channels, which are freed one by one. Tiles
// that meet are joined as those of a whole are.
[[nodiscard]] sparse_volume join_slabs(std::vector<sparse_volume>&& parts);
// Copies values of a part's channel: `count` of them from number `first` on.
using slab_reader =
    std::function<void(std::size_t part, std::size_t channel, std::uint64_t first, std::uint64_t count, std::byte* to)>;
// One volume of parts whose channels hold no data: `read` copies their values. Each value is read once, or a few times
// if it is a tile's; those of a part's channel ascend.
[[nodiscard]] sparse_volume join_slabs(std::vector<sparse_volume>&& parts, const slab_reader& read);

// The same volume, in which those of `keys`, ascending, that lie in tiles are bricks; without keys, all bricks of
// tiles.
[[nodiscard]] sparse_volume open_tiles(const sparse_volume& v, const std::vector<std::uint64_t>* keys = nullptr);

// The voxels become those of V, which has none. Returns the places in `voxels` of the voxels in their order in V. None
// is listed twice.
[[nodiscard]] std::vector<std::uint32_t> set_voxels(sparse_volume& v, std::span<const glm::ivec3> voxels);

// The bricks of the occupied voxels of a dense volume, which has the channel "occupancy"; without channels.
[[nodiscard]] sparse_volume find_bricks(const volume& v, int threads);

// The occupied voxels of a dense volume, with the values of its other channels. It has the channel "occupancy".
[[nodiscard]] sparse_volume make_sparse(const volume& v, int threads);

} // namespace voxelize
