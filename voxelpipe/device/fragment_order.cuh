// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment order: fragments that were found in any order and then sorted by voxel are put in order of their primitives
// within each voxel, and the voxels are listed with where their fragments begin. A warp takes a window of fragments, in
// which it sorts all voxels of some hundred fragments at once; longer ones are a warp's or a block's each, and what is
// more than that is cut into runs that are sorted and merged. How many fragments there are is known on the device
// alone.

#include <voxelpipe/device/fragment_sort.cuh>
#include <voxelpipe/device/scene.cuh>

#include <cub/block/block_merge_sort.cuh>
#include <cuda/atomic>

#include <algorithm>
#include <bit>

namespace voxelpipe::device {

inline constexpr std::uint32_t window_length = 192;  // a warp takes the voxels that begin in so many fragments
inline constexpr std::uint32_t most_of_window = 256; // fragments of a voxel
inline constexpr int num_warp_sorts = 2;             // with 16 or 32 fragments a lane
inline constexpr std::uint32_t most_of_warp = 32 * 32;
inline constexpr std::uint32_t most_of_block = 4096;
inline constexpr int narrow_primitive_bits = 24; // beside the rank of a voxel in its window, in 32
inline constexpr int order_warps = 4;            // of a block that takes windows
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

// Voxels that are too long for a window, by how they are sorted. The lists cannot overflow: a voxel in one of them has
// so many fragments.
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
        return k == 0 ? most_of_window : k == 1 ? 32 * 16 : most_of_warp;
    }
    // A voxel that begins at `begin`. By one thread.
    __device__ void push(unsigned long long begin, unsigned long long length) const {
        if (length > most_of_block) {
            const auto entries = static_cast<unsigned>((length + most_of_block - 1) / most_of_block);
            const unsigned at = atomicAdd(&counts[run_list], entries);
            for (unsigned k = 0; k < entries; ++k) {
                const unsigned long long from = std::uint64_t{k} * most_of_block, rest = length - from;
                runs[at + k] = {{begin + from, rest < most_of_block ? rest : most_of_block}, {begin, length}};
            }
            return;
        }
        const int kind = length > most_below(2) ? 2 : length > most_below(1) ? 1 : 0;
        static_assert(block_list == 2);
        const unsigned at = atomicAdd(&counts[kind], 1u);
        for (int k = 0; k <= block_list; ++k) // an index that is no constant would put the pointers in local memory
            if (kind == k) voxels[k][at] = {begin, length};
    }
};

// Arrays for lists: the voxels, ascending, in one of two, where their fragments begin, and one place more that says how
// many fragments there are; voxels beyond the room are counted, not written. The primitives by voxel, and payloads.
struct list_places {
    std::uint64_t* voxels = nullptr; // or
    std::uint32_t* narrow_voxels = nullptr;
    std::uint64_t* offsets = nullptr;
    std::uint64_t room = 0;
    std::uint32_t* primitives = nullptr;
    void* payloads = nullptr;
};

// Where the lists are to go: null where they come to lie. With a page, which the device can read, what it says when the
// call runs, so that a call that is kept as a graph finds new arrays.
struct asked_places {
    list_places value;
    const list_places* page = nullptr;
};

// How many voxels begin in each tile of windows, passed on from tile to tile: one word each, zeroed before.
struct tile_counts {
    static constexpr std::uint32_t length = order_warps * window_length; // fragments of a tile
    static constexpr unsigned long long own = 1ull << 62, all = 2ull << 62, value = own - 1;
    unsigned long long* words;

    [[nodiscard]] VOXELPIPE_HD static std::uint64_t num(std::uint64_t capacity) {
        return (capacity + length - 1) / length;
    }

