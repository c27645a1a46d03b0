// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers of fragment lists: staging, sorts, the order within voxels, reduction and folds; and of the queues of the
// fine raster and tile resolve. Results do not depend on them. Measured on an NVIDIA H200; docs/optimizations.md has
// the gains.

#include <cstddef>
#include <cstdint>

namespace voxelpipe::tuning {

// ---- staging in the raster (device/fragments/list_sink.cuh) ---------------------------------------------------------

// Fragments that a warp stages in shared memory: together with the queues, less than 48 KB a block. The deferred pass
// has fewer blocks, and triangles of many rows.
inline constexpr unsigned staged_fragments = 448, deferred_staged_fragments = 960, deferred_flush_at = 192;

// ---- radix sort (device/fragments/radix_sort.cuh) -------------------------------------------------------------------

inline constexpr int sort_threads = 512;  // of a block, which sorts a tile
inline constexpr int sort_items = 16;     // pairs per thread
inline constexpr int few_sort_items = 8;  // if the device runs all tiles at once: shorter tiles finish sooner
inline constexpr int max_digit_bits = 10; // 30 bits of a voxel of 1024^3 are three passes
inline constexpr int digit_count_threads = 1024;
[[nodiscard]] constexpr int sort_blocks(int items) { return items == few_sort_items ? 3 : 2; } // per multiprocessor

// ---- key sort and selection (device/scene/) -----------------------------------------------------------------------

inline constexpr int key_sort_threads = 512; // of a block, which sorts a tile
inline constexpr int key_sort_items = 8;     // pairs per thread: 16 KB of shared memory
inline constexpr int max_key_digit_bits = 9; // one digit per thread; 18 bits of a tile's number are two passes
inline constexpr int key_sort_blocks = 3;    // per multiprocessor
inline constexpr int selection_items = 8;    // elements per thread

// ---- counting sort (device/fragments/counting_sort.cuh) -------------------------------------------------------------

inline constexpr unsigned counting_items = 8;                               // independent fragments of a thread
inline constexpr unsigned counting_threads = 1024;                          // of a block that lists voxels
inline constexpr std::uint32_t counting_tile = 16384;                       // voxels of such a block
inline constexpr std::uint64_t max_counted_voxels = std::uint64_t{1} << 21; // of a grid: the counters fit the cache

// ---- order within voxels (device/fragments/order_memory.cuh) --------------------------------------------------------

inline constexpr std::uint32_t window_length = 192; // a warp takes the voxels that begin in this many fragments
inline constexpr std::uint32_t max_of_window = 256; // most fragments of a voxel that a window orders
inline constexpr std::uint32_t max_of_block = 4096; // that a block orders; longer voxels are divided into runs
inline constexpr int order_warps = 4;               // of a block that takes windows
inline constexpr int order_blocks = 8;              // of these per multiprocessor
inline constexpr int block_sort_threads = 256;
inline constexpr std::uint32_t merge_ways = 64; // runs that one merge takes
// A voxel of more than max_of_block fragments is dense if at least one in min_dense of all primitives is in it. Then a
// bit for each primitive orders it, by blocks for dense_part bits each, all of which read the whole voxel. So all bits
// of a call are a few words per fragment.
inline constexpr std::uint32_t dense_part = 1u << 15, max_dense_parts = 64, min_dense = 64;
inline constexpr int dense_threads = 1024;

// ---- reduction and folds --------------------------------------------------------------------------------------------

inline constexpr std::uint32_t resolve_run = 256;       // fragments of a run (device/fragments/segmented_reduce.cuh)
inline constexpr std::size_t max_cell_bytes = 128;      // of a voxel's partial results, which shuffles move
inline constexpr std::uint32_t max_folded_alone = 1024; // most fragments of a voxel that one thread folds (fold.cuh)
inline constexpr unsigned max_long_in_order = 32;       // most longer voxels of a block that are folded one by one
inline constexpr int fold_bytes = 8 * 1024;             // of shared memory, for values of fragments

// ---- fine raster and tile resolve (device/tiles/) -------------------------------------------------------------------

inline constexpr int unit_columns = 32;      // approximate columns of a unit of a larger triangle
inline constexpr int queue_capacity = 2048;  // fragments of small triangles that wait in a block
inline constexpr int max_queue_cells = 1024; // most voxels of a bounding box within the tile whose fragments are queued
inline constexpr int resolve_bytes = 16 * 1024; // of shared memory for partial cells, one target after the other
// Most pairs of a work item: makes enough items for the device, and few images of split tiles.
[[nodiscard]] constexpr std::uint32_t default_pairs_per_item(std::uint64_t pair_capacity) {
    return static_cast<std::uint32_t>(pair_capacity / 1024 > 512 ? pair_capacity / 1024 : 512);
}

} // namespace voxelpipe::tuning
