// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Long voxels: those with more fragments than a window holds (fragments/order_voxels.cuh). A warp or a block sorts such
// a voxel; a longer one is divided into runs, which are sorted and merged.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/fragments/order_memory.cuh>
#include <voxelpipe/device/fragments/warp_sort.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Numbers of a block while lanes exchange them. Each warp has its own part, with a padding word for every 32, so that
// lanes do not conflict in a bank.
struct sort_exchange {
    static constexpr std::uint32_t of_warp = max_of_warp + max_of_warp / 32;
    std::uint32_t numbers[tuning::block_sort_threads / 32 * of_warp];
    static_assert(tuning::block_sort_threads / 32 * of_warp >= tuning::max_of_block);
};

// Writes the first n numbers of a warp; a lane has Items consecutive ones.
template <int Items>
__device__ VOXELPIPE_INLINE void store_warp(const std::uint32_t (&w)[Items], sort_exchange& exchange, std::uint32_t* to,
                                            std::uint32_t n) {
    std::uint32_t* const mine = exchange.numbers + warp_in_block() * sort_exchange::of_warp;
    const std::uint32_t lane = threadIdx.x % 32;
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k) mine[lane * Items + k + (lane * Items + k) / 32] = w[k];
    __syncwarp();
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k)
        if (lane + 32 * k < n) to[lane + 32 * k] = mine[lane + 33 * k];
    __syncwarp();
}

// Sorts the voxels of a list, one per warp, starting with the first warp of block `start`. Elements beyond a voxel's
// fragments are larger than any primitive, or equal to the last.
template <int List>
__device__ VOXELPIPE_INLINE void order_by_warps(const order_buffers& b, std::uint32_t* to, sort_exchange& exchange,
                                                unsigned start) {
    constexpr int items = static_cast<int>(order_lists::max_below(List + 1) / 32);
    constexpr std::uint32_t warps = tuning::block_sort_threads / 32;
    const std::uint32_t n = uniform(b.lists.counts[List]), lane = threadIdx.x % 32;
    const std::uint32_t block = blockIdx.x >= start ? blockIdx.x - start : blockIdx.x + gridDim.x - start;
    for (std::uint32_t r = block * warps + warp_in_block(); r < n; r += gridDim.x * warps) {
        const fragment_run run = b.lists.voxels[List][r];
        std::uint32_t w[items];
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t i = lane + 32 * k;
            w[k] = i < run.length ? b.from[run.begin + i] : ~0u;
        }
        sort_warp(w);
        store_warp(w, exchange, to + run.begin, static_cast<std::uint32_t>(run.length));
    }
}

// Sorts the numbers of a block; a thread has Items consecutive ones. The network of sort_warp, in which warps exchange
// numbers through shared memory.
template <int Items>
__device__ VOXELPIPE_INLINE void sort_block(std::uint32_t (&w)[Items], sort_exchange& exchange) {
    constexpr int of_warp = 32 * Items, all = tuning::block_sort_threads * Items;
    sort_warp(w);
    // Compares this thread's numbers with those of the thread whose number differs in the bits `threads`.
    const auto compare = [&](unsigned threads, unsigned lower_bit, bool mirrored) VOXELPIPE_INLINE_LAMBDA {
        __syncthreads();
#pragma unroll
        for (int k = 0; k < Items; ++k) exchange.numbers[k * tuning::block_sort_threads + threadIdx.x] = w[k];
        __syncthreads();
        const bool lower = (threadIdx.x & lower_bit) == 0;
#pragma unroll
        for (int k = 0; k < Items; ++k) {
            const std::uint32_t other =
                exchange.numbers[(mirrored ? Items - 1 - k : k) * tuning::block_sort_threads + (threadIdx.x ^ threads)];
            w[k] = lower ? min(w[k], other) : max(w[k], other);
        }
    };
    for (int size = 2 * of_warp; size <= all; size *= 2) {
        const auto threads = static_cast<unsigned>(size / Items);
        compare(threads - 1, threads / 2, true);
        for (unsigned apart = threads / 4; apart >= 32; apart /= 2) compare(apart, apart, false);
        merge_warp(w, of_warp / 2);
    }
}

