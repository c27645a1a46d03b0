// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment order: fragments that were found in any order and then sorted by voxel are put in order of their primitives
// within each voxel. A thread takes a voxel of a few fragments, a warp one of some hundreds, a block one of thousands;
// more are cut into runs that are sorted and merged. How many voxels there are is known on the device alone.

#include <voxelpipe/device/scene.cuh>

#include <cub/block/block_merge_sort.cuh>

#include <algorithm>

namespace voxelpipe::device {

inline constexpr std::uint32_t most_of_thread = 16; // fragments of a voxel
inline constexpr int num_warp_sorts = 3;            // with 4, 16 or 32 fragments a lane
inline constexpr std::uint32_t most_of_warp = 32 * 32;
inline constexpr std::uint32_t most_of_block = 4096;
inline constexpr int block_sort_threads = 256;
inline constexpr std::uint32_t merge_ways = 64; // runs that one merge takes

// A stretch of fragments.
struct fragment_run {
    unsigned long long begin, length;
};
// A run of at most most_of_block fragments, of a voxel that has more.
struct voxel_run {
    fragment_run run, voxel;
};

// Voxels by how they are sorted. The lists cannot overflow: a voxel in one of them has so many fragments.
struct order_lists {
    static constexpr int block_list = num_warp_sorts, run_list = num_warp_sorts + 1, num_lists = num_warp_sorts + 2;
    fragment_run* voxels[num_warp_sorts + 1]; // of a warp; of a block
    voxel_run* runs;
    unsigned int* counts; // of all lists; zeroed

    [[nodiscard]] static order_lists take(arena& memory, std::uint64_t capacity) {
        order_lists w{};
        for (int k = 0; k < num_lists - 1; ++k) w.voxels[k] = memory.take<fragment_run>(capacity / (most_below(k) + 1));
        w.runs = memory.take<voxel_run>(2 * (capacity / most_of_block)); // each voxel's last may be short
        return w;
    }
    // With its counters.
    [[nodiscard]] order_lists with(pipeline_state* state) const {
        static_assert(sizeof(state->num_ordered) == num_lists * sizeof(*counts));
        order_lists w = *this;
        w.counts = state->num_ordered;
        return w;
    }
    // The most fragments of a voxel that is too small for list k.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint32_t most_below(int k) {
        return k == 0 ? most_of_thread : k == 1 ? 32 * 4 : k == 2 ? 32 * 16 : most_of_warp;
    }
};

// from: the primitives, sorted by voxel, and overwritten; to: where they come to lie in order; spare: room for as many.
struct order_buffers {
    const unsigned long long* first_of_voxel;
    std::uint32_t* from;
    std::uint32_t* to;
    std::uint32_t* spare;
    order_lists lists;
};

// ---- kernels --------------------------------------------------------------------------------------------------------

// Sorts up to Most numbers in the registers of a thread, by Batcher's odd-even merges.
template <std::uint32_t Most>
__device__ VOXELPIPE_INLINE void sort_by_thread(const std::uint32_t* from, std::uint32_t* to, std::uint32_t length) {
    std::uint32_t w[Most];
#pragma unroll
    for (std::uint32_t k = 0; k < Most; ++k) w[k] = k < length ? from[k] : ~0u;
#pragma unroll
    for (std::uint32_t sorted = 1; sorted < Most; sorted *= 2) {
#pragma unroll
        for (std::uint32_t apart = sorted; apart > 0; apart /= 2) {
#pragma unroll
            for (std::uint32_t k = 0; k + apart < Most; ++k) {
                const bool pairs = k >= apart % sorted && (k - apart % sorted) / apart % 2 == 0;
                if (!pairs || k / (2 * sorted) != (k + apart) / (2 * sorted)) continue;
                const std::uint32_t low = min(w[k], w[k + apart]), high = max(w[k], w[k + apart]);
                w[k] = low;
                w[k + apart] = high;
            }
        }
    }
#pragma unroll
    for (std::uint32_t k = 0; k < Most; ++k)
        if (k < length) to[k] = w[k];
}