    // How many voxels begin in the tiles before this one, in which `count` do. By all lanes of one warp. Tiles are
    // taken in order, so those before are under way.
    [[nodiscard]] __device__ unsigned long long before(std::uint32_t tile, unsigned long long count) const {
        using word = ::cuda::atomic_ref<unsigned long long, ::cuda::thread_scope_device>;
        const auto lane = threadIdx.x % 32;
        unsigned long long sum = 0;
        if (tile != 0) {
            if (lane == 0) word(words[tile]).store(own | count, ::cuda::memory_order_relaxed);
            for (std::int64_t last = std::int64_t{tile} - 1;; last -= 32) { // lane k looks at tile last - k
                const std::int64_t mine = last - lane;
                unsigned long long w = all; // before the first tile
                if (mine >= 0) do
                        w = word(words[mine]).load(::cuda::memory_order_relaxed);
                    while ((w & ~value) == 0);
                const unsigned with_all = __ballot_sync(0xffffffffu, (w & all) != 0);
                const unsigned nearest =
                    with_all == 0 ? 31 : static_cast<unsigned>(__ffs(static_cast<int>(with_all))) - 1;
                unsigned part = lane <= nearest ? static_cast<unsigned>(w & value) : 0; // fewer than 2^32 fragments
                part = __reduce_add_sync(0xffffffffu, part);
                sum += part;
                if (with_all != 0) break;
            }
        }
        if (lane == 0) word(words[tile]).store(all | (sum + count), ::cuda::memory_order_relaxed);
        return sum;
    }
};

// What the sort and the order of a call's fragments want before they begin, which the raster that lists them does on
// its way: zeros, and the page's word of where the lists are to go.
struct sort_preparation {
    bool is_wanted = false;
    bool sorts = false; // by sort_fragments
    sort_memory sort{};
    std::uint64_t capacity = 0;    // fragments
    tile_counts tiles{};           // or none
    list_places* places = nullptr; // or none
    asked_places asked;

    // By all threads of a grid.
    __device__ VOXELPIPE_INLINE void run(std::uint64_t thread, std::uint64_t threads) const {
        if (places != nullptr && thread == 0) *places = asked.page != nullptr ? *asked.page : asked.value;
        if (tiles.words != nullptr)
            for (std::uint64_t i = thread; i < tile_counts::num(capacity); i += threads) tiles.words[i] = 0;
        if (sorts) sort.zero(capacity, thread, threads);
    }
};

// Memory for the order of so many fragments.
struct order_memory {
    tile_counts tiles;
    order_lists lists;

    [[nodiscard]] static order_memory take(arena& memory, std::uint64_t capacity) {
        order_memory m{};
        m.tiles.words = memory.take<unsigned long long>(tile_counts::num(capacity));
        m.lists = order_lists::take(memory, capacity);
        return m;
    }
};

// keys: the voxels of the fragments, ascending; from: their primitives, in any order within a voxel, overwritten;
// spare: room for as many, which may be where the keys are. The lists go where `asked` says, in device memory, or
// `here` where that has no voxels.
struct order_buffers {
    const std::uint32_t* keys;
    std::uint32_t* from;
    std::uint32_t* spare;
    const list_places* asked;
    list_places here;
    tile_counts tiles;
    order_lists lists;
    int primitive_bits = 32; // of the largest primitive

    [[nodiscard]] __device__ VOXELPIPE_INLINE const list_places& places() const {
        return asked->voxels != nullptr ? *asked : here;
    }
};

// ---- windows --------------------------------------------------------------------------------------------------------

// Sorts the numbers of a warp, of which a lane has Items neighbours, by a bitonic network that first compares each with
// its mirror image, so that all comparisons go the same way. Neighbours up to Items apart are in one lane; beyond,
// lanes exchange theirs.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void sort_warp(Word (&w)[Items]) {
    const int lane = static_cast<int>(threadIdx.x % 32);
    const auto put_in_order = [&](int low, int high) VOXELPIPE_INLINE_LAMBDA {
        const Word a = w[low], b = w[high];
        w[low] = min(a, b);
        w[high] = max(a, b);
    };