// Sorts a run of at most Items * block_sort_threads primitives.
template <int Items>
__device__ VOXELPIPE_INLINE void order_run(const std::uint32_t* from, std::uint32_t* to, std::uint32_t length,
                                           sort_exchange& exchange) {
    std::uint32_t w[Items];
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k) {
        const std::uint32_t i = threadIdx.x + tuning::block_sort_threads * k;
        w[k] = i < length ? from[i] : ~0u;
    }
    sort_block(w, exchange);
    __syncthreads(); // nobody reads the exchange any longer
    const std::uint32_t first = warp_in_block() * 32 * Items;
    if (first < length) store_warp(w, exchange, to + first, length - first);
    __syncthreads();
}

// Sorts, one per block, voxels, and runs of longer voxels, which are sorted in offset.
__device__ VOXELPIPE_INLINE void order_by_blocks(const order_buffers& b, std::uint32_t* primitives,
                                                 sort_exchange& exchange) {
    constexpr int max_items = tuning::max_of_block / tuning::block_sort_threads;
    using lists = order_lists;
    const std::uint32_t whole = b.lists.counts[lists::block_list], all = whole + b.lists.counts[lists::run_list];
    for (std::uint32_t r = blockIdx.x; r < all; r += gridDim.x) {
        const fragment_run run = r < whole ? b.lists.voxels[lists::block_list][r] : b.lists.runs[r - whole].run;
        const std::uint32_t* const from = b.from + run.begin;
        std::uint32_t* const to = (r < whole ? primitives : b.from) + run.begin;
        const auto length = static_cast<std::uint32_t>(run.length);
        if (length <= tuning::max_of_block / 2)
            order_run<max_items / 2>(from, to, length, exchange);
        else
            order_run<max_items>(from, to, length, exchange);
    }
}

template <class Buffers>
__global__ __launch_bounds__(tuning::block_sort_threads, 4) void order_long_kernel(const __grid_constant__ Buffers b) {
    __shared__ sort_exchange exchange;
    await_stream();
    std::uint32_t* const to = b.pointers().primitives;
    // If there are few blocks' worth, each list has blocks of its own.
    order_by_warps<0>(b, to, exchange, gridDim.x / 3);
    order_by_warps<1>(b, to, exchange, gridDim.x / 3 * 2);
    static_assert(num_warp_sorts == 2);
    __syncthreads();
    order_by_blocks(b, to, exchange);
}

// Sorts dense voxels: a block sets a bit for each primitive of its part that occurs in a voxel, and counts the
// primitives of earlier parts.
template <class Buffers>
__global__ __launch_bounds__(tuning::dense_threads) void order_dense_kernel(const __grid_constant__ Buffers b) {
    constexpr std::uint32_t num_words = tuning::dense_part / 32;
    constexpr unsigned at_once = 4; // loads in flight
    static_assert(num_words == tuning::dense_threads);
    __shared__ std::uint32_t words[num_words], offsets[num_words], all_before;
    __shared__ block_scan<std::uint32_t, tuning::dense_threads> scan;
    await_stream();
    std::uint32_t* const primitives = b.pointers().primitives;
    const std::uint32_t parts = b.lists.dense_parts(), lane = threadIdx.x % 32,
                        n = b.lists.counts[order_lists::dense_list] * parts;
    for (std::uint32_t r = blockIdx.x; r < n; r += gridDim.x) {
        const fragment_run run = b.lists.voxels[order_lists::dense_list][r / parts];
        const std::uint32_t first = r % parts * tuning::dense_part;
        const auto begin = static_cast<std::uint32_t>(run.begin), length = static_cast<std::uint32_t>(run.length);
        words[threadIdx.x] = 0;
        if (threadIdx.x == 0) all_before = 0;
        __syncthreads();
        // Aligned groups of four; some elements may lie outside the voxel.
        std::uint32_t before = 0;
        const std::uint32_t end_four = (begin + length + 3) / 4;
        for (std::uint32_t i = begin / 4 + threadIdx.x; i < end_four; i += at_once * tuning::dense_threads) {
            uint4 fours[at_once];
#pragma unroll
            for (unsigned k = 0; k < at_once; ++k)
                if (i + k * tuning::dense_threads < end_four)
                    fours[k] = reinterpret_cast<const uint4*>(b.from)[i + k * tuning::dense_threads];
#pragma unroll
            for (unsigned k = 0; k < at_once; ++k) {
                const std::uint32_t at = 4 * (i + k * tuning::dense_threads) - begin; // modulo 2^32
                const auto add = [&](std::uint32_t primitive, std::uint32_t offset) VOXELPIPE_INLINE_LAMBDA {
                    if (offset >= length) return;
                    const std::uint32_t bit = primitive - first; // modulo 2^32
                    before += primitive < first ? 1 : 0;
                    if (bit < tuning::dense_part) atomicOr(&words[bit / 32], 1u << bit % 32);
                };
                if (i + k * tuning::dense_threads >= end_four) break;
                add(fours[k].x, at);
                add(fours[k].y, at + 1);
                add(fours[k].z, at + 2);
                add(fours[k].w, at + 3);
            }
        }
        before = __reduce_add_sync(0xffffffffu, before);
        if (lane == 0 && before != 0) atomicAdd(&all_before, before);
        __syncthreads();
        offsets[threadIdx.x] = scan.sum_before(static_cast<std::uint32_t>(__popc(words[threadIdx.x])));
        __syncthreads();
        // One word per warp, so that neighbouring lanes write neighbouring elements.
        std::uint32_t* const to = primitives + run.begin + all_before;
        const unsigned below = (1u << lane) - 1;
#pragma unroll(4)
        for (std::uint32_t w = warp_in_block(); w < num_words; w += tuning::dense_threads / 32) {
            const std::uint32_t word = words[w];
            if ((word >> lane & 1u) != 0)
                to[offsets[w] + static_cast<std::uint32_t>(__popc(word & below))] = first + 32 * w + lane;
        }
        __syncthreads();
    }
}

