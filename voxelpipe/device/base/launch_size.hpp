// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How many blocks a kernel is launched with, as plain arithmetic on 64 bits: never none, for that is an error, and
// never more than a grid can have along x.

#include <cstdint>

namespace voxelpipe::core {

inline constexpr std::uint64_t max_blocks = 0x7fffffffu;

// What a call numbers with 32 bits (triangles, vertices, tile pairs, fragments) is at most so many; the numbers above
// mark what there is none of.
inline constexpr std::uint64_t max_numbered = 0xfffffff0u;

// Of a kernel with a thread an item, which has no loop: items are numbered with 32 bits.
[[nodiscard]] constexpr unsigned blocks_for_each(std::uint32_t items, std::uint32_t per_block) {
    const std::uint32_t blocks = items / per_block + static_cast<std::uint32_t>(items % per_block != 0);
    return blocks == 0 ? 1 : blocks < max_blocks ? blocks : static_cast<unsigned>(max_blocks);
}

// Of a kernel whose threads loop: enough to fill the device, no more than there is work for, by a block or so.
[[nodiscard]] constexpr unsigned blocks_to_fill(std::uint64_t items, std::uint32_t per_block,
                                                std::uint32_t multiprocessors,
                                                std::uint32_t blocks_per_multiprocessor) {
    const std::uint64_t room = std::uint64_t{multiprocessors} * blocks_per_multiprocessor;
    const std::uint64_t most = room == 0 ? 1 : room < max_blocks ? room : max_blocks;
    const std::uint64_t wanted = items / per_block + static_cast<std::uint64_t>(items % per_block != 0);
    return static_cast<unsigned>(wanted == 0 ? 1 : wanted < most ? wanted : most);
}

} // namespace voxelpipe::core
