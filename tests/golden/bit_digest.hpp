// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A hash of the set voxels of a bit grid, and random picks from it.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scenes {

// FNV-1a, 64 bits, over (8-byte word number, 4-byte word) of every word that is not zero, in order, little-endian.
inline std::uint64_t digest(const std::vector<std::uint32_t>& words) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&](std::uint64_t value, int bytes) {
        for (int i = 0; i < bytes; ++i) hash = (hash ^ ((value >> (8 * i)) & 0xffu)) * 0x100000001b3u;
    };
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == 0) continue;
        add(i, 8);
        add(words[i], 4);
    }
    return hash;
}

inline std::uint64_t count_bits(const std::vector<std::uint32_t>& words) {
    std::uint64_t n = 0;
    for (const std::uint32_t w : words) n += static_cast<unsigned>(std::popcount(w));
    return n;
}

} // namespace scenes
