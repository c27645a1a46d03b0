// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The passes of sparse/passes/row_runs.hpp in memory of the caller, for calls that never wait: levels of rows with room
// for the most rows and bounds that there can be, while only the device knows how many there are. Nothing can overflow:
// a level has no more rows, and no more bounds, than the one below, nor more than fit the grid.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/sparse/passes/row_runs.hpp>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));

// A functor whose count only the device knows, for the calls below that; with Ends, for the one behind, too.
template <class F, bool Ends>
struct with_count {
    F f;
    const unsigned long long* count;
    __device__ void operator()(std::uint64_t i) const {
        F here = f;
        here.count = *count;
        if (i < here.count + (Ends ? 1 : 0)) here(i);
    }
};

// Room for rows, and for the bounds of their runs.
struct row_room {
    std::uint64_t rows, bounds;
};
// An upper bound for the rows of cells of 2^level voxels a side in a part of a grid, and for the bounds of their runs.
// Runs begin and end at entries, or at the end of the part.
[[nodiscard]] inline row_room row_room_of(const glm::ivec3& extent, std::uint64_t entries, int level) {
    const auto cells = [&](int size) { return static_cast<std::uint64_t>((size >> level) + 2); };
    const std::uint64_t rows = std::min(std::max<std::uint64_t>(entries, 1), cells(extent.y) * cells(extent.z));
    return {rows, std::min(2 * std::max<std::uint64_t>(entries, 1), rows * (cells(extent.x) + 1))};
}

struct bounded_level {
    std::uint64_t rows; // that there is room for
    std::uint64_t* keys;
    std::uint64_t* first_child;      // and one more
    unsigned long long* parent;      // once the level above is made
    const unsigned long long* count; // on the device
};
struct bounded_runs {
    unsigned long long* first; // one more than rows; behind the last row the number of bounds
    std::uint32_t* bounds;
    [[nodiscard]] core::run_view view() const { return {reinterpret_cast<const std::uint64_t*>(first), bounds}; }
};
// Cells that are listed by key with their rows, up to a number.
struct bounded_cells {
    std::uint64_t* keys[2]; // the second: scratch of the sort
    std::uint32_t* rows[2];
    std::uint64_t room;
};

template <int = 0> // so that programs that do not call it compile no kernels
class bounded_rows {
public:
    // rows: of the lowest level.
    bounded_rows(std::uint64_t rows, cudaStream_t stream, arena& memory)
        : rows_(rows), stream_(stream), counts_(memory.take<std::uint32_t>(rows + 1)),
          storage_(memory.take<std::byte>(scan_bytes())) {}

    [[nodiscard]] static bounded_level take_level(const row_room& room, arena& memory) {
        bounded_level l{};
        l.rows = room.rows;
        l.keys = memory.take<std::uint64_t>(room.rows + 1);
        l.first_child = memory.take<std::uint64_t>(room.rows + 1);
        l.parent = memory.take<unsigned long long>(room.rows + 1);
        return l;
    }
    [[nodiscard]] static bounded_runs take_runs(const row_room& room, arena& memory) {
        bounded_runs r{};
        r.first = memory.take<unsigned long long>(room.rows + 1);
        r.bounds = memory.take<std::uint32_t>(room.bounds);
        return r;
    }
    [[nodiscard]] static bounded_cells take_cells(std::uint64_t room, arena& memory) {
        bounded_cells c{};
        for (std::uint64_t*& k : c.keys) k = memory.take<std::uint64_t>(room);
        for (std::uint32_t*& r : c.rows) r = memory.take<std::uint32_t>(room);
        c.room = room;
        return c;
    }