#pragma unroll
    for (int size = 2; size <= 32 * Items; size *= 2) {
        if (size <= Items) {
#pragma unroll
            for (int k = 0; k < Items; ++k)
                if ((k & size / 2) == 0) put_in_order(k, k ^ (size - 1));
        } else {
            const int lanes = size / Items;
            const bool lower = (lane & lanes / 2) == 0;
#pragma unroll
            for (int k = 0; k < Items / 2; ++k) {
                const Word a = __shfl_xor_sync(0xffffffffu, w[Items - 1 - k], lanes - 1);
                const Word b = __shfl_xor_sync(0xffffffffu, w[k], lanes - 1);
                w[k] = lower ? min(w[k], a) : max(w[k], a);
                w[Items - 1 - k] = lower ? min(w[Items - 1 - k], b) : max(w[Items - 1 - k], b);
            }
        }
#pragma unroll
        for (int apart = size / 4; apart > 0; apart /= 2) {
            if (apart >= Items) {
                const bool lower = (lane & apart / Items) == 0;
#pragma unroll
                for (int k = 0; k < Items; ++k) {
                    const Word other = __shfl_xor_sync(0xffffffffu, w[k], apart / Items);
                    w[k] = lower ? min(w[k], other) : max(w[k], other);
                }
            } else {
#pragma unroll
                for (int k = 0; k < Items; ++k)
                    if ((k & apart) == 0) put_in_order(k, k | apart);
            }
        }
    }
}

// What a warp keeps of its window.
struct order_window {
    static constexpr std::uint32_t most = window_length - 1 + most_of_window; // fragments of all voxels but a long one
    static constexpr std::uint32_t places = 512;
    static_assert(most <= places);
    std::uint32_t voxels[window_length], first[window_length]; // of each voxel that begins here
    std::uint32_t primitives[places + places / 32];            // a word more for 32, so that lanes meet no bank twice
};

// Writes the primitives of the fragments from `begin` on in order: places 0 .. end - 1 of the window, of which the
// first `skipped` are of a voxel that begins before it. starts: by 32 places, where voxels begin. A fragment's number
// in the sort is its voxel's rank within the window and then its primitive, in primitive_bits.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void order_places(const order_buffers& b, std::uint32_t* to, order_window& window,
                                              std::uint32_t begin, std::uint32_t skipped, std::uint32_t end,
                                              const unsigned (&starts)[window_length / 32], int primitive_bits) {
    constexpr int rows = window_length / 32;
    const std::uint32_t lane = threadIdx.x % 32;
    Word w[Items];
    std::uint32_t before = 0; // voxels that begin before this row of places
#pragma unroll
    for (int k = 0; k < Items; ++k) {
        const std::uint32_t place = lane + 32 * static_cast<std::uint32_t>(k);
        const unsigned mine = k < rows ? starts[k < rows ? k : 0] : 0;
        const std::uint32_t rank = before + static_cast<std::uint32_t>(__popc(mine & (2u << lane) - 1)) - 1;
        before += static_cast<std::uint32_t>(__popc(mine));
        w[k] = place >= skipped && place < end ? static_cast<Word>(rank) << primitive_bits | b.from[begin + place]
                                               : ~Word{0};
    }
    sort_warp(w);
#pragma unroll
    for (int k = 0; k < Items; ++k) {
        const std::uint32_t at = lane * Items + static_cast<std::uint32_t>(k);
        window.primitives[at + at / 32] =
            static_cast<std::uint32_t>(w[k] & (static_cast<Word>(1) << primitive_bits) - 1);
    }
    __syncwarp();
#pragma unroll
    for (int k = 0; k < Items; ++k) {
        const std::uint32_t at = lane + 32 * static_cast<std::uint32_t>(k);
        if (at < end - skipped) to[begin + skipped + at] = window.primitives[at + static_cast<std::uint32_t>(k)];
    }
}

// Of n voxels of fragments, ascending: the first from `at` on that is not this one, where all before are. By all lanes.
[[nodiscard]] __device__ inline std::uint32_t find_end(const std::uint32_t* voxels, std::uint32_t n,
                                                       std::uint32_t voxel, std::uint32_t at) {
    const std::uint64_t lane = threadIdx.x % 32;
    const auto same_strides = [&](std::uint64_t first, std::uint64_t stride) { // of 32, how many are this voxel's
        const std::uint64_t last = first + lane * stride + stride - 1;
        return static_cast<std::uint64_t>(__popc(__ballot_sync(0xffffffffu, last < n && voxels[last] == voxel)));
    };
    std::uint64_t end = at, stride = 32;
    for (;; stride *= 32) {
        const std::uint64_t same = same_strides(end, stride);
        end += same * stride;
        if (same < 32) break;
    }
    for (; stride > 1; stride /= 32) end += same_strides(end, stride / 32) * (stride / 32);
    return static_cast<std::uint32_t>(end);
}

