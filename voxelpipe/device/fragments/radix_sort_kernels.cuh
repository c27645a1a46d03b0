// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of the fragment sort (fragments/radix_sort.cuh).

#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/fragments/radix_sort.cuh>

#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// One digit of a key.
struct digit_of {
    int shift;
    std::uint32_t mask;
    VOXELPIPE_HD constexpr digit_of(const digit_plan& plan, int pass)
        : shift(pass * plan.bits), mask(plan.num_digits() - 1) {}
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t operator()(std::uint32_t key) const {
        return key >> shift & mask;
    }
};

// Counts the digits of all passes, and computes the offset of each digit's first pair.
template <class Count>
__global__ __launch_bounds__(tuning::digit_count_threads) void count_digits_kernel(
    const std::uint32_t* keys, const __grid_constant__ Count count, const __grid_constant__ sort_memory m) {
    constexpr int at_once = 4; // loads in flight
    static_assert(tuning::digit_count_threads >= 1 << tuning::max_digit_bits);
    __shared__ std::uint32_t digits[max_digit_passes][1 << tuning::max_digit_bits];
    __shared__ block_scan<std::uint32_t, tuning::digit_count_threads> scan;
    __shared__ bool is_last;
    const std::uint32_t num_digits = m.plan.num_digits();
    for (int p = 0; p < m.plan.passes; ++p)
        if (threadIdx.x < num_digits) digits[p][threadIdx.x] = 0;
    await_stream();
    __syncthreads();
    const std::uint64_t n = count.get(), threads = std::uint64_t{gridDim.x} * tuning::digit_count_threads,
                        thread = std::uint64_t{blockIdx.x} * tuning::digit_count_threads + threadIdx.x;
    for (std::uint64_t i = thread; i < n / 4; i += threads * at_once) {
        uint4 fours[at_once];
#pragma unroll
        for (unsigned k = 0; k < at_once; ++k)
            if (i + k * threads < n / 4) fours[k] = reinterpret_cast<const uint4*>(keys)[i + k * threads];
#pragma unroll
        for (unsigned k = 0; k < at_once; ++k) {
            if (i + k * threads >= n / 4) break;
            for (int p = 0; p < m.plan.passes; ++p) {
                const digit_of digit(m.plan, p);
                atomicAdd(&digits[p][digit(fours[k].x)], 1u);
                atomicAdd(&digits[p][digit(fours[k].y)], 1u);
                atomicAdd(&digits[p][digit(fours[k].z)], 1u);
                atomicAdd(&digits[p][digit(fours[k].w)], 1u);
            }
        }
    }
    if (thread < n % 4)
        for (int p = 0; p < m.plan.passes; ++p) {
            const digit_of digit(m.plan, p);
            atomicAdd(&digits[p][digit(keys[n / 4 * 4 + thread])], 1u);
        }
    __syncthreads();
    for (int p = 0; p < m.plan.passes; ++p)
        if (threadIdx.x < num_digits && digits[p][threadIdx.x] != 0)
            atomicAdd(&m.all_tiles->digits[p][threadIdx.x], digits[p][threadIdx.x]);
    __threadfence();
    __syncthreads();
    if (threadIdx.x == 0) is_last = atomicAdd(&m.all_tiles->blocks_done, 1u) == gridDim.x - 1;
    __syncthreads();
    if (!is_last) return;
    __threadfence();
    if (threadIdx.x == 0) m.all_tiles->num = static_cast<std::uint32_t>(n);
    for (int p = 0; p < m.plan.passes; ++p) {
        std::uint32_t* const mine = &m.all_tiles->digits[p][threadIdx.x];
        const std::uint32_t sum = scan.sum_before(threadIdx.x < num_digits ? __ldcg(mine) : 0);
        if (threadIdx.x < num_digits) *mine = sum;
        __syncthreads(); // the scan's memory may be used again
    }
}

// Counts of a thread's digits, one or two neighbours, packed: 16 bits each for a warp, 32 bits each for a tile, whose
// flags are equal because they are stored at once.
template <int DigitsEach>
struct digit_group {
    static_assert(DigitsEach == 1 || DigitsEach == 2);
    using counts = std::conditional_t<DigitsEach == 1, std::uint16_t, std::uint32_t>;
    using word = std::conditional_t<DigitsEach == 1, std::uint32_t, unsigned long long>;

    [[nodiscard]] VOXELPIPE_HD static constexpr word each(std::uint32_t bits) {
        return static_cast<word>(DigitsEach == 1 ? bits : std::uint64_t{bits} << 32 | bits);
    }
    [[nodiscard]] VOXELPIPE_HD static constexpr word widen(counts c) {
        return static_cast<word>(
            DigitsEach == 1 ? c : static_cast<std::uint64_t>(c >> (DigitsEach - 1) * 16) << 32 | (c & 0xffffu));
    }
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint32_t get(word w, int k) { // of one digit
        return static_cast<std::uint32_t>(w >> 32 * k);
    }
};

