// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers of the raster without tiles, of coarse counting, and of clears: block sizes, the borders between size
// classes, queue lengths. Results do not depend on them. Measured on an NVIDIA H200; docs/optimizations.md has the
// gains. All "blocks" are per multiprocessor, and bound the registers.

#include <voxelpipe/core/coverage_rule.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::tuning {

// ---- size classes (device/raster/size_class.cuh) --------------------------------------------------------------------

inline constexpr int raster_threads = 128; // of a block
inline constexpr int group_lanes = 8;      // lanes that share one larger triangle

// Longest side of a bounding box, in voxels, that is drawn without a loop.
template <coverage Rule>
inline constexpr int max_tiny_side = Rule == coverage::thin ? 2 : 3;
inline constexpr int small_cells = 27;   // most voxels of size_class::thread
inline constexpr int small_columns = 12; // the same for thin coverage, in columns of voxels
inline constexpr int max_cells = 1024;   // most voxels of size_class::thread_heavy
inline constexpr int max_columns = 192;  // the same for thin coverage, in columns

// ---- the first pass (device/raster/raster.cuh) ----------------------------------------------------------------------

// Blocks of the first pass. stages: fragments are staged in shared memory.
[[nodiscard]] constexpr int first_blocks(coverage rule, bool stages) {
    return rule == coverage::thin || stages ? 6 : 8;
}
// Use the slim-box code if at least this many of the warp's triangles have a box three voxels long; it draws the
// smaller ones too, with 1.5 x the instructions of the cube code.
inline constexpr int min_slim = 3;
// Draw thin boxes of at most two voxels a side as soon as they are read, if a warp's 32 triangles have at least this
// many; fewer are queued until all lanes have one.
inline constexpr int min_thin_cubes = 16;
// Triangles per voxel of three faces of the grid from which on batches are tried as close cubes. On a surface as large
// as these faces, 32 triangles then cover at most five voxels.
inline constexpr std::uint64_t min_close_triangles = 6;
// Batches of a warp of which only one is tried as close cubes, after one that was not close.
inline constexpr std::uint32_t batches_not_close = 16;
// Blocks of the first pass for targets of values (device/raster/block_pass.cuh).
inline constexpr int value_blocks = 5;

inline constexpr int queue_slots = 64;  // of a warp's queue of triangles: up to 31 wait when a warp adds up to 32
inline constexpr int class_slots = 128; // of a warp's queue of deferred triangles of one class: long, for few atomics

// ---- the deferred pass (device/raster/deferred_pass.cuh) ------------------------------------------------------------

[[nodiscard]] constexpr int deferred_blocks(coverage rule, bool stages) {
    return stages ? 4 : rule == coverage::thin ? 6 : 5;
}
// log2 of the parts in which the lists of all classes advance together.
inline constexpr int max_part_bits = 6;
// log2 of the words of bits that a warp gathers before it writes them (device/raster/warp_combine.cuh).
inline constexpr int log2_word_slots = 8;

// ---- split triangles (device/raster/split_triangles.cuh) ------------------------------------------------------------

// Pieces of a work item, one per lane or group of lanes. Few for conservative coverage: the bricks of a column keep
// eight lanes busy, and a floor or a wall would otherwise make one warp finish last.
template <coverage Rule>
inline constexpr int pieces_per_work_item = Rule == coverage::thin ? 32 : 8;
// All triangles are set up before their work items are drawn if each warp has at least this many.
inline constexpr unsigned min_items_for_setups = 3;
inline constexpr std::size_t max_setups = 1u << 14; // that are kept
// Largest side of a sparse grid whose bricks are marked without kept setups, which would take more than the result.
inline constexpr int max_extent_without_setups = 4096;
inline constexpr int setup_polls = 256; // of their number, before a warp sets up its own
inline constexpr int max_bricks = 64;   // that wait in a warp

// ---- counting and emitting cells (device/scene/count_and_emit.cuh) --------------------------------------------------

inline constexpr int count_emit_min_blocks = 3; // blocks of its kernels
// Most columns of cells of a triangle that one thread takes; a warp takes a larger one. Tiles, and voxels.
inline constexpr std::int64_t small_tile_columns = 16, small_fragment_columns = 256;
inline constexpr unsigned coarse_triangles = 4; // of a thread, which the coarse raster takes together
inline constexpr int wide_batch = 8;            // spans of the 128-bit path at a time

// ---- clears and last passes (device/targets/) -----------------------------------------------------------------------

// 16-byte stores of a thread. A block fills 16 KB and ends: 4 GiB take 0.92 ms, against 1.0 ms with persistent blocks.
inline constexpr unsigned fill_stores = 4;
// Bit targets within these sizes, which exceed the cache, are written past it, so that it keeps what it has of the
// mesh: calls at 1024^3 took 0.3 to 2 % less on average. Values are written through the cache: streaming made no
// difference at 512 MB and cost 1 % at 4 GiB.
inline constexpr std::uint64_t min_streamed = std::uint64_t{64} << 20, max_streamed = std::uint64_t{256} << 20;
inline constexpr unsigned last_pass_loads = 4; // in flight per thread

} // namespace voxelpipe::tuning
