// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a triangle in one brick of 8^3 voxels. Rows lie along the axis of the normal's least
// component, along which the plane is longest, so that they are few. A brick's tests are those of
// small_conservative.hpp, with the brick's lowest voxel as the origin. Axes here are (row, across, deep): the row's
// axis and the two that follow it, modulo 3; coverage does not depend on the names of axes.

#include <voxelpipe/core/brick_triangle.hpp>

#include <cstdint>

namespace voxelpipe::core {

inline constexpr int mask_brick_size = 8;

// The axis of the least component of a normal, the first of equals.
template <class Normal>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr int row_axis(const Normal& n) {
    const auto x = magnitude(n[0]), y = magnitude(n[1]), z = magnitude(n[2]);
    return x <= y && x <= z ? 0 : y <= z ? 1 : 2;
}
// Component i of (row, across, deep), and which component an axis is.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr int axis_of_row(int row, int i) {
    return row + i >= 3 ? row + i - 3 : row + i;
}
template <class T>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr triple<T> turn_to_row(int row, const T& x, const T& y,
                                                                            const T& z) {
    return {row == 0 ? x : row == 1 ? y : z, row == 0 ? y : row == 1 ? z : x, row == 0 ? z : row == 1 ? x : y};
}

// A setup gives a brick, by its offset from the lowest voxel of the triangle's bounding box, in the setup's axes:
//   half(k, u, v)     half-plane k with (u, v) as the origin: 0 to 2 of (row, across), 3 to 5 of (across, deep), 6 to 8
//                     of (deep, row)
//   normal(i)         of the plane
//   plane(o, below, above)   as in small_conservative, with o as the origin
// Numbers that exceed what a brick can change are cut off, with their sign.

// True if the triangle can have voxels in the brick; never false if it has some.
template <class Setup>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets_mask_brick(const Setup& s, const triple<int>& o) {
    std::int32_t least = 0;
    for (int k = 0; k < 9; ++k) {
        const int i = k / 3, j = i == 2 ? 0 : i + 1;
        const small_half_plane h = s.half(k, o[i], o[j]);
        least |= h.c + (mask_brick_size - 1) * ((h.a > 0 ? h.a : 0) + (h.b > 0 ? h.b : 0));
    }
    std::int64_t below = 0, above = 0, high = 0, low = 0;
    s.plane(o, below, above);
    for (int i = 0; i < 3; ++i) {
        const std::int64_t n = s.normal(i);
        high += (mask_brick_size - 1) * positive_part(n);
        low += (mask_brick_size - 1) * negative_part(n);
    }
    return least >= 0 && ((below + high) | (above - low)) >= 0;
}
// Coverage in a brick that the triangle meets.
template <class Setup>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE small_conservative in_mask_brick(const Setup& s, const triple<int>& o) {
    small_conservative q;
    for (int k = 0; k < 3; ++k) {
        q.xy[k] = s.half(k, o[0], o[1]);
        q.yz[k] = s.half(3 + k, o[1], o[2]);
        q.zx[k] = s.half(6 + k, o[2], o[0]);
        q.n[k] = s.normal(k);
    }
    s.plane(o, q.below, q.above);
    return q;
}

// The setup of a triangle of any size whose bounding box has at most 2^mask_edge_bits units a side. Widths: edges 25
// bits; within a brick, and as many voxels beyond it, a half-plane changes by less than 2^29.5 and the plane by less
// than 2^56; the plane's constants take 128 bits.
struct mask_triangle {
    static constexpr int max_edge_bits = 25;
    int row; // the axis of rows
    std::int32_t a[9], b[9];
    std::int64_t c[9], n[3];
    int128 below, above; // at the lowest voxel of the bounding box