// Shared memory of a block: first the number of each digit's pairs in its warps, then the pairs of its tile.
template <int DigitsEach, int Items>
union sort_tile_memory {
    std::uint16_t counts[tuning::sort_threads / 32][DigitsEach * tuning::sort_threads];
    uint2 pairs[sort_tile(Items)];
};

// Pass `pass` over the digits; each thread handles DigitsEach digits. A template, like all kernels in headers.
template <class Memory, int DigitsEach, int Items>
__global__ __launch_bounds__(tuning::sort_threads,
                             tuning::sort_blocks(Items)) void sort_pass_kernel(const __grid_constant__ pair_array from,
                                                                               const __grid_constant__ pair_array to,
                                                                               const __grid_constant__ Memory m,
                                                                               int pass) {
    using group = digit_group<DigitsEach>;
    using word = typename group::word;
    using counts = typename group::counts;
    using tile_memory = sort_tile_memory<DigitsEach, Items>;
    constexpr unsigned warps = tuning::sort_threads / 32;
    constexpr unsigned items = Items;
    constexpr std::uint32_t most = sort_tile(Items);
    static_assert(items % 2 == 0 && most < 1 << 16);
    extern __shared__ __align__(16) unsigned char dynamic_memory[];
    auto& shared = *reinterpret_cast<tile_memory*>(dynamic_memory);
    // By digit: the offset within the tile, later the difference from it to the global offset.
    __shared__ std::uint32_t offsets[DigitsEach * tuning::sort_threads];
    __shared__ block_scan<std::uint32_t, tuning::sort_threads> scan;
    const digit_of digit(m.plan, pass);
    const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32, num_digits = m.plan.num_digits();
    for (unsigned i = threadIdx.x; i < sizeof(shared.counts) / sizeof(std::uint32_t); i += tuning::sort_threads)
        reinterpret_cast<std::uint32_t*>(shared.counts)[i] = 0; // wider stores made the pass 7 % slower
    await_stream();
    __syncthreads();
    const std::uint32_t tile = blockIdx.x;
    const std::uint32_t n = m.all_tiles->num, begin = tile * most;
    if (begin >= n) return;
    const std::uint32_t length = n - begin < most ? n - begin : most;
    // A lane has every 32nd pair of its warp's. Elements beyond the last count as pairs with the last digit.
    const std::uint32_t first = warp * 32 * items + lane;
    std::uint32_t key[items], value[items], slot[items / 2]; // two offsets in each
    from.with_layout([&]<class Joined>(Joined) VOXELPIPE_INLINE_LAMBDA {
#pragma unroll
        for (std::uint32_t i = 0; i < items; ++i) {
            const bool is_one = first + 32 * i < length;
            const uint2 pair = is_one ? from.template load<Joined::value>(begin + first + 32 * i) : uint2{~0u, 0};
            key[i] = pair.x;
            value[i] = pair.y;
        }
    });
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) {
        const std::uint32_t d = digit(key[i]);
        std::uint16_t& of_digit = shared.counts[warp][d];
        const unsigned same = __match_any_sync(0xffffffffu, d);
        const auto before = static_cast<std::uint32_t>(__popc(same & ((1u << lane) - 1)));
        const std::uint32_t own = of_digit + before;
        __syncwarp();
        if (before == 0) of_digit = static_cast<std::uint16_t>(own + static_cast<std::uint32_t>(__popc(same)));
        __syncwarp();
        slot[i / 2] = i % 2 == 0 ? own : slot[i / 2] | own << 16;
    }
    // Makes the compiler recompute the counts' addresses below: held until then, they would not fit the registers.
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) asm volatile("" : "+r"(key[i]));
    __syncthreads();
    // For the thread's digits: prefix sums over the warps, and totals.
    const std::uint32_t first_digit = DigitsEach * threadIdx.x;
    const bool has_digits = first_digit < num_digits;
    const std::uint32_t apart = num_digits / DigitsEach;
    const std::uint64_t my_word = std::uint64_t{tile} * apart + threadIdx.x;
    word* const mine = reinterpret_cast<word*>(m.words[pass % 2]) + my_word;
    std::uint32_t total[DigitsEach], tile_offset[DigitsEach];
    counts sum{};
#pragma unroll(8)
    for (unsigned w = 0; w < warps; ++w) {
        counts& of_warp = *reinterpret_cast<counts*>(&shared.counts[w][first_digit]);
        const counts count = of_warp;
        of_warp = sum;
        sum = static_cast<counts>(sum + count); // each less than 2^16
    }
    const word own = group::widen(sum);
