// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment sort: a stable radix sort of (voxel, value) pairs whose number only the device knows. One kernel counts the
// digits of all passes; then each pass reads and writes every pair once, and a tile learns from earlier tiles where its
// digits go (decoupled look-back: Merrill and Garland 2016, Adinets and Merrill 2022). The sort of
// scene/key_sort.cuh needs the number on the host, so it would sort the whole capacity, and it takes 9 bits a pass: the
// 30 bits of a voxel of 1024^3 are three passes of ten here and four there. Between passes a key is stored next to its
// value: a pass writes short runs, and 16 consecutive pairs occupy fewer cache sectors than 16 keys and 16 values
// apart.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

[[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t sort_tile(int items) {
    return static_cast<std::uint32_t>(tuning::sort_threads * items);
}
inline constexpr int max_digit_passes = 4;
inline constexpr std::uint64_t max_sorted = std::uint64_t{1} << 30; // pairs: two bits of a tile's words are flags

// True if up to `capacity` keys of this type are sorted by fragments/radix_sort.cuh; otherwise by scene/key_sort.cuh.
template <class Key>
[[nodiscard]] VOXELPIPE_HD constexpr bool are_sorted_here(std::uint64_t capacity) {
    return sizeof(Key) == sizeof(std::uint32_t) && capacity < max_sorted;
}

// How the bits of keys are divided into digits, lowest first: as few as possible, all of one size.
struct digit_plan {
    int passes, bits; // bits of a digit

    VOXELPIPE_HD constexpr explicit digit_plan(int key_bits)
        : passes(key_bits == 0 ? 1 : (key_bits + tuning::max_digit_bits - 1) / tuning::max_digit_bits),
          bits(key_bits == 0 ? 1 : (key_bits + passes - 1) / passes) {}
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t num_digits() const { return 1u << bits; }
};

// Pairs: keys and values apart or, if values is null, interleaved from keys[0] on, in the same memory.
struct pair_array {
    std::uint32_t *keys, *values;

    // Calls use(std::bool_constant<interleaved>). Tested once and not for each pair, so that loads are not delayed.
    template <class Use>
    __device__ VOXELPIPE_INLINE void with_layout(Use&& use) const {
        if (values == nullptr)
            use(std::true_type{});
        else
            use(std::false_type{});
    }
    template <bool Joined>
    [[nodiscard]] __device__ VOXELPIPE_INLINE uint2 load(std::uint32_t i) const {
        if constexpr (Joined)
            return reinterpret_cast<const uint2*>(keys)[i];
        else
            return {keys[i], values[i]};
    }
    template <bool Joined>
    __device__ VOXELPIPE_INLINE void store(std::uint32_t i, const uint2& pair) const {
        if constexpr (Joined) {
            reinterpret_cast<uint2*>(keys)[i] = pair;
        } else {
            keys[i] = pair.x;
            values[i] = pair.y;
        }
    }
};

// The two buffers between which a sort moves its pairs. Values begin where the padded keys end.
struct sort_pairs {
    std::uint32_t *keys[2]{}, *values[2]{};

    [[nodiscard]] static sort_pairs take(arena& memory, std::uint64_t capacity) {
        const std::uint64_t padded = padded_to_256_bytes(capacity);
        sort_pairs p;
        for (int i = 0; i < 2; ++i) {
            p.keys[i] = memory.take<std::uint32_t>(2 * padded);
            p.values[i] = p.keys[i] == nullptr ? nullptr : p.keys[i] + padded;
        }
        return p;
    }
    // Number of keys after which values begin at a multiple of 256 bytes too.
    [[nodiscard]] static constexpr std::uint64_t padded_to_256_bytes(std::uint64_t capacity) {
        return (capacity + 63) / 64 * 64;
    }
    [[nodiscard]] pair_array joined(int i) const { return {keys[i], nullptr}; }
    [[nodiscard]] pair_array apart(int i) const { return {keys[i], values[i]}; }
};

// Memory of a sort.
struct sort_memory {
    // Flags of a tile's word for a digit: it counts the pairs with the digit in the tile, or in all tiles up to it.
    static constexpr std::uint32_t own = 1u << 30, all = 2u << 30, value = own - 1;
    struct totals {
        std::uint32_t digits[max_digit_passes]
                            [1 << tuning::max_digit_bits]; // counts; then the offset of each digit's first pair
        std::uint32_t blocks_done;
        std::uint32_t num; // pairs
    };
    totals* all_tiles = nullptr;
    std::uint32_t* words[2]{}; // [tile][digit], used by alternate passes: each pass zeros those of the next
    digit_plan plan{1};
    int items = tuning::sort_items; // per thread

    // Pairs per thread for up to `capacity` pairs.
    [[nodiscard]] static int items_for(std::uint64_t capacity) {
        const std::uint64_t at_once = static_cast<std::uint64_t>(num_multiprocessors()) *
                                      static_cast<unsigned>(tuning::sort_blocks(tuning::few_sort_items));
        return capacity <= at_once * sort_tile(tuning::few_sort_items) ? tuning::few_sort_items : tuning::sort_items;
    }
    [[nodiscard]] static sort_memory take(arena& memory, std::uint64_t capacity, int key_bits, int items) {
        sort_memory m{};
        m.plan = digit_plan(key_bits);
        m.items = items;
        m.all_tiles = memory.take<totals>(1);
        for (auto& w : m.words) w = memory.take<std::uint32_t>(m.num_tiles(capacity) * m.plan.num_digits());
        return m;
    }
    [[nodiscard]] static sort_memory take(arena& memory, std::uint64_t capacity, int key_bits) {
        return take(memory, capacity, key_bits, items_for(capacity));
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_tiles(std::uint64_t num) const {
        return (num + sort_tile(items) - 1) / sort_tile(items);
    }
    // Zeros what must be zero before a sort of num pairs. All threads of a launch call it.
    __device__ void zero(std::uint64_t num, std::uint64_t thread, std::uint64_t threads) const {
        const std::uint64_t tiles = num_tiles(num);
        for (std::uint64_t i = thread; i < tiles * plan.num_digits(); i += threads) words[0][i] = 0;
        for (std::uint64_t i = thread; i < sizeof(totals) / sizeof(std::uint32_t); i += threads)
            reinterpret_cast<std::uint32_t*>(all_tiles)[i] = 0;
    }
};

// Number of pairs that a call sorts: 0 if it has failed.
struct sort_count {
    const pipeline_state* state;
    capacities limits;
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t get() const {
        return has_failed(*state, limits) ? 0 : state->list_fragments;
    }
};

// Sorts the pairs in keys[0] and values[0]: at most `capacity`, which is below max_sorted and for which both were
// taken. sort_memory::zero must have run. Returns the index of the sorted pairs: 0 or 1.
VOXELPIPE_DECLARES_KERNELS [[nodiscard]] int sort_fragments(const sort_pairs& pairs, const sort_count& count,
                                                            std::uint64_t capacity, const sort_memory& m,
                                                            cudaStream_t stream);

} // namespace voxelpipe::device