    [[nodiscard]] VOXELPIPE_HD static constexpr bool fits(const snapped_position& p, const snapped_position& q,
                                                          const snapped_position& r) {
        constexpr std::int64_t most = std::int64_t{1} << max_edge_bits;
        return max3(p.x, q.x, r.x) - min3(p.x, q.x, r.x) <= most && max3(p.y, q.y, r.y) - min3(p.y, q.y, r.y) <= most &&
               max3(p.z, q.z, r.z) - min3(p.z, q.z, r.z) <= most;
    }

    mask_triangle() = default;
    // lowest: the lowest voxel of the bounding box. Only for triangles that fit.
    VOXELPIPE_HD mask_triangle(const snapped_position& p0, const snapped_position& p1, const snapped_position& p2,
                               const triple<std::int64_t>& lowest, int fraction) {
        const snapped_position corners[3] = {p0, p1, p2};
        const std::int64_t x = lowest[0] << fraction, y = lowest[1] << fraction, z = lowest[2] << fraction;
        const auto normal = cross({{p1.x - p0.x, p1.y - p0.y, p1.z - p0.z}}, {{p2.x - p0.x, p2.y - p0.y, p2.z - p0.z}});
        row = row_axis(normal);
        triple<std::int64_t> p[3];
        for (int i = 0; i < 3; ++i)
            p[i] = turn_to_row<std::int64_t>(row, corners[i].x - x, corners[i].y - y, corners[i].z - z);
        const auto turned = turn_to_row(row, normal[0], normal[1], normal[2]);
        int128 at_plane = 0;
        std::int64_t positive = 0, negative = 0;
        for (int i = 0; i < 3; ++i) {
            n[i] = turned[i];
            at_plane += static_cast<int128>(n[i]) * p[0][i];
            positive += positive_part(n[i]);
            negative += negative_part(n[i]);
        }
        for (int k = 0; k < 9; ++k) {
            const int i = k / 3, j = i == 2 ? 0 : i + 1, from = k % 3, to = from == 2 ? 0 : from + 1;
            const int sign = n[3 - i - j] < 0 ? -1 : 1;
            const std::int64_t across = sign * (p[from][j] - p[to][j]), along = sign * (p[to][i] - p[from][i]);
            a[k] = static_cast<std::int32_t>(across);
            b[k] = static_cast<std::int32_t>(along);
            c[k] = exact::floor_shift(-(across * p[from][i] + along * p[from][j]), fraction) + positive_part(across) +
                   positive_part(along);
        }
        below = positive - exact::ceil_shift(at_plane, fraction);
        above = exact::floor_shift(at_plane, fraction) - negative;
    }

    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE small_half_plane half(int k, int u, int v) const {
        return {a[k], b[k],
                static_cast<std::int32_t>(cut<std::int64_t, 30>(static_cast<std::int64_t>(a[k]) * u +
                                                                static_cast<std::int64_t>(b[k]) * v + c[k]))};
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int64_t normal(int i) const { return n[i]; }
    VOXELPIPE_HD VOXELPIPE_INLINE void plane(const triple<int>& o, std::int64_t& to_below,
                                             std::int64_t& to_above) const {
        const int128 depth =
            static_cast<int128>(n[0]) * o[0] + static_cast<int128>(n[1]) * o[1] + static_cast<int128>(n[2]) * o[2];
        to_below = static_cast<std::int64_t>(cut<int128, 60>(below + depth));
        to_above = static_cast<std::int64_t>(cut<int128, 60>(above - depth));
    }

    // The range of voxels along an axis in which the plane can pass the column of 8 x 8 voxels at (u, v) along the two
    // axes that follow it, from the lowest voxel of the box; widened by one voxel. It only selects what to test, so its
    // roundings do not matter.
    VOXELPIPE_HD VOXELPIPE_INLINE void depths(int axis, int u, int v, double& first, double& last) const {
        const int of_w = axis_of_row(3 - row, axis); // which of n
        const int of_u = axis_of_row(of_w, 1), of_v = axis_of_row(of_w, 2);
        const auto nu = static_cast<double>(n[of_u]), nv = static_cast<double>(n[of_v]),
                   nw = static_cast<double>(n[of_w]);
        first = -1e9;
        last = 1e9;
        if (n[of_w] == 0) return;
        constexpr double side = mask_brick_size - 1;
        const double sum = nu * u + nv * v;
        const double low = sum + side * ((nu < 0 ? nu : 0) + (nv < 0 ? nv : 0)),
                     high = sum + side * ((nu > 0 ? nu : 0) + (nv > 0 ? nv : 0));
        const double from = (-static_cast<double>(below) - high) / nw, to = (static_cast<double>(above) - low) / nw;
        first = (from < to ? from : to) - 1.0;
        last = (from < to ? to : from) + 1.0;
    }

private:
    [[nodiscard]] VOXELPIPE_HD static triple<std::int64_t> cross(const triple<std::int64_t>& e,
                                                                 const triple<std::int64_t>& f) {
        return {{e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]}};
    }
    template <class T, int Bits>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE static T cut(T value) {
        constexpr T most = T{1} << Bits;
        return value > most ? most : value < -most ? -most : value;
    }
};

