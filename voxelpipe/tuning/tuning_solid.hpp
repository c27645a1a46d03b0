// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers of solids on a GPU (device/solid). Results do not depend on them. Measured on an NVIDIA H200. All "blocks"
// are per multiprocessor, and bound the registers.

#include <cstdint>

namespace voxelpipe::tuning {

// ---- crossings (solid/device/small_rows.cuh, large_rows.cuh) --------------------------------------------------------

inline constexpr int small_row_blocks = 3;        // of the first pass
inline constexpr std::uint32_t looks_at_once = 4; // triangles of a lane whose corners are loaded together
inline constexpr int lines_at_once = 16;          // lines of a lane's triangle whose rows are kept
// About the crossings of a lane's triangle; one of more is cut into work items.
inline constexpr int small_crossing_count = 64;

inline constexpr int large_row_blocks = 2;
inline constexpr int lines_per_item = 32; // of a work item: rows of one z, one a lane
inline constexpr int rows_per_line = 256; // of a work item
inline constexpr int wide_line_batch = 8; // crossings that the 128-bit path returns at once

// ---- rows of bits (solid/device/parity_rows.cuh, fill_bit_rows.cuh) -------------------------------------------------

inline constexpr int parity_blocks = 4;
inline constexpr std::uint32_t row_words = 4;    // of a lane: one store of 16 bytes
inline constexpr std::uint32_t parity_loads = 4; // groups of row_words that are loaded before the first is used
// Entries of a row that a lane sorts in registers, a power of two; longer rows are a warp's.
inline constexpr std::uint32_t lane_entries = 32;
inline constexpr int fill_blocks = 4;

// ---- repair::exterior (solid/device/flood_tiles.cuh) ----------------------------------------------------------------

inline constexpr int flood_tile_z = 16; // of a tile of 32 x 32 x 16 voxels, which a warp has in registers
inline constexpr int flood_blocks = 3;
inline constexpr int flood_launches = 16; // between two looks of the host; they end at once when nothing changes
inline constexpr int flood_passes = 8;    // of a launch over its tiles, as long as some of a warp's have work

} // namespace voxelpipe::tuning
