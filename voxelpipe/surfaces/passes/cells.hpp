// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells that a surface passes: functors for a backend's for_each. Cell (x, y, z) has the samples from (x - 1, y -
// 1, z - 1) to (x, y, z), so that cells are numbered from 0 and there is one more of them than of samples along an
// axis. Samples beyond the grid are outside.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/surfaces/core/cell_table.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core::passes {

// A bit a sample: 32 along x a word, rows padded to words.
struct sample_bits {
    const std::uint32_t* words;
    int nx, ny, nz;

    [[nodiscard]] VOXELPIPE_HD int row_words() const { return (nx + 31) / 32; }
    // Word w of a row; 0 beyond the grid.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t word(int w, int y, int z) const {
        if (w < 0 || y < 0 || z < 0 || w >= row_words() || y >= ny || z >= nz) return 0;
        const std::size_t row =
            static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y);
        const std::uint32_t all = words[row * static_cast<std::size_t>(row_words()) + static_cast<std::size_t>(w)];
        const int left = nx - 32 * w;
        return left < 32 ? all & ((1u << left) - 1) : all;
    }
    [[nodiscard]] VOXELPIPE_HD bool inside(int x, int y, int z) const {
        if (x < 0) return false;
        return (word(x >> 5, y, z) >> (x & 31) & 1) != 0;
    }
    // The corners of a cell as bits.
    [[nodiscard]] VOXELPIPE_HD int corners(int x, int y, int z) const {
        int c = 0;
        for (int i = 0; i < 8; ++i)
            if (inside(x - 1 + (i & 1), y - 1 + (i >> 1 & 1), z - 1 + (i >> 2))) c |= 1 << i;
        return c;
    }
};

// Position of a cell in one number, ordered as cell numbers are: by z, then y, then x.
struct cell_key {
    std::uint64_t key;
    [[nodiscard]] VOXELPIPE_HD static cell_key of(int x, int y, int z) {
        return {static_cast<std::uint64_t>(x) | static_cast<std::uint64_t>(y) << 21 |
                static_cast<std::uint64_t>(z) << 42};
    }
    [[nodiscard]] VOXELPIPE_HD int x() const { return static_cast<int>(key & 0x1fffff); }
    [[nodiscard]] VOXELPIPE_HD int y() const { return static_cast<int>(key >> 21 & 0x1fffff); }
    [[nodiscard]] VOXELPIPE_HD int z() const { return static_cast<int>(key >> 42); }
};

// The four rows of samples of 32 cells, and the same moved so that bit i is the lower sample of cell i along x.
struct cell_rows {
    std::uint32_t high[4], low[4]; // rows y - 1 + (i & 1), z - 1 + (i >> 1)

    VOXELPIPE_HD cell_rows(const sample_bits& s, int w, int y, int z) {
        for (int i = 0; i < 4; ++i) {
            const int ry = y - 1 + (i & 1), rz = z - 1 + (i >> 1);
            high[i] = s.word(w, ry, rz);
            low[i] = high[i] << 1 | s.word(w - 1, ry, rz) >> 31;
        }
    }
    // Cells whose samples differ.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t active() const {
        std::uint32_t any = 0, all = ~0u;
        for (int i = 0; i < 4; ++i) {
            any |= high[i] | low[i];
            all &= high[i] & low[i];
        }
        return any & ~all;
    }
    // Corners of the cell of a bit.
    [[nodiscard]] VOXELPIPE_HD int corners(int bit) const {
        std::uint32_t c = 0;
        for (int i = 0; i < 4; ++i) c |= (low[i] >> bit & 1) << (2 * i) | (high[i] >> bit & 1) << (2 * i + 1);
        return static_cast<int>(c);
    }
};

// The layers of samples, or of cells, whose counts are wanted: a slab shares some with its neighbours.
struct counted_layers {
    int first = 0, end = 0x7fffffff;
    [[nodiscard]] VOXELPIPE_HD bool has(int z) const { return z >= first && z < end; }
    // The cells whose lowest samples lie in these layers. The cells below the grid belong to its lowest layer.
    [[nodiscard]] counted_layers cells() const {
        return {first == 0 ? 0 : first + 1, end == 0x7fffffff ? end : end + 1};
    }
};

// All cells of a grid of samples, in rows along x of 32 cells a word.
struct cell_grid {
    sample_bits samples;

    [[nodiscard]] VOXELPIPE_HD int row_words() const { return (samples.nx + 32) / 32; }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rows() const {
        return static_cast<std::uint64_t>(samples.ny + 1) * static_cast<std::uint64_t>(samples.nz + 1);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t row(int y, int z) const {
        return static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(samples.ny + 1) +
               static_cast<std::uint64_t>(y);
    }
    [[nodiscard]] VOXELPIPE_HD int y(std::uint64_t row) const {
        return static_cast<int>(row % static_cast<std::uint64_t>(samples.ny + 1));
    }
    [[nodiscard]] VOXELPIPE_HD int z(std::uint64_t row) const {
        return static_cast<int>(row / static_cast<std::uint64_t>(samples.ny + 1));
    }
};

// Number of cells of row i that the surface passes; 0 for i = rows().
struct count_active_cells {
    cell_grid cells;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint32_t n = 0;
        if (i < cells.rows()) {
            const int y = cells.y(i), z = cells.z(i);
            for (int w = 0; w < cells.row_words(); ++w)
                n += static_cast<std::uint32_t>(exact::count_ones(cell_rows(cells.samples, w, y, z).active()));
        }
        counts[i] = n;
    }
};

