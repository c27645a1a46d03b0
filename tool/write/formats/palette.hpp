// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reduces a set of colours to a small palette, the same way on every machine: integer arithmetic only, ties broken by
// order. Exact when the colours fit. Otherwise median cut (P. Heckbert, "Color image quantization for frame buffer
// display", SIGGRAPH 1982) on the most varied box, then two rounds of moving each entry to the mean of the colours
// nearest to it.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelize {

using rgb8 = std::array<std::uint8_t, 3>;

// One distinct colour and how many voxels have it (>= 1).
struct counted_color {
    rgb8 color;
    std::uint32_t count;
};

struct palette {
    std::vector<rgb8> entries;          // at most max_entries, ascending, no two alike
    std::vector<std::uint8_t> entry_of; // for each input colour the index of its entry
};

// max_entries is 1..256.
[[nodiscard]] palette make_palette(std::span<const counted_color> colors, std::size_t max_entries);

} // namespace voxelize