// Puts the voxels in order that begin in the window of n fragments from `begin` on, but for one that is too long, which
// goes to its list; leaves all of them in `window`, and returns how many they are. By all lanes of a warp.
template <bool Narrow>
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t
order_window_at(const order_buffers& b, std::uint32_t* to, order_window& window, std::uint32_t begin, std::uint32_t n) {
    constexpr int rows = window_length / 32;
    const std::uint32_t lane = threadIdx.x % 32;
    const std::uint32_t* const voxels = b.keys + begin;
    n -= begin; // from here on places count from the window's first
    std::uint32_t row[rows];
#pragma unroll
    for (int k = 0; k < rows; ++k) {
        const std::uint32_t place = lane + 32 * static_cast<std::uint32_t>(k);
        row[k] = place < n ? voxels[place] : ~0u;
    }
    std::uint32_t before = begin == 0 ? ~0u : *(voxels - 1); // the voxel of the fragment before a row
    unsigned starts[rows];
    std::uint32_t count = 0;
#pragma unroll
    for (int k = 0; k < rows; ++k) {
        const std::uint32_t place = lane + 32 * static_cast<std::uint32_t>(k);
        std::uint32_t previous = __shfl_up_sync(0xffffffffu, row[k], 1);
        if (lane == 0) previous = before;
        before = __shfl_sync(0xffffffffu, row[k], 31);
        const bool is_first = place < n && row[k] != previous;
        starts[k] = __ballot_sync(0xffffffffu, is_first);
        if (is_first) {
            const std::uint32_t rank = count + static_cast<std::uint32_t>(__popc(starts[k] & ((1u << lane) - 1)));
            window.voxels[rank] = row[k];
            window.first[rank] = begin + place;
        }
        count += static_cast<std::uint32_t>(__popc(starts[k]));
    }
    __syncwarp();
    if (count == 0) return 0;
    // The last one ends in another window.
    const std::uint32_t last = window.first[count - 1] - begin, voxel = window.voxels[count - 1];
    std::uint32_t end = window_length;
    for (;;) {
        const unsigned other = __ballot_sync(0xffffffffu, end + lane >= n || voxels[end + lane] != voxel);
        if (other != 0) {
            end += static_cast<std::uint32_t>(__ffs(static_cast<int>(other))) - 1;
            break;
        }
        end += 32;
        if (end - last > most_of_window) break;
    }
    end = end < n ? end : n;
    const bool is_long = end - last > most_of_window;
    if (is_long) {
        end = find_end(voxels, n, voxel, end);
        if (lane == 0) b.lists.push(begin + last, end - last);
        end = last;
    }
    const std::uint32_t skipped = window.first[0] - begin;
    if (end - skipped <= (is_long ? count - 1 : count)) { // a fragment each, or nothing
        for (std::uint32_t i = skipped + lane; i < end; i += 32) to[begin + i] = b.from[begin + i];
    } else {
        const auto order = [&]<class Word>(int primitive_bits) VOXELPIPE_INLINE_LAMBDA {
            if (end <= 32 * 8)
                order_places<Word, 8>(b, to, window, begin, skipped, end, starts, primitive_bits);
            else
                order_places<Word, 16>(b, to, window, begin, skipped, end, starts, primitive_bits);
        };
        if constexpr (Narrow)
            order.template operator()<std::uint32_t>(narrow_primitive_bits);
        else if (b.primitive_bits < 32 &&
                 count <= 1u << (32 - b.primitive_bits)) // few voxels, as where triangles are tiny
            order.template operator()<std::uint32_t>(b.primitive_bits);
        else
            order.template operator()<std::uint64_t>(32);
    }
    return count;
}

