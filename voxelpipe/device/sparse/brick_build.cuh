// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks from voxels: the voxels that keep a fragment, as an A-buffer lists them, and those that existed before. An
// index of the bricks numbers them, masks are filled by atomics, ranks come from a prefix sum. Grids beyond the index
// sort Morton keys instead: equal keys are one voxel and equal leading bits one brick.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/scene/cub_sort.cuh>
#include <voxelpipe/device/sparse/brick_index.cuh>
#include <voxelpipe/device/sparse/mask_counts.cuh>

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
    brick_table kept;                     // bricks that stay
    std::uint32_t num_kept;               // their voxels
    const std::uint64_t* count = nullptr; // on the device: how many are listed, if the host does not know

    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t size() const {
        return count == nullptr ? num_listed : *count;
    }
};

// Arrays of the result, and where its voxels come from.
struct brick_arrays {
    std::uint64_t* keys;
    brick_mask* masks;
    std::uint64_t* offsets;           // one more than bricks
    std::uint32_t *listed, *existing; // of each voxel, by rank: its number in the list, its rank before; or no_source
};

// The place of a listed voxel in the whole grid.
[[nodiscard]] __device__ VOXELPIPE_INLINE glm::ivec3 place_of(std::uint64_t voxel, const glm::ivec3& extent,
                                                              const glm::ivec3& offset) {
    const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
    return glm::ivec3(static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny),
                      static_cast<int>(voxel / (nx * ny))) +
           offset;
}

// ---- by an index ----------------------------------------------------------------------------------------------------

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
    if (i >= table.count) return;
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
    if (i >= table.count * 8) return;
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
    if (i >= table.count * 8) return;
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
    const std::uint64_t kept = from.num_kept == 0 ? 0 : from.kept.count;
    if (index.has_nodes()) {
        by_voxels(mark_listed_voxels<0>, mark_kept_bricks<0>, kept, index.nodes(), 7);
        index.make_words();
    }
    by_voxels(mark_listed_voxels<0>, mark_kept_bricks<0>, kept, index.bricks(), 3);
    const std::uint64_t bricks = index.make_numbers();
    brick_arrays to = allocate_bricks(bricks);
    index.write_keys(to.keys);
    check(cudaMemsetAsync(to.masks, 0, bricks * sizeof(brick_mask), stream), where);
    by_voxels(mask_listed_voxels<0>, mask_kept_voxels<0>, kept * 8, index.bricks(), to.masks);
    device_buffer<std::uint32_t> counts(memory, bricks);
    device_buffer<mask_totals> totals(memory, std::size_t{1});
    check(cudaMemsetAsync(totals.data(), 0, sizeof(mask_totals), stream), where);
    rank_bricks(memory, to.masks, static_cast<std::uint32_t>(bricks), counts.data(), to.offsets, totals.data(), where);
    mask_totals on_host{};
    check(cudaMemcpyAsync(&on_host, totals.data(), sizeof(on_host), cudaMemcpyDeviceToHost, stream), where);
    check(cudaStreamSynchronize(stream), where);
    to = allocate_voxels(bricks, on_host.voxels);
    check(cudaMemsetAsync(to.listed, 0xff, on_host.voxels * sizeof(std::uint32_t), stream), where);
    check(cudaMemsetAsync(to.existing, 0xff, on_host.voxels * sizeof(std::uint32_t), stream), where);
    by_voxels(place_listed_voxels<0>, place_kept_voxels<0>, kept * 8, index.bricks(), to);
    check(cudaStreamSynchronize(stream), where);
}

// ---- by a sort ------------------------------------------------------------------------------------------------------

// Keys of listed voxels, linear numbers in the part of the grid; values are their numbers in the list.
template <int = 0> // compiled where it is called
__global__ void key_listed_voxels(const brick_voxels from, std::uint64_t* keys, std::uint32_t* values) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= from.num_listed) return;
    keys[i] = core::morton_key(place_of(from.listed[i], from.extent, from.offset));
    values[i] = static_cast<std::uint32_t>(i);
}

