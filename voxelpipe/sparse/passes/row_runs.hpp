// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sets of cells as rows along x, and a row as runs: of voxels, of 2^3 voxels, of 4^3 and so on, each level from the one
// below, on any backend. A cell of a level is in the set if all, or if any, of its 8 children are. Time and memory are
// in proportion to the runs, however long they are. Places count in the whole grid.

#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/core/morton_parents.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace voxelpipe::core {

// The runs of rows, which someone owns: row r has [first[r], first[r + 1]) of the bounds, begin and end in turn.
// Neither overlapping nor touching.
struct run_view {
    const std::uint64_t* first;
    const std::uint32_t* bounds;
};

// The runs of a level's rows.
template <class Backend>
struct run_list {
    typename Backend::template buffer<std::uint64_t> first;
    typename Backend::template buffer<std::uint32_t> bounds;

    explicit run_list(Backend& backend) : first(backend, std::size_t{0}), bounds(backend, std::size_t{0}) {}
    [[nodiscard]] run_view view() const { return {first.data(), bounds.data()}; }
};

// Rows as a backend finds them: in any order, at most one of each place.
template <class Backend>
struct found_rows {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    buffer<std::uint64_t> places; // morton_key(0, y, z) of each row
    run_list<Backend> runs;       // one more than rows in `first`

    explicit found_rows(Backend& backend) : places(backend, std::size_t{0}), runs(backend) {}
};

// ---- functors -------------------------------------------------------------------------------------------------------

struct number_rows {
    std::uint32_t* order;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { order[i] = static_cast<std::uint32_t>(i); }
};
// The bounds of rows in another order; counted where `counts` is not null, with a 0 behind the last row.
struct gather_rows {
    const std::uint32_t* order;
    std::uint64_t count;
    run_view from;
    std::uint32_t* counts = nullptr;
    const std::uint64_t* first = nullptr;
    std::uint32_t* bounds = nullptr;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t row = i < count ? order[i] : 0;
        const std::uint64_t n = i < count ? from.first[row + 1] - from.first[row] : 0;
        if (counts != nullptr) {
            counts[i] = static_cast<std::uint32_t>(n);
            return;
        }
        for (std::uint64_t k = 0; k < n; ++k) bounds[first[i] + k] = from.bounds[from.first[row] + k];
    }
};
// Numbers of parents, their keys and their first children, and one more.
struct make_row_parents {
    const std::uint64_t* keys;
    std::uint64_t count;
    const std::uint32_t* is_first;
    std::uint64_t* parent; // in: those that begin before a row; out: the row's own
    std::uint64_t* parent_keys;
    std::uint64_t* first_child;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t p = parent[i] + is_first[i] - 1;
        parent[i] = p;
        if (is_first[i] != 0) {
            parent_keys[p] = keys[i] >> 3;
            first_child[p] = i;
        }
        if (i + 1 == count) first_child[p + 1] = count;
    }
};

// The runs of parents from those of their up to four children: cells that have all (All) or any of their children.
// Counted where `counts` is not null, with a 0 behind the last parent.
template <bool All>
struct join_rows {
    const std::uint64_t* first_child;
    std::uint64_t count; // parents
    run_view from;
    std::uint32_t* counts = nullptr;
    const std::uint64_t* first = nullptr;
    std::uint32_t* bounds = nullptr;

