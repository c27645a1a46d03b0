// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The cells that a surface passes, by words of 32 cells along x: of each word with such a cell a few masks, so that
// numbers of cells, vertices and crossed edges are a word's first number and a count of bits. Words without a cell cost
// a bit. The GPU's kernels work on these words (device/word_cells.cuh).

#include <voxelpipe/surfaces/passes/cells.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// A word with an active cell. Bit i of a mask is its cell i.
struct alignas(32) surface_word {
    std::uint64_t first_edge; // of the crossed edges that begin at the lowest samples of its cells
    std::uint32_t first_vertex, first_cell;
    std::uint32_t active; // cells that the surface passes
    std::uint32_t more;   // cells of 2 or 4 sheets
    std::uint32_t many;   // cells of 3 or 4 sheets
    std::uint32_t linked; // cells with one sheet, which goes on in the cell before it, which has one sheet too

    [[nodiscard]] VOXELPIPE_HD static std::uint32_t below(int bit) { return (std::uint32_t{1} << bit) - 1; }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t single() const { return active & ~(more | many); }
    [[nodiscard]] VOXELPIPE_HD bool has_several(int bit) const { return ((more | many) >> bit & 1) != 0; }
    [[nodiscard]] VOXELPIPE_HD int num_sheets(int bit) const {
        return 1 + static_cast<int>(more >> bit & 1) + 2 * static_cast<int>(many >> bit & 1);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t num_vertices() const { return vertices_in(~std::uint32_t{0}); }
    // Numbers of a cell, and of its first vertex.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t cell(int bit) const {
        return first_cell + static_cast<std::uint32_t>(exact::count_ones(active & below(bit)));
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t vertex(int bit) const { return first_vertex + vertices_in(below(bit)); }
    // The cell at which the row of linked cells begins that a cell belongs to.
    [[nodiscard]] VOXELPIPE_HD int begin_of_links(int bit) const {
        return exact::highest_one(~linked & (below(bit) | std::uint32_t{1} << bit)); // the first cell is not linked
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t vertices_in(std::uint32_t bits) const {
        return static_cast<std::uint32_t>(exact::count_ones(active & bits) + exact::count_ones(more & bits) +
                                          2 * exact::count_ones(many & bits));
    }
};

// The crossed edges along an axis that begin at the lowest samples of a word's cells, and the faces between its cells
// and those before them along x that the surface passes.
struct alignas(16) word_edges {
    std::uint32_t x, y, z;
    std::uint32_t faces_x;

    [[nodiscard]] VOXELPIPE_HD std::uint32_t along(int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t count() const { return count_in(~std::uint32_t{0}); }
    // Crossed edges of the word before this one, in the order of their numbers.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t before(int bit, int axis) const {
        return count_in(surface_word::below(bit)) + (axis > 0 ? x >> bit & 1 : 0) + (axis > 1 ? y >> bit & 1 : 0);
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t count_in(std::uint32_t bits) const {
        return static_cast<std::uint32_t>(exact::count_ones(x & bits) + exact::count_ones(y & bits) +
                                          exact::count_ones(z & bits));
    }
};
// The faces between a word's cells and those before them along y and z.
struct alignas(8) word_faces {
    std::uint32_t y, z;
};

// Where words lie: a bit a word, 32 words of a row a group, and the number of each group's first word that has a cell.
struct word_groups {
    cell_grid cells;
    const std::uint32_t* masks;
    const std::uint64_t* first;

    [[nodiscard]] VOXELPIPE_HD std::uint32_t groups() const {
        return static_cast<std::uint32_t>(cells.row_words() + 31) / 32;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t count() const { return cells.rows() * groups(); }
    // A word: the number of words with a cell before it, which is its own where it has one.
    struct place {
        std::uint32_t number;
        bool exists;
    };
    // Word w of a row; w is not negative.
    [[nodiscard]] VOXELPIPE_HD place look(int w, int y, int z) const {
        const std::uint64_t group = cells.row(y, z) * groups() + static_cast<std::uint32_t>(w >> 5);
        const std::uint32_t mask = masks[group], below = mask & surface_word::below(w & 31);
        return {static_cast<std::uint32_t>(first[group]) + static_cast<std::uint32_t>(exact::count_ones(below)),
                (mask >> (w & 31) & 1) != 0};
    }
    // Number of a word that has a cell.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t find(int w, int y, int z) const { return look(w, y, z).number; }
};

// Finds cells by their word.
struct grouped_index {
    word_groups groups;
    const surface_word* words; // one more than there are, which counts all

    [[nodiscard]] VOXELPIPE_HD std::uint32_t find(int x, int y, int z) const {
        return words[groups.find(x >> 5, y, z)].cell(x & 31);
    }
    // Number of the first cell of a row, or of what follows it.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t first_cell(std::uint64_t row) const {
        return words[groups.first[row * groups.groups()]].first_cell;
    }
};

} // namespace voxelpipe::core::passes
