// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of scene/key_sort.cuh: CUB's sort, and one of our own for keys of 32 bits of which at most
// max_narrow_bits are in use.

#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <cub/device/device_radix_sort.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr std::uint32_t key_sort_tile = tuning::key_sort_threads * tuning::key_sort_items,
                               max_key_digits = 1u << tuning::max_key_digit_bits;
inline constexpr int max_key_passes = 2, max_narrow_bits = max_key_passes * tuning::max_key_digit_bits;
static_assert(max_key_digits <= tuning::key_sort_threads, "a thread has one digit at most");

// Memory of a sort of num pairs. The first array, and the words of the first pass, are zero before.
struct key_sort_memory {
    struct totals {
        unsigned long long digits[max_key_passes][max_key_digits]; // counts; then the offset of each digit's first pair
        unsigned long long blocks_done;
    };
    std::uint64_t num = 0;    // pairs
    std::uint32_t used = 0;   // the key bits that count
    int passes = 1, bits = 1; // bits of a digit: passes are as few as possible, their digits of one size
    totals* all_tiles = nullptr;
    unsigned long long* words[2]{}; // [tile][digit], used by alternate passes: each pass zeros those of the next

    [[nodiscard]] static key_sort_memory take(arena& memory, std::uint64_t num, int key_bits) {
        key_sort_memory m;
        m.num = num;
        m.used = (1u << key_bits) - 1;
        m.passes = std::max((key_bits + tuning::max_key_digit_bits - 1) / tuning::max_key_digit_bits, 1);
        m.bits = std::max((key_bits + m.passes - 1) / m.passes, 1);
        m.all_tiles = memory.take<totals>(1);
        for (auto& w : m.words) w = memory.take<unsigned long long>(m.num_words());
        return m;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_tiles() const { return (num + key_sort_tile - 1) / key_sort_tile; }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t num_digits() const { return 1u << bits; }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_words() const { return num_tiles() * num_digits(); }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t digit(std::uint32_t key, int pass) const {
        return (key & used) >> pass * bits & (num_digits() - 1);
    }
};

// Counts the digits of all passes, and computes the offset of each digit's first pair.
template <int = 0>
__global__
__launch_bounds__(tuning::key_sort_threads) void count_key_digits_kernel(const std::uint32_t* keys,
                                                                         const __grid_constant__ key_sort_memory m) {
    constexpr unsigned threads = tuning::key_sort_threads;
    constexpr int at_once = 4; // loads in flight
    __shared__ std::uint32_t digits[max_key_passes][max_key_digits];
    __shared__ block_scan<unsigned long long, threads> scan;
    __shared__ bool is_last;
    const bool has_digit = threadIdx.x < m.num_digits();
    for (int p = 0; p < m.passes; ++p)
        if (has_digit) digits[p][threadIdx.x] = 0;
    await_stream();
    __syncthreads();
    const std::uint64_t stride = std::uint64_t{gridDim.x} * threads;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * threads + threadIdx.x; i < m.num; i += stride * at_once) {
        std::uint32_t key[at_once];
#pragma unroll
        for (unsigned k = 0; k < at_once; ++k)
            if (i + k * stride < m.num) key[k] = keys[i + k * stride];
#pragma unroll
        for (unsigned k = 0; k < at_once; ++k) {
            if (i + k * stride >= m.num) break;
            for (int p = 0; p < m.passes; ++p) atomicAdd(&digits[p][m.digit(key[k], p)], 1u);
        }
    }
    __syncthreads();
    for (int p = 0; p < m.passes; ++p)
        if (has_digit && digits[p][threadIdx.x] != 0)
            atomicAdd(&m.all_tiles->digits[p][threadIdx.x], static_cast<unsigned long long>(digits[p][threadIdx.x]));
    __threadfence();
    __syncthreads();
    if (threadIdx.x == 0) is_last = atomicAdd(&m.all_tiles->blocks_done, 1ull) == gridDim.x - 1;
    __syncthreads();
    if (!is_last) return;
    __threadfence();
    for (int p = 0; p < m.passes; ++p) {
        unsigned long long* const mine = &m.all_tiles->digits[p][has_digit ? threadIdx.x : 0];
        const unsigned long long offset = scan.sum_before(has_digit ? __ldcg(mine) : 0);
        if (has_digit) *mine = offset;
        __syncthreads(); // the scan's memory may be used again
    }
}

