// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks from voxels: the voxels that keep a fragment, as an A-buffer lists them, and those that existed before. An
// index of the bricks numbers them, masks are filled by atomics, ranks come from a prefix sum. Bricks that were in
// tiles have all their voxels.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/sparse/device/brick_index.cuh>
#include <voxelpipe/sparse/device/mask_counts.cuh>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr std::uint32_t no_source = 0xffffffffu;

// Voxels that become bricks, at most 2^32 - 2 in all.
struct brick_voxels {
    const std::uint64_t* listed;          // linear numbers in the part of the grid
    std::uint32_t num_listed;             // how many, or at most
    glm::ivec3 extent, offset, whole;     // of the part; of the grid
    brick_table kept;                     // bricks that stay, and those of tiles that are drawn in
    const std::uint64_t* count = nullptr; // on the device: how many are listed, if the host does not know

    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t size() const {
        return count == nullptr ? num_listed : *count;
    }
};

// Arrays of the result, and where its voxels come from.
struct brick_arrays {
    std::uint64_t* keys;
    brick_mask* masks;
    std::uint64_t* offsets; // one more than bricks
    // For each voxel, by rank, its number in the list and its rank before; or no_source. existing: null if nothing
    // stays.
    std::uint32_t *listed, *existing;
};

// The place of a listed voxel in the whole grid. Most numbers fit 32 bits, whose divisions take a few instructions.
[[nodiscard]] __device__ VOXELPIPE_INLINE glm::ivec3 place_of(std::uint64_t voxel, const glm::ivec3& extent,
                                                              const glm::ivec3& offset) {
    if (voxel >> 32 == 0) {
        const voxel_position at = position_of(static_cast<std::uint32_t>(voxel), extent);
        return glm::ivec3(at.x, at.y, at.z) + offset;
    }
    const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
    return glm::ivec3(static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny),
                      static_cast<int>(voxel / (nx * ny))) +
           offset;
}

// Sets the bits of the cells of 2^shift voxels a side that voxels lie in.
template <int = 0> // compiled where it is called
__global__ void mark_listed_voxels(const brick_voxels from, index_level level, int shift) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= from.size()) return;
    const glm::ivec3 at = place_of(from.listed[i], from.extent, from.offset);
    const std::uint64_t key = short_morton_key(at.x >> shift, at.y >> shift, at.z >> shift);
    level.set(key, 1ull << (key & 63u));
}
template <int = 0> // compiled where it is called
__global__ void mark_kept_bricks(const brick_table table, index_level level, int shift) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= table.count || table.keys[i] == brick_table::none) return; // the table may have room; so below
    const std::uint64_t key = table.keys[i] >> (3 * (shift - core::log2_sparse_brick));
    level.set(key, 1ull << (key & 63u));
}
template <int = 0> // compiled where it is called
__global__ void mask_listed_voxels(const brick_voxels from, index_level bricks, brick_mask* masks) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= from.size()) return;
    const std::uint64_t key = core::morton_key(place_of(from.listed[i], from.extent, from.offset));
    const auto bit = static_cast<unsigned>(key % core::sparse_brick_voxels);
    brick_mask& mask = masks[bricks.number_of(key / core::sparse_brick_voxels)];
    atomicOr(reinterpret_cast<unsigned long long*>(&mask.words[bit / 64]), 1ull << (bit % 64));
}
// A thread has a word of a mask; so in place_kept_voxels.
template <int = 0> // compiled where it is called
__global__ void mask_kept_voxels(const brick_table table, index_level bricks, brick_mask* masks) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= table.count * 8 || table.keys[i / 8] == brick_table::none) return;
    const std::uint64_t word = table.masks[i / 8].words[i % 8];
    if (word == 0) return;
    brick_mask& mask = masks[bricks.number_of(table.keys[i / 8])];
    atomicOr(reinterpret_cast<unsigned long long*>(&mask.words[i % 8]), static_cast<unsigned long long>(word));
}
template <int = 0> // compiled where it is called
__global__ void place_listed_voxels(const brick_voxels from, index_level bricks, const brick_arrays to) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= from.size()) return;
    const std::uint64_t key = core::morton_key(place_of(from.listed[i], from.extent, from.offset));
    const std::uint32_t brick = bricks.number_of(key / core::sparse_brick_voxels);
    const auto bit = static_cast<unsigned>(key % core::sparse_brick_voxels);
    to.listed[to.offsets[brick] + to.masks[brick].before(bit)] = static_cast<std::uint32_t>(i);
}
template <int = 0> // compiled where it is called
__global__ void place_kept_voxels(const brick_table table, index_level bricks, const brick_arrays to) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= table.count * 8 || table.keys[i / 8] == brick_table::none) return;
    const auto w = static_cast<unsigned>(i % 8);
    std::uint64_t word = table.masks[i / 8].words[w];
    if (word == 0) return;
    std::uint64_t old = table.offsets[i / 8] + table.masks[i / 8].before(64 * w);
    const std::uint32_t brick = bricks.number_of(table.keys[i / 8]);
    const brick_mask& mask = to.masks[brick];
    const std::uint64_t rank = to.offsets[brick] + mask.before(64 * w);
    for (; word != 0; word &= word - 1, ++old) {
        const std::uint64_t below = (word & (~word + 1)) - 1;
        to.existing[rank + core::count_ones(mask.words[w] & below)] = static_cast<std::uint32_t>(old);
    }
}

