// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// sparse/passes/solid_bricks.hpp in memory of the caller, for calls that never wait: the same passes over the rows'
// runs, level by level, for as many levels as the grid can have. Memory is in proportion to the crossings, bricks and
// tiles that there is room for.

#include <voxelpipe/solid/device/run_rows.cuh>
#include <voxelpipe/sparse/device/bounded_bricks.cuh>
#include <voxelpipe/sparse/device/bounded_rows.cuh>
#include <voxelpipe/sparse/device/bounded_tiles.cuh>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// The number of bounds, behind the last row that was found.
struct end_runs {
    const run_totals* totals;
    std::uint64_t* first;
    __device__ void operator()(std::uint64_t) const { first[totals->rows] = totals->bounds; }
};

template <int = 0> // so that programs that do not call it compile no kernels
class bounded_solid_bricks {
public:
    // fragments: crossings that there is room for.
    bounded_solid_bricks(const grid& g, std::uint64_t fragments, const brick_room& room, cudaStream_t stream,
                         arena& memory)
        : g_(g), stream_(stream), entries_(fragments), rows_(room_of(0).rows),
          room_(std::max<std::uint64_t>(room.bricks, 1)), passes_(rows_, stream, memory),
          found_runs_(passes_.take_runs(room_of(0), memory)), voxel_runs_(passes_.take_runs(room_of(0), memory)) {
        for (int l = 0; l < 5; ++l) levels_[l] = passes_.take_level(room_of(l), memory);
        for (bounded_runs* runs : {any_, all_}) // of the odd levels, and of the even ones
            for (int k = 0; k < 2; ++k) runs[k] = passes_.take_runs(room_of(2 - k), memory);
        for (std::uint32_t*& o : order_) o = memory.take<std::uint32_t>(rows_);
        other_keys_ = memory.take<std::uint64_t>(rows_);
        totals_ = memory.take<run_totals>(1);
        first_ = memory.take<unsigned long long>(levels_[3].rows + 1);
        first_row_ = memory.take<std::uint64_t>(levels_[3].rows + 1);
        bricks_ = passes_.take_cells(room_, memory);
        tiles_ = passes_.take_cells(room_, memory);
        mask_counts_ = memory.take<std::uint32_t>(room_);
        numbers_ = memory.take<unsigned long long>(num_numbers);
        sort_bytes_ =
            std::max({sort_bytes<std::uint64_t>(rows_, row_bits()), sort_bytes<std::uint64_t>(room_, brick_bits()),
                      sort_bytes<std::uint64_t>(room_, tile_bits())});
        storage_ = memory.take<std::byte>(sort_bytes_);
        made_tiles_ = memory.take<brick_tile>(room_);
    }
    // The arrays into which the runs of the rows are written, in any order of rows.
    [[nodiscard]] run_arrays found() const {
        return {levels_[0].keys, reinterpret_cast<std::uint64_t*>(found_runs_.first), found_runs_.bounds, 0, 0};
    }
    [[nodiscard]] run_totals* totals() const { return totals_; }
    // Before the runs are written.
    void clear() const {
        check(cudaMemsetAsync(levels_[0].keys, 0xff, rows_ * sizeof(std::uint64_t), stream_), where);
        for (const bounded_cells& c : {bricks_, tiles_}) {
            check(cudaMemsetAsync(c.keys[0], 0xff, room_ * sizeof(std::uint64_t), stream_), where);
            check(cudaMemsetAsync(c.rows[0], 0, room_ * sizeof(std::uint32_t), stream_), where);
        }
        check(cudaMemsetAsync(numbers_, 0, num_numbers * sizeof(*numbers_), stream_), where);
    }
    // Bricks and tiles of the runs; to.masks are zero before. to.keys becomes an array of this.
    void launch(bounded_arrays<>& to);
    // On the device: how many tiles there are, or would be.
    [[nodiscard]] const unsigned long long* num_tiles() const { return numbers_ + num_levels(); }
    [[nodiscard]] const brick_tile* tiles() const { return made_tiles_; }
    // After the result has been published.
    void end_tiles(const sparse_counts* made) const {
        for_each(room_, end_bounded_tiles{sorted_tiles_, made, made_tiles_}, where, stream_);
    }

private:
    static constexpr stage where = stage::tile_resolve;
    static constexpr int max_levels = 18; // of tiles
    // Zero, ends of the tiles' levels, bricks, bricks with masks.
    static constexpr std::size_t num_numbers = max_levels + 3;
    [[nodiscard]] row_room room_of(int level) const { return row_room_of(g_.extent, entries_, level); }
    [[nodiscard]] static int bits_of(std::uint64_t most) { return std::max(1, static_cast<int>(std::bit_width(most))); }
    [[nodiscard]] int row_bits() const {
        const glm::ivec3 whole = g_.whole_extent();
        return bits_of(core::morton_key(0, whole.y - 1, whole.z - 1));
    }
    [[nodiscard]] int brick_bits() const {
        return bits_of(core::morton_key((g_.whole_extent() - 1) / core::sparse_brick_size));
    }
    [[nodiscard]] int tile_bits() const { return brick_bits() + brick_tile::level_bits; }
    // Sizes that a cube of full bricks can have within the grid.
    [[nodiscard]] int num_levels() const {
        const glm::ivec3 bricks = g_.extent / core::sparse_brick_size;
        const auto side = static_cast<unsigned>(std::min({bricks.x, bricks.y, bricks.z}));
        return std::min(static_cast<int>(std::bit_width(side)), max_levels);
    }
    [[nodiscard]] std::uint64_t* sort_cells(bounded_cells& cells, int bits, std::uint32_t** rows) const {
        const int result = sort_by_cell<std::uint64_t>(cells.keys, cells.rows, room_, bits, storage_, sort_bytes_,
                                                       stage::tile_sort, stream_);
        if (rows != nullptr) *rows = cells.rows[result];
        return cells.keys[result];
    }
    [[nodiscard]] unsigned long long* num_bricks() const { return numbers_ + (max_levels + 1); }
    [[nodiscard]] unsigned long long* num_masks() const { return numbers_ + (max_levels + 2); }
    // From the runs of rows of bricks.
    void write_masks(const bounded_runs& all, const bounded_runs& any, bounded_arrays<>& to);
    void list_tiles(const bounded_runs& all);