    VOXELPIPE_HD void operator()(std::uint64_t p) const {
        std::uint32_t made = 0;
        if (p < count) {
            std::uint64_t at[4]{}, end[4]{};
            const std::uint64_t children = first_child[p + 1] - first_child[p];
            for (std::uint64_t c = 0; c < children; ++c) {
                at[c] = from.first[first_child[p] + c];
                end[c] = from.first[first_child[p] + c + 1];
            }
            if constexpr (All)
                made = children == 4 ? join_all(p, at, end) : 0;
            else
                made = join_any(p, at, end);
        }
        if (counts != nullptr) counts[p] = made;
    }

private:
    VOXELPIPE_HD void add(std::uint64_t p, std::uint32_t& made, std::uint32_t begin, std::uint32_t end) const {
        if (counts == nullptr) {
            bounds[first[p] + made] = begin;
            bounds[first[p] + made + 1] = end;
        }
        made += 2;
    }
    VOXELPIPE_HD std::uint32_t join_all(std::uint64_t p, std::uint64_t (&at)[4], const std::uint64_t (&end)[4]) const {
        std::uint32_t made = 0;
        while (at[0] < end[0] && at[1] < end[1] && at[2] < end[2] && at[3] < end[3]) {
            std::uint32_t low = 0, high = ~0u;
            for (const std::uint64_t a : at) {
                low = from.bounds[a] > low ? from.bounds[a] : low;
                high = from.bounds[a + 1] < high ? from.bounds[a + 1] : high;
            }
            const std::uint32_t b = (low + 1) >> 1, e = high >> 1;
            if (b < e) add(p, made, b, e);
            for (std::uint64_t& a : at)
                if (from.bounds[a + 1] == high) a += 2;
        }
        return made;
    }
    VOXELPIPE_HD std::uint32_t join_any(std::uint64_t p, std::uint64_t (&at)[4], const std::uint64_t (&end)[4]) const {
        std::uint32_t made = 0;
        bool is_open = false;
        std::uint32_t b = 0, e = 0;
        while (true) {
            int next = -1; // the child whose run begins first
            for (int c = 0; c < 4; ++c)
                if (at[c] < end[c] && (next < 0 || from.bounds[at[c]] < from.bounds[at[next]])) next = c;
            if (next < 0) break;
            const std::uint32_t low = from.bounds[at[next]] >> 1, high = (from.bounds[at[next] + 1] + 1) >> 1;
            at[next] += 2;
            if (is_open && low <= e) {
                e = high > e ? high : e;
                continue;
            }
            if (is_open) add(p, made, b, e);
            is_open = true;
            b = low;
            e = high;
        }
        if (is_open) add(p, made, b, e);
        return made;
    }
};

// The cells of `outer` that are not in `inner`, whose cells are `scale` as large; keys of cells with their row's
// number. Counted where `counts` is not null, with a 0 behind the last row.
struct cells_beyond {
    const std::uint64_t* row_keys;
    std::uint64_t count; // rows of outer
    run_view outer, inner;
    const std::uint64_t* inner_row; // of each row; null: the same number
    std::uint32_t scale;
    std::uint32_t* counts = nullptr;
    const std::uint64_t* first = nullptr;
    std::uint64_t* keys = nullptr;
    std::uint32_t* rows = nullptr;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint32_t made = 0;
        if (i < count) {
            std::uint64_t in = 0, in_end = 0;
            if (inner.first != nullptr) {
                const std::uint64_t row = inner_row == nullptr ? i : inner_row[i];
                in = inner.first[row];
                in_end = inner.first[row + 1];
            }
            for (std::uint64_t o = outer.first[i]; o < outer.first[i + 1]; o += 2) {
                std::uint32_t x = outer.bounds[o];
                const std::uint32_t end = outer.bounds[o + 1];
                for (; in < in_end && inner.bounds[in] * scale < end; in += 2) {
                    add(i, made, x, inner.bounds[in] * scale);
                    x = inner.bounds[in + 1] * scale;
                }
                add(i, made, x, end);
            }
        }
        if (counts != nullptr) counts[i] = made;
    }

private:
    VOXELPIPE_HD void add(std::uint64_t i, std::uint32_t& made, std::uint32_t begin, std::uint32_t end) const {
        if (counts != nullptr) {
            made += end - begin;
            return;
        }
        for (std::uint32_t x = begin; x < end; ++x, ++made) {
            keys[first[i] + made] = row_keys[i] | spread_bits(x);
            rows[first[i] + made] = static_cast<std::uint32_t>(i);
        }
    }
};

// ---- levels ---------------------------------------------------------------------------------------------------------

// Rows of a level by key, morton_key(0, y, z) of the level's cells.
template <class Backend>
struct row_level {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    buffer<std::uint64_t> keys;
    buffer<std::uint64_t> first_child; // of each row in the level below, and one more; none in the lowest level
    buffer<std::uint64_t> parent;      // of each row in the level above, once that is made

    explicit row_level(Backend& backend)
        : keys(backend, std::size_t{0}), first_child(backend, std::size_t{0}), parent(backend, std::size_t{0}) {}
    [[nodiscard]] std::uint64_t size() const { return keys.size(); }
};

