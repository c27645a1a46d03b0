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
inline constexpr int order_blocks = 8;           // on a multiprocessor
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

    using word = ::cuda::atomic_ref<unsigned long long, ::cuda::thread_scope_device>;

    // Says how many voxels begin in this tile, for those behind. By one thread.
    __device__ void publish(std::uint32_t tile, unsigned long long count) const {
        if (tile != 0) word(words[tile]).store(own | count, ::cuda::memory_order_relaxed);
    }
    // How many voxels begin in the tiles before this one, in which `count` do, as has been published. By all lanes of
    // one warp. Tiles are taken in order, so those before are under way.
    [[nodiscard]] __device__ unsigned long long before(std::uint32_t tile, unsigned long long count) const {
        const auto lane = threadIdx.x % 32;
        unsigned long long sum = 0;
        if (tile != 0) {
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

template <class Word>
__device__ VOXELPIPE_INLINE void put_in_order(Word& low, Word& high) {
    const Word a = low, b = high;
    low = min(a, b);
    high = max(a, b);
}

// The numbers of a warp, of which a lane has Items neighbours, by a bitonic network: those of runs of 2 * apart numbers
// that are each less than all behind them, or more, once those apart have been compared.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void merge_warp(Word (&w)[Items], int apart) {
    const int lane = static_cast<int>(threadIdx.x % 32);
#pragma unroll
    for (; apart > 0; apart /= 2) {
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
                if ((k & apart) == 0) put_in_order(w[k], w[k | apart]);
        }
    }
}

// Sorts them. Each run of numbers is compared with its mirror image first, so that all comparisons go the same way.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void sort_warp(Word (&w)[Items]) {
    const int lane = static_cast<int>(threadIdx.x % 32);
#pragma unroll
    for (int size = 2; size <= 32 * Items; size *= 2) {
        if (size <= Items) {
#pragma unroll
            for (int k = 0; k < Items; ++k)
                if ((k & size / 2) == 0) put_in_order(w[k], w[k ^ (size - 1)]);
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
        merge_warp(w, size / 4);
    }
}

// Sorts them where they are made of runs of at most `longest` numbers, each run less than the next: neighbours by
// neighbours, even and odd ones in turn, which takes as many rounds as the longest run has numbers.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void sort_runs_of_warp(Word (&w)[Items], std::uint32_t longest) {
    static_assert(Items % 2 == 0);
    const bool is_first = threadIdx.x % 32 == 0, is_last = threadIdx.x % 32 == 31;
    for (std::uint32_t round = 0; round < longest; round += 2) {
#pragma unroll
        for (int k = 0; k < Items; k += 2) put_in_order(w[k], w[k + 1]);
#pragma unroll
        for (int k = 1; k < Items - 1; k += 2) put_in_order(w[k], w[k + 1]);
        const Word previous = __shfl_up_sync(0xffffffffu, w[Items - 1], 1);
        const Word next = __shfl_down_sync(0xffffffffu, w[0], 1);
        w[0] = max(w[0], is_first ? Word{0} : previous);
        w[Items - 1] = min(w[Items - 1], is_last ? ~Word{0} : next);
    }
}

// What a warp keeps of its window: the voxels that begin in it, and where.
struct order_window {
    std::uint32_t voxels[window_length], first[window_length];
};

