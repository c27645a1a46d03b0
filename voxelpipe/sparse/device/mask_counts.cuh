// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// From complete masks to ranks: voxels of each brick, their sums before it, and what the host has to know.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

struct mask_totals {
    unsigned long long voxels;
    std::uint32_t empty_bricks, unused;
};

template <int = 0> // compiled where it is called
__global__ void count_masks(const brick_mask* masks, std::uint32_t count, std::uint32_t* counts, mask_totals* totals) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const unsigned voxels = i < count ? masks[i].count() : 0;
    if (i < count) counts[i] = voxels;
    const unsigned long long sum = block_sum(voxels);
    const int empty = __syncthreads_count(static_cast<int>(i < count && voxels == 0));
    if (threadIdx.x != 0) return;
    if (sum != 0) atomicAdd(&totals->voxels, sum);
    if (empty != 0) atomicAdd(&totals->empty_bricks, static_cast<unsigned>(empty));
}

// Counts the voxels of `bricks` masks, more than 0 of them, and writes the rank of each brick's first voxel, and one
// more, the number of voxels. *totals is zero before. storage: cell_scan_bytes(bricks).
template <int = 0>
void rank_bricks(const brick_mask* masks, std::uint32_t bricks, std::uint32_t* counts, std::uint64_t* offsets,
                 mask_totals* totals, void* storage, stage where, cudaStream_t stream) {
    static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
    launch_kernel(false, count_masks<0>, num_blocks(bricks), threads_per_block, 0, stream, where, masks, bricks, counts,
                  totals);
    sum_counts(counts, reinterpret_cast<unsigned long long*>(offsets), bricks, storage, cell_scan_bytes(bricks), where,
               stream);
    check(cudaMemcpyAsync(offsets + bricks, &totals->voxels, sizeof(std::uint64_t), cudaMemcpyDeviceToDevice, stream),
          where);
}
// The same, in memory of its own.
template <int = 0>
void rank_bricks(const stream_memory& memory, const brick_mask* masks, std::uint32_t bricks, std::uint32_t* counts,
                 std::uint64_t* offsets, mask_totals* totals, stage where) {
    device_buffer<std::byte> storage(memory, cell_scan_bytes(bricks));
    rank_bricks(masks, bricks, counts, offsets, totals, storage.data(), where, memory.stream);
}

} // namespace voxelpipe::device