// Narrow: primitives have narrow_primitive_bits.
template <bool Narrow>
__global__ __launch_bounds__(32 * order_warps) void order_windows_kernel(const __grid_constant__ order_buffers b,
                                                                         pipeline_state* state, capacities limits) {
    __shared__ order_window windows[order_warps];
    __shared__ std::uint32_t tile, counts[order_warps];
    __shared__ unsigned long long before;
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments); // see core::most_numbered
    const std::uint32_t warp = warp_in_block(), lane = threadIdx.x % 32;
    const list_places to = b.places();
    for (;;) {
        __syncthreads(); // all have read what the last tile left
        if (threadIdx.x == 0) tile = atomicAdd(&state->next_tile, 1u);
        __syncthreads();
        const std::uint64_t first = std::uint64_t{tile} * tile_counts::length, begin = first + warp * window_length;
        if (first >= n) return;
        order_window& window = windows[warp];
        const std::uint32_t count =
            begin < n ? order_window_at<Narrow>(b, to.primitives, window, static_cast<std::uint32_t>(begin), n) : 0;
        if (lane == 0) counts[warp] = count;
        __syncthreads();
        if (warp == 0) {
            const std::uint32_t all = __reduce_add_sync(0xffffffffu, lane < order_warps ? counts[lane] : 0);
            const unsigned long long sum = b.tiles.before(tile, all);
            if (lane == 0) {
                before = sum;
                if (first + tile_counts::length >= n) { // the last tile
                    state->list_voxels = sum + all;
                    if (sum + all <= to.room) to.offsets[sum + all] = n;
                }
            }
        }
        __syncthreads();
        std::uint64_t at = before + lane;
        for (std::uint32_t w = 0; w < warp; ++w) at += counts[w];
        for (std::uint32_t r = lane; r < count && at < to.room; r += 32, at += 32) {
            if (to.voxels != nullptr)
                to.voxels[at] = window.voxels[r];
            else
                to.narrow_voxels[at] = window.voxels[r];
            to.offsets[at] = window.first[r];
        }
    }
}

// ---- long voxels ----------------------------------------------------------------------------------------------------

// The voxels of a list by a warp each, the first one by the first warp of block `start`. What is beyond the fragments
// of a voxel is more than any primitive, or equal to the last.
template <int List>
__device__ VOXELPIPE_INLINE void order_by_warps(const order_buffers& b, std::uint32_t* to, unsigned start) {
    constexpr int items = static_cast<int>(order_lists::most_below(List + 1) / 32);
    constexpr std::uint32_t warps = block_sort_threads / 32;
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
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k)
            if (lane * items + k < run.length) to[run.begin + lane * items + k] = w[k];
    }
}

struct less_than {
    [[nodiscard]] __device__ bool operator()(std::uint32_t a, std::uint32_t b) const { return a < b; }
};

// By a block each: voxels, and runs of one, which go back to where they were.
__device__ VOXELPIPE_INLINE void order_by_blocks(const order_buffers& b, std::uint32_t* primitives) {
    constexpr std::uint32_t items = most_of_block / block_sort_threads;
    using lists = order_lists;
    using sorter = cub::BlockMergeSort<std::uint32_t, block_sort_threads, static_cast<int>(items)>;
    __shared__ typename sorter::TempStorage storage;
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
        std::uint32_t* const to = r < whole ? primitives : b.from;
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t i = threadIdx.x * items + k;
            if (i < run.length) to[run.begin + i] = w[k];
        }
    }
}

template <class Buffers>
__global__ __launch_bounds__(block_sort_threads, 4) void order_long_kernel(const __grid_constant__ Buffers b) {
    await_stream();
    std::uint32_t* const to = b.places().primitives;
    // Where there are few, each list has blocks of its own.
    order_by_warps<0>(b, to, gridDim.x / 3);
    order_by_warps<1>(b, to, gridDim.x / 3 * 2);
    static_assert(num_warp_sorts == 2);
    order_by_blocks(b, to);
}