// A lane's neighbours of n numbers, from number `first` on; ~0 beyond. numbers: aligned to 16 bytes.
template <int Items>
__device__ VOXELPIPE_INLINE void load_neighbours(const std::uint32_t* numbers, std::uint32_t first, std::uint32_t n,
                                                 std::uint32_t (&to)[Items]) {
    static_assert(Items % 4 == 0);
    if (first + Items <= n) {
#pragma unroll
        for (int k = 0; k < Items; k += 4) {
            const uint4 four = *reinterpret_cast<const uint4*>(numbers + first + k);
            to[k] = four.x;
            to[k + 1] = four.y;
            to[k + 2] = four.z;
            to[k + 3] = four.w;
        }
    } else {
#pragma unroll
        for (std::uint32_t k = 0; k < Items; ++k) to[k] = first + k < n ? numbers[first + k] : ~0u;
    }
}
// Those of places begin .. end - 1 go where they belong.
template <int Items>
__device__ VOXELPIPE_INLINE void store_neighbours(std::uint32_t* numbers, std::uint32_t first, std::uint32_t begin,
                                                  std::uint32_t end, const std::uint32_t (&from)[Items]) {
    if (first >= begin && first + Items <= end && reinterpret_cast<std::uintptr_t>(numbers) % 16 == 0) {
#pragma unroll
        for (int k = 0; k < Items; k += 4)
            *reinterpret_cast<uint4*>(numbers + first + k) = {from[k], from[k + 1], from[k + 2], from[k + 3]};
    } else {
#pragma unroll
        for (std::uint32_t k = 0; k < Items; ++k)
            if (first + k >= begin && first + k < end) numbers[first + k] = from[k];
    }
}

// The voxels of a window of 32 * Items places, which count from its first; a lane has Items neighbours.
template <int Items>
struct window_voxels {
    static constexpr std::uint32_t places = 32 * Items;
    std::uint32_t voxel[Items];
    unsigned starts;    // bit k: another voxel begins at the lane's place k than was before, or none
    unsigned begins;    // the same of voxels that begin within window_length and before n
    std::uint32_t rank; // of them, how many before this lane's places

    // voxels: of n fragments, from the window's first; before: the voxel of the one before, or ~0.
    __device__ VOXELPIPE_INLINE window_voxels(const std::uint32_t* voxels, std::uint32_t n, std::uint32_t before) {
        const std::uint32_t lane = threadIdx.x % 32, first = lane * Items;
        load_neighbours(voxels, first, n, voxel);
        std::uint32_t previous = __shfl_up_sync(0xffffffffu, voxel[Items - 1], 1);
        if (lane == 0) previous = before;
        starts = 0;
#pragma unroll
        for (int k = 0; k < Items; ++k) {
            starts |= voxel[k] != previous ? 1u << k : 0;
            previous = voxel[k];
        }
        constexpr std::uint32_t length = window_length;
        const std::uint32_t most = n < length ? n : length, own = first < most ? most - first : 0;
        begins = starts & (own < Items ? (1u << own) - 1 : ~0u);
        rank = static_cast<std::uint32_t>(__popc(begins));
#pragma unroll
        for (unsigned apart = 1; apart < 32; apart *= 2) {
            const std::uint32_t other = __shfl_up_sync(0xffffffffu, rank, apart);
            rank += lane >= apart ? other : 0;
        }
        rank -= static_cast<std::uint32_t>(__popc(begins));
    }

    // The first and the last of the places that are set in `bits` of any lane, of which there are some.
    [[nodiscard]] static __device__ VOXELPIPE_INLINE std::uint32_t first_of(unsigned bits) {
        const int lane = __ffs(static_cast<int>(__ballot_sync(0xffffffffu, bits != 0))) - 1;
        return static_cast<std::uint32_t>(lane * Items + __ffs(static_cast<int>(__shfl_sync(0xffffffffu, bits, lane))) -
                                          1);
    }
    [[nodiscard]] static __device__ VOXELPIPE_INLINE std::uint32_t last_of(unsigned bits) {
        const int lane = 31 - __clz(static_cast<int>(__ballot_sync(0xffffffffu, bits != 0)));
        return static_cast<std::uint32_t>(lane * Items + 31 -
                                          __clz(static_cast<int>(__shfl_sync(0xffffffffu, bits, lane))));
    }
    // No voxel between two starts has more fragments.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t longest() const {
        constexpr unsigned within = Items - 1; // of a lane
        const unsigned next = __shfl_down_sync(0xffffffffu, starts, 1);
        const unsigned across = starts != 0 && next != 0 && threadIdx.x % 32 != 31
                                    ? static_cast<unsigned>(__ffs(static_cast<int>(next)) - 1 + Items - 31 +
                                                            __clz(static_cast<int>(starts)))
                                    : within;
        unsigned most = __reduce_max_sync(0xffffffffu, across);
        const unsigned lanes = __ballot_sync(0xffffffffu, starts != 0);
        unsigned empty = ~lanes & (0u - (lanes & (0u - lanes))) & ~0u >> __clz(static_cast<int>(lanes));
        if (empty != 0) { // lanes between others within which no voxel begins
            for (most = 2 * Items - 1; empty != 0; empty &= empty << 1) most += Items;
        }
        return most < within ? within : most;
    }
};