    const grid& g_;
    cudaStream_t stream_;
    std::uint64_t entries_, rows_, room_; // that there is room for: rows of voxels; bricks
    bounded_rows<> passes_;
    bounded_runs found_runs_, voxel_runs_;
    bounded_level levels_[5]; // of voxels, of 2, 4 and 8; beyond, of bricks, the last two in turn
    bounded_runs any_[2], all_[2];
    std::uint32_t* order_[2];
    std::uint64_t* other_keys_;
    run_totals* totals_;
    unsigned long long* first_;
    std::uint64_t* first_row_;
    bounded_cells bricks_, tiles_;
    std::uint32_t* mask_counts_;
    unsigned long long* numbers_;
    std::size_t sort_bytes_;
    std::byte* storage_;
    brick_tile* made_tiles_;
    std::uint64_t* sorted_tiles_ = nullptr;
};

template <int N>
void bounded_solid_bricks<N>::launch(bounded_arrays<>& to) {
    static_assert(sizeof(run_totals) == 2 * sizeof(unsigned long long));
    for_each(1, end_runs{totals_, reinterpret_cast<std::uint64_t*>(found_runs_.first)}, where, stream_);
    levels_[0].count = &totals_->rows;
    passes_.sort(levels_[0], found_runs_, voxel_runs_, other_keys_, order_, row_bits(), storage_, sort_bytes_);
    // Level by level, up to bricks: the runs of cells wholly inside, and of cells with any voxel inside.
    const bounded_runs *all = &voxel_runs_, *any = &voxel_runs_;
    for (int l = 1; l < 4; ++l) {
        passes_.make_parents(levels_[l - 1], levels_[l]);
        passes_.template join<true>(levels_[l], *all, all_[l % 2]);
        passes_.template join<false>(levels_[l], *any, any_[l % 2]);
        all = &all_[l % 2];
        any = &any_[l % 2];
    }
    write_masks(*all, *any, to);
    list_tiles(*all);
}

template <int N>
void bounded_solid_bricks<N>::write_masks(const bounded_runs& all, const bounded_runs& any, bounded_arrays<>& to) {
    const bounded_level& beams = levels_[3];
    passes_.list({beams.keys, 0, any.view(), all.view(), nullptr, 1}, beams, bricks_, first_, numbers_, num_bricks());
    std::uint32_t* rows = nullptr;
    to.keys = sort_cells(bricks_, brick_bits(), &rows);
    to.num_bricks = num_bricks();
    for_each(1, take_bricks{num_bricks(), to.room.bricks, num_masks()}, where, stream_);
    for_each(
        beams.rows + 1,
        compose_within{{beams.first_child, levels_[2].first_child, levels_[1].first_child, first_row_}, beams.count},
        where, stream_);
    const core::make_masks make{to.keys,  rows,        0, first_row_, levels_[0].keys, voxel_runs_.view(),
                                to.masks, mask_counts_};
    for_each(room_, with_count<core::make_masks, false>{make, num_masks()}, where, stream_);
}

template <int N>
void bounded_solid_bricks<N>::list_tiles(const bounded_runs& all) {
    bounded_level here = levels_[3];
    const bounded_runs* inside = &all;
    for (int l = 0; l < num_levels(); ++l) {
        bounded_level above = levels_[l % 2 == 0 ? 4 : 1]; // those of voxels, and of 2 and 4, are needed no more
        above.rows = room_of(l + 4).rows;
        const bounded_runs& inside_above = all_[inside == &all_[0] ? 1 : 0];
        passes_.make_parents(here, above);
        passes_.template join<true>(above, *inside, inside_above);
        const unsigned long long *const begin = numbers_ + l, *const end = numbers_ + (l + 1);
        passes_.list(
            {here.keys, 0, inside->view(), inside_above.view(), reinterpret_cast<const std::uint64_t*>(here.parent), 2},
            here, tiles_, first_, begin, numbers_ + (l + 1));
        for_each(
            room_,
            make_tiles_within<core::make_tiles>{{tiles_.keys[0], l, tiles_.keys[0], tiles_.rows[0]}, begin, end, room_},
            where, stream_);
        here = above;
        inside = &inside_above;
    }
    sorted_tiles_ = sort_cells(tiles_, tile_bits(), nullptr);
}

} // namespace voxelpipe::device