// How many of n sorted numbers are less than w.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t count_less(const std::uint32_t* numbers, std::uint32_t n,
                                                                   std::uint32_t w) {
    std::uint32_t lo = 0;
    while (n > 0) {
        const std::uint32_t half = n / 2;
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
// thread takes one fragment, a warp 32 neighbours of a run: each lane finds where those begin and end in another run,
// and all search between. Last: the rest of the voxel in one go, however many runs that is.
template <class Buffers>
__global__ void merge_runs_kernel(const __grid_constant__ Buffers b, const std::uint32_t* from, std::uint32_t* to,
                                  std::uint64_t length, bool last) {
    constexpr std::uint32_t parts = most_of_block / threads_per_block;
    await_stream();
    const std::uint32_t lane = threadIdx.x % 32;
    const std::uint64_t n = std::uint64_t{b.lists.counts[order_lists::run_list]} * parts;
    for (std::uint64_t r = blockIdx.x; r < n; r += gridDim.x) {
        const voxel_run entry = b.lists.runs[r / parts];
        const fragment_run voxel = entry.voxel;
        if (voxel.length <= length) continue; // was done by the merge before
        const std::uint64_t i = r % parts * threads_per_block + threadIdx.x;
        if (i - lane >= entry.run.length) continue; // no lane has one
        const std::uint64_t group_length = last ? voxel.length : length * merge_ways;
        // Within the voxel. Lanes beyond the last fragment take that.
        const std::uint64_t at = entry.run.begin - voxel.begin + (i < entry.run.length ? i : entry.run.length - 1);
        const std::uint64_t group = at / group_length * group_length, own = at / length * length;
        const std::uint64_t end = group + group_length < voxel.length ? group + group_length : voxel.length;
        const std::uint32_t* const numbers = from + voxel.begin;
        const std::uint32_t primitive = numbers[at];
        const std::uint32_t least = __shfl_sync(0xffffffffu, primitive, 0),
                            most = __shfl_sync(0xffffffffu, primitive, 31);
        std::uint64_t place = voxel.begin + group + (at - own);
        for (std::uint64_t start = group; start < end; start += 32 * length) {
            const std::uint64_t mine = start + lane * length;
            std::uint32_t low = 0, high = 0; // of the run's numbers, those before `least` and before `most`
            if (mine < end && mine != own) {
                const auto of_run = static_cast<std::uint32_t>(end - mine < length ? end - mine : length);
                low = count_less(numbers + mine, of_run, least);
                high = low + count_less(numbers + mine + low, of_run - low, most);
            }
            for (unsigned k = 0; k < 32 && start + k * length < end; ++k) {
                const std::uint32_t first = __shfl_sync(0xffffffffu, low, k);
                const std::uint32_t between = __shfl_sync(0xffffffffu, high, k) - first;
                place += first + count_less(numbers + start + k * length + first, between, primitive);
            }
        }
        if (i < entry.run.length) (voxel.length <= group_length ? b.places().primitives : to)[place] = primitive;
    }
}

// ---- host -----------------------------------------------------------------------------------------------------------

// Puts b.from in order and lists the voxels; counts them in the state.
inline void order_fragments(order_buffers b, std::uint64_t num_primitives, pipeline_state* state,
                            const capacities& limits, cudaStream_t stream) {
    constexpr stage where = stage::abuffer_emit;
    const std::uint64_t capacity = limits.fragments;
    b.primitive_bits = num_primitives < 2 ? 1 : static_cast<int>(std::bit_width(num_primitives - 1));
    const auto windows =
        b.primitive_bits <= narrow_primitive_bits ? order_windows_kernel<true> : order_windows_kernel<false>;
    const std::uint64_t tiles = tile_counts::num(capacity);
    launch_behind(windows, fill_device(tiles * threads_per_block, 8), 32 * order_warps, stream, where, b, state,
                  limits);
    if (capacity > most_of_window)
        launch_behind(order_long_kernel<order_buffers>, fill_device(capacity / (most_of_window + 1) * 32, 4),
                      block_sort_threads, stream, where, b);
    // Runs of 2^12, 2^18 and 2^24 fragments; the last merge takes all that there are.
    std::uint64_t length = most_of_block;
    for (int level = 0; level < 3 && capacity > length; ++level, length *= merge_ways)
        launch_behind(merge_runs_kernel<order_buffers>, fill_device(capacity), threads_per_block, stream, where, b,
                      level % 2 == 0 ? b.from : b.spare, level % 2 == 0 ? b.spare : b.from, length, level == 2);
}

} // namespace voxelpipe::device