// Pass `pass` over the digits. Keys and values go through shared memory one after the other, so that neighbouring
// threads write neighbouring elements.
template <int = 0>
__global__ __launch_bounds__(tuning::key_sort_threads, tuning::key_sort_blocks) void sort_keys_kernel(
    const std::uint32_t* keys, std::uint32_t* to_keys, const std::uint32_t* values, std::uint32_t* to_values,
    const __grid_constant__ key_sort_memory m, int pass) {
    constexpr unsigned threads = tuning::key_sort_threads, items = tuning::key_sort_items, warps = threads / 32;
    constexpr unsigned digits_of_word = sizeof(std::uint32_t) / sizeof(std::uint16_t);
    static_assert(key_sort_tile < 1 << 16 && items % digits_of_word == 0);
    union tile_memory {
        std::uint16_t counts[warps][max_key_digits]; // each digit's pairs in a warp, then in the warps before it
        std::uint32_t pairs[key_sort_tile];          // keys, then values
    };
    __shared__ tile_memory shared;
    __shared__ std::uint32_t starts[max_key_digits];       // by digit: the offset within the tile
    __shared__ unsigned long long offsets[max_key_digits]; // the difference from it to the global offset
    __shared__ block_scan<std::uint32_t, threads> scan;
    const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32, num_digits = m.num_digits();
    for (unsigned i = threadIdx.x; i < sizeof(shared.counts) / sizeof(std::uint32_t); i += threads)
        reinterpret_cast<std::uint32_t*>(shared.counts)[i] = 0;
    await_stream();
    __syncthreads();
    const std::uint64_t begin = std::uint64_t{blockIdx.x} * key_sort_tile;
    const auto length = static_cast<std::uint32_t>(m.num - begin < key_sort_tile ? m.num - begin : key_sort_tile);
    // A lane has every 32nd pair of its warp's. Elements beyond the last count as pairs with the largest key.
    const std::uint32_t first = warp * 32 * items + lane;
    std::uint32_t key[items];
    std::uint32_t slot[items];
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i)
        key[i] = first + 32 * i < length ? keys[begin + first + 32 * i] : ~std::uint32_t{0};
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) {
        const std::uint32_t d = m.digit(key[i], pass);
        std::uint16_t& of_digit = shared.counts[warp][d];
        const unsigned same = __match_any_sync(0xffffffffu, d);
        const auto before = static_cast<std::uint32_t>(__popc(same & ((1u << lane) - 1)));
        slot[i] = of_digit + before;
        __syncwarp();
        if (before == 0) of_digit = static_cast<std::uint16_t>(slot[i] + static_cast<std::uint32_t>(__popc(same)));
        __syncwarp();
    }
    __syncthreads();
    // For the thread's digit: prefix sums over the warps, and the total.
    const bool has_digit = threadIdx.x < num_digits;
    std::uint32_t total = 0;
    if (has_digit)
#pragma unroll(4)
        for (unsigned w = 0; w < warps; ++w) {
            const std::uint32_t count = shared.counts[w][threadIdx.x];
            shared.counts[w][threadIdx.x] = static_cast<std::uint16_t>(total);
            total += count;
        }
    const std::uint64_t my_word = std::uint64_t{blockIdx.x} * num_digits + threadIdx.x;
    unsigned long long* const mine = m.words[pass % 2] + my_word;
    if (has_digit) {
        store_relaxed(*mine, (blockIdx.x == 0 ? lookback::all : lookback::own) | total);
        if (pass + 1 < m.passes) m.words[1 - pass % 2][my_word] = 0;
    }
    const std::uint32_t start = scan.sum_before(total);
    if (has_digit) starts[threadIdx.x] = start;
    __syncthreads();
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) {
        const std::uint32_t d = m.digit(key[i], pass);
        slot[i] += starts[d] + shared.counts[warp][d];
    }
    __syncthreads(); // the counts have been read
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) shared.pairs[slot[i]] = key[i];
    if (has_digit) {
        unsigned long long before = 0;
        if (blockIdx.x != 0) {
            before = lookback::before_alone(mine, blockIdx.x, num_digits, lookback::all, lookback::value);
            store_relaxed(*mine, lookback::all | (before + total));
        }
        offsets[threadIdx.x] = m.all_tiles->digits[pass][threadIdx.x] + before - start; // modulo 2^64
    }
    __syncthreads();
    std::uint32_t digits[items / digits_of_word]; // of the pairs that the thread writes, packed
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) {
        const std::uint32_t at = threadIdx.x + threads * i, d = m.digit(shared.pairs[at], pass);
        if (at < length) to_keys[offsets[d] + at] = shared.pairs[at];
        digits[i / digits_of_word] = i % digits_of_word == 0 ? d : digits[i / digits_of_word] | d << 16;
    }
    __syncthreads(); // the keys have been read
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i)
        if (first + 32 * i < length) shared.pairs[slot[i]] = values[begin + first + 32 * i];
    __syncthreads();