// A thread looks at a voxel, and puts it in order or into a list.
template <class Buffers>
__global__ void order_voxels_kernel(const __grid_constant__ Buffers b, const pipeline_state* state, capacities limits) {
    using lists = order_lists;
    __shared__ std::uint32_t wanted[lists::num_lists], first[lists::num_lists];
    await_stream();
    const std::uint64_t n = has_failed(*state, limits) ? 0 : state->list_voxels;
    for (std::uint64_t start = std::uint64_t{blockIdx.x} * blockDim.x; start < n;
         start += std::uint64_t{gridDim.x} * blockDim.x) {
        if (threadIdx.x < lists::num_lists) wanted[threadIdx.x] = 0;
        __syncthreads();
        const std::uint64_t voxel = start + threadIdx.x;
        fragment_run r{0, 0};
        if (voxel < n) {
            r.begin = b.first_of_voxel[voxel];
            r.length = (voxel + 1 < n ? b.first_of_voxel[voxel + 1] : state->list_fragments) - r.begin;
        }
        int kind = -1;
        for (int k = 0; k < lists::num_lists - 1; ++k)
            if (r.length > lists::most_below(k)) kind = k;
        if (r.length > most_of_block) kind = lists::run_list;
        const auto entries =
            static_cast<std::uint32_t>(kind == lists::run_list ? (r.length + most_of_block - 1) / most_of_block : 1);
        std::uint32_t at = 0;
        if (kind >= 0) at = atomicAdd(&wanted[kind], entries);
        __syncthreads();
        if (threadIdx.x < lists::num_lists && wanted[threadIdx.x] != 0)
            first[threadIdx.x] = atomicAdd(&b.lists.counts[threadIdx.x], wanted[threadIdx.x]);
        __syncthreads();
        if (kind < 0) {
            const auto length = static_cast<std::uint32_t>(r.length);
            if (length <= 2)
                sort_by_thread<2>(b.from + r.begin, b.to + r.begin, length);
            else if (length <= 8)
                sort_by_thread<8>(b.from + r.begin, b.to + r.begin, length);
            else
                sort_by_thread<most_of_thread>(b.from + r.begin, b.to + r.begin, length);
            continue;
        }
        at += first[kind];
        for (int k = 0; k < lists::num_lists - 1; ++k)
            if (kind == k) b.lists.voxels[k][at] = r;
        if (kind == lists::run_list)
            for (std::uint32_t k = 0; k < entries; ++k) {
                voxel_run& entry = b.lists.runs[at + k];
                entry.voxel = r;
                entry.run.begin = r.begin + std::uint64_t{k} * most_of_block;
                const std::uint64_t rest = r.begin + r.length - entry.run.begin;
                entry.run.length = rest < most_of_block ? rest : most_of_block;
            }
    }
}

// Sorts the numbers of a warp, of which a lane has Items neighbours: a bitonic network. Neighbours up to Items apart
// are in one lane; beyond, lanes exchange theirs.
template <int Items>
__device__ VOXELPIPE_INLINE void sort_warp(std::uint32_t (&w)[Items]) {
    const int lane = static_cast<int>(threadIdx.x % 32);
#pragma unroll
    for (int size = 2; size <= 32 * Items; size *= 2) {
#pragma unroll
        for (int apart = size / 2; apart > 0; apart /= 2) {
            if (apart >= Items) {
                const int lanes_apart = apart / Items;
                const bool lower = (lane & lanes_apart) == 0, ascending = (lane & (size / Items)) == 0;
#pragma unroll
                for (int k = 0; k < Items; ++k) {
                    const std::uint32_t other = __shfl_xor_sync(0xffffffffu, w[k], lanes_apart);
                    w[k] = lower == ascending ? min(w[k], other) : max(w[k], other);
                }
            } else {
#pragma unroll
                for (int k = 0; k < Items; ++k) {
                    if ((k & apart) != 0) continue;
                    const bool ascending = size < Items ? (k & size) == 0 : (lane & (size / Items)) == 0;
                    const std::uint32_t low = min(w[k], w[k | apart]), high = max(w[k], w[k | apart]);
                    w[k] = ascending ? low : high;
                    w[k | apart] = ascending ? high : low;
                }
            }
        }
    }
}

// A warp sorts a voxel. What is beyond its fragments is more than any primitive, or equal to the last.
template <int List, class Buffers>
__global__ __launch_bounds__(threads_per_block) void warp_sort_kernel(const __grid_constant__ Buffers b) {
    constexpr int items = static_cast<int>(order_lists::most_below(List + 1) / 32);
    constexpr std::uint32_t warps = threads_per_block / 32;
    await_stream();
    const std::uint32_t n = uniform(b.lists.counts[List]), lane = threadIdx.x % 32;
    for (std::uint32_t r = blockIdx.x * warps + warp_in_block(); r < n; r += gridDim.x * warps) {
        const fragment_run run = b.lists.voxels[List][r];
        std::uint32_t w[items];
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t i = lane + 32 * k;
            w[k] = i < run.length ? b.from[run.begin + i] : ~0u;
        }
        sort_warp(w);
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k)
            if (lane * items + k < run.length) b.to[run.begin + lane * items + k] = w[k];
    }
}

struct less_than {
    [[nodiscard]] __device__ bool operator()(std::uint32_t a, std::uint32_t b) const { return a < b; }
};

