// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks in memory of the caller, for calls that never wait: an index, keys, masks and ranks with room for a fixed
// number of nodes, bricks and voxels. Only the device knows how many there are. Nodes and bricks that are too many
// share the spare ones behind the last, so that no kernel writes outside; then the result is empty.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/sparse/device/brick_index.cuh>
#include <voxelpipe/sparse/device/mask_counts.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// How many bricks of 8^3 voxels a sparse call has made, how many voxels exist in them, and how many tiles there are:
// all 0 if it failed.
struct sparse_counts {
    std::uint64_t bricks, voxels, tiles;
};

namespace device {

struct brick_room {
    std::uint64_t nodes, bricks, voxels;
};

// Cells beyond the room that number_words and list_keys give numbers to.
inline constexpr std::uint64_t spare_cells = 64;
// Voxels of a failed call have the ranks of one brick.
inline constexpr std::uint64_t spare_ranks = core::sparse_brick_voxels;

// The index of brick_index.cuh in an arena. There are at most as many groups as nodes.
template <int = 0> // so that programs that do not call it compile no kernels
class bounded_index {
public:
    bounded_index(const glm::ivec3& whole, const brick_room& room, arena& memory)
        : size_(index_size_of(whole)), room_(room), unused_total_(memory.take<unsigned long long>(1)) {
        std::uint32_t most = 0;
        for (int l = levels() - 1; l >= 0; --l) {
            num_words_[l] = static_cast<std::uint32_t>(
                l + 1 == levels() ? size_.top_words : (room.nodes + spare_cells) << index_level::log2_node_words);
            words_[l] = memory.take<index_word>(num_words_[l]);
            if (l != 0) keys_[l] = memory.take<std::uint64_t>(room.nodes + spare_cells);
            most = std::max(most, num_words_[l]);
        }
        counts_ = memory.take<std::uint32_t>(most);
        before_ = memory.take<unsigned long long>(most);
        storage_ = memory.take<std::byte>(cell_scan_bytes(most));
    }
    [[nodiscard]] index_level bricks() const { return {words_[1], words_[0], words_[2]}; }

    // Before anything is marked.
    void clear(cudaStream_t stream) const {
        for (int l = 0; l < levels(); ++l)
            check(cudaMemsetAsync(words_[l], 0, num_words_[l] * sizeof(index_word), stream));
    }
    // Calls mark(index_level, log2 of its cells' voxels) for the levels above the bricks. *nodes becomes the number of
    // nodes, or is left as it is.
    template <class Mark>
    void mark_above(const Mark& mark, unsigned long long* nodes, cudaStream_t stream) const {
        for (int l = max_levels - 1; l > 0; --l) { // a constant bound: g++ 13 does not see that of levels()
            if (l >= levels()) continue;
            mark(index_level{nullptr, words_[l], l == 1 ? words_[2] : nullptr}, brick_index<>::log2_cell_of(l));
            number(l, room_.nodes, l == 1 ? nodes : unused_total_, keys_[l], stream);
        }
    }
    // After the bricks have been marked. *total becomes their number; their keys are written in order.
    void number_bricks(unsigned long long* total, std::uint64_t* keys, cudaStream_t stream) const {
        number(0, room_.bricks, total, keys, stream);
    }

private:
    static constexpr int max_levels = 3;
    // Levels of the grid's index. The bound is what the compiler needs to see that the arrays below are long enough.
    [[nodiscard]] int levels() const { return std::min(size_.levels, max_levels); }

    void number(int l, std::uint64_t most, unsigned long long* total, std::uint64_t* keys, cudaStream_t stream) const {
        constexpr stage where = stage::tile_sort;
        index_word* const words = words_[l];
        const std::uint32_t n = num_words_[l];
        launch_kernel(false, count_word_bits<0>, num_blocks(n), threads_per_block, 0, stream, where,
                      static_cast<const index_word*>(words), n, counts_);
        sum_counts(counts_, before_, n, storage_, cell_scan_bytes(n), where, stream);
        launch_kernel(false, number_words<0>, num_blocks(n), threads_per_block, 0, stream, where, words, n,
                      static_cast<const unsigned long long*>(before_), static_cast<std::uint32_t>(most), total);
        launch_kernel(false, list_keys<0>, num_blocks(n), threads_per_block, 0, stream, where,
                      static_cast<const index_word*>(words), n,
                      static_cast<const std::uint64_t*>(l + 1 < levels() ? keys_[l + 1] : nullptr), most, keys);
    }

