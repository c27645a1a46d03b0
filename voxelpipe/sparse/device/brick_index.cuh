// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The bricks that a call may touch, as bits in Morton order, and the numbers that follow from the bits before each: a
// brick's number among them, which is its place in the arrays of the result, without a sort. Large grids have two
// levels: nodes of 16^3 bricks, and words for those nodes alone that something lies in. Grids of more than 65,536
// voxels a side have three: groups of 16^3 nodes, and words of nodes for those alone.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/device/base/device_buffer.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// Bits of 4^3 neighbours, and the number of bits in all words before.
struct alignas(16) index_word {
    unsigned long long bits;
    std::uint32_t before;
    std::uint32_t unused;
};

// Reads and sets the bits of one level, bricks or nodes. Names memory of a brick_index.
struct index_level {
    static constexpr int log2_node = 4, log2_node_words = 6; // bricks along a side; words of a node
    static constexpr int log2_brick = 3, log2_node_voxels = 7, log2_group_voxels = 11; // of 2^n voxels a side
    index_word* nodes; // null if `words` has all there are
    index_word* words;
    index_word* groups = nullptr; // null if `nodes`, or `words` where that is null, has all there are

    // The word of a key, whose node has been marked.
    [[nodiscard]] __device__ VOXELPIPE_INLINE index_word* word_of(std::uint64_t key) const {
        const std::uint64_t number = key >> 6;
        if (nodes == nullptr) return word_in(groups, words, number);
        return word_below(*word_in(groups, nodes, number >> 12), words, number);
    }
    // Sets bits of the word of a key.
    __device__ VOXELPIPE_INLINE void set(std::uint64_t key, unsigned long long bits) const {
        index_word* const w = word_of(key);
        // The word may be stale: bits are never cleared, so that is safe.
        if ((bits & ~__ldca(&w->bits)) != 0) atomicOr(&w->bits, bits);
    }
    // The number of a key whose bit is set.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t number_of(std::uint64_t key) const {
        const index_word& w = *word_of(key);
        return w.before + static_cast<unsigned>(__popcll(w.bits & ((1ull << (key & 63u)) - 1)));
    }

private:
    // Word `number` of all, where words lie behind each other for the cells that are marked in `above`.
    [[nodiscard]] __device__ VOXELPIPE_INLINE static index_word* word_below(const index_word& above, index_word* words,
                                                                            std::uint64_t number) {
        const auto bit = static_cast<unsigned>(number >> log2_node_words & 63u);
        const std::uint32_t cell = above.before + static_cast<unsigned>(__popcll(above.bits & ((1ull << bit) - 1)));
        return words + (std::uint64_t{cell} << log2_node_words | (number & 63u));
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static index_word* word_in(const index_word* groups, index_word* words,
                                                                         std::uint64_t number) {
        return groups == nullptr ? words + number : word_below(groups[number >> 12], words, number);
    }
};

// core::morton_key of a brick or node, mostly in 32 bits.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t short_morton_key(int x, int y, int z) {
    const auto of_ten_bits = [](unsigned a, unsigned b, unsigned c) VOXELPIPE_INLINE_LAMBDA {
        const auto spread = [](unsigned n) VOXELPIPE_INLINE_LAMBDA {
            n &= 1023u;
            n = (n | n << 16) & 0x030000ffu;
            n = (n | n << 8) & 0x0300f00fu;
            n = (n | n << 4) & 0x030c30c3u;
            return (n | n << 2) & 0x09249249u;
        };
        return spread(a) | spread(b) << 1 | spread(c) << 2;
    };
    const auto a = static_cast<unsigned>(x), b = static_cast<unsigned>(y), c = static_cast<unsigned>(z);
    std::uint64_t key = of_ten_bits(a, b, c);
    if ((a | b | c) >> 10 != 0) key |= std::uint64_t{of_ten_bits(a >> 10, b >> 10, c >> 10)} << 30;
    return key;
}

// ---- numbers --------------------------------------------------------------------------------------------------------

template <int = 0> // compiled where it is called
__global__ void count_word_bits(const index_word* words, std::uint32_t count, std::uint32_t* counts) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < count) counts[i] = static_cast<unsigned>(__popcll(words[i].bits));
}
// Bits beyond `capacity`, which is the room in the caller's memory, get numbers from capacity to capacity + 63.
template <int = 0> // compiled where it is called
__global__ void number_words(index_word* words, std::uint32_t count, const unsigned long long* before,
                             std::uint32_t capacity, unsigned long long* total) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    words[i].before = before[i] < capacity ? static_cast<std::uint32_t>(before[i]) : capacity;
    if (i + 1 == count) *total = before[i] + static_cast<unsigned>(__popcll(words[i].bits));
}
// The keys of the first `capacity` bits, in order. node_keys: of the cells above that the words belong to; null if
// there are none.
template <int = 0> // compiled where it is called
__global__ void list_keys(const index_word* words, std::uint32_t count, const std::uint64_t* node_keys,
                          std::uint64_t capacity, std::uint64_t* keys) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const index_word w = words[i];
    if (w.bits == 0) return;
    const std::uint64_t number =
        node_keys == nullptr ? i
                             : node_keys[i >> index_level::log2_node_words] << index_level::log2_node_words | (i & 63u);
    std::uint64_t at = w.before;
    for (unsigned long long bits = w.bits; bits != 0 && at < capacity; bits &= bits - 1)
        keys[at++] = number << 6 | static_cast<unsigned>(__ffsll(static_cast<long long>(bits)) - 1);
}