#pragma unroll
    for (std::uint32_t i = 0; i < items; ++i) {
        const std::uint32_t at = threadIdx.x + threads * i;
        if (at < length)
            to_values[offsets[digits[i / digits_of_word] >> i % digits_of_word * 16 & 0xffffu] + at] = shared.pairs[at];
    }
}

[[nodiscard]] inline std::size_t narrow_sort_bytes(std::uint64_t capacity, int bits) {
    arena memory;
    (void)key_sort_memory::take(memory, capacity, bits);
    return memory.used();
}

template <int = 0>
int sort_narrow_keys(std::uint32_t* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity,
                     int bits, void* storage, stage where, cudaStream_t stream) {
    arena memory(storage);
    const auto m = key_sort_memory::take(memory, capacity, bits);
    const auto* const end = reinterpret_cast<std::byte*>(m.words[0] + m.num_words());
    check(cudaMemsetAsync(storage, 0, static_cast<std::size_t>(end - static_cast<std::byte*>(storage)), stream), where);
    const std::uint64_t blocks = std::min(m.num_tiles(), static_cast<std::uint64_t>(num_multiprocessors()) * 2);
    count_key_digits_kernel<<<static_cast<unsigned>(blocks), tuning::key_sort_threads, 0, stream>>>(keys[0], m);
    check(cudaGetLastError(), where);
    for (int p = 0; p < m.passes; ++p)
        launch_behind(sort_keys_kernel<>, static_cast<unsigned>(m.num_tiles()), tuning::key_sort_threads, stream, where,
                      static_cast<const std::uint32_t*>(keys[p % 2]), keys[1 - p % 2],
                      static_cast<const std::uint32_t*>(values[p % 2]), values[1 - p % 2], m, p);
    return m.passes % 2;
}

template <class Key>
cudaError_t sort_by_cub(void* storage, std::size_t& bytes, cub::DoubleBuffer<Key>& keys,
                        cub::DoubleBuffer<std::uint32_t>& values, std::uint64_t num, int bits, cudaStream_t stream) {
    return cub::DeviceRadixSort::SortPairs(storage, bytes, keys, values, num, 0, bits, stream);
}

template <class Key>
std::size_t sort_bytes(std::uint64_t capacity, int bits) {
    if (sizeof(Key) == sizeof(std::uint32_t) && bits <= max_narrow_bits) return narrow_sort_bytes(capacity, bits);
    cub::DoubleBuffer<Key> keys;
    cub::DoubleBuffer<std::uint32_t> values;
    std::size_t bytes = 0;
    check(sort_by_cub(nullptr, bytes, keys, values, capacity, bits, nullptr));
    return bytes;
}

template <class Key>
int sort_by_cell(Key* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity, int bits,
                 void* storage, std::size_t bytes, stage where, cudaStream_t stream) {
    if (capacity == 0) return 0;
    VOXELPIPE_ASSERT(bytes >= sort_bytes<Key>(capacity, bits));
    if constexpr (sizeof(Key) == sizeof(std::uint32_t))
        if (bits <= max_narrow_bits) return sort_narrow_keys(keys, values, capacity, bits, storage, where, stream);
    cub::DoubleBuffer<Key> of_keys(keys[0], keys[1]);
    cub::DoubleBuffer<std::uint32_t> of_values(values[0], values[1]);
    check(sort_by_cub(storage, bytes, of_keys, of_values, capacity, bits, stream), where);
    return of_keys.selector;
}

template <class Key>
__global__ void fill_end_kernel(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs,
                                std::uint64_t capacity, const pipeline_state* state, capacities limits) {
    await_stream();
    const std::uint64_t first = has_failed(*state, limits) ? 0 : *num_pairs;
    for (std::uint64_t i = first + std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < capacity;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        keys[i] = static_cast<Key>(~Key{0});
        values[i] = 0;
    }
}

template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(fill_end_kernel<Key>, fill_device(capacity), threads_per_block, stream, stage::tile_sort, keys,
                  values, num_pairs, capacity, state, limits);
}

} // namespace voxelpipe::device
