// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cells/passes/cell_bricks.hpp in memory of the caller, for calls that never wait: the same passes over the rows that
// the records lie in, level by level, for as many levels as the grid can have. Memory is in proportion to the records,
// bricks and tiles that there is room for.

#include <voxelpipe/cells/passes/sparse_cell_passes.hpp>
#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/sparse/device/bounded_bricks.cuh>
#include <voxelpipe/sparse/device/bounded_rows.cuh>
#include <voxelpipe/sparse/device/bounded_tiles.cuh>
#include <voxelpipe/surfaces/passes/bounded.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// A functor for the listed rows, whose number only the device knows; with Ends, for the one behind the last, too.
template <class F, bool Ends>
struct for_listed_rows {
    F f;
    const unsigned long long* rows;
    __device__ void operator()(std::uint64_t i) const {
        F here = f;
        here.num_rows = *rows;
        if (i < here.num_rows + (Ends ? 1 : 0)) here(i);
    }
};

// The rows of the grid that records lie in, ascending, in an arena.
template <int = 0> // so that programs that do not call it compile no kernels
class bounded_cell_rows {
public:
    // extent: of the part of the grid, turned.
    bounded_cell_rows(const glm::ivec3& extent, std::uint64_t records, arena& memory)
        : records_(records), room_(row_room_of(extent, records, 0).rows),
          is_first_(memory.take<std::uint32_t>(records + 1)), place_(memory.take<unsigned long long>(records + 1)),
          storage_(memory.take<std::byte>(scan_bytes())), rows_(memory.take<std::uint64_t>(room_)) {}
    [[nodiscard]] std::uint64_t room() const { return room_; }
    [[nodiscard]] const std::uint64_t* rows() const { return rows_; }
    // On the device: how many there are.
    [[nodiscard]] const unsigned long long* count() const { return place_ + records_; }

    // count: of the records, on the device.
    template <class Terms>
    void find(const core::passes::record_list<Terms>& list, const std::uint64_t* count, cudaStream_t stream) const {
        using namespace core::passes;
        const std::uint64_t keys_a_row = list.keys_of.slots * list.keys_of.bodies;
        check(cudaMemsetAsync(is_first_, 0, (records_ + 1) * sizeof(std::uint32_t), stream), where);
        const mark_cell_rows mark{list.keys, 0, keys_a_row, is_first_};
        for_each(records_ + 1,
                 with_count<mark_cell_rows, true>{mark, reinterpret_cast<const unsigned long long*>(count)}, where,
                 stream);
        sum_counts(is_first_, place_, static_cast<std::uint32_t>(records_ + 1), storage_, scan_bytes(), where, stream);
        const list_cell_rows rows{list.keys, keys_a_row, is_first_, reinterpret_cast<const std::uint64_t*>(place_),
                                  rows_};
        for_each(records_, bounded<list_cell_rows>{rows, count}, where, stream);
    }

private:
    static constexpr stage where = stage::tile_sort;
    [[nodiscard]] std::size_t scan_bytes() const { return cell_scan_bytes(static_cast<std::uint32_t>(records_ + 1)); }

    std::uint64_t records_, room_; // that there is room for: records; rows
    std::uint32_t* is_first_;
    unsigned long long* place_; // of each row among the listed ones, and behind the last record their number
    std::byte* storage_;
    std::uint64_t* rows_;
};

// Looks at the sums of the listed rows.
template <class Terms>
struct measure_listed_rows {
    core::passes::measure_rows<Terms> measure;
    const unsigned long long* rows;
    __device__ void operator()(std::uint64_t i) const {
        if (i < *rows * measure.list.keys_of.bodies) measure(i);
    }
};

