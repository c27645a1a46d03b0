// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers that choose between strategies and between ways to launch a call. Results do not depend on them. Measured on
// an NVIDIA H200 unless a comment names another device; docs/optimizations.md has the gains.

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::tuning {

// ---- the strategy of a framebuffer call (device/call/strategy.hpp) --------------------------------------------------

// The raster is launched once per draw. Calls of more draws go through tiles, whose launches take all draws.
inline constexpr std::size_t max_raster_draws = 16;

// A raster without tiles draws many instances in passes of at most max_pass_triangles, or of one instance, in some 25
// bytes a triangle and 40 a vertex. In grids whose triangles may have so much work that it could not be numbered,
// passes are smaller, down to the minimum. 10^6 instances of 980 triangles into bits at 1024^3, in passes of 2^21,
// 2^22, 2^23 and 2^24 triangles: 64.9, 49.4, 40.3 and 34.3 ms (H200).
inline constexpr std::uint64_t max_pass_triangles = std::uint64_t{1} << 24, min_pass_triangles = std::uint64_t{1} << 21;

// The last pass of a mask reads all of it, so larger ones are not used.
inline constexpr std::uint64_t max_mask_bytes = std::uint64_t{512} << 20;
// If the targets could also be blended in place, a mask pays up to this size, as long as it stays in L2, and if voxels
// are counted, values are cleared or indices must be checked anyway.
inline constexpr std::uint64_t max_mask_bytes_in_place = std::uint64_t{32} << 20;
// Otherwise it pays up to a size that grows with the triangles. 16 MB and the 871,000 triangles of the dragon: 0.0976
// ms instead of 0.0935; 2.9 million triangles: the same; 7.2 million: 0.173 instead of 0.193.
inline constexpr std::uint64_t min_mask_bytes = std::uint64_t{1} << 20, mask_bytes_per_triangle = 6;

// Targets of at least this size are worth marks: reading them takes longer than marking.
inline constexpr std::uint64_t marked_bytes = std::uint64_t{32} << 20;
// Tiles take over if counted targets without marks have more bytes than counted_bytes plus this per triangle: their
// last pass reads the whole grid, but tiles only what is touched. At 4 TB/s these bytes take 4 ns, as much as a few
// fragments cost in tiles.
inline constexpr std::uint64_t counted_bytes_per_triangle = 16384, counted_bytes = marked_bytes;
// Bits up to this size are counted after drawing, which takes as long as the clear. Atomics that report first touches
// make every warp wait; beyond this size they take less time than counting.
inline constexpr std::uint64_t max_counted_bits = std::uint64_t{256} << 20;

// Fragments per voxel, on average, from which on an A-buffer sorts them by counting. With 16 and 21, as on hairball,
// that took 1 to 3 % longer than the radix sort; with 35 and more, 9 to 19 % less (whole calls at 128^3).
inline constexpr std::uint64_t min_counted = 24;

// ---- launches -------------------------------------------------------------------------------------------------------

// Elements that a call of n triangles gets room for if nothing is known of it: tile pairs, tile records, fragments and
// fragment records. Fits meshes whose triangles are mostly smaller than a tile.
[[nodiscard]] constexpr std::array<std::uint64_t, 4> first_capacities(std::uint64_t n) {
    return {n + n / 4 + 16384, n / 16 + 4096, 4 * n + 65536, n / 16 + 4096};
}

// Deferred triangles per block, on average, up to which a call is launched without a deferred pass: each block of the
// first pass draws its own at its end, which takes no longer than a second kernel takes to start. At most
// max_left_blocks blocks per multiprocessor count.
inline constexpr std::uint64_t max_left_of_block = 14, max_left_blocks = 6;

// Equal calls after which a call is kept as a CUDA graph: making one costs as much as ten calls save.
inline constexpr int worth_a_graph = 3;

// Polls of the page with the counters before a call blocks, and polls between two queries of the stream. A poll takes
// one or two nanoseconds, so calls of milliseconds block.
inline constexpr unsigned max_looks = 1u << 20, looks_between = 1u << 14;

} // namespace voxelpipe::tuning