// Writes the primitives of the window's places begin .. end - 1 in order, within which whole voxels lie. A fragment's
// number in the sort is its voxel's rank within the window and then its primitive, in primitive_bits.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void order_places(const std::uint32_t (&primitive)[Items], std::uint32_t* to,
                                              const window_voxels<Items>& window, std::uint32_t begin,
                                              std::uint32_t end, int primitive_bits) {
    constexpr std::uint32_t few = Items <= 8 ? 6 * Items : 0; // beyond, the network for any order takes less
    const std::uint32_t first = threadIdx.x % 32 * Items;
    Word w[Items], rank = static_cast<Word>(window.rank) - 1;
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k) {
        rank += window.begins >> k & 1u;
        const Word own = rank << primitive_bits | primitive[k], but_before = first + k < begin ? Word{0} : own;
        w[k] = first + k < end ? but_before : ~Word{0};
    }
    // A voxel that ends with the window has no start behind it.
    const std::uint32_t longest = few != 0 && end < window.places ? window.longest() : few + 1;
    if (longest <= few)
        sort_runs_of_warp(w, longest);
    else
        sort_warp(w);
    std::uint32_t sorted[Items];
#pragma unroll
    for (int k = 0; k < Items; ++k)
        sorted[k] = static_cast<std::uint32_t>(w[k] & (static_cast<Word>(1) << primitive_bits) - 1);
    store_neighbours(to, first, begin, end, sorted);
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

// The window of n fragments from `begin` on, by all lanes of a warp.
struct order_of_window {
    static constexpr int items = 8, wide_items = 16;
    using voxels_type = window_voxels<items>;
    using wide_type = window_voxels<wide_items>;
    static_assert(voxels_type::places >= window_length && wide_type::places >= window_length - 1 + most_of_window);

    const order_buffers& b;
    std::uint32_t begin, n, before; // n counts from the window's first, as all places do; the voxel before it
    std::uint32_t primitive[items]{};
    voxels_type voxels;
    std::uint32_t count; // of voxels that begin in it

    __device__ VOXELPIPE_INLINE order_of_window(const order_buffers& buffers, std::uint32_t begin_, std::uint32_t n_)
        : b(buffers), begin(begin_), n(n_ - begin_), before(begin_ == 0 ? ~0u : b.keys[begin_ - 1]),
          voxels(b.keys + begin, n, before) {
        load_neighbours(b.from + begin, threadIdx.x % 32 * items, n, primitive);
        count = __reduce_add_sync(0xffffffffu, static_cast<std::uint32_t>(__popc(voxels.begins)));
    }