// run_shaded_cells as bounded_rows<>::count_and_write calls it.
template <class Shade>
struct shade_runs {
    Shade shade;
    std::uint64_t count = 0; // rows
    std::uint32_t* counts = nullptr;
    const std::uint64_t* first = nullptr;
    __device__ void operator()(std::uint64_t i) const {
        Shade here = shade;
        here.num_rows = count;
        here.num_bounds = counts;
        here.first = first;
        here(i);
    }
};
// F for cells that are listed, unless they do not fit.
template <class F>
struct for_listed_cells {
    F f;
    const unsigned long long* count;
    std::uint64_t room;
    __device__ void operator()(std::uint64_t i) const {
        if (*count <= room && i < *count) f(i);
    }
};
// store_brick_values of the bricks that a result has, and store_tile_values of its tiles.
template <class F>
struct store_made_bricks {
    F store;
    const sparse_counts* made;
    __device__ void operator()(std::uint64_t call) const {
        if (call / 64 < made->bricks) store(call);
    }
};
template <class F>
struct store_made_tiles {
    F store;
    const sparse_counts* made;
    __device__ void operator()(std::uint64_t i) const {
        F here = store;
        here.first = made->voxels;
        if (i < made->tiles) here(i);
    }
};

// Runs of cells of one value, and a run of voxels that has the value of each.
struct bounded_equal_runs {
    bounded_runs runs;
    std::uint32_t* sources; // null: of voxels themselves
};