// Puts rows in order.
template <class Backend>
[[nodiscard]] std::pair<row_level<Backend>, run_list<Backend>> sort_rows(Backend& backend, found_rows<Backend>&& found,
                                                                         int key_bits) {
    const std::size_t n = found.places.size();
    typename Backend::template buffer<std::uint32_t> order(backend, n), counts(backend, n + 1);
    backend.for_each(n, number_rows{order.data()});
    backend.sort_by_key(found.places, order, key_bits);
    std::pair<row_level<Backend>, run_list<Backend>> sorted{row_level<Backend>(backend), run_list<Backend>(backend)};
    sorted.first.keys = std::move(found.places);
    run_list<Backend>& runs = sorted.second;
    runs.first = typename Backend::template buffer<std::uint64_t>(backend, n + 1);
    gather_rows gather{order.data(), n, found.runs.view(), counts.data()};
    backend.for_each(n + 1, gather);
    const auto bounds = static_cast<std::size_t>(backend.sum(counts, runs.first));
    runs.bounds = typename Backend::template buffer<std::uint32_t>(backend, bounds);
    gather.counts = nullptr;
    gather.first = runs.first.data();
    gather.bounds = runs.bounds.data();
    backend.for_each(n, gather);
    return sorted;
}

// The rows above those of a level, which learns the numbers of its parents.
template <class Backend>
[[nodiscard]] row_level<Backend> parents_of(Backend& backend, row_level<Backend>& level) {
    const auto n = static_cast<std::size_t>(level.size());
    typename Backend::template buffer<std::uint32_t> is_first(backend, n + 1);
    level.parent = typename Backend::template buffer<std::uint64_t>(backend, n + 1);
    backend.for_each(n + 1, count_parents{level.keys.data(), n, is_first.data()});
    const auto parents = static_cast<std::size_t>(backend.sum(is_first, level.parent));
    row_level<Backend> above(backend);
    above.keys = typename Backend::template buffer<std::uint64_t>(backend, parents);
    above.first_child = typename Backend::template buffer<std::uint64_t>(backend, parents + 1);
    backend.for_each(n, make_row_parents{level.keys.data(), n, is_first.data(), level.parent.data(), above.keys.data(),
                                         above.first_child.data()});
    return above;
}

// Their runs, from those of the level below.
template <bool All, class Backend>
[[nodiscard]] run_list<Backend> runs_of_parents(Backend& backend, const row_level<Backend>& level,
                                                const run_list<Backend>& below) {
    const auto n = static_cast<std::size_t>(level.size());
    typename Backend::template buffer<std::uint32_t> counts(backend, n + 1);
    run_list<Backend> runs(backend);
    runs.first = typename Backend::template buffer<std::uint64_t>(backend, n + 1);
    join_rows<All> join{level.first_child.data(), n, below.view(), counts.data()};
    backend.for_each(n + 1, join);
    runs.bounds = typename Backend::template buffer<std::uint32_t>(
        backend, static_cast<std::size_t>(backend.sum(counts, runs.first)));
    join.counts = nullptr;
    join.first = runs.first.data();
    join.bounds = runs.bounds.data();
    backend.for_each(n, join);
    return runs;
}

// Cells of a level with their rows.
template <class Backend>
struct cell_list {
    typename Backend::template buffer<std::uint64_t> keys;
    typename Backend::template buffer<std::uint32_t> rows;
};
template <class Backend>
[[nodiscard]] cell_list<Backend> list_cells(Backend& backend, cells_beyond cells) {
    const auto n = static_cast<std::size_t>(cells.count);
    typename Backend::template buffer<std::uint32_t> counts(backend, n + 1);
    typename Backend::template buffer<std::uint64_t> first(backend, n + 1);
    cells.counts = counts.data();
    backend.for_each(n + 1, cells);
    const auto all = static_cast<std::size_t>(backend.sum(counts, first));
    cell_list<Backend> made{{backend, all}, {backend, all}};
    cells.counts = nullptr;
    cells.first = first.data();
    cells.keys = made.keys.data();
    cells.rows = made.rows.data();
    backend.for_each(n, cells);
    return made;
}

} // namespace voxelpipe::core
