// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The division of a grid into tiles.

#include <voxelpipe/config.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Divides the extent into cubic tiles of 2^log2_size voxels a side, numbered x fastest.
struct tile_grid {
    int log2_size;
    glm::ivec3 tiles;

    VOXELPIPE_HD
    tile_grid(glm::ivec3 extent, int log2_size_)
        : log2_size(log2_size_),
          tiles((extent.x + (1 << log2_size_) - 1) >> log2_size_, (extent.y + (1 << log2_size_) - 1) >> log2_size_,
                (extent.z + (1 << log2_size_) - 1) >> log2_size_) {}

    [[nodiscard]] VOXELPIPE_HD std::uint64_t count() const {
        return static_cast<std::uint64_t>(tiles.x) * static_cast<std::uint64_t>(tiles.y) *
               static_cast<std::uint64_t>(tiles.z);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return (static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(tiles.y) + static_cast<std::uint64_t>(y)) *
                   static_cast<std::uint64_t>(tiles.x) +
               static_cast<std::uint64_t>(x);
    }
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 position(std::uint64_t tile) const {
        const auto x = static_cast<std::uint64_t>(tiles.x), y = static_cast<std::uint64_t>(tiles.y);
        return {static_cast<int>(tile % x), static_cast<int>(tile / x % y), static_cast<int>(tile / (x * y))};
    }
};

} // namespace voxelpipe::core