// Keys of the voxels of bricks that stay, behind `first` listed ones; values are `first` and the rank. A thread has a
// word of a mask.
template <int = 0> // compiled where it is called
__global__ void key_kept_voxels(const brick_table table, std::uint32_t first, std::uint64_t* keys,
                                std::uint32_t* values) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= table.count * 8) return;
    const std::uint64_t brick = i / 8;
    const auto w = static_cast<unsigned>(i % 8);
    std::uint64_t rank = table.offsets[brick];
    for (unsigned before = 0; before < w; ++before) rank += core::count_ones(table.masks[brick].words[before]);
    const std::uint64_t word = table.masks[brick].words[w];
    for (unsigned bit = 0; bit < 64; ++bit) {
        if ((word >> bit & 1u) == 0) continue;
        keys[first + rank] = table.keys[brick] * core::sparse_brick_voxels + 64 * w + bit;
        values[first + rank] = first + static_cast<std::uint32_t>(rank);
        ++rank;
    }
}

// 1 where a voxel begins among the sorted keys, and where a brick does.
template <int = 0> // compiled where it is called
__global__ void mark_heads(const std::uint64_t* keys, std::uint32_t count, std::uint32_t* voxel_heads,
                           std::uint32_t* brick_heads) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const std::uint64_t key = keys[i], before = i == 0 ? 0 : keys[i - 1];
    voxel_heads[i] = i == 0 || key != before ? 1 : 0;
    brick_heads[i] = i == 0 || key / core::sparse_brick_voxels != before / core::sparse_brick_voxels ? 1 : 0;
}

// What the sorted keys become; numbers before each key are exclusive prefix sums of the heads.
template <int = 0> // compiled where it is called
__global__ void write_bricks(const std::uint64_t* keys, const std::uint32_t* values, std::uint32_t count,
                             std::uint32_t num_listed, const std::uint32_t* voxel_heads,
                             const std::uint32_t* brick_heads, const unsigned long long* voxels_before,
                             const unsigned long long* bricks_before, const brick_arrays to) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const std::uint64_t rank = voxels_before[i] + voxel_heads[i] - 1, brick = bricks_before[i] + brick_heads[i] - 1;
    if (brick_heads[i] != 0) {
        to.keys[brick] = keys[i] / core::sparse_brick_voxels;
        to.offsets[brick] = rank;
    }
    if (voxel_heads[i] != 0) {
        const auto bit = static_cast<unsigned>(keys[i] % core::sparse_brick_voxels);
        atomicOr(reinterpret_cast<unsigned long long*>(&to.masks[brick].words[bit / 64]), 1ull << (bit % 64));
    }
    if (values[i] < num_listed)
        to.listed[rank] = values[i];
    else
        to.existing[rank] = values[i] - num_listed;
}