    __device__ VOXELPIPE_INLINE void keep(order_window& kept) const {
        const std::uint32_t first = begin + threadIdx.x % 32 * items;
        std::uint32_t rank = voxels.rank;
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k)
            if ((voxels.begins >> k & 1u) != 0) {
                kept.voxels[rank] = voxels.voxel[k];
                kept.first[rank++] = first + k;
            }
    }

    // Puts its voxels in order, but for one that is too long, which goes to its list.
    template <bool Narrow>
    __device__ VOXELPIPE_INLINE void order(std::uint32_t* to) const {
        if (count == 0) return;
        const std::uint32_t skipped = voxels_type::first_of(voxels.begins);
        const unsigned behind = voxels.starts & ~voxels.begins;
        std::uint32_t whole = count;
        std::uint32_t end = voxels_type::places;
        if (__any_sync(0xffffffffu, behind != 0))
            end = voxels_type::first_of(behind);
        else
            whole -= find_last(end);
        to += begin;
        if (end - skipped <= whole) { // a fragment each, or nothing
            store_neighbours(to, threadIdx.x % 32 * items, skipped, end, primitive);
            return;
        }
        const auto order = [&]<class Word>(int primitive_bits) VOXELPIPE_INLINE_LAMBDA {
            if (end <= voxels_type::places) {
                order_places<Word>(primitive, to, voxels, skipped, end, primitive_bits);
            } else {
                std::uint32_t all[wide_items];
                load_neighbours(b.from + begin, threadIdx.x % 32 * wide_items, n, all);
                order_places<Word>(all, to, wide_type(b.keys + begin, n, before), skipped, end, primitive_bits);
            }
        };
        if constexpr (Narrow)
            order.template operator()<std::uint32_t>(narrow_primitive_bits);
        else if (b.primitive_bits < 32 &&
                 count <= 1u << (32 - b.primitive_bits)) // few voxels, as where triangles are tiny
            order.template operator()<std::uint32_t>(b.primitive_bits);
        else
            order.template operator()<std::uint64_t>(32);
    }

private:
    // Where the last voxel ends, which does so at `end` or beyond. Returns 1 where it is too long: then `end` is where
    // it begins.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t find_last(std::uint32_t& end) const {
        const std::uint32_t lane = threadIdx.x % 32, last = voxels_type::last_of(voxels.begins);
        const std::uint32_t* const keys = b.keys + begin;
        const std::uint32_t voxel = keys[last];
        do {
            const unsigned other = __ballot_sync(0xffffffffu, end + lane >= n || keys[end + lane] != voxel);
            if (other != 0) {
                end += static_cast<std::uint32_t>(__ffs(static_cast<int>(other))) - 1;
                break;
            }
            end += 32;
        } while (end - last <= most_of_window);
        if (end - last <= most_of_window) return 0;
        end = find_end(keys, n, voxel, end);
        if (lane == 0) b.lists.push(begin + last, end - last);
        end = last;
        return 1;
    }
};

// Narrow: primitives have narrow_primitive_bits.
template <bool Narrow>
__global__ __launch_bounds__(32 * order_warps,
                             order_blocks) void order_windows_kernel(const __grid_constant__ order_buffers b,
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
        // Where the tile has no such window, one behind the last fragment, in which nothing begins.
        const order_of_window window(b, static_cast<std::uint32_t>(begin < n ? begin : n), n);
        if (lane == 0) counts[warp] = window.count;
        __syncthreads();
        std::uint32_t earlier = 0, all = 0;
        for (std::uint32_t w = 0; w < order_warps; ++w) {
            earlier += w < warp ? counts[w] : 0;
            all += counts[w];
        }
        if (threadIdx.x == 0) b.tiles.publish(tile, all); // before the sort, for the tiles behind
        window.keep(windows[warp]);
        window.template order<Narrow>(to.primitives);
        if (warp == 0) {
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
        std::uint64_t at = before + earlier + lane;
        for (std::uint32_t r = lane; r < window.count && at < to.room; r += 32, at += 32) {
            if (to.voxels != nullptr)
                to.voxels[at] = windows[warp].voxels[r];
            else
                to.narrow_voxels[at] = windows[warp].voxels[r];
            to.offsets[at] = windows[warp].first[r];
        }
    }
}

// ---- long voxels ----------------------------------------------------------------------------------------------------

// Numbers of a block, on their way from one lane to another. Those of a warp lie apart; a word more for 32, so that
// lanes meet no bank twice.
struct sort_exchange {
    static constexpr std::uint32_t of_warp = most_of_warp + most_of_warp / 32;
    std::uint32_t numbers[block_sort_threads / 32 * of_warp];
    static_assert(block_sort_threads / 32 * of_warp >= most_of_block);
};

// Writes the first n numbers of a warp, of which a lane has Items neighbours.
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