// Lists the cells of row i, and for each of its words the number of its first cell.
struct list_active_cells {
    cell_grid cells;
    const std::uint64_t* first_of_row;
    std::uint32_t* first_of_word;
    std::uint64_t* keys;
    std::uint16_t* states; // corners

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const int y = cells.y(i), z = cells.z(i);
        std::uint64_t at = first_of_row[i];
        for (int w = 0; w < cells.row_words(); ++w) {
            first_of_word[i * static_cast<std::uint64_t>(cells.row_words()) + static_cast<std::uint64_t>(w)] =
                static_cast<std::uint32_t>(at);
            const cell_rows rows(cells.samples, w, y, z);
            for (std::uint32_t left = rows.active(); left != 0; left &= left - 1) {
                const int bit = exact::lowest_one(left);
                keys[at] = cell_key::of(32 * w + bit, y, z).key;
                states[at++] = static_cast<std::uint16_t>(rows.corners(bit));
            }
        }
    }
};

// Finds the cells that list_active_cells has listed by their word.
struct word_index {
    cell_grid cells;
    const std::uint32_t* first_of_word;

    [[nodiscard]] VOXELPIPE_HD std::uint32_t find(int x, int y, int z) const {
        const int w = x >> 5;
        const std::uint64_t word =
            cells.row(y, z) * static_cast<std::uint64_t>(cells.row_words()) + static_cast<std::uint64_t>(w);
        const std::uint32_t below = cell_rows(cells.samples, w, y, z).active() & ((1u << (x & 31)) - 1);
        return first_of_word[word] + static_cast<std::uint32_t>(exact::count_ones(below));
    }
    // Number of the first cell of a row, or of what follows it. The rows are below cells.rows().
    [[nodiscard]] VOXELPIPE_HD std::uint64_t first_cell(std::uint64_t row) const {
        return first_of_word[row * static_cast<std::uint64_t>(cells.row_words())];
    }
};

// The cells that a surface passes, in the order of their numbers. An index finds them by position.
template <class Index>
struct indexed_cells {
    Index index;
    const cell_sheets* table;
    const std::uint64_t* keys;
    const std::uint16_t* states;         // corners, and 256 if its joined face is flipped
    const std::uint64_t* first_vertices; // of the cells' sheets
    const std::uint64_t* first_edges;    // of the crossed edges that begin at the cells' lowest samples

    // Number of a cell; it is active.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t find(int x, int y, int z) const { return index.find(x, y, z); }
    [[nodiscard]] VOXELPIPE_HD cell_sheets sheets(std::uint32_t cell) const { return table[states[cell]]; }
    // Number of the crossed edge along `axis` that begins at the cell's lowest sample.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t edge(std::uint32_t cell, int axis) const {
        const int corners = states[cell] & 255;
        std::uint64_t at = first_edges[cell];
        for (int a = 0; a < axis; ++a) at += is_crossed(corners, 4 * a) ? 1U : 0U;
        return at;
    }
    // Number of crossed edge e of a cell.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t crossing(const cell_key& at, int e) const {
        const int corner = edge_corner(e);
        return edge(find(at.x() + (corner & 1), at.y() + (corner >> 1 & 1), at.z() + (corner >> 2)), e >> 2);
    }
};

// The cells of a grid of bits.
using cell_list = indexed_cells<word_index>;

// Calls use(number, axis, low, goes_out) for the crossed edges along Axis that begin at the lowest sample of cell i, or
// with all_axes along all of them: `low` is that sample, and goes_out is true if it is inside.
inline constexpr int all_axes = 3;
template <int Axis, class Cells, class Use>
struct edges_of_cell {
    Cells cells;
    Use use;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto cell = static_cast<std::uint32_t>(i);
        const int corners = cells.states[cell] & 255;
        if (Axis != all_axes && !is_crossed(corners, 4 * Axis)) return;
        const cell_key at{cells.keys[cell]};
        const glm::ivec3 low(at.x() - 1, at.y() - 1, at.z() - 1);
        const bool goes_out = (corners & 1) != 0;
        std::uint64_t number = cells.first_edges[cell];
        for (int axis = 0; axis < 3; ++axis) {
            if (!is_crossed(corners, 4 * axis)) continue;
            if (Axis == all_axes || axis == Axis) use(number, axis, low, goes_out);
            ++number;
        }
    }
};

// Decides the flips: a face both of whose segments lie in one sheet in both of its cells. Looks at samples alone, so
// that all are decided on unflipped cells. Counts the sheets, and the crossed edges of the lowest sample. `samples` has
// corners(x, y, z) of any cell.
template <class Samples>
struct flip_cells {
    Samples samples;
    const cell_sheets* table;
    const std::uint64_t* keys;
    std::uint64_t count;
    std::uint16_t* states;
    std::uint32_t *sheets, *edges; // one more than cells; the last is 0

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count) {
            sheets[i] = edges[i] = 0;
            return;
        }
        const int corners = states[i];
        const int face = table[corners].joined_face();
        if (face != cell_sheets::no_face) {
            const cell_key at{keys[i]};
            const int axis = face >> 1, step = (face & 1) != 0 ? 1 : -1;
            const int across = samples.corners(at.x() + (axis == 0 ? step : 0), at.y() + (axis == 1 ? step : 0),
                                               at.z() + (axis == 2 ? step : 0));
            if (table[across].joined_face() == (face ^ 1)) states[i] = static_cast<std::uint16_t>(corners | 256);
        }
        sheets[i] = static_cast<std::uint32_t>(table[states[i]].count());
        edges[i] = (is_crossed(corners, 0) ? 1u : 0u) + (is_crossed(corners, 4) ? 1u : 0u) +
                   (is_crossed(corners, 8) ? 1u : 0u);
    }
};

} // namespace voxelpipe::core::passes
