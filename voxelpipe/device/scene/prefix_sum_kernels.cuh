// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of scene/prefix_sum.cuh.

#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <cub/device/device_scan.cuh>
#include <cuda/std/functional>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr std::uint32_t selection_tile = threads_per_block * tuning::selection_items;

// Numbers of a block: the sum before its tile, which the first warp finds, and the sums before its threads.
struct tile_scan {
    block_scan<unsigned long long, threads_per_block> threads;
    unsigned long long before_tile;

    // The sum before this thread, over all tiles; `end`: with the whole tile. All threads call it, once.
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long
    sum_before(unsigned long long* words, unsigned long long own, unsigned long long& end) {
        const unsigned long long before = threads.sum_before(own), all = threads.sum();
        if (warp_in_block() == 0) {
            if (threadIdx.x == 0) lookback::publish(words, blockIdx.x, all);
            const unsigned long long earlier =
                lookback::before(words, blockIdx.x, all, [](unsigned long long part) { return warp_sum(part); });
            if (threadIdx.x == 0) before_tile = earlier;
        }
        __syncthreads();
        end = before_tile + all;
        return before_tile + before;
    }
};

// The first sum has 64 bits, and so have all: CUB adds counts of 32 bits in the type of the first.
inline cudaError_t sum_by_cub(void* storage, std::size_t& bytes, const std::uint32_t* counts,
                              unsigned long long* offsets, std::uint32_t num, cudaStream_t stream) {
    return cub::DeviceScan::ExclusiveScan(storage, bytes, counts, offsets, cuda::std::plus<>{}, 0ull, num, stream);
}

VOXELPIPE_DEFINES_KERNELS std::size_t cell_scan_bytes(std::uint32_t num_primitives) {
    std::size_t bytes = 0;
    check(sum_by_cub(nullptr, bytes, nullptr, nullptr, num_primitives, nullptr));
    return bytes;
}

VOXELPIPE_DEFINES_KERNELS void sum_counts(const std::uint32_t* counts, unsigned long long* offsets,
                                          std::uint32_t num_primitives, void* storage, std::size_t bytes, stage where,
                                          cudaStream_t stream) {
    if (num_primitives == 0) return;
    check(sum_by_cub(storage, bytes, counts, offsets, num_primitives, stream), where);
}

// words: one of each tile, zero before.
template <class State>
__global__ __launch_bounds__(threads_per_block) void select_voxels_kernel(const sorted_keys keys,
                                                                          std::uint64_t* first_of_voxel, State* state,
                                                                          const __grid_constant__ capacities limits,
                                                                          unsigned long long* words) {
    constexpr unsigned items = tuning::selection_items;
    __shared__ tile_scan scan;
    await_stream();
    const std::uint64_t num = has_failed(*state, limits) ? 0 : state->list_fragments,
                        tile_begin = std::uint64_t{blockIdx.x} * selection_tile;
    if (num == 0 && blockIdx.x == 0 && threadIdx.x == 0) state->list_voxels = 0;
    if (tile_begin >= num) return;
    // A warp has consecutive elements; a lane has every 32nd of them.
    const unsigned lane = threadIdx.x % 32;
    const std::uint64_t first = tile_begin + threadIdx.x / 32 * (32 * items) + lane;
    unsigned is_first[items], own = 0;
#pragma unroll
    for (unsigned k = 0; k < items; ++k) {
        const std::uint64_t i = first + 32 * k;
        is_first[k] = __ballot_sync(0xffffffffu, i < num && (i == 0 || keys.differ(i, i - 1)));
        own += static_cast<unsigned>(__popc(is_first[k]));
    }
    unsigned long long end = 0; // the first lane counts for its warp, so lanes after it would count it as before them
    const unsigned long long before = scan.sum_before(words, lane == 0 ? own : 0, end);
    std::uint64_t to = lane == 0 ? before : before - own;
#pragma unroll
    for (unsigned k = 0; k < items; ++k) {
        if ((is_first[k] >> lane & 1u) != 0)
            first_of_voxel[to + static_cast<unsigned>(__popc(is_first[k] & ((1u << lane) - 1)))] = first + 32 * k;
        to += static_cast<unsigned>(__popc(is_first[k]));
    }
    if (threadIdx.x == 0 && num - tile_begin <= selection_tile) state->list_voxels = end;
}

VOXELPIPE_DEFINES_KERNELS std::size_t select_bytes(std::uint64_t capacity) {
    return std::max<std::uint64_t>((capacity + selection_tile - 1) / selection_tile, 1) * sizeof(unsigned long long);
}

VOXELPIPE_DEFINES_KERNELS void select_voxels(const sorted_keys& keys, std::uint64_t* first_of_voxel,
                                             pipeline_state* state, const capacities& limits, void* storage,
                                             [[maybe_unused]] std::size_t bytes, cudaStream_t stream) {
    constexpr stage where = stage::abuffer_emit;
    const std::size_t used = select_bytes(limits.fragments);
    VOXELPIPE_ASSERT(bytes >= used);
    check(cudaMemsetAsync(storage, 0, used, stream), where);
    select_voxels_kernel<pipeline_state>
        <<<static_cast<unsigned>(used / sizeof(unsigned long long)), threads_per_block, 0, stream>>>(
            keys, first_of_voxel, state, limits, static_cast<unsigned long long*>(storage));
    check(cudaGetLastError(), where);
}

} // namespace voxelpipe::device