    index_size size_;
    brick_room room_;
    std::uint32_t num_words_[max_levels]{};
    index_word* words_[max_levels]{};   // of bricks, nodes, groups
    std::uint64_t* keys_[max_levels]{}; // of nodes and groups
    unsigned long long* unused_total_;
    std::uint32_t* counts_;
    unsigned long long* before_;
    std::byte* storage_;
};

// Sizes of a result, on the device.
struct bounded_totals {
    const unsigned long long *bricks, *voxels;
    const unsigned long long* tiles; // null: none
    const unsigned long long* drawn; // voxels that the call draws in; null: not counted
};
// Publishes the counts, and notes what the call needs: tiles are bricks, and voxels, of their own. Without room, no key
// is left and every rank is that of an empty result.
template <int = 0> // compiled where it is called
__global__ void publish_bricks(pipeline_state* state, capacities limits, brick_room room, bounded_totals totals,
                               sparse_counts* counts, std::uint64_t* keys, std::uint64_t* offsets) {
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    const unsigned long long bricks = *totals.bricks, voxels = *totals.voxels,
                             tiles = totals.tiles == nullptr ? 0 : *totals.tiles;
    const bool failed = has_failed(*state, limits) || state->sparse.nodes > room.nodes ||
                        bricks + tiles > room.bricks || voxels + tiles > room.voxels;
    if (thread == 0) {
        *counts = failed ? sparse_counts{0, 0, 0} : sparse_counts{bricks, voxels, tiles};
        state->sparse.bricks = bricks + tiles; // nobody here reads these three
        state->sparse.voxels = voxels + tiles;
        state->voxels = totals.drawn != nullptr && !failed ? *totals.drawn : 0;
    }
    if (!failed) return;
    for (std::uint64_t i = thread; i < room.bricks; i += threads) keys[i] = ~std::uint64_t{0};
    for (std::uint64_t i = thread; i <= room.bricks + spare_cells; i += threads) offsets[i] = 0;
}

// The arrays of a result.
template <int = 0>
struct bounded_arrays {
    brick_room room;
    mask_totals* totals;
    unsigned long long* num_bricks;
    sparse_counts* counts;
    std::uint64_t* keys;    // ~0, which no brick has, behind the last: so the whole array can be bisected
    brick_mask* masks;      // and spare ones, which are empty
    std::uint64_t* offsets; // one more than masks
    std::uint32_t* of_masks;
    std::byte* storage;

    bounded_arrays(const brick_room& r, arena& memory)
        : room(r), totals(memory.take<mask_totals>(1)), num_bricks(memory.take<unsigned long long>(1)),
          counts(memory.take<sparse_counts>(1)), keys(memory.take<std::uint64_t>(r.bricks)),
          masks(memory.take<brick_mask>(num_masks())), offsets(memory.take<std::uint64_t>(num_masks() + 1)),
          of_masks(memory.take<std::uint32_t>(num_masks())),
          storage(memory.take<std::byte>(cell_scan_bytes(num_masks()))) {}
    [[nodiscard]] std::uint32_t num_masks() const { return static_cast<std::uint32_t>(room.bricks + spare_cells); }

    // Before anything is written.
    void clear(cudaStream_t stream) const {
        check(cudaMemsetAsync(totals, 0, sizeof(mask_totals), stream));
        check(cudaMemsetAsync(keys, 0xff, room.bricks * sizeof(std::uint64_t), stream));
        check(cudaMemsetAsync(masks, 0, num_masks() * sizeof(brick_mask), stream));
    }
    // When the masks are complete. tiles: how many there are, on the device, or null. drawn: how many voxels are drawn
    // in; null if they are not counted.
    void publish(pipeline_state* state, const capacities& limits, const unsigned long long* tiles,
                 const unsigned long long* drawn, cudaStream_t stream) const {
        constexpr stage where = stage::fine_raster;
        rank_bricks(masks, num_masks(), of_masks, offsets, totals, storage, where, stream);
        launch_kernel(false, publish_bricks<0>, fill_device(num_masks()), threads_per_block, 0, stream, where, state,
                      limits, room, bounded_totals{num_bricks, &totals->voxels, tiles, drawn}, counts, keys, offsets);
    }
};
// The same with an index of the bricks.
template <int = 0>
struct bounded_bricks : bounded_arrays<> {
    bounded_index<> index;

    bounded_bricks(const glm::ivec3& whole, const brick_room& r, arena& memory)
        : bounded_arrays<>(r, memory), index(whole, r, memory) {}

    // Before anything is marked.
    void clear(cudaStream_t stream) const {
        index.clear(stream);
        bounded_arrays<>::clear(stream);
    }
    // After the bricks have been marked.
    void number(cudaStream_t stream) const { index.number_bricks(num_bricks, keys, stream); }
};

} // namespace device
} // namespace voxelpipe
