// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of the fragment order (fragments/order_voxels.cuh).

#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/fragments/order_long_voxels.cuh>
#include <voxelpipe/device/fragments/order_voxels.cuh>
#include <voxelpipe/device/fragments/warp_sort.cuh>

#include <algorithm>
#include <bit>
#include <cstdint>

namespace voxelpipe::device {

// Number of voxels that begin in earlier tiles; `count` begin in this one, as published. All lanes of one warp call it.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long count_before(const tile_counts& tiles, std::uint32_t tile,
                                                                          unsigned long long count) {
    return lookback::before(tiles.words, tile, count, [](unsigned long long part) { // fewer than 2^32 fragments
        return __reduce_add_sync(0xffffffffu, static_cast<unsigned>(part));
    });
}

// ---- windows --------------------------------------------------------------------------------------------------------

// A warp's window: the voxels that begin in it, and their offsets.
struct order_window {
    std::uint32_t voxels[tuning::window_length], first[tuning::window_length];
};

// Bit k of the result: element k of the lane's Items neighbours begins another voxel than the element before, or lies
// beyond the n fragments. voxels: the keys from the window's first fragment on; `voxel` receives the lane's. before:
// the key before the window, or ~0.
template <int Items>
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned find_starts(const std::uint32_t* voxels, std::uint32_t n,
                                                               std::uint32_t before, std::uint32_t (&voxel)[Items]) {
    const std::uint32_t lane = threadIdx.x % 32;
    load_neighbours(voxels, lane * Items, n, voxel);
    std::uint32_t previous = __shfl_up_sync(0xffffffffu, voxel[Items - 1], 1);
    if (lane == 0) previous = before;
    unsigned starts = 0;
#pragma unroll
    for (int k = 0; k < Items; ++k) {
        starts |= voxel[k] != previous ? 1u << k : 0;
        previous = voxel[k];
    }
    return starts;
}
// The same from one bit per element, for a window that begins at `begin`, a multiple of 32.
template <int Items>
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned load_starts(const std::uint32_t* starts, std::uint32_t begin) {
    using bits = std::conditional_t<Items == 8, std::uint8_t, std::uint16_t>;
    static_assert(Items == 8 || Items == 16);
    return reinterpret_cast<const bits*>(starts)[begin / Items + threadIdx.x % 32];
}

// The voxels of a window of 32 * Items elements, counted from its first; a lane has Items neighbours.
template <int Items>
struct window_voxels {
    static constexpr std::uint32_t num_elements = 32 * Items;
    unsigned starts;    // bit k: the lane's element k begins another voxel than the element before, or lies beyond the
                        // fragments
    unsigned begins;    // the same for voxels that begin within window_length and before n
    std::uint32_t rank; // voxels that begin in the window before this lane's elements

    __device__ VOXELPIPE_INLINE window_voxels(unsigned starts_, std::uint32_t n) : starts(starts_) {
        const std::uint32_t lane = threadIdx.x % 32, first = lane * Items;
        constexpr std::uint32_t length = tuning::window_length;
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

    // The first and the last element with a bit in any lane's `bits`; there must be one.
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
    // An upper bound of the fragments of any voxel between two starts.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t longest() const {
        constexpr unsigned within = Items - 1; // within one lane
        const unsigned next = __shfl_down_sync(0xffffffffu, starts, 1);
        const unsigned across = starts != 0 && next != 0 && threadIdx.x % 32 != 31
                                    ? static_cast<unsigned>(__ffs(static_cast<int>(next)) - 1 + Items - 31 +
                                                            __clz(static_cast<int>(starts)))
                                    : within;
        unsigned most = __reduce_max_sync(0xffffffffu, across);
        const unsigned lanes = __ballot_sync(0xffffffffu, starts != 0);
        unsigned empty = ~lanes & (0u - (lanes & (0u - lanes))) & ~0u >> __clz(static_cast<int>(lanes));
        if (empty != 0) { // lanes between others in which no voxel begins
            for (most = 2 * Items - 1; empty != 0; empty &= empty << 1) most += Items;
        }
        return most < within ? within : most;
    }
};

