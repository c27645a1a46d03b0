// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment sort: a stable radix sort of (voxel, value) pairs whose number is known on the device alone. One kernel
// counts the digits of all passes, then each pass reads and writes every pair once: a tile learns where its digits go
// from the tiles before it (decoupled look-back: Merrill and Garland 2016, Adinets and Merrill 2022). cub's sort has to
// be told the number, so that the whole capacity would be sorted, fillers included, and takes 8 bits a pass: the 30
// bits of a voxel of 1024^3 are three passes of ten here and four there. Between passes a key lies next to its value: a
// pass writes short runs, and 16 pairs in a row lie in fewer sectors of the cache than 16 keys and 16 values elsewhere.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

inline constexpr int sort_threads = 512; // of a block, which takes a tile
inline constexpr int sort_items = 16;    // pairs of a thread
inline constexpr int few_sort_items = 8; // where the device takes all tiles at once: shorter ones are done sooner
[[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t sort_tile(int items) {
    return static_cast<std::uint32_t>(sort_threads * items);
}
[[nodiscard]] VOXELPIPE_HD constexpr int sort_blocks(int items) { // of a multiprocessor, at once
    return items == few_sort_items ? 3 : 2;
}
inline constexpr int digit_count_threads = 1024;
inline constexpr int most_digit_bits = 10;
inline constexpr int max_digit_passes = 4;
inline constexpr std::uint64_t max_sorted = std::uint64_t{1} << 30; // pairs: two bits of a tile's words are flags

// How keys of so many bits are cut into digits, lowest first: as few as can be, all of one size.
struct digit_plan {
    int passes, bits; // of a digit

    VOXELPIPE_HD constexpr explicit digit_plan(int key_bits)
        : passes(key_bits == 0 ? 1 : (key_bits + most_digit_bits - 1) / most_digit_bits),
          bits(key_bits == 0 ? 1 : (key_bits + passes - 1) / passes) {}
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t num_digits() const { return 1u << bits; }
};

// Pairs: keys and values apart or, where there are no values, joined from keys[0] on, in the same memory.
struct pair_array {
    std::uint32_t *keys, *values;

    // Calls use(std::bool_constant<are they joined>): asked once, not for each pair, so that loads are not held up.
    template <class Use>
    __device__ VOXELPIPE_INLINE void ask_once(Use&& use) const {
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

// The two places between which a sort moves its pairs, apart: values begin where the room for keys ends.
struct sort_pairs {
    std::uint32_t *keys[2]{}, *values[2]{};

    [[nodiscard]] static sort_pairs take(arena& memory, std::uint64_t capacity) {
        const std::uint64_t room = room_for(capacity);
        sort_pairs p;
        for (int i = 0; i < 2; ++i) {
            p.keys[i] = memory.take<std::uint32_t>(2 * room);
            p.values[i] = p.keys[i] == nullptr ? nullptr : p.keys[i] + room;
        }
        return p;
    }
    // For keys: values begin at a whole 256 bytes too.
    [[nodiscard]] static constexpr std::uint64_t room_for(std::uint64_t capacity) { return (capacity + 63) / 64 * 64; }
    [[nodiscard]] pair_array joined(int i) const { return {keys[i], nullptr}; }
    [[nodiscard]] pair_array apart(int i) const { return {keys[i], values[i]}; }
};

// Memory of a sort.
struct sort_memory {
    // A tile's word for a digit: how many pairs have it, in the tile, or in all up to it.
    static constexpr std::uint32_t own = 1u << 30, all = 2u << 30, value = own - 1;
    struct totals {
        std::uint32_t digits[max_digit_passes][1 << most_digit_bits]; // how many; then where the first one goes
        std::uint32_t blocks_done;
        std::uint32_t num; // pairs
    };
    totals* all_tiles = nullptr;
    std::uint32_t* words[2]{}; // [tile][digit], of passes in turn: each zeroes those of the next
    digit_plan plan{1};
    int items = sort_items; // of a thread

    // Pairs of a thread where there are so many in all, at most.
    [[nodiscard]] static int items_for(std::uint64_t capacity) {
        const std::uint64_t at_once =
            static_cast<std::uint64_t>(num_multiprocessors()) * static_cast<unsigned>(sort_blocks(few_sort_items));
        return capacity <= at_once * sort_tile(few_sort_items) ? few_sort_items : sort_items;
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
    // What has to be zero when a sort of num pairs starts. By all threads of a grid.
    __device__ void zero(std::uint64_t num, std::uint64_t thread, std::uint64_t threads) const {
        const std::uint64_t tiles = num_tiles(num);
        for (std::uint64_t i = thread; i < tiles * plan.num_digits(); i += threads) words[0][i] = 0;
        for (std::uint64_t i = thread; i < sizeof(totals) / sizeof(std::uint32_t); i += threads)
            reinterpret_cast<std::uint32_t*>(all_tiles)[i] = 0;
    }
};

// How many pairs a call sorts: none where it has failed.
struct sort_count {
    const pipeline_state* state;
    capacities limits;
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t get() const {
        return has_failed(*state, limits) ? 0 : state->list_fragments;
    }
};

// Sorts the pairs in keys[0] and values[0]; at most `capacity`, which is below max_sorted and for which both were
// taken. The memory's zeros are there (sort_memory::zero). Returns where the sorted pairs are: 0 or 1.
VOXELPIPE_DECLARES_KERNELS [[nodiscard]] int sort_fragments(const sort_pairs& pairs, const sort_count& count,
                                                            std::uint64_t capacity, const sort_memory& m,
                                                            cudaStream_t stream);

} // namespace voxelpipe::device