#pragma unroll
    for (int k = 0; k < DigitsEach; ++k) total[k] = group::get(own, k);
    if (has_digits) {
        store_relaxed(*mine, group::each(tile == 0 ? sort_memory::all : sort_memory::own) | own);
        if (pass + 1 < m.plan.passes) reinterpret_cast<word*>(m.words[1 - pass % 2])[my_word] = 0;
    }
    if constexpr (DigitsEach == 1) {
        tile_offset[0] = scan.sum_before(total[0]);
    } else {
        tile_offset[0] = scan.sum_before(total[0] + total[1]);
        tile_offset[1] = tile_offset[0] + total[0];
    }
#pragma unroll
    for (std::uint32_t k = 0; k < DigitsEach; ++k) offsets[first_digit + k] = tile_offset[k];
    __syncthreads();
#pragma unroll
    for (std::uint32_t i = 0; i < items; i += 2) {
        const std::uint32_t d = digit(key[i]), other = digit(key[i + 1]);
        slot[i / 2] += offsets[d] + shared.counts[warp][d] + ((offsets[other] + shared.counts[warp][other]) << 16);
    }
    __syncthreads(); // the counts have been read
#pragma unroll
    for (std::uint32_t i = 0; i < items; i += 2) {
        shared.pairs[slot[i / 2] & 0xffffu] = {key[i], value[i]};
        shared.pairs[slot[i / 2] >> 16] = {key[i + 1], value[i + 1]};
    }
    if (has_digits) {
        word before = 0;
        if (tile != 0) {
            before = lookback::before_alone(mine, tile, apart, group::each(sort_memory::all),
                                            group::each(sort_memory::value));
            store_relaxed(*mine, group::each(sort_memory::all) | (before + own));
        }
#pragma unroll
        for (int k = 0; k < DigitsEach; ++k)
            offsets[first_digit + k] =
                m.all_tiles->digits[pass][first_digit + k] + group::get(before, k) - tile_offset[k]; // modulo 2^32
    }
    __syncthreads();
    to.with_layout([&]<class Joined>(Joined) VOXELPIPE_INLINE_LAMBDA {
#pragma unroll
        for (std::uint32_t i = 0; i < items; ++i) {
            const std::uint32_t at = threadIdx.x + tuning::sort_threads * i;
            if (at >= length) break;
            const uint2 pair = shared.pairs[at];
            to.template store<Joined::value>(offsets[digit(pair.x)] + at, pair);
        }
    });
}

template <int DigitsEach, int Items>
void launch_sort_pass(const pair_array& from, const pair_array& to, unsigned tiles, const sort_memory& m, int pass,
                      stage where, cudaStream_t stream) {
    constexpr auto shared_bytes = sizeof(sort_tile_memory<DigitsEach, Items>);
    const auto kernel = sort_pass_kernel<sort_memory, DigitsEach, Items>;
    check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(shared_bytes)),
          where);
    launch_behind(kernel, tiles, tuning::sort_threads, shared_bytes, stream, where, from, to, m, pass);
}

VOXELPIPE_DEFINES_KERNELS [[nodiscard]] int sort_fragments(const sort_pairs& pairs, const sort_count& count,
                                                           std::uint64_t capacity, const sort_memory& m,
                                                           cudaStream_t stream) {
    constexpr stage where = stage::abuffer_emit;
    constexpr std::uint64_t pairs_of_block = 8 * tuning::digit_count_threads;
    const auto max_blocks = static_cast<std::uint64_t>(num_multiprocessors());
    launch_behind(count_digits_kernel<sort_count>,
                  static_cast<unsigned>(std::min(capacity / pairs_of_block + 1, max_blocks)),
                  tuning::digit_count_threads, stream, where, pairs.keys[0], count, m);
    const auto tiles = static_cast<unsigned>(m.num_tiles(capacity));
    const bool few = m.items == tuning::few_sort_items;
    for (int p = 0; p < m.plan.passes && tiles != 0; ++p) {
        const pair_array from = p == 0 ? pairs.apart(0) : pairs.joined(p % 2);
        const pair_array to = p + 1 == m.plan.passes ? pairs.apart(1 - p % 2) : pairs.joined(1 - p % 2);
        if (m.plan.bits == tuning::max_digit_bits)
            few ? launch_sort_pass<2, tuning::few_sort_items>(from, to, tiles, m, p, where, stream)
                : launch_sort_pass<2, tuning::sort_items>(from, to, tiles, m, p, where, stream);
        else
            few ? launch_sort_pass<1, tuning::few_sort_items>(from, to, tiles, m, p, where, stream)
                : launch_sort_pass<1, tuning::sort_items>(from, to, tiles, m, p, where, stream);
    }
    return tiles == 0 ? 0 : m.plan.passes % 2;
}

} // namespace voxelpipe::device
