// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage of a small triangle in 32-bit integers: the sets of coverage.hpp for a triangle whose bounding box is a few
// voxels, with coordinates relative to that box. This header has what both coverages share (small_conservative.hpp,
// small_thin.hpp). Only the setup multiplies in 64 bits, and the plane, whose normal is an area, is kept in 64.
// Conservative coverage comes as rows of bits along x, whatever the dominant axis: the separating axes (bounding box,
// plane, three projections) do not depend on it. Nothing branches on the triangle's shape.

#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::core {

// ---- widths ---------------------------------------------------------------------------------------------------------
// A side of the bounding box has at most 2^e units of 2^-F voxel, so: normal components 2e bits (twice an area is at
// most the projected box), n . p 3e + 1.6 and doubled for thin 3e + 2.6 bits, edge coefficients e bits, their constants
// after the division by 2^F, and every value within the box and one voxel beyond it, 2e + 3 - F bits.
inline constexpr int small_edge_bits = 20;
inline constexpr int small_max_voxels = 32; // a row is one word

// The most voxels along a side of a small triangle's bounding box.
[[nodiscard]] VOXELPIPE_HD constexpr int small_voxels(int fraction) {
    // Few fraction bits bound the edges of a box of small_max_voxels more closely.
    const int edge_bits = fraction + 5 < small_edge_bits ? fraction + 5 : small_edge_bits;
    if (2 * edge_bits + 3 - fraction > 31) return 0;
    const int n = 1 << (fraction < small_edge_bits ? small_edge_bits - fraction : 0);
    return n < small_max_voxels ? n : small_max_voxels;
}
static_assert(3 * small_edge_bits + 3 <= 63, "the plane of a small triangle would overflow 64 bits");
static_assert(small_voxels(16) == 16 && small_voxels(14) == 32 && small_voxels(12) == 32 && small_voxels(4) == 32);
static_assert(small_max_voxels == 1 << 5 && small_voxels(19) == 2);

// A triangle relative to the corner of the lowest voxel of its bounding box: 0 < p <= 2^small_edge_bits.
struct small_triangle {
    std::int32_t p[3][3]; // [vertex][axis]
};

// The wanted part of the bounding box, inclusive, relative to its lowest voxel.
struct small_box {
    int lo[3], hi[3];
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]; }
};

struct small_half_plane {
    std::int32_t a, b, c;
    [[nodiscard]] VOXELPIPE_HD constexpr std::int32_t at(int x, int y) const { return a * x + b * y + c; }
};

// The three half-planes of the projection on axes (X, Y). The sign of the projected area orients the edges. If the area
// is zero, the closed chain of edges runs along one line in both directions, so exactly that line is left.
template <int X, int Y>
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void small_projection(const small_triangle& t, bool negative, int fraction,
                                                              small_half_plane (&out)[3]) {
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        std::int32_t a = t.p[i][Y] - t.p[j][Y], b = t.p[j][X] - t.p[i][X];
        if (negative) {
            a = -a;
            b = -b;
        }
        const std::int64_t at_vertex =
            static_cast<std::int64_t>(a) * t.p[i][X] + static_cast<std::int64_t>(b) * t.p[i][Y];
        out[i] = {a, b, static_cast<std::int32_t>(-at_vertex >> fraction) + (a > 0 ? a : 0) + (b > 0 ? b : 0)};
    }
}

// The voxels of 2 x 2 inside three half-planes, bit x + 2 y.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::uint32_t quad_bits(const small_half_plane (&e)[3]) {
    std::uint32_t out = 0;
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
            std::int32_t v = 0;
            for (int i = 0; i < 3; ++i) v |= e[i].c + (x != 0 ? e[i].a : 0) + (y != 0 ? e[i].b : 0);
            out |= static_cast<std::uint32_t>(v >> 31) & (1u << (x + 2 * y));
        }
    return ~out & 15u;
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr triple<std::int64_t> small_normal(const small_triangle& t) {
    const std::int64_t e1x = t.p[1][0] - t.p[0][0], e1y = t.p[1][1] - t.p[0][1], e1z = t.p[1][2] - t.p[0][2];
    const std::int64_t e2x = t.p[2][0] - t.p[0][0], e2y = t.p[2][1] - t.p[0][1], e2z = t.p[2][2] - t.p[0][2];
    return {{e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x}};
}

// The dominant axis: that of the largest component, the first of equals; -1 if the area is zero.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr int small_axis(const triple<std::int64_t>& normal) {
    const std::int64_t x = magnitude(normal[0]), y = magnitude(normal[1]), z = magnitude(normal[2]);
    return (x | y | z) == 0 ? -1 : x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

