// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Morton keys: the bits of three coordinates in turn, x in the lowest bit of each triple, 21 bits an axis.

#include <voxelpipe/config.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Bit i of the lowest 21 moves to bit 3 * i.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t spread_bits(std::uint32_t n) {
    std::uint64_t b = n & 0x1fffffu;
    b = (b | b << 32) & 0x001f00000000ffffu;
    b = (b | b << 16) & 0x001f0000ff0000ffu;
    b = (b | b << 8) & 0x100f00f00f00f00fu;
    b = (b | b << 4) & 0x10c30c30c30c30c3u;
    return (b | b << 2) & 0x1249249249249249u;
}

// The inverse; bits in between are ignored.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t gather_bits(std::uint64_t b) {
    b &= 0x1249249249249249u;
    b = (b | b >> 2) & 0x10c30c30c30c30c3u;
    b = (b | b >> 4) & 0x100f00f00f00f00fu;
    b = (b | b >> 8) & 0x001f0000ff0000ffu;
    b = (b | b >> 16) & 0x001f00000000ffffu;
    return static_cast<std::uint32_t>((b | b >> 32) & 0x1fffffu);
}

// Coordinates are from 0 to 2^21 - 1.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t morton_key(int x, int y, int z) {
    return spread_bits(static_cast<std::uint32_t>(x)) | spread_bits(static_cast<std::uint32_t>(y)) << 1 |
           spread_bits(static_cast<std::uint32_t>(z)) << 2;
}
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t morton_key(const glm::ivec3& p) { return morton_key(p.x, p.y, p.z); }

[[nodiscard]] VOXELPIPE_HD inline glm::ivec3 morton_position(std::uint64_t key) {
    return {static_cast<int>(gather_bits(key)), static_cast<int>(gather_bits(key >> 1)),
            static_cast<int>(gather_bits(key >> 2))};
}

} // namespace voxelpipe::core
