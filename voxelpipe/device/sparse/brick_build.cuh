// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks from voxels: the voxels that keep a fragment, as an A-buffer lists them, and those that existed before become
// Morton keys, sorted; equal keys are one voxel and equal leading bits one brick. Masks are filled by atomics, ranks
// come from a prefix sum.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/scene/cub_sort.cuh>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr std::uint32_t no_source = 0xffffffffu;

// Keys of listed voxels, linear numbers in the part of the grid; values are their numbers in the list.
template <int = 0> // compiled where it is called
__global__ void key_listed_voxels(const std::uint64_t* voxels, std::uint32_t count, glm::ivec3 extent,
                                  glm::ivec3 offset, std::uint64_t* keys, std::uint32_t* values) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
    const std::uint64_t v = voxels[i];
    const glm::ivec3 at(static_cast<int>(v % nx), static_cast<int>(v / nx % ny), static_cast<int>(v / (nx * ny)));
    keys[i] = core::morton_key(at.x + offset.x, at.y + offset.y, at.z + offset.z);
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
struct brick_arrays {
    std::uint64_t* keys;
    brick_mask* masks;                // zero at first
    std::uint64_t* offsets;           // all but the last are written
    std::uint32_t *listed, *existing; // of each voxel, by rank: its number in the list, its rank before; or no_source
};
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

// Bricks of the union of `num_listed` voxels and of the voxels of `kept`, at most 2^32 - 2 entries in all. `allocate`
// (bricks, voxels) is asked for the arrays, or for null pointers, once their lengths are known; it may throw. Waits.
template <class Allocate>
void build_bricks(const stream_memory& memory, const std::uint64_t* listed, std::uint32_t num_listed,
                  const glm::ivec3& extent, const glm::ivec3& offset, const glm::ivec3& whole, const brick_table& kept,
                  std::uint32_t num_kept, const Allocate& allocate) {
    const std::uint32_t count = num_listed + num_kept;
    const cudaStream_t stream = memory.stream;
    constexpr stage where = stage::tile_resolve;
    if (count == 0) {
        allocate(0, 0);
        return;
    }
    device_buffer<std::uint64_t> keys0(memory, count), keys1(memory, count);
    device_buffer<std::uint32_t> values0(memory, count), values1(memory, count);
    constexpr unsigned threads = threads_per_block;
    if (num_listed != 0)
        launch_kernel(false, key_listed_voxels<0>, num_blocks(num_listed), threads, 0, stream, where, listed,
                      num_listed, extent, offset, keys0.data(), values0.data());
    if (num_kept != 0)
        launch_kernel(false, key_kept_voxels<0>, num_blocks(kept.count * 8), threads, 0, stream, where, kept,
                      num_listed, keys0.data(), values0.data());
    // Stable, so of two entries of a voxel the listed one comes first; neither depends on that.
    const int bits = key_bits(core::morton_key(whole.x - 1, whole.y - 1, whole.z - 1) + 1);
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
    const brick_arrays to = allocate(num_bricks, num_voxels);
    check(cudaMemsetAsync(to.masks, 0, num_bricks * sizeof(brick_mask), stream), where);
    check(cudaMemsetAsync(to.listed, 0xff, num_voxels * sizeof(std::uint32_t), stream), where);
    check(cudaMemsetAsync(to.existing, 0xff, num_voxels * sizeof(std::uint32_t), stream), where);
    launch_kernel(false, write_bricks<0>, num_blocks(count), threads, 0, stream, where, keys, values, count, num_listed,
                  voxel_heads.data(), brick_heads.data(), voxels_before.data(), bricks_before.data(), to);
    check(cudaMemcpyAsync(to.offsets + num_bricks, &num_voxels, sizeof(num_voxels), cudaMemcpyHostToDevice, stream),
          where);
    check(cudaStreamSynchronize(stream), where);
}

} // namespace voxelpipe::device
