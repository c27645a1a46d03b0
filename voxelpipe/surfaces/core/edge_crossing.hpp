// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where a triangle crosses the edge between two neighbouring samples: exact, from the snapped vertices. The crossing is
// that of solid/core/crossing.hpp, which says that the row of the samples' moved centres meets the triangle and between
// which two of them; here is where.

#include <voxelpipe/core/fixed_point.hpp>

#include <cstdint>

namespace voxelpipe::core {

// A crossing of an edge as surfaces keep it.
struct edge_crossing {
    static constexpr int fraction = 24;                             // bits of t
    static constexpr std::uint32_t middle = 1u << (fraction - 1);   // t of a crossing that nothing places
    static constexpr std::uint32_t no_triangle = ~std::uint32_t{0}; // of a crossing that no triangle of a draw makes
    std::uint32_t t = middle;                                       // from the lower sample, in units of 2^-24
    std::uint32_t triangle = no_triangle;                           // its number in the gathered mesh
    float nx = 0.0f, ny = 0.0f, nz = 0.0f; // outward unit normal in units of the samples' spacing; 0: no normal
};

// A position on an edge: numerator / denominator from the lower sample, 0 to 1. Below 2^98: the denominator is a
// component of a normal, at most 2 * 41 bits, times 2^F.
struct edge_position {
    uint128 numerator, denominator; // the denominator is above 0
};

// Less than 0, 0, or more, as a - b. Continued fractions where products would not fit: both quotients, then the
// reciprocals of what is left.
[[nodiscard]] VOXELPIPE_HD inline int compare(edge_position a, edge_position b) {
    constexpr uint128 narrow = uint128{1} << 63;
    int sign = 1;
    for (;;) {
        if (a.numerator < narrow && a.denominator < narrow && b.numerator < narrow && b.denominator < narrow) {
            const uint128 left = a.numerator * b.denominator, right = b.numerator * a.denominator;
            return left == right ? 0 : left < right ? -sign : sign;
        }
        const uint128 p = a.numerator / a.denominator, q = b.numerator / b.denominator;
        if (p != q) return p < q ? -sign : sign;
        a.numerator -= p * a.denominator;
        b.numerator -= q * b.denominator;
        if (a.numerator == 0 || b.numerator == 0) {
            if (a.numerator == b.numerator) return 0;
            return a.numerator == 0 ? -sign : sign;
        }
        const edge_position rest = a;
        a = {rest.denominator, rest.numerator};
        const edge_position other = b;
        b = {other.denominator, other.numerator};
        sign = -sign;
    }
}

// Rounded to 2^-24, half up.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t round_position(const edge_position& p) {
    constexpr int f = edge_crossing::fraction;
    if ((p.numerator >> (62 - f)) == 0 && (p.denominator >> 62) == 0) {
        const auto n = static_cast<std::uint64_t>(p.numerator), d = static_cast<std::uint64_t>(p.denominator);
        return static_cast<std::uint32_t>(((n << (f + 1)) + d) / (2 * d));
    }
    if ((p.denominator >> 51) == 0) { // the bits of twice the quotient in two parts, which 64 bits can divide
        constexpr int upper = 12, lower = f + 1 - upper;
        const auto n = static_cast<std::uint64_t>(p.numerator), d = static_cast<std::uint64_t>(p.denominator);
        const std::uint64_t high = (n << upper) / d, rest = (n << upper) - high * d, low = (rest << lower) / d;
        return static_cast<std::uint32_t>(((high << lower) + low + 1) >> 1);
    }
    return static_cast<std::uint32_t>(((p.numerator << (f + 1)) + p.denominator) / (2 * p.denominator));
}

// The plane of a triangle: its normal by the right-hand rule, exact, below 2^83 a component.
struct exact_normal {
    int128 x, y, z;
    [[nodiscard]] VOXELPIPE_HD int128 along(int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};
[[nodiscard]] VOXELPIPE_HD inline exact_normal normal_of(const snapped_position& a, const snapped_position& b,
                                                         const snapped_position& c) {
    const int128 ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z, vx = c.x - a.x, vy = c.y - a.y, vz = c.z - a.z;
    return {uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
}

// Where the plane through `a` crosses the edge along `axis` that begins at `sample`, a position in the units of snapped
// vertices; n.along(axis) is not 0. Products of 83 and 41 bits, three of them: less than 2^126. The quotient may lie
// outside of 0 to 1 by the offset of the moved centres only, which is no distance: it is cut off.
[[nodiscard]] VOXELPIPE_HD inline edge_position position_on_edge(const exact_normal& n, const snapped_position& a,
                                                                 const snapped_position& sample, int axis,
                                                                 int fraction) {
    const int128 dot = n.x * (a.x - sample.x) + n.y * (a.y - sample.y) + n.z * (a.z - sample.z);
    const int128 depth = n.along(axis);
    const int128 over = depth > 0 ? dot : -dot;
    const uint128 denominator = static_cast<uint128>(depth > 0 ? depth : -depth) << fraction;
    if (over <= 0) return {0, denominator};
    const auto numerator = static_cast<uint128>(over);
    return {numerator < denominator ? numerator : denominator, denominator};
}

// The unit normal, turned so that its component along `axis` is positive or negative. Written operations: doubles,
// then one rounding to float.
VOXELPIPE_HD inline void set_normal(edge_crossing& c, const exact_normal& n, int axis, bool positive) {
    const double x = exact::to_double(n.x), y = exact::to_double(n.y), z = exact::to_double(n.z);
    const double length = exact::sqrt(exact::fma(z, z, exact::fma(y, y, exact::mul(x, x))));
    const double size = (n.along(axis) > 0) == positive ? length : -length;
    c.nx = exact::to_float(exact::div(x, size));
    c.ny = exact::to_float(exact::div(y, size));
    c.nz = exact::to_float(exact::div(z, size));
}

} // namespace voxelpipe::core