// As build_bricks_by_index.
template <class AllocateBricks, class AllocateVoxels>
void build_bricks_by_sort(const stream_memory& memory, const brick_voxels& from, const AllocateBricks& allocate_bricks,
                          const AllocateVoxels& allocate_voxels) {
    const std::uint32_t num_listed = from.num_listed, num_kept = from.num_kept, count = num_listed + num_kept;
    const cudaStream_t stream = memory.stream;
    constexpr stage where = stage::tile_resolve;
    device_buffer<std::uint64_t> keys0(memory, count), keys1(memory, count);
    device_buffer<std::uint32_t> values0(memory, count), values1(memory, count);
    constexpr unsigned threads = threads_per_block;
    if (num_listed != 0)
        launch_kernel(false, key_listed_voxels<0>, num_blocks(num_listed), threads, 0, stream, where, from,
                      keys0.data(), values0.data());
    if (num_kept != 0)
        launch_kernel(false, key_kept_voxels<0>, num_blocks(from.kept.count * 8), threads, 0, stream, where, from.kept,
                      num_listed, keys0.data(), values0.data());
    // Stable, so of two entries of a voxel the listed one comes first; neither depends on that.
    const int bits = key_bits(core::morton_key(from.whole - 1) + 1);
    const std::size_t sort_storage = sort_bytes<std::uint64_t>(count, bits), scan_storage = cell_scan_bytes(count);
    device_buffer<std::byte> storage(memory, sort_storage > scan_storage ? sort_storage : scan_storage);
    const int in = sort_by_cell<std::uint64_t>({keys0.data(), keys1.data()}, {values0.data(), values1.data()}, count,
                                               bits, storage.data(), storage.size(), where, stream);
    const std::uint64_t* const keys = in == 0 ? keys0.data() : keys1.data();
    const std::uint32_t* const values = in == 0 ? values0.data() : values1.data();
    device_buffer<std::uint32_t> voxel_heads(memory, count), brick_heads(memory, count);
    device_buffer<unsigned long long> voxels_before(memory, count), bricks_before(memory, count);
    launch_kernel(false, mark_heads<0>, num_blocks(count), threads, 0, stream, where, keys, count, voxel_heads.data(),
                  brick_heads.data());
    sum_counts(voxel_heads.data(), voxels_before.data(), count, storage.data(), scan_storage, where, stream);
    sum_counts(brick_heads.data(), bricks_before.data(), count, storage.data(), scan_storage, where, stream);
    unsigned long long last_voxel = 0, last_brick = 0;
    std::uint32_t voxel_head = 0, brick_head = 0;
    const auto read_last = [&](auto& to, const auto& from) {
        check(cudaMemcpyAsync(&to, from.data() + count - 1, sizeof(to), cudaMemcpyDeviceToHost, stream), where);
    };
    read_last(last_voxel, voxels_before);
    read_last(last_brick, bricks_before);
    read_last(voxel_head, voxel_heads);
    read_last(brick_head, brick_heads);
    check(cudaStreamSynchronize(stream), where);
    const std::uint64_t num_bricks = last_brick + brick_head, num_voxels = last_voxel + voxel_head;
    (void)allocate_bricks(num_bricks);
    const brick_arrays to = allocate_voxels(num_bricks, num_voxels);
    check(cudaMemsetAsync(to.masks, 0, num_bricks * sizeof(brick_mask), stream), where);
    check(cudaMemsetAsync(to.listed, 0xff, num_voxels * sizeof(std::uint32_t), stream), where);
    check(cudaMemsetAsync(to.existing, 0xff, num_voxels * sizeof(std::uint32_t), stream), where);
    launch_kernel(false, write_bricks<0>, num_blocks(count), threads, 0, stream, where, keys, values, count, num_listed,
                  voxel_heads.data(), brick_heads.data(), voxels_before.data(), bricks_before.data(), to);
    check(cudaMemcpyAsync(to.offsets + num_bricks, &num_voxels, sizeof(num_voxels), cudaMemcpyHostToDevice, stream),
          where);
    check(cudaStreamSynchronize(stream), where);
}

// Bricks of the union of the voxels.
template <class AllocateBricks, class AllocateVoxels>
void build_bricks(const stream_memory& memory, const brick_voxels& from, const AllocateBricks& allocate_bricks,
                  const AllocateVoxels& allocate_voxels) {
    if (from.num_listed == 0 && from.num_kept == 0) {
        (void)allocate_bricks(0);
        (void)allocate_voxels(0, 0);
    } else if (std::max({from.whole.x, from.whole.y, from.whole.z}) <= max_index_extent) {
        build_bricks_by_index(memory, from, allocate_bricks, allocate_voxels);
    } else {
        build_bricks_by_sort(memory, from, allocate_bricks, allocate_voxels);
    }
}

} // namespace voxelpipe::device