// All voxels of the bricks that were in tiles.
template <int = 0> // compiled where it is called
__global__ void mask_bricks_of_tiles(const brick_table table, const std::uint64_t* keys, std::uint64_t bricks,
                                     brick_mask* masks) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= bricks || core::find_tile(table.tiles, table.num_tiles, keys[i]) == table.num_tiles) return;
    for (std::uint64_t& word : masks[i].words) word = ~std::uint64_t{0};
}
template <int = 0> // compiled where it is called
__global__ void place_voxels_of_tiles(const brick_table table, const std::uint64_t* keys, std::uint64_t bricks,
                                      const std::uint64_t* offsets, std::uint32_t* existing) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= bricks) return;
    const std::uint64_t tile = core::find_tile(table.tiles, table.num_tiles, keys[i]);
    if (tile == table.num_tiles) return;
    for (unsigned v = 0; v < core::sparse_brick_voxels; ++v)
        existing[offsets[i] + v] = static_cast<std::uint32_t>(table.num_in_bricks() + tile);
}

// allocate_bricks(bricks) gives the first three arrays, allocate_voxels(bricks, voxels) all; either may throw. Waits.
template <class AllocateBricks, class AllocateVoxels>
void build_bricks_by_index(const stream_memory& memory, const brick_voxels& from, const AllocateBricks& allocate_bricks,
                           const AllocateVoxels& allocate_voxels) {
    const cudaStream_t stream = memory.stream;
    constexpr stage where = stage::tile_resolve;
    constexpr unsigned threads = threads_per_block;
    const auto by_voxels = [&](auto* listed_kernel, auto* kept_kernel, std::uint64_t kept_threads,
                               const auto&... rest) {
        if (from.num_listed != 0)
            launch_kernel(false, listed_kernel, num_blocks(from.num_listed), threads, 0, stream, where, from, rest...);
        if (kept_threads != 0)
            launch_kernel(false, kept_kernel, num_blocks(kept_threads), threads, 0, stream, where, from.kept, rest...);
    };
    brick_index<> index(memory, from.whole);
    const std::uint64_t kept = from.kept.count;
    const auto mark = [&](const index_level& level, int log2_cell) {
        by_voxels(mark_listed_voxels<0>, mark_kept_bricks<0>, kept, level, log2_cell);
    };
    index.mark_above(mark);
    mark(index.bricks(), index_level::log2_brick);
    const std::uint64_t bricks = index.make_numbers();
    brick_arrays to = allocate_bricks(bricks);
    index.write_keys(to.keys);
    check(cudaMemsetAsync(to.masks, 0, bricks * sizeof(brick_mask), stream), where);
    by_voxels(mask_listed_voxels<0>, mask_kept_voxels<0>, kept * 8, index.bricks(), to.masks);
    const auto by_bricks = [&](auto* kernel, const auto&... rest) {
        if (from.kept.num_tiles != 0 && bricks != 0)
            launch_kernel(false, kernel, num_blocks(bricks), threads, 0, stream, where, from.kept,
                          static_cast<const std::uint64_t*>(to.keys), bricks, rest...);
    };
    by_bricks(mask_bricks_of_tiles<0>, to.masks);
    device_buffer<std::uint32_t> counts(memory, bricks);
    device_buffer<mask_totals> totals(memory, std::size_t{1});
    check(cudaMemsetAsync(totals.data(), 0, sizeof(mask_totals), stream), where);
    rank_bricks(memory, to.masks, static_cast<std::uint32_t>(bricks), counts.data(), to.offsets, totals.data(), where);
    mask_totals on_host{};
    check(cudaMemcpyAsync(&on_host, totals.data(), sizeof(on_host), cudaMemcpyDeviceToHost, stream), where);
    check(cudaStreamSynchronize(stream), where);
    to = allocate_voxels(bricks, on_host.voxels);
    if (to.existing != nullptr) // otherwise each voxel is listed
        for (std::uint32_t* const sources : {to.listed, to.existing})
            check(cudaMemsetAsync(sources, 0xff, on_host.voxels * sizeof(std::uint32_t), stream), where);
    by_voxels(place_listed_voxels<0>, place_kept_voxels<0>, kept * 8, index.bricks(), to);
    by_bricks(place_voxels_of_tiles<0>, static_cast<const std::uint64_t*>(to.offsets), to.existing);
    check(cudaStreamSynchronize(stream), where);
}

// Bricks of the union of the voxels.
template <class AllocateBricks, class AllocateVoxels>
void build_bricks(const stream_memory& memory, const brick_voxels& from, const AllocateBricks& allocate_bricks,
                  const AllocateVoxels& allocate_voxels) {
    if (from.num_listed == 0 && from.kept.count == 0) {
        (void)allocate_bricks(0);
        (void)allocate_voxels(0, 0);
    } else {
        build_bricks_by_index(memory, from, allocate_bricks, allocate_voxels);
    }
}

} // namespace voxelpipe::device