// The voxels of a list by a warp each, the first one by the first warp of block `start`. What is beyond the fragments
// of a voxel is more than any primitive, or equal to the last.
template <int List>
__device__ VOXELPIPE_INLINE void order_by_warps(const order_buffers& b, std::uint32_t* to, sort_exchange& exchange,
                                                unsigned start) {
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
        store_warp(w, exchange, to + run.begin, static_cast<std::uint32_t>(run.length));
    }
}

// Sorts the numbers of a block, of which a thread has Items neighbours: the network of sort_warp, in which warps
// exchange theirs through shared memory.
template <int Items>
__device__ VOXELPIPE_INLINE void sort_block(std::uint32_t (&w)[Items], sort_exchange& exchange) {
    constexpr int of_warp = 32 * Items, all = block_sort_threads * Items;
    sort_warp(w);
    // Number k of this thread with that of another, whose number differs by the bits of `threads`.
    const auto compare = [&](unsigned threads, unsigned lower_bit, bool mirrored) VOXELPIPE_INLINE_LAMBDA {
        __syncthreads();
#pragma unroll
        for (int k = 0; k < Items; ++k) exchange.numbers[k * block_sort_threads + threadIdx.x] = w[k];
        __syncthreads();
        const bool lower = (threadIdx.x & lower_bit) == 0;
#pragma unroll
        for (int k = 0; k < Items; ++k) {
            const std::uint32_t other =
                exchange.numbers[(mirrored ? Items - 1 - k : k) * block_sort_threads + (threadIdx.x ^ threads)];
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

// A run of at most Items * block_sort_threads primitives.
template <int Items>
__device__ VOXELPIPE_INLINE void order_run(const std::uint32_t* from, std::uint32_t* to, std::uint32_t length,
                                           sort_exchange& exchange) {
    std::uint32_t w[Items];
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k) {
        const std::uint32_t i = threadIdx.x + block_sort_threads * k;
        w[k] = i < length ? from[i] : ~0u;
    }
    sort_block(w, exchange);
    __syncthreads(); // nobody reads what others wrote into the exchange
    const std::uint32_t first = warp_in_block() * 32 * Items;
    if (first < length) store_warp(w, exchange, to + first, length - first);
    __syncthreads();
}

// By a block each: voxels, and runs of one, which go back to where they were.
__device__ VOXELPIPE_INLINE void order_by_blocks(const order_buffers& b, std::uint32_t* primitives,
                                                 sort_exchange& exchange) {
    constexpr int most_items = most_of_block / block_sort_threads;
    using lists = order_lists;
    const std::uint32_t whole = b.lists.counts[lists::block_list], all = whole + b.lists.counts[lists::run_list];
    for (std::uint32_t r = blockIdx.x; r < all; r += gridDim.x) {
        const fragment_run run = r < whole ? b.lists.voxels[lists::block_list][r] : b.lists.runs[r - whole].run;
        const std::uint32_t* const from = b.from + run.begin;
        std::uint32_t* const to = (r < whole ? primitives : b.from) + run.begin;
        const auto length = static_cast<std::uint32_t>(run.length);
        if (length <= most_of_block / 2)
            order_run<most_items / 2>(from, to, length, exchange);
        else
            order_run<most_items>(from, to, length, exchange);
    }
}

template <class Buffers>
__global__ __launch_bounds__(block_sort_threads, 4) void order_long_kernel(const __grid_constant__ Buffers b) {
    __shared__ sort_exchange exchange;
    await_stream();
    std::uint32_t* const to = b.places().primitives;
    // Where there are few, each list has blocks of its own.
    order_by_warps<0>(b, to, exchange, gridDim.x / 3);
    order_by_warps<1>(b, to, exchange, gridDim.x / 3 * 2);
    static_assert(num_warp_sorts == 2);
    __syncthreads();
    order_by_blocks(b, to, exchange);
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
    launch_behind(windows, fill_device(tiles * threads_per_block, order_blocks), 32 * order_warps, stream, where, b,
                  state, limits);
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