// Writes the window's primitives [begin, end), whole voxels, in order. A fragment is sorted by its voxel's rank within
// the window, then by its primitive, of primitive_bits bits.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void order_elements(const std::uint32_t (&primitive)[Items], std::uint32_t* to,
                                                const window_voxels<Items>& window, std::uint32_t begin,
                                                std::uint32_t end, int primitive_bits) {
    constexpr std::uint32_t few = Items <= 8 ? 6 * Items : 0; // for longer runs the general network is cheaper
    const std::uint32_t first = threadIdx.x % 32 * Items;
    Word w[Items], rank = static_cast<Word>(window.rank) - 1;
#pragma unroll
    for (std::uint32_t k = 0; k < Items; ++k) {
        rank += window.begins >> k & 1u;
        const Word own = rank << primitive_bits | primitive[k], but_before = first + k < begin ? Word{0} : own;
        w[k] = first + k < end ? but_before : ~Word{0};
    }
    // A voxel that ends with the window has no start behind it.
    const std::uint32_t longest = few != 0 && end < window.num_elements ? window.longest() : few + 1;
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

// The first of n ascending voxels, from `at` on, that differs from `voxel`; all before it are equal. All lanes call it.
[[nodiscard]] __device__ inline std::uint32_t find_end(const std::uint32_t* voxels, std::uint32_t n,
                                                       std::uint32_t voxel, std::uint32_t at) {
    const std::uint64_t lane = threadIdx.x % 32;
    const auto same_strides = [&](std::uint64_t first,
                                  std::uint64_t stride) { // of 32 strides, how many lie within the voxel
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

// The window of n fragments from `begin` on, ordered by one warp. ByStarts: a counting sort has found where voxels
// begin.
template <bool ByStarts>
struct order_of_window {
    static constexpr int items = 8, wide_items = 16;
    using voxels_type = window_voxels<items>;
    using wide_type = window_voxels<wide_items>;
    static_assert(voxels_type::num_elements >= tuning::window_length &&
                  wide_type::num_elements >= tuning::window_length - 1 + tuning::max_of_window);

    const order_buffers& b;
    std::uint32_t begin, n, before; // n counts from the window's first, as all indices do; the voxel before it
    std::uint32_t primitive[items]{}, voxel[items]; // `voxel` is set by keys only
    voxels_type voxels;
    std::uint32_t count; // voxels that begin in the window

    __device__ VOXELPIPE_INLINE order_of_window(const order_buffers& buffers, std::uint32_t begin_, std::uint32_t n_)
        : b(buffers), begin(begin_), n(n_ - begin_), before(ByStarts || begin_ == 0 ? ~0u : b.keys[begin_ - 1]),
          voxels(get_starts(voxel), n) {
        load_neighbours(b.from + begin, threadIdx.x % 32 * items, n, primitive);
        count = __reduce_add_sync(0xffffffffu, static_cast<std::uint32_t>(__popc(voxels.begins)));
    }

    __device__ VOXELPIPE_INLINE void keep(order_window& kept) const {
        const std::uint32_t first = begin + threadIdx.x % 32 * items;
        std::uint32_t rank = voxels.rank;
#pragma unroll
        for (std::uint32_t k = 0; k < items; ++k)
            if ((voxels.begins >> k & 1u) != 0) {
                kept.voxels[rank] = voxel[k];
                kept.first[rank++] = first + k;
            }
    }

    // Orders the window's voxels. The last one, if it is too long, goes to its list.
    template <bool Narrow>
    __device__ VOXELPIPE_INLINE void order(std::uint32_t* to) const {
        if (count == 0) return;
        const std::uint32_t skipped = voxels_type::first_of(voxels.begins);
        const unsigned behind = voxels.starts & ~voxels.begins;
        std::uint32_t whole = count;
        std::uint32_t end = voxels_type::num_elements;
        if (__any_sync(0xffffffffu, behind != 0))
            end = voxels_type::first_of(behind);
        else
            whole -= find_last(end);
        to += begin;
        if (end - skipped <= whole) { // one fragment each, or nothing
            store_neighbours(to, threadIdx.x % 32 * items, skipped, end, primitive);
            return;
        }
        const auto order = [&]<class Word>(int primitive_bits) VOXELPIPE_INLINE_LAMBDA {
            if (end <= voxels_type::num_elements) {
                order_elements<Word>(primitive, to, voxels, skipped, end, primitive_bits);
            } else {
                std::uint32_t all[wide_items], voxels_of_all[wide_items];
                load_neighbours(b.from + begin, threadIdx.x % 32 * wide_items, n, all);
                order_elements<Word>(all, to, wide_type(get_starts(voxels_of_all), n), skipped, end, primitive_bits);
            }
        };
        if constexpr (Narrow)
            order.template operator()<std::uint32_t>(narrow_primitive_bits);
        else if (b.primitive_bits < 32 && count <= 1u << (32 - b.primitive_bits)) // few voxels, as with tiny triangles
            order.template operator()<std::uint32_t>(b.primitive_bits);
        else
            order.template operator()<std::uint64_t>(32);
    }

private:
    template <int Items>
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned get_starts(std::uint32_t (&voxel_of)[Items]) const {
        if constexpr (ByStarts)
            return load_starts<Items>(b.starts, begin);
        else
            return find_starts(b.keys + begin, n, before, voxel_of);
    }
    // Finds the end of the last voxel, which lies at `end` or beyond. Returns 1 if it is too long; then `end` is its
    // beginning.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t find_last(std::uint32_t& end) const {
        const std::uint32_t lane = threadIdx.x % 32, last = voxels_type::last_of(voxels.begins);
        if constexpr (ByStarts) { // the counting sort has put it into its list
            const unsigned word = b.starts[(begin + end) / 32 + lane];
            const unsigned lanes = __ballot_sync(0xffffffffu, word != 0);
            if (lanes != 0) {
                const int nearest = __ffs(static_cast<int>(lanes)) - 1;
                end += static_cast<std::uint32_t>(32 * nearest +
                                                  __ffs(static_cast<int>(__shfl_sync(0xffffffffu, word, nearest))) - 1);
                if (end - last <= tuning::max_of_window) return 0;
            }
            end = last;
            return 1;
        }
        const std::uint32_t* const keys = b.keys + begin;
        const std::uint32_t voxel = keys[last];
        do {
            const unsigned other = __ballot_sync(0xffffffffu, end + lane >= n || keys[end + lane] != voxel);
            if (other != 0) {
                end += static_cast<std::uint32_t>(__ffs(static_cast<int>(other))) - 1;
                break;
            }
            end += 32;
        } while (end - last <= tuning::max_of_window);
        if (end - last <= tuning::max_of_window) return 0;
        end = find_end(keys, n, voxel, end);
        if (lane == 0) b.lists.push(begin + last, end - last);
        end = last;
        return 1;
    }
};

// Narrow: primitives have at most narrow_primitive_bits bits.
template <bool Narrow>
__global__ __launch_bounds__(32 * tuning::order_warps,
                             tuning::order_blocks) void order_windows_kernel(const __grid_constant__ order_buffers b,
                                                                             pipeline_state* state, capacities limits) {
    __shared__ order_window windows[tuning::order_warps];
    __shared__ std::uint32_t counts[tuning::order_warps];
    __shared__ unsigned long long before;
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments); // see core::max_numbered
    const std::uint32_t warp = warp_in_block(), lane = threadIdx.x % 32;
    const csr_pointers to = b.pointers();
    const std::uint32_t tile = blockIdx.x; // see count_before
    const std::uint64_t first = std::uint64_t{tile} * tile_counts::length, begin = first + warp * tuning::window_length;
    if (first >= n) return;
    // A warp without a window takes one behind the last fragment, in which nothing begins.
    const order_of_window<false> window(b, static_cast<std::uint32_t>(begin < n ? begin : n), n);
    if (lane == 0) counts[warp] = window.count;
    __syncthreads();
    std::uint32_t earlier = 0, all = 0;
    for (std::uint32_t w = 0; w < tuning::order_warps; ++w) {
        earlier += w < warp ? counts[w] : 0;
        all += counts[w];
    }
    if (threadIdx.x == 0)
        lookback::publish(b.tiles.words, tile, all); // before the sort, so that later tiles need not wait
    window.keep(windows[warp]);
    window.template order<Narrow>(to.primitives);
    if (warp == 0) {
        const unsigned long long sum = count_before(b.tiles, tile, all);
        if (lane == 0) {
            before = sum;
            if (first + tile_counts::length >= n) { // the last tile
                state->list_voxels = sum + all;
                if (sum + all <= to.voxel_capacity) to.offsets[sum + all] = n;
            }
        }
    }
    __syncthreads();
    std::uint64_t at = before + earlier + lane;
    for (std::uint32_t r = lane; r < window.count && at < to.voxel_capacity; r += 32, at += 32) {
        if (to.voxels != nullptr)
            to.voxels[at] = windows[warp].voxels[r];
        else
            to.narrow_voxels[at] = windows[warp].voxels[r];
        to.offsets[at] = windows[warp].first[r];
    }
}

// The same if a counting sort has listed the voxels, long ones included.
template <bool Narrow>
__global__ __launch_bounds__(32 * tuning::order_warps,
                             tuning::order_blocks) void order_starts_kernel(const __grid_constant__ order_buffers b,
                                                                            const pipeline_state* state,
                                                                            capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments);
    const std::uint64_t begin =
        (std::uint64_t{blockIdx.x} * tuning::order_warps + warp_in_block()) * tuning::window_length;
    if (begin >= n) return;
    const order_of_window<true> window(b, static_cast<std::uint32_t>(begin), n);
    window.template order<Narrow>(b.pointers().primitives);
}

