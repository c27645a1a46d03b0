// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Which runs of voxels touch each other, word by word. A segment is a run of set bits within a word; it is named by its
// lowest voxel. The four rows around a row that come before it are those at y - 1 (front), at z - 1 (below), and at
// z - 1 with y - 1 (below_front) and y + 1 (below_back).

#include <voxelpipe/core/disjoint_sets.hpp>
#include <voxelpipe/core/exact.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

template <class Word>
inline constexpr int bits_of_word = 8 * static_cast<int>(sizeof(Word));

// The bits of a row in words of 32 or 64. What lies beyond the row is 0, whatever the padding holds.
template <class Word>
struct bit_row {
    const std::uint32_t* words = nullptr; // in linear layout; null: a row beyond the grid
    int width = 0;                        // voxels

    [[nodiscard]] VOXELPIPE_HD Word operator()(int i) const {
        const int first = i * bits_of_word<Word>, left = width - first;
        if (words == nullptr || i < 0 || left <= 0) return 0;
        Word w = 0;
        if constexpr (sizeof(Word) == 8) {
            const std::uint32_t* const halves = words + 2 * static_cast<std::size_t>(i);
            w = halves[0];
            if (left > 32) w |= Word{halves[1]} << 32;
        } else {
            w = words[i];
        }
        return left < bits_of_word<Word> ? w & ((Word{1} << left) - 1) : w;
    }
};

// The bits of a grid, and the numbers of its voxels.
template <class Word, class Number>
struct bit_rows_of {
    const std::uint32_t* bits; // in linear layout
    glm::ivec3 extent;

    [[nodiscard]] VOXELPIPE_HD int row_words() const {
        return (extent.x + bits_of_word<Word> - 1) / bits_of_word<Word>;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rows() const {
        return static_cast<std::uint64_t>(extent.y) * static_cast<std::uint64_t>(extent.z);
    }
    // Empty beyond the grid.
    [[nodiscard]] VOXELPIPE_HD bit_row<Word> row(int y, int z) const {
        if (y < 0 || z < 0 || y >= extent.y || z >= extent.z) return {};
        const std::size_t number =
            static_cast<std::size_t>(z) * static_cast<std::size_t>(extent.y) + static_cast<std::size_t>(y);
        return {bits + number * static_cast<std::size_t>((extent.x + 31) / 32), extent.x};
    }
    // Number of voxel (0, y, z). Of a row beyond the grid it means nothing.
    [[nodiscard]] VOXELPIPE_HD Number first_voxel(int y, int z) const {
        return (static_cast<Number>(z) * static_cast<Number>(extent.y) + static_cast<Number>(y)) *
               static_cast<Number>(extent.x);
    }
};

// A word, and those beside it in its row.
template <class Word>
struct word_window {
    Word before = 0, now = 0, after = 0;

    // Bit x is that of voxel x - 1.
    [[nodiscard]] VOXELPIPE_HD Word low() const { return now << 1 | before >> (bits_of_word<Word> - 1); }
    // Bit x is that of voxel x + 1.
    [[nodiscard]] VOXELPIPE_HD Word high() const { return now >> 1 | after << (bits_of_word<Word> - 1); }
};

// The lowest bits of the segments of a word.
template <class Word>
[[nodiscard]] VOXELPIPE_HD constexpr Word segment_starts(Word w) {
    return w & ~(w << 1);
}
// The lowest bit of the segment that holds bit x.
template <class Word>
[[nodiscard]] VOXELPIPE_HD inline int segment_start(Word w, int x) {
    const Word gaps = ~w & ((Word{1} << x) - 1);
    if constexpr (sizeof(Word) == 8)
        return exact::bit_width(gaps);
    else
        return gaps == 0 ? 0 : exact::highest_one(gaps) + 1;
}

// Bits x of a word whose segments touch one of another row, at x (same), x - 1 (low) or x + 1 (high): one bit at least
// for each two segments that touch, unless these touch in an earlier word as well.
template <class Word>
struct word_contacts {
    Word same = 0, low = 0, high = 0;