// Values: of all targets.
template <class Values>
class bounded_cell_bricks {
public:
    // records, rows: that there is room for.
    bounded_cell_bricks(const grid& g, int axis, std::uint64_t records, std::uint64_t rows, const brick_room& room,
                        cudaStream_t stream, arena& memory)
        : g_(g), axis_(axis), extent_(core::turn(g.extent, axis)), stream_(stream), records_(records), rows_(rows),
          room_(std::max<std::uint64_t>(room.bricks, 1)), passes_(rows, stream, memory),
          voxel_runs_(passes_.take_runs(room_of(0), memory)), values_(memory.take<Values>(room_of(0).bounds / 2)) {
        for (int l = 0; l < 5; ++l) levels_[l] = passes_.take_level(room_of(l), memory);
        for (int k = 0; k < 2; ++k) { // of the even levels, and of the odd ones
            const row_room of = room_of(2 - k);
            any_[k] = passes_.take_runs(of, memory);
            all_[k] = {passes_.take_runs(of, memory), memory.take<std::uint32_t>(of.bounds / 2)};
        }
        other_keys_ = memory.take<std::uint64_t>(rows_);
        for (std::uint32_t*& o : order_) o = memory.take<std::uint32_t>(rows_);
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
    // Runs of voxels of the rows. shade: run_shaded_cells of them, which lacks what this has.
    template <class Shade>
    void write_runs(const bounded_cell_rows<>& rows, std::uint64_t rows_y, Shade shade);
    // Their bricks and tiles; to.masks are zero before. to.keys becomes an array of this.
    void launch(bounded_arrays<>& to);
    // On the device: how many tiles there are, or would be.
    [[nodiscard]] const unsigned long long* num_tiles() const { return numbers_ + num_levels(); }
    [[nodiscard]] const brick_tile* tiles() const { return made_tiles_; }
    // After the result has been published.
    void end_tiles(const sparse_counts* made) const {
        for_each(room_, end_bounded_tiles{sorted_tiles_, made, made_tiles_}, where, stream_);
    }
    // Writes the values of target I of all ranks, `voxels` at most.
    template <std::size_t I, class Target>
    void store_values(const bounded_arrays<>& made, std::uint64_t voxels,
                      typename core::rank_map<Target>::element* to) const;

private:
    static constexpr stage where = stage::tile_resolve;
    static constexpr int max_levels = 18; // of tiles
    // Zero, ends of the tiles' levels, bricks, bricks with masks.
    static constexpr std::size_t num_numbers = max_levels + 3;
    // A record is one of a voxel, which may be a run, and begins another one at most. Runs of unequal values touch.
    [[nodiscard]] row_room room_of(int level) const {
        const std::uint64_t rows = row_room_of(extent_, records_, level).rows;
        const auto cells = static_cast<std::uint64_t>((extent_.x >> level) + 2);
        return {rows, std::min(4 * std::max<std::uint64_t>(records_, 1), 2 * rows * cells)};
    }
    [[nodiscard]] static int bits_of(std::uint64_t most) { return std::max(1, static_cast<int>(std::bit_width(most))); }
    [[nodiscard]] int row_bits() const {
        const glm::ivec3 whole = core::turn(g_.whole_extent(), axis_);
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
    [[nodiscard]] int sort(std::uint64_t* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t count,
                           int bits) const {
        return sort_by_cell<std::uint64_t>(keys, values, count, bits, storage_, sort_bytes_, stage::tile_sort, stream_);
    }
    [[nodiscard]] unsigned long long* num_bricks() const { return numbers_ + (max_levels + 1); }
    [[nodiscard]] unsigned long long* num_masks() const { return numbers_ + (max_levels + 2); }
    [[nodiscard]] core::passes::brick_rows rows_of(const std::uint64_t* keys) const {
        return {keys, brick_rows_, first_row_, levels_[0].keys, voxel_runs_.view(), axis_};
    }
    void join_equal(const bounded_level& above, const bounded_equal_runs& below, const bounded_equal_runs& to) const {
        using join_type = core::passes::join_equal_rows<Values>;
        const join_type join{above.first_child, 0,       below.runs.view(), below.sources, values_,
                             nullptr,           nullptr, nullptr,           nullptr};
        passes_.count_and_write(join, above, to.runs.first, [&](join_type& j) {
            j.bounds = to.runs.bounds;
            j.to_sources = to.sources;
        });
    }
    // From the runs of rows of bricks.
    void write_masks(const bounded_runs& all, const bounded_runs& any, bounded_arrays<>& to);
    void list_tiles(const bounded_equal_runs& all);

    const grid& g_;
    int axis_;
    glm::ivec3 extent_; // of the part, turned
    cudaStream_t stream_;
    std::uint64_t records_, rows_, room_; // that there is room for: records; rows of voxels; bricks
    bounded_rows<> passes_;
    bounded_runs voxel_runs_;
    Values* values_;          // of the runs of voxels
    bounded_level levels_[5]; // of voxels, of 2, 4 and 8; beyond, of bricks, the last two in turn
    bounded_runs any_[2];
    bounded_equal_runs all_[2];
    std::uint64_t* other_keys_;
    std::uint32_t* order_[2];
    unsigned long long* first_;
    std::uint64_t* first_row_;
    bounded_cells bricks_, tiles_;
    std::uint32_t* mask_counts_;
    unsigned long long* numbers_;
    std::size_t sort_bytes_;
    std::byte* storage_;
    brick_tile* made_tiles_;
    std::uint32_t* brick_rows_ = nullptr; // of the sorted bricks
    std::uint64_t* sorted_tiles_ = nullptr;
    std::uint32_t* tile_sources_ = nullptr; // runs of voxels
};

template <class Values>
template <class Shade>
void bounded_cell_bricks<Values>::write_runs(const bounded_cell_rows<>& rows, std::uint64_t rows_y, Shade shade) {
    bounded_level& voxels = levels_[0];
    check(cudaMemsetAsync(voxels.keys, 0xff, rows_ * sizeof(std::uint64_t), stream_), where);
    check(cudaMemsetAsync(order_[0], 0, rows_ * sizeof(std::uint32_t), stream_), where);
    for (const bounded_cells& c : {bricks_, tiles_}) {
        check(cudaMemsetAsync(c.keys[0], 0xff, room_ * sizeof(std::uint64_t), stream_), where);
        check(cudaMemsetAsync(c.rows[0], 0, room_ * sizeof(std::uint32_t), stream_), where);
    }
    check(cudaMemsetAsync(numbers_, 0, num_numbers * sizeof(*numbers_), stream_), where);
    const core::passes::key_cell_rows key{rows.rows(), rows_y, core::turn(g_.offset, axis_), voxels.keys, order_[0]};
    for_each(rows_, for_listed_cells<core::passes::key_cell_rows>{key, rows.count(), rows_}, where, stream_);
    std::uint64_t* const keys[2] = {voxels.keys, other_keys_};
    const int at = sort(keys, order_, rows_, row_bits());
    voxels.keys = keys[at];
    voxels.count = rows.count();
    shade.order = order_[at];
    passes_.count_and_write(shade_runs<Shade>{shade}, voxels, voxel_runs_.first, [&](shade_runs<Shade>& s) {
        s.shade.bounds = voxel_runs_.bounds;
        s.shade.values = values_;
    });
}

template <class Values>
void bounded_cell_bricks<Values>::launch(bounded_arrays<>& to) {
    // Level by level, up to bricks: the runs of cells of one value, and of cells with any voxel.
    const bounded_equal_runs voxels{voxel_runs_, nullptr};
    const bounded_equal_runs* all = &voxels;
    const bounded_runs* any = &voxel_runs_;
    for (int l = 1; l < 4; ++l) {
        passes_.make_parents(levels_[l - 1], levels_[l]);
        join_equal(levels_[l], *all, all_[l % 2]);
        passes_.template join<false>(levels_[l], *any, any_[l % 2]);
        all = &all_[l % 2];
        any = &any_[l % 2];
    }
    write_masks(all->runs, *any, to);
    list_tiles(*all);
}

template <class Values>
void bounded_cell_bricks<Values>::write_masks(const bounded_runs& all, const bounded_runs& any, bounded_arrays<>& to) {
    using namespace core::passes;
    const bounded_level& beams = levels_[3];
    passes_.list({beams.keys, 0, any.view(), all.view(), nullptr, 1}, beams, bricks_, first_, numbers_, num_bricks());
    if (axis_ != 0)
        for_each(room_, for_listed_cells<turn_keys>{{bricks_.keys[0], axis_}, num_bricks(), room_}, where, stream_);
    const int at = sort(bricks_.keys, bricks_.rows, room_, brick_bits());
    brick_rows_ = bricks_.rows[at];
    to.keys = bricks_.keys[at];
    to.num_bricks = num_bricks();
    for_each(1, take_bricks{num_bricks(), to.room.bricks, num_masks()}, where, stream_);
    for_each(
        beams.rows + 1,
        compose_within{{beams.first_child, levels_[2].first_child, levels_[1].first_child, first_row_}, beams.count},
        where, stream_);
    const make_cell_masks make{rows_of(to.keys), 0, to.masks, mask_counts_};
    for_each(room_, with_count<make_cell_masks, false>{make, num_masks()}, where, stream_);
}

template <class Values>
void bounded_cell_bricks<Values>::list_tiles(const bounded_equal_runs& all) {
    using core::passes::make_cell_tiles;
    bounded_level here = levels_[3];
    const bounded_equal_runs* inside = &all;
    for (int l = 0; l < num_levels(); ++l) {
        bounded_level above = levels_[l % 2 == 0 ? 4 : 1]; // that of 2 is needed no more
        above.rows = room_of(l + 4).rows;
        const bounded_equal_runs& inside_above = all_[inside == &all_[0] ? 1 : 0];
        passes_.make_parents(here, above);
        join_equal(above, *inside, inside_above);
        const unsigned long long* const begin = numbers_ + l;
        passes_.list({here.keys, 0, inside->runs.view(), inside_above.runs.view(),
                      reinterpret_cast<const std::uint64_t*>(here.parent), 2},
                     here, tiles_, first_, begin, numbers_ + (l + 1));
        const make_cell_tiles make{tiles_.keys[0], tiles_.rows[0], inside->runs.view(), inside->sources, l,
                                   axis_,          tiles_.keys[0], tiles_.rows[0]};
        for_each(room_, make_tiles_within<make_cell_tiles>{make, begin, begin + 1, room_}, where, stream_);
        here = above;
        inside = &inside_above;
    }
    const int at = sort(tiles_.keys, tiles_.rows, room_, tile_bits());
    sorted_tiles_ = tiles_.keys[at];
    tile_sources_ = tiles_.rows[at];
}

template <class Values>
template <std::size_t I, class Target>
void bounded_cell_bricks<Values>::store_values(const bounded_arrays<>& made, std::uint64_t voxels,
                                               typename core::rank_map<Target>::element* to) const {
    using namespace core::passes;
    using map = core::rank_map<Target>;
    if constexpr (map::is_bit) check(cudaMemsetAsync(to, 0, map::elements(voxels) * sizeof(*to), stream_), where);
    using of_bricks_type = store_brick_values<I, Target, Values>;
    using of_tiles_type = store_tile_values<I, Target, Values>;
    const of_bricks_type of_bricks{rows_of(made.keys), made.masks, made.offsets, values_, to};
    for_each(64 * made.room.bricks, store_made_bricks<of_bricks_type>{of_bricks, made.counts}, where, stream_);
    const of_tiles_type of_tiles{tile_sources_, values_, 0, to};
    for_each(made.room.bricks, store_made_tiles<of_tiles_type>{of_tiles, made.counts}, where, stream_);
}

} // namespace voxelpipe::device
