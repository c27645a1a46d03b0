// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sheets of a cell: how a surface passes a cube of eight samples (docs/design.md, "Surfaces").
//
// Corners are numbered x + 2 y + 4 z. Edges along x are 0 to 3, along y 4 to 7, along z 8 to 11; within an axis the
// lower-numbered other axis runs fastest. Faces are 2 axis + side. An edge is crossed if one of its samples is inside
// and one is not. On each face the crossed edges are paired by segments. A face with four crossed edges is ambiguous:
// each of its segments cuts off one inside sample, or on a flipped face one outside sample. Edges that segments join,
// directly or through others, are one sheet. Sheets are numbered by their lowest edge.

#include <voxelpipe/config.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// The sheets of one of the 256 cells, flipped or not, in 64 bits: 4 bits an edge, then their number, then a face.
struct cell_sheets {
    std::uint64_t bits;

    static constexpr int no_sheet = 15; // of an edge that is not crossed
    static constexpr int no_face = 7;

    // Sheet of an edge.
    [[nodiscard]] VOXELPIPE_HD constexpr int of_edge(int e) const { return static_cast<int>(bits >> (4 * e) & 15); }
    // Number of sheets, 0 to 4.
    [[nodiscard]] VOXELPIPE_HD constexpr int count() const { return static_cast<int>(bits >> 48 & 15); }
    // The ambiguous face both of whose segments lie in one sheet; no cell has two such faces. no_face: the cell has no
    // such face.
    [[nodiscard]] VOXELPIPE_HD constexpr int joined_face() const { return static_cast<int>(bits >> 52 & 15); }
};

// Number of an edge along `axis`: low and high are its coordinates, 0 or 1, along the lower- and the higher-numbered
// other axis.
[[nodiscard]] VOXELPIPE_HD constexpr int cell_edge(int axis, int low, int high) { return 4 * axis + low + 2 * high; }
// The other two axes, the lower-numbered one first.
[[nodiscard]] VOXELPIPE_HD constexpr int low_axis(int axis) { return axis == 0 ? 1 : 0; }
[[nodiscard]] VOXELPIPE_HD constexpr int high_axis(int axis) { return axis == 2 ? 1 : 2; }
// The lower corner of an edge.
[[nodiscard]] VOXELPIPE_HD constexpr int edge_corner(int e) {
    return (e & 1) << low_axis(e >> 2) | (e >> 1 & 1) << high_axis(e >> 2);
}
[[nodiscard]] VOXELPIPE_HD constexpr bool is_crossed(int corners, int e) {
    const int c = edge_corner(e);
    return ((corners >> c ^ corners >> (c + (1 << (e >> 2)))) & 1) != 0;
}

// A face: corner i and the edge from it to corner i + 1, around it.
struct cell_face {
    std::array<int, 4> corner, edge;
};
[[nodiscard]] constexpr cell_face face_of_cell(int face) {
    const int axis = face >> 1, side = face & 1, b = low_axis(axis), d = high_axis(axis);
    const auto corner = [=](int along_b, int along_d) { return side << axis | along_b << b | along_d << d; };
    // An edge along b has `axis` and d as its other axes, and one along d has `axis` and b.
    const auto along_b = [=](int at_d) { return axis < d ? cell_edge(b, side, at_d) : cell_edge(b, at_d, side); };
    const auto along_d = [=](int at_b) { return axis < b ? cell_edge(d, side, at_b) : cell_edge(d, at_b, side); };
    return {{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)}, {along_b(0), along_d(1), along_b(1), along_d(0)}};
}

// The sheets of a cell whose corners have these bits; `flipped`: its flipped face, or no_face.
[[nodiscard]] constexpr cell_sheets find_sheets(int corners, int flipped) {
    std::array<int, 12> root{};
    for (int e = 0; e < 12; ++e) root[static_cast<std::size_t>(e)] = e;
    const auto join = [&](int a, int b) {
        const int from = root[static_cast<std::size_t>(a)], to = root[static_cast<std::size_t>(b)];
        for (int& r : root)
            if (r == from) r = to;
    };
    for (int f = 0; f < 6; ++f) {
        const cell_face face = face_of_cell(f);
        int crossed = 0, first = -1;
        for (const int e : face.edge) {
            if (!is_crossed(corners, e)) continue;
            ++crossed;
            if (first < 0) first = e;
        }
        for (std::size_t i = 0; i < 4 && crossed != 0; ++i) {
            const int before = face.edge[(i + 3) % 4], after = face.edge[i];
            const bool inside = (corners >> face.corner[i] & 1) != 0;
            if (crossed == 4 && inside == (f != flipped)) join(before, after);
            if (crossed == 2 && is_crossed(corners, after)) join(after, first);
        }
    }
    cell_sheets result{0};
    int count = 0;
    std::array<int, 12> number{};
    number.fill(-1);
    for (int e = 0; e < 12; ++e) {
        std::uint64_t sheet = cell_sheets::no_sheet;
        if (is_crossed(corners, e)) {
            int& n = number[static_cast<std::size_t>(root[static_cast<std::size_t>(e)])];
            if (n < 0) n = count++;
            sheet = static_cast<std::uint64_t>(n);
        }
        result.bits |= sheet << (4 * e);
    }
    std::uint64_t joined = cell_sheets::no_face;
    for (int f = 0; f < 6; ++f) {
        bool one = true;
        const cell_face face = face_of_cell(f);
        for (const int e : face.edge)
            one = one && is_crossed(corners, e) && result.of_edge(e) == result.of_edge(face.edge[0]);
        if (one) joined = static_cast<std::uint64_t>(f);
    }
    result.bits |= static_cast<std::uint64_t>(count) << 48 | joined << 52;
    return result;
}

// All cells: entry `corners`, and 256 + corners of the cell with its joined face flipped.
[[nodiscard]] inline std::array<cell_sheets, 512> make_cell_table() {
    std::array<cell_sheets, 512> table{};
    for (int corners = 0; corners < 256; ++corners) {
        const cell_sheets plain = find_sheets(corners, cell_sheets::no_face);
        table[static_cast<std::size_t>(corners)] = plain;
        table[256U + static_cast<std::size_t>(corners)] = find_sheets(corners, plain.joined_face());
    }
    return table;
}

} // namespace voxelpipe::core
