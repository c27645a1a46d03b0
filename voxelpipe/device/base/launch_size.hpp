// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Block counts of kernel launches, in 64-bit arithmetic: at least 1, because 0 is an error, and at most the limit
// of a grid's x axis.

#include <cstdint>

namespace voxelpipe::core {

inline constexpr std::uint64_t max_blocks = 0x7fffffffu;

// Most elements that a call numbers with 32 bits: triangles, vertices, tile pairs, fragments. Larger numbers mark
// absent elements.
inline constexpr std::uint64_t max_numbered = 0xfffffff0u;

// For a kernel with one thread per item and no loop.
[[nodiscard]] constexpr unsigned blocks_for_each(std::uint32_t items, std::uint32_t per_block) {
    const std::uint32_t blocks = items / per_block + static_cast<std::uint32_t>(items % per_block != 0);
    return blocks == 0 ? 1 : blocks < max_blocks ? blocks : static_cast<unsigned>(max_blocks);
}

// For a kernel whose threads loop: enough blocks to fill the device, but no more than there is work for.
[[nodiscard]] constexpr unsigned blocks_to_fill(std::uint64_t items, std::uint32_t per_block,
                                                std::uint32_t multiprocessors,
                                                std::uint32_t blocks_per_multiprocessor) {
    const std::uint64_t resident = std::uint64_t{multiprocessors} * blocks_per_multiprocessor;
    const std::uint64_t max_useful = resident == 0 ? 1 : resident < max_blocks ? resident : max_blocks;
    const std::uint64_t wanted = items / per_block + static_cast<std::uint64_t>(items % per_block != 0);
    return static_cast<unsigned>(wanted == 0 ? 1 : wanted < max_useful ? wanted : max_useful);
}

} // namespace voxelpipe::core