    // Rows in the order of their keys: found.keys, ~0 behind the last, which `sorted` gets in order, and the runs in
    // that order. other, order, storage: scratch, keys and numbers of as many rows.
    void sort(bounded_level& found, const bounded_runs& runs, const bounded_runs& sorted, std::uint64_t* other,
              std::uint32_t* const (&order)[2], int key_bits, std::byte* storage, std::size_t storage_bytes) const {
        for_each(found.rows, core::number_rows{order[0]}, stage::tile_sort, stream_);
        std::uint64_t* const keys[2] = {found.keys, other};
        const int result = sort_by_cell<std::uint64_t>(keys, order, found.rows, key_bits, storage, storage_bytes,
                                                       stage::tile_sort, stream_);
        found.keys = keys[result];
        const core::gather_rows gather{order[result], 0, runs.view()};
        count_and_write(gather, found, sorted.first, [&](core::gather_rows& g) { g.bounds = sorted.bounds; });
    }
    // The rows above those of a level.
    void make_parents(const bounded_level& of, bounded_level& above) const {
        const core::count_parents count{of.keys, 0, counts_};
        clear_counts(of.rows);
        run<true>(of.rows + 1, count, of.count);
        sum(of.parent, of.rows);
        above.count = of.parent + of.rows;
        run<false>(of.rows,
                   core::make_row_parents{of.keys, 0, counts_, reinterpret_cast<std::uint64_t*>(of.parent), above.keys,
                                          above.first_child},
                   of.count);
    }
    // Their runs.
    template <bool All>
    void join(const bounded_level& above, const bounded_runs& below, const bounded_runs& to) const {
        const core::join_rows<All> join{above.first_child, 0, below.view()};
        count_and_write(join, above, to.first, [&](core::join_rows<All>& j) { j.bounds = to.bounds; });
    }
    // Two passes over a level's rows of a functor with `count`, `counts` and `first`: it counts, and then writes what
    // write(f) has given it arrays for.
    template <class F, class Write>
    void count_and_write(F f, const bounded_level& of, unsigned long long* first, const Write& write) const {
        clear_counts(of.rows);
        f.counts = counts_;
        run<true>(of.rows + 1, f, of.count);
        sum(first, of.rows);
        f.counts = nullptr;
        f.first = reinterpret_cast<const std::uint64_t*>(first);
        write(f);
        run<false>(of.rows, f, of.count);
    }
    // Lists cells of a level's rows behind the first *begin of `to`; if there is no room for all, none. *end becomes
    // *begin and their number. first: scratch, one more than rows.
    void list(core::cells_beyond cells, const bounded_level& of, const bounded_cells& to, unsigned long long* first,
              const unsigned long long* begin, unsigned long long* end) const;

private:
    [[nodiscard]] std::size_t scan_bytes() const { return cell_scan_bytes(static_cast<std::uint32_t>(rows_ + 1)); }
    void clear_counts(std::uint64_t rows) const {
        check(cudaMemsetAsync(counts_, 0, (rows + 1) * sizeof(std::uint32_t), stream_), stage::tile_resolve);
    }
    template <bool Ends, class F>
    void run(std::uint64_t calls, const F& f, const unsigned long long* count) const {
        for_each(calls, with_count<F, Ends>{f, count}, stage::tile_resolve, stream_);
    }
    void sum(unsigned long long* first, std::uint64_t rows) const {
        sum_counts(counts_, first, static_cast<std::uint32_t>(rows + 1), storage_, scan_bytes(), stage::tile_resolve,
                   stream_);
    }

    std::uint64_t rows_;
    cudaStream_t stream_;
    std::uint32_t* counts_;
    std::byte* storage_;
};

// Cells of a level among those of all.
struct list_cells_within {
    core::cells_beyond cells;
    const unsigned long long *rows, *begin, *end;
    std::uint64_t room;
    __device__ void operator()(std::uint64_t i) const {
        if (*end > room || i >= *rows) return;
        core::cells_beyond here = cells;
        here.count = *rows;
        here.keys += *begin;
        here.rows += *begin;
        here(i);
    }
};
struct add_cells {
    const unsigned long long *begin, *more;
    unsigned long long* end;
    __device__ void operator()(std::uint64_t) const { *end = *begin + *more; }
};

template <int N>
void bounded_rows<N>::list(core::cells_beyond cells, const bounded_level& of, const bounded_cells& to,
                           unsigned long long* first, const unsigned long long* begin, unsigned long long* end) const {
    clear_counts(of.rows);
    cells.counts = counts_;
    run<true>(of.rows + 1, cells, of.count);
    sum(first, of.rows);
    for_each(1, add_cells{begin, first + of.rows, end}, stage::tile_resolve, stream_);
    cells.counts = nullptr;
    cells.first = reinterpret_cast<const std::uint64_t*>(first);
    cells.keys = to.keys[0];
    cells.rows = to.rows[0];
    for_each(of.rows, list_cells_within{cells, of.count, begin, end, to.room}, stage::tile_resolve, stream_);
}

// How many bricks get masks: none, if there is no room for all.
struct take_bricks {
    const unsigned long long* bricks;
    std::uint64_t room;
    unsigned long long* taken;
    __device__ void operator()(std::uint64_t) const { *taken = *bricks > room ? 0 : *bricks; }
};
// compose_first_rows for the rows that there are, and one more.
struct compose_within {
    core::compose_first_rows compose;
    const unsigned long long* rows;
    __device__ void operator()(std::uint64_t i) const {
        if (*rows != 0 && i <= *rows) compose(i);
    }
};
// F makes tiles of the cells of one level, in place.
template <class F>
struct make_tiles_within {
    F make;
    const unsigned long long *begin, *end;
    std::uint64_t room;
    __device__ void operator()(std::uint64_t i) const {
        if (*end <= room && *begin <= i && i < *end) make(i);
    }
};

} // namespace voxelpipe::device