// The rows of a brick that may have voxels, by parts of their coverage (small_conservative.hpp): bytes of 8 voxels
// along the rows' axis within one projection at each place across, and within another at each place deep; and a bit
// across + 8 deep for each row within the third. A row's coverage is what both bytes and the plane leave.
struct mask_rows {
    std::uint64_t by_across = 0, by_deep = 0, met = 0;

    mask_rows() = default;
    // part: the voxels of the brick that are wanted, in the setup's axes; not empty.
    VOXELPIPE_HD VOXELPIPE_INLINE mask_rows(const small_conservative& s, const small_box& part) {
        const std::uint32_t along = ((2u << part.hi[0]) - 1) & ~((1u << part.lo[0]) - 1),
                            across = ((2u << part.hi[1]) - 1) & ~((1u << part.lo[1]) - 1);
        for (int y = part.hi[1]; y >= part.lo[1]; --y) by_across = by_across << 8 | (along & s.limits_at_y<8>(7, y));
        for (int z = part.hi[2]; z >= part.lo[2]; --z) {
            by_deep = by_deep << 8 | (along & s.limits_at_z<8>(7, z));
            met = met << 8 | (across & s.rows_at_z<8>(7, z));
        }
        by_across <<= 8 * part.lo[1];
        by_deep <<= 8 * part.lo[2];
        met <<= 8 * part.lo[2];
    }
};

// Puts the bits of a row into its brick's mask (brick_table.hpp), taken as 16 words of 32 bits. `bits` has a bit for
// each of the 8 voxels along axis `row`, at (across, deep). Calls set(word, bits) for each of up to four words' parts
// that has any.
template <class Set>
VOXELPIPE_HD VOXELPIPE_INLINE void place_mask_row(int row, int across, int deep, std::uint32_t bits, const Set& set) {
    const int of_across = axis_of_row(row, 1), of_deep = axis_of_row(row, 2);
    const auto y = static_cast<unsigned>(across), z = static_cast<unsigned>(deep);
    const unsigned first = (y >> 2) << (of_across + 1) | (z >> 2) << (of_deep + 1), one = 1u << row;
    // Place in a block of 4^3: bits 0 and 1 of a coordinate are 3 apart; the highest says which half of 64 bits.
    const unsigned place =
        (y & 1u) << of_across | (y & 2u) << (of_across + 2) | (z & 1u) << of_deep | (z & 2u) << (of_deep + 2);
    for (unsigned k = 0; k < 4; ++k) {
        const std::uint32_t two = bits >> (2 * k) & 3u;
        if (two == 0) continue;
        const unsigned at = place | (k & 1u) << (row + 3);
        set(first | (k >> 1) << (row + 1) | at >> 5, ((two & 1u) | (two >> 1) << one) << (at & 31u));
    }
}

} // namespace voxelpipe::core