// A block sorts a voxel, or a run of one, which goes back to where it was.
template <class Buffers>
__global__ __launch_bounds__(block_sort_threads) void block_sort_kernel(const __grid_constant__ Buffers b) {
    constexpr std::uint32_t items = most_of_block / block_sort_threads;
    using lists = order_lists;
    using sorter = cub::BlockMergeSort<std::uint32_t, block_sort_threads, static_cast<int>(items)>;
    __shared__ typename sorter::TempStorage storage;
    await_stream();
    const std::uint32_t whole = b.lists.counts[lists::block_list], all = whole + b.lists.counts[lists::run_list];
    for (std::uint32_t r = blockIdx.x; r < all; r += gridDim.x) {
        const fragment_run run = r < whole ? b.lists.voxels[lists::block_list][r] : b.lists.runs[r - whole].run;
        std::uint32_t w[items];
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t i = threadIdx.x + block_sort_threads * k;
            w[k] = i < run.length ? b.from[run.begin + i] : ~0u;
        }
        sorter(storage).Sort(w, less_than{});
        __syncthreads(); // all have read the run, and the storage may be used again
        std::uint32_t* const to = r < whole ? b.to : b.from;
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t i = threadIdx.x * items + k;
            if (i < run.length) to[run.begin + i] = w[k];
        }
    }
}

// How many of the sorted numbers are less than w.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t count_less(const std::uint32_t* numbers, std::uint64_t n,
                                                                   std::uint32_t w) {
    std::uint64_t lo = 0;
    while (n > 0) {
        const std::uint64_t half = n / 2;
        if (numbers[lo + half] < w) {
            lo += half + 1;
            n -= half + 1;
        } else {
            n = half;
        }
    }
    return lo;
}

// Merges up to merge_ways sorted runs of `length` each: a primitive's place is the sum of how many are less in each. A
// thread takes one fragment. Last: the rest of the voxel in one go, however many runs that is.
template <class Buffers>
__global__ void merge_runs_kernel(const __grid_constant__ Buffers b, const std::uint32_t* from, std::uint32_t* to,
                                  std::uint64_t length, bool last) {
    constexpr std::uint32_t parts = most_of_block / threads_per_block;
    await_stream();
    const std::uint64_t n = std::uint64_t{b.lists.counts[order_lists::run_list]} * parts;
    for (std::uint64_t r = blockIdx.x; r < n; r += gridDim.x) {
        const voxel_run entry = b.lists.runs[r / parts];
        const fragment_run voxel = entry.voxel;
        if (voxel.length <= length) continue; // was done by the merge before
        const std::uint64_t i = r % parts * threads_per_block + threadIdx.x;
        if (i >= entry.run.length) continue;
        const std::uint64_t group_length = last ? voxel.length : length * merge_ways;
        const std::uint64_t at = entry.run.begin - voxel.begin + i; // within the voxel
        const std::uint64_t group = at / group_length * group_length, own = at / length * length;
        const std::uint64_t end = group + group_length < voxel.length ? group + group_length : voxel.length;
        const std::uint32_t primitive = from[voxel.begin + at];
        std::uint64_t place = voxel.begin + group + (at - own);
        for (std::uint64_t start = group; start < end; start += length)
            if (start != own)
                place += count_less(from + voxel.begin + start, end - start < length ? end - start : length, primitive);
        (voxel.length <= group_length ? b.to : to)[place] = primitive;
    }
}

// ---- host -----------------------------------------------------------------------------------------------------------

template <int List>
void sort_by_warps(const order_buffers& b, std::uint64_t capacity, cudaStream_t stream) {
    constexpr std::uint64_t least = order_lists::most_below(List) + 1;
    if (capacity < least) return;
    launch_behind(warp_sort_kernel<List, order_buffers>, fill_device(capacity / least * 32), threads_per_block, stream,
                  stage::abuffer_emit, b);
}

// Puts b.from in order, in b.to.
inline void order_fragments(const order_buffers& b, const pipeline_state* state, const capacities& limits,
                            cudaStream_t stream) {
    constexpr stage where = stage::abuffer_emit;
    const std::uint64_t capacity = limits.fragments;
    launch_behind(order_voxels_kernel<order_buffers>, fill_device(capacity), threads_per_block, stream, where, b, state,
                  limits);
    sort_by_warps<0>(b, capacity, stream);
    sort_by_warps<1>(b, capacity, stream);
    sort_by_warps<2>(b, capacity, stream);
    static_assert(num_warp_sorts == 3);
    if (capacity > most_of_warp)
        launch_behind(block_sort_kernel<order_buffers>, fill_device(capacity / (most_of_warp + 1) * threads_per_block),
                      block_sort_threads, stream, where, b);
    // Runs of 2^12, 2^18 and 2^24 fragments; the last merge takes all that there are.
    std::uint64_t length = most_of_block;
    for (int level = 0; level < 3 && capacity > length; ++level, length *= merge_ways)
        launch_behind(merge_runs_kernel<order_buffers>, fill_device(capacity), threads_per_block, stream, where, b,
                      level % 2 == 0 ? b.from : b.spare, level % 2 == 0 ? b.spare : b.from, length, level == 2);
}

} // namespace voxelpipe::device