// How many levels a grid's index has, and the words of the highest, which has a bit for every cell of the grid.
struct index_size {
    int levels = 1; // 1: bricks; 2: nodes; 3: groups
    std::uint64_t top_words = 1;
};
[[nodiscard]] constexpr index_size index_size_of(const glm::ivec3& whole) {
    constexpr unsigned max_side = 256, max_nodes = 512; // of bricks without nodes, of nodes without groups
    const auto largest = static_cast<unsigned>(std::max({whole.x, whole.y, whole.z}));
    index_size s;
    std::uint64_t side = std::bit_ceil((largest + 7) / 8);
    if (side > max_side) {
        side >>= index_level::log2_node;
        s.levels = 2;
    }
    if (s.levels == 2 && side > max_nodes) {
        side >>= index_level::log2_node;
        s.levels = 3;
    }
    s.top_words = std::max<std::uint64_t>(1, side * side * side / 64);
    return s;
}

// Memory and numbers of an index for bricks of a grid. Marking comes in between: for each level above the bricks, from
// the highest on, level() is marked, then make_words(); then bricks() and make_numbers().
template <int = 0> // so that programs that do not call it compile no kernels
class brick_index {
public:
    // Throws as device_buffer does.
    brick_index(const stream_memory& memory, const glm::ivec3& whole)
        : memory_(memory), size_(index_size_of(whole)), words_{{memory, std::size_t{0}},
                                                               {memory, std::size_t{0}},
                                                               {memory, std::size_t{0}}},
          keys_{{memory, std::size_t{0}}, {memory, std::size_t{0}}}, total_(memory, std::size_t{1}) {
        words_[size_.levels - 1] = index_word_buffer(memory, size_.top_words);
        clear(words_[size_.levels - 1]);
    }
    // Calls mark(index_level, log2 of its cells' voxels) for the levels above the bricks. Waits once a level.
    template <class Mark>
    void mark_above(const Mark& mark) {
        for (int l = size_.levels - 1; l > 0; --l) {
            mark(level(l), log2_cell_of(l));
            make_words(l);
        }
    }
    [[nodiscard]] index_level bricks() { return level(0); }
    // After the bricks have been marked: their number. Waits.
    [[nodiscard]] std::uint64_t make_numbers() { return number(words_[0]); }
    // Writes the keys of all bricks, in order.
    void write_keys(std::uint64_t* keys) { write_keys(0, ~std::uint64_t{0}, keys); }

    [[nodiscard]] static constexpr int log2_cell_of(int level) {
        return level == 2   ? index_level::log2_group_voxels
               : level == 1 ? index_level::log2_node_voxels
                            : index_level::log2_brick;
    }

private:
    using index_word_buffer = device_buffer<index_word>;
    [[nodiscard]] index_level level(int l) {
        const auto words = [this](int n) { return n < size_.levels ? words_[n].data() : nullptr; };
        if (l == 0) return {words(1), words(0), words(2)};
        return {nullptr, words(l), l == 1 ? words(2) : nullptr};
    }
    // After the cells of a level have been marked: words for those.
    void make_words(int l) {
        const std::uint64_t num = number(words_[l]);
        keys_[l - 1] = device_buffer<std::uint64_t>(memory_, num);
        if (num != 0) write_keys(l, num, keys_[l - 1].data());
        words_[l - 1] = index_word_buffer(memory_, std::max<std::uint64_t>(1, num << index_level::log2_node_words));
        clear(words_[l - 1]);
    }
    void write_keys(int l, std::uint64_t capacity, std::uint64_t* keys) {
        launch_kernel(
            false, list_keys<0>, num_blocks(words_[l].size()), threads_per_block, 0, memory_.stream, stage::tile_sort,
            static_cast<const index_word*>(words_[l].data()), static_cast<std::uint32_t>(words_[l].size()),
            static_cast<const std::uint64_t*>(l + 1 < size_.levels ? keys_[l].data() : nullptr), capacity, keys);
    }
    void clear(index_word_buffer& words) {
        check(cudaMemsetAsync(words.data(), 0, words.size() * sizeof(index_word), memory_.stream), stage::tile_sort);
    }
    // Numbers the bits; how many there are. Waits.
    [[nodiscard]] std::uint64_t number(index_word_buffer& words) {
        const auto n = static_cast<std::uint32_t>(words.size());
        const cudaStream_t stream = memory_.stream;
        constexpr stage where = stage::tile_sort;
        device_buffer<std::uint32_t> counts(memory_, n);
        device_buffer<unsigned long long> before(memory_, n);
        device_buffer<std::byte> storage(memory_, cell_scan_bytes(n));
        launch_kernel(false, count_word_bits<0>, num_blocks(n), threads_per_block, 0, stream, where,
                      static_cast<const index_word*>(words.data()), n, counts.data());
        sum_counts(counts.data(), before.data(), n, storage.data(), storage.size(), where, stream);
        launch_kernel(false, number_words<0>, num_blocks(n), threads_per_block, 0, stream, where, words.data(), n,
                      static_cast<const unsigned long long*>(before.data()), ~std::uint32_t{0}, total_.data());
        unsigned long long total = 0;
        check(cudaMemcpyAsync(&total, total_.data(), sizeof(total), cudaMemcpyDeviceToHost, stream), where);
        check(cudaStreamSynchronize(stream), where);
        return total;
    }

    stream_memory memory_;
    index_size size_;
    index_word_buffer words_[3];           // of bricks, nodes, groups
    device_buffer<std::uint64_t> keys_[2]; // of nodes, groups
    device_buffer<unsigned long long> total_;
};

} // namespace voxelpipe::device
