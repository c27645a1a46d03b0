// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The tessellator (docs/design.md, "Tessellation"): the triangles and points of a patch with three integer levels.
//
// A patch v0 v1 v2 whose edges v0 v1, v1 v2, v2 v0 have levels l0, l1, l2 is a uniform lattice of n^2 triangles,
// n = max(l0, l1, l2). Row r of its points, from v0, holds r + 1 of them, from the side of v1; row r of its triangles
// holds 2 r + 1, numbers r^2 to r^2 + 2 r. Only points on the patch's edges move: point i of edge e, counted in the
// direction v0 -> v1 -> v2 -> v0, moves to k / l_e with k = floor((2 i l_e + n) / (2 n)), the nearest multiple. A
// triangle with two equal points is left out; its number stays.
//
// As i grows by 1, k grows by 0 or 1, because l_e <= n: so every k of 0 .. l_e is present, and n - l_e steps of an edge
// collapse. For n >= 2 that leaves out sum (n - l_e) triangles: each collapsed step takes the one triangle that holds
// it. A corner's triangle would be counted twice if both its steps collapsed; then the triangle across its third side
// is left out as well, since both of that side's points lie on the corner. (n = 2 has no such corner.)

#include <voxelpipe/core/exact.hpp>

#include <cstdint>

namespace voxelpipe::core {

inline constexpr int max_tessellation_level = 1024;

// A point of a patch.
struct lattice_point {
    enum kind_type : std::uint8_t { corner, edge, interior };
    kind_type kind;
    int which; // corner, or edge
    int a, b;  // edge: it lies at a / b; interior: weights of v1 and v2, times n
    friend constexpr bool operator==(const lattice_point&, const lattice_point&) = default;
};

// Position of a point in the lattice before edges move: row from v0, then from the side of v1.
struct lattice_index {
    int row, column;
    // Points are numbered row by row.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t number() const {
        return static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(row + 1) / 2 +
               static_cast<std::uint32_t>(column);
    }
    // The inverse. 8 number + 1 is below 2^24, so its root is rounded correctly, and that of a square is exact. The
    // other roots of a row stay 2 / (row + 1) below the next one's: their floor is right.
    [[nodiscard]] VOXELPIPE_HD static lattice_index of(std::uint32_t number) {
        const int row = (static_cast<int>(exact::sqrt(static_cast<float>(8 * number + 1))) - 1) / 2;
        return {row, static_cast<int>(number - lattice_index{row, 0}.number())};
    }
};

// The points of a lattice triangle, wound as the patch.
struct lattice_triangle {
    lattice_index p[3];
};

// Triangle `number` of any lattice that has one. Below 2^20, the root of a number that is no square is at least 2^-21
// of it below the next integer.
[[nodiscard]] VOXELPIPE_HD inline lattice_triangle lattice_triangle_of(std::uint32_t number) {
    const int row = static_cast<int>(exact::sqrt(static_cast<float>(number)));
    const int i = static_cast<int>(number) - row * row, c = i / 2;
    if (i % 2 == 0) return {{{row, c}, {row + 1, c}, {row + 1, c + 1}}};
    return {{{row, c}, {row + 1, c + 1}, {row, c + 1}}};
}

class lattice {
public:
    // Levels are 1 to max_tessellation_level.
    VOXELPIPE_HD constexpr lattice(int l0, int l1, int l2)
        : level_{l0, l1, l2}, n_(l0 > l1   ? l0 > l2 ? l0 : l2
                                 : l1 > l2 ? l1
                                           : l2) {}

    // In 30 bits, and back.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t packed() const {
        return static_cast<std::uint32_t>((level_[0] - 1) | (level_[1] - 1) << 10 | (level_[2] - 1) << 20);
    }
    [[nodiscard]] VOXELPIPE_HD static constexpr lattice unpack(std::uint32_t p) {
        return {static_cast<int>(p & 1023) + 1, static_cast<int>(p >> 10 & 1023) + 1, static_cast<int>(p >> 20) + 1};
    }

    [[nodiscard]] VOXELPIPE_HD constexpr int size() const { return n_; }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t num_triangles() const {
        return static_cast<std::uint32_t>(n_) * static_cast<std::uint32_t>(n_);
    }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t num_points() const { return lattice_index{n_ + 1, 0}.number(); }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t num_left_out() const {
        return n_ == 1 ? 0 : static_cast<std::uint32_t>(3 * n_ - level_[0] - level_[1] - level_[2]);
    }
    [[nodiscard]] VOXELPIPE_HD constexpr lattice_point point(const lattice_index& i) const {
        if (i.column == 0) return on_edge(0, i.row);
        if (i.row == n_) return on_edge(1, i.column);
        if (i.column == i.row) return on_edge(2, n_ - i.row);
        return {lattice_point::interior, 0, i.row - i.column, i.column};
    }
    [[nodiscard]] VOXELPIPE_HD constexpr bool is_left_out(const lattice_triangle& t) const {
        const lattice_point a = point(t.p[0]), b = point(t.p[1]), c = point(t.p[2]);
        return a == b || b == c || c == a;
    }

private:
    // Point i of an edge, from its first corner.
    [[nodiscard]] VOXELPIPE_HD constexpr lattice_point on_edge(int e, int i) const {
        const int k = (2 * i * level_[e] + n_) / (2 * n_);
        if (k == 0) return {lattice_point::corner, e, 0, 0};
        if (k == level_[e]) return {lattice_point::corner, e == 2 ? 0 : e + 1, 0, 0};
        return {lattice_point::edge, e, k, level_[e]};
    }

    int level_[3], n_;
};

} // namespace voxelpipe::core