// Number of n sorted numbers that are less than w.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t count_less(const std::uint32_t* numbers, std::uint32_t n,
                                                                   std::uint32_t w) {
    return core::bisect(n, [=](std::uint32_t i) { return numbers[i] < w; });
}

// Merges up to merge_ways sorted runs of `length` each: a primitive's position is the sum, over the runs, of how many
// primitives are smaller. A thread takes one fragment, a warp 32 neighbours of a run: each lane finds the range of
// these in one of the other runs, and all lanes search within the ranges. Last: merges the rest of the voxel, however
// many runs that is.
template <class Buffers>
__global__ void merge_runs_kernel(const __grid_constant__ Buffers b, const std::uint32_t* from, std::uint32_t* to,
                                  std::uint64_t length, bool last) {
    constexpr std::uint32_t parts = tuning::max_of_block / threads_per_block;
    await_stream();
    const std::uint32_t lane = threadIdx.x % 32;
    const std::uint64_t n = std::uint64_t{b.lists.counts[order_lists::run_list]} * parts;
    for (std::uint64_t r = blockIdx.x; r < n; r += gridDim.x) {
        const voxel_run entry = b.lists.runs[r / parts];
        const fragment_run voxel = entry.voxel;
        if (voxel.length <= length) continue; // done by the previous merge
        const std::uint64_t i = r % parts * threads_per_block + threadIdx.x;
        if (i - lane >= entry.run.length) continue; // no lane has a fragment
        const std::uint64_t group_length = last ? voxel.length : length * tuning::merge_ways;
        // Within the voxel. Lanes beyond the last fragment take the last.
        const std::uint64_t at = entry.run.begin - voxel.begin + (i < entry.run.length ? i : entry.run.length - 1);
        const std::uint64_t group = at / group_length * group_length, own = at / length * length;
        const std::uint64_t end = group + group_length < voxel.length ? group + group_length : voxel.length;
        const std::uint32_t* const numbers = from + voxel.begin;
        const std::uint32_t primitive = numbers[at];
        const std::uint32_t least = __shfl_sync(0xffffffffu, primitive, 0),
                            most = __shfl_sync(0xffffffffu, primitive, 31);
        std::uint64_t offset = voxel.begin + group + (at - own);
        for (std::uint64_t start = group; start < end; start += 32 * length) {
            const std::uint64_t mine = start + lane * length;
            std::uint32_t low = 0, high = 0; // how many of the run's numbers are below `least`, and below `most`
            if (mine < end && mine != own) {
                const auto of_run = static_cast<std::uint32_t>(end - mine < length ? end - mine : length);
                low = count_less(numbers + mine, of_run, least);
                high = low + count_less(numbers + mine + low, of_run - low, most);
            }
            for (unsigned k = 0; k < 32 && start + k * length < end; ++k) {
                const std::uint32_t first = __shfl_sync(0xffffffffu, low, k);
                const std::uint32_t between = __shfl_sync(0xffffffffu, high, k) - first;
                offset += first + count_less(numbers + start + k * length + first, between, primitive);
            }
        }
        if (i < entry.run.length) (voxel.length <= group_length ? b.pointers().primitives : to)[offset] = primitive;
    }
}

} // namespace voxelpipe::device