    // is_wide: voxels that differ by one in x touch, too.
    VOXELPIPE_HD word_contacts(const word_window<Word>& a, const word_window<Word>& b, bool is_wide) {
        const Word both = a.now & b.now, both_before = (a.before & b.before) >> (bits_of_word<Word> - 1);
        same = both & ~(both << 1 | both_before);
        if (!is_wide) return;
        // Elsewhere the two segments touch at x, or at the neighbour, as well.
        low = a.now & ~a.low() & ~b.now & b.low();
        high = a.now & ~a.high() & ~b.now & b.high();
    }
};

// A word, and the words at its place in the rows before. Rows that do not count are empty.
template <class Word>
struct near_words {
    word_window<Word> here, front, below, below_front, below_back;
};
// The numbers of the voxels at bit 0 of these words.
template <class Number>
struct near_numbers {
    Number here, front, below, below_front, below_back;
};

// Rows whose segments are joined with those of a row: all that the connectivity has, or some of them.
struct near_rows {
    bool front, below, below_front, below_back;
};

// Joins the segments of a word with those of other rows that touch them, through faces (connectivity 6), edges (18) or
// corners (26). Segments that touch are left out where others join them: two voxels across an edge or a corner of a
// cube both touch a third one between them, and of four voxels around an edge three pairs suffice. Alone: no other
// thread changes these sets.
template <bool Alone, class Word, class Number>
VOXELPIPE_HD inline void join_word(const disjoint_sets<Number>& sets, const near_words<Word>& w,
                                   const near_numbers<Number>& first, int connectivity, const near_rows& rows) {
    constexpr int top = bits_of_word<Word> - 1;
    const auto join = [&](Number a, Number b) {
        if constexpr (Alone)
            sets.join_alone(a, b);
        else
            sets.join(a, b);
    };
    const auto join_all = [&](const word_window<Word>& other, Number other_first, const word_contacts<Word>& at) {
        for (Word left = at.same; left != 0; left &= left - 1) {
            const int x = exact::lowest_one(left);
            join(first.here + static_cast<Number>(segment_start(w.here.now, x)),
                 other_first + static_cast<Number>(segment_start(other.now, x)));
        }
        for (Word left = at.low; left != 0; left &= left - 1) {
            const int x = exact::lowest_one(left);
            const Number touched = x == 0 ? other_first - static_cast<Number>(top + 1) +
                                                static_cast<Number>(segment_start(other.before, top))
                                          : other_first + static_cast<Number>(segment_start(other.now, x - 1));
            join(first.here + static_cast<Number>(x), touched);
        }
        for (Word left = at.high; left != 0; left &= left - 1) {
            const int x = exact::lowest_one(left);
            join(first.here + static_cast<Number>(segment_start(w.here.now, x)),
                 other_first + static_cast<Number>(x + 1));
        }
    };
    const bool has_edges = connectivity >= 18, has_corners = connectivity == 26;
    if (rows.front) join_all(w.front, first.front, {w.here, w.front, has_edges});
    if (rows.below) {
        word_contacts<Word> at(w.here, w.below, has_edges);
        at.same &= ~(w.front.now & w.below_front.now);
        join_all(w.below, first.below, at);
    }
    if (!has_edges) return;
    if (rows.below_front) {
        word_contacts<Word> at(w.here, w.below_front, has_corners);
        at.same &= ~(w.front.now | w.below.now);
        at.low &= ~(w.front.now | w.front.low() | w.below.now | w.below.low());
        at.high &= ~(w.front.now | w.front.high() | w.below.now | w.below.high());
        join_all(w.below_front, first.below_front, at);
    }
    if (rows.below_back) {
        word_contacts<Word> at(w.here, w.below_back, has_corners);
        at.same &= ~w.below.now;
        at.low &= ~(w.below.now | w.below.low());
        at.high &= ~(w.below.now | w.below.high());
        join_all(w.below_back, first.below_back, at);
    }
}

} // namespace voxelpipe::core