// Determines a fragment's position on a small triangle, and its normal: triangle_frame in fewer bits, relative to the
// lowest voxel of the bounding box.
struct small_frame {
    int axis, fraction;
    bool zero_area;
    triple<std::int32_t> p[3];   // uvw order
    triple<std::int64_t> normal; // (p1 - p0) x (p2 - p0), uvw order

    VOXELPIPE_HD VOXELPIPE_INLINE constexpr small_frame(const small_triangle& t, int fraction_)
        : axis(0), fraction(fraction_), zero_area(false), p{}, normal(small_normal(t)) {
        axis = small_axis(normal);
        zero_area = axis < 0;
        if (zero_area) { // the longest side
            triple<std::int32_t> sides{};
            for (int k = 0; k < 3; ++k)
                sides[k] = max3(t.p[0][k], t.p[1][k], t.p[2][k]) - min3(t.p[0][k], t.p[1][k], t.p[2][k]);
            axis = sides[0] >= sides[1] && sides[0] >= sides[2] ? 0 : sides[1] >= sides[2] ? 1 : 2;
        }
        for (int i = 0; i < 3; ++i) p[i] = to_uvw(axis, t.p[i][0], t.p[i][1], t.p[i][2]);
        normal = to_uvw(axis, normal[0], normal[1], normal[2]);
    }
};

// Bit x is set if three linear functions of x are all >= 0, for x = 0 .. Length - 1. e: their values at x = Length - 1;
// s: their steps. Without branches, and from the last one down, so that one shift of two words moves each sign to its
// bit. The caller masks bits beyond the row; up to 63 voxels from the corner of a box of at most 32, values stay below
// 2^28.
template <int Length>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::uint32_t
small_line(std::int32_t e0, std::int32_t e1, std::int32_t e2, std::int32_t s0, std::int32_t s1, std::int32_t s2) {
    std::uint32_t outside = 0;
    for (int x = Length; x > 0; --x) {
        outside = outside << 1 | static_cast<std::uint32_t>(e0 | e1 | e2) >> 31;
        e0 -= s0;
        e1 -= s1;
        e2 -= s2;
    }
    return ~outside;
}
// The columns in which rows of at most 32 enter and leave three half-planes, row after row. A half-plane e + a u ends
// at u = -e / a; wanted is the next integer beyond. The nearest integer, by floats, is tested by one product, which
// distinguishes it from its neighbour. |e| < 2^28, so a quotient from -16 to 48, the range of interest, is off by less
// than 2^-15.
struct small_row_ends {
    std::int32_t at[3], step[3], slope[3]; // at the next row's first column; from row to row; from column to column
    float inverse[3];                      // -1 / (64 slope); a slope of zero ends at infinity

    // Rows v0, v0 + row_step, ... from column u0 on, of half-planes on (u, v) or, if `turned`, on (v, u).
    VOXELPIPE_HD VOXELPIPE_INLINE small_row_ends(const small_half_plane (&e)[3], bool turned, int u0, int v0,
                                                 int row_step) {
        for (int i = 0; i < 3; ++i) {
            slope[i] = turned ? e[i].b : e[i].a;
            const std::int32_t across = turned ? e[i].a : e[i].b;
            at[i] = slope[i] * u0 + across * v0 + e[i].c;
            step[i] = across * row_step;
            inverse[i] = -exact::near_inverse(exact::mul(64.0f, static_cast<float>(slope[i])));
        }
    }
    // The covered columns of the next row, within 0 .. last, last < 32.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t next(int last) {
        std::int32_t first = 0;
        for (int i = 0; i < 3; ++i) {
            const float quotient = exact::fma_saturated(static_cast<float>(at[i]), inverse[i], 0.25f);
            const float sum = exact::fma(quotient, 64.0f, 12582912.0f - 16.0f);
            const std::int32_t n = core::bit_cast<std::int32_t>(sum) - exact::integer_shift;
            const std::int32_t outside = (at[i] + slope[i] * n) >> 31; // -1 or 0
            const bool leaves = slope[i] < 0;
            const std::int32_t end = n + (leaves ? outside : -outside), low = end - (leaves ? 1024 : 0),
                               high = end + (leaves ? 0 : 1024);
            first = first > low ? first : low;
            last = last < high ? last : high;
            at[i] += step[i];
        }
        return first > last ? 0 : ((2u << last) - 1) & (~0u << first);
    }
};

// a * b for 0 <= b < 2^32, modulo 2^64: two 32-bit multiplications.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::int64_t times(std::int64_t a, int b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) * static_cast<std::uint32_t>(b));
}

// Exact for |a| < 2^22; one integer addition and one of floats.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float small_to_float(std::int32_t a) {
    constexpr std::uint32_t shift = 0x4b400000u; // 1.5 * 2^23
    return exact::sub(core::bit_cast<float>(shift + static_cast<std::uint32_t>(a)), 12582912.0f);
}

} // namespace voxelpipe::core
