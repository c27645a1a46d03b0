// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A tile: a cube of 8^level bricks in which every voxel exists and all have one value. Its bricks are consecutive in
// Morton order, so a tile is the key of its first brick and a level, in one word; words ascend as the keys do.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/morton.hpp>

#include <glm/vec3.hpp>

#include <bit>
#include <cstdint>

namespace voxelpipe {

// A cube of 8^level bricks, all full and of one value, aligned to its size. One word.
struct brick_tile {
    static constexpr int level_bits = 5; // of `bits`, the lowest

    std::uint64_t bits = 0; // the first brick's key, then the level

    // `first` is a multiple of 8^level.
    [[nodiscard]] VOXELPIPE_HD static constexpr brick_tile of(std::uint64_t first, int level) {
        return {first << level_bits | static_cast<std::uint64_t>(level)};
    }
    // The Morton key of its first brick.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t first() const { return bits >> level_bits; }
    // 0: one brick.
    [[nodiscard]] VOXELPIPE_HD constexpr int level() const { return static_cast<int>(bits & ((1u << level_bits) - 1)); }
    // The key behind that of its last brick.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t end() const {
        return first() + (std::uint64_t{1} << (3 * level()));
    }
    // Voxels a side: 8, 16, 32 ...
    [[nodiscard]] VOXELPIPE_HD constexpr int side() const { return 8 << level(); }
    // Voxels in all.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t num_voxels() const {
        return std::uint64_t{1} << (3 * (level() + 3));
    }
    // Its first voxel in the whole grid.
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 origin() const {
        const glm::ivec3 brick = core::morton_position(first());
        return {brick.x * 8, brick.y * 8, brick.z * 8};
    }
    // No tile. Fills the rest of an array with room for more: no brick has its key, and it sorts to the end.
    [[nodiscard]] VOXELPIPE_HD static constexpr brick_tile none() { return of(~std::uint64_t{0} >> level_bits, 0); }
    friend constexpr bool operator==(const brick_tile&, const brick_tile&) = default;
};

namespace core {

// How many of `count` tiles in order begin at this key or before, by bisection.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t num_tiles_up_to(const brick_tile* tiles, std::uint64_t count,
                                                                std::uint64_t key) {
    return bisect(count, [=](std::uint64_t i) { return tiles[i].first() <= key; });
}
// The number of the tile that has the brick with this key; `count` if no tile has it.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t find_tile(const brick_tile* tiles, std::uint64_t count,
                                                          std::uint64_t key) {
    const std::uint64_t first = num_tiles_up_to(tiles, count, key);
    return first != 0 && key < tiles[first - 1].end() ? first - 1 : count;
}

// The level of the largest tile that begins at brick `begin` and ends at `end` at the latest; begin < end.
[[nodiscard]] VOXELPIPE_HD inline int level_of_tile(std::uint64_t begin, std::uint64_t end) {
    int level = 0;
    while (level < 17) {
        const std::uint64_t size = std::uint64_t{8} << (3 * level);
        if ((begin & (size - 1)) != 0 || end - begin < size) break;
        ++level;
    }
    return level;
}

} // namespace core
} // namespace voxelpipe