// ---- host -----------------------------------------------------------------------------------------------------------

VOXELPIPE_DEFINES_KERNELS void order_fragments(order_buffers b, std::uint64_t num_primitives, pipeline_state* state,
                                               capacities limits, cudaStream_t stream) {
    constexpr stage where = stage::abuffer_emit;
    const std::uint64_t capacity = limits.fragments, longest = limits.longest_ordered;
    limits.longest_ordered = ~0ull; // what the windows find out must not stop them
    const bool by_starts = b.starts != nullptr;
    for (const std::uint32_t* numbers : {b.keys, static_cast<const std::uint32_t*>(b.from)})
        VOXELPIPE_ASSERT(reinterpret_cast<std::uintptr_t>(numbers) % 16 == 0); // for load_neighbours
    if (num_primitives <= std::uint64_t{tuning::dense_part} * tuning::max_dense_parts)
        b.lists.num_primitives = static_cast<std::uint32_t>(num_primitives);
    b.primitive_bits = num_primitives < 2 ? 1 : static_cast<int>(std::bit_width(num_primitives - 1));
    const auto windows =
        b.primitive_bits <= narrow_primitive_bits ? order_windows_kernel<true> : order_windows_kernel<false>;
    const std::uint64_t tiles = tile_counts::num(capacity);
    const auto blocks = static_cast<unsigned>(std::max<std::uint64_t>(tiles, 1));
    if (by_starts)
        launch_behind(b.primitive_bits <= narrow_primitive_bits ? order_starts_kernel<true>
                                                                : order_starts_kernel<false>,
                      blocks, 32 * tuning::order_warps, stream, where, b, state, limits);
    else
        launch_behind(windows, blocks, 32 * tuning::order_warps, stream, where, b, state, limits);
    if (capacity > tuning::max_of_window && longest != 0)
        launch_behind(order_long_kernel<order_buffers>, fill_device(capacity / (tuning::max_of_window + 1) * 32, 4),
                      tuning::block_sort_threads, stream, where, b);
    if (capacity > tuning::max_of_block && longest > tuning::max_of_block && b.lists.num_primitives != 0)
        launch_behind(order_dense_kernel<order_buffers>, static_cast<unsigned>(num_multiprocessors()),
                      tuning::dense_threads, stream, where, b);
    // Runs of 2^12, 2^18 and 2^24 fragments; the last merge takes all that there are.
    std::uint64_t length = tuning::max_of_block;
    for (int level = 0; level < 3 && capacity > length && longest > std::max(length, only_dense);
         ++level, length *= tuning::merge_ways)
        launch_behind(merge_runs_kernel<order_buffers>, fill_device(capacity), threads_per_block, stream, where, b,
                      level % 2 == 0 ? b.from : b.spare, level % 2 == 0 ? b.spare : b.from, length, level == 2);
}

} // namespace voxelpipe::device
