// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage of a small triangle in 32-bit integers: the sets of coverage.hpp for a triangle whose bounding box is a few
// voxels, with coordinates that count from that box. Only the set-up multiplies in 64 bits, and the plane, whose normal
// is an area, is kept in 64. Conservative coverage comes as rows of bits along x, whatever the dominant axis: the
// separating axes (bounding box, plane, three projections) do not know one. Nothing branches on the triangle's shape.

#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::core {

// ---- widths ---------------------------------------------------------------------------------------------------------
// A side of the bounding box has at most 2^e units of 2^-F voxel, so: normal components 2e bits (twice an area is at
// most the projected box), n . p 3e + 1.6 and doubled for thin 3e + 2.6 bits, edge coefficients e bits, their constants
// after the division by 2^F, and every value within the box and one voxel beyond it, 2e + 3 - F bits.
inline constexpr int small_edge_bits = 20;
inline constexpr int small_most_voxels = 32; // a row is one word

// How many voxels a side of a small triangle's bounding box may have.
[[nodiscard]] VOXELPIPE_HD constexpr int small_voxels(int fraction) {
    if (2 * small_edge_bits + 3 - fraction > 31) return 0;
    const int n = 1 << (fraction < small_edge_bits ? small_edge_bits - fraction : 0);
    return n < small_most_voxels ? n : small_most_voxels;
}
static_assert(3 * small_edge_bits + 3 <= 63, "the plane of a small triangle would overflow 64 bits");
static_assert(small_voxels(16) == 16 && small_voxels(14) == 32 && small_voxels(12) == 32 && small_voxels(11) == 0);
// Thin depths are found by one division in double: numerator and divisor are exact (3e + 3 - F and 2e + 2 bits), and a
// quotient below 2^8 that is no integer is further from the next one than the rounding reaches.
static_assert(3 * small_edge_bits + 3 - 12 <= 53 && 2 * small_edge_bits + 2 + 8 <= 52);

// A triangle relative to the corner of the lowest voxel of its bounding box: 0 < p <= 2^small_edge_bits.
struct small_triangle {
    std::int32_t p[3][3]; // [vertex][axis]
};

// The part of the bounding box that is wanted, inclusive, relative to its lowest voxel.
struct small_box {
    int lo[3], hi[3];
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]; }
};

struct small_half_plane {
    std::int32_t a, b, c;
    [[nodiscard]] VOXELPIPE_HD constexpr std::int32_t at(int x, int y) const { return a * x + b * y + c; }
};

// The three half-planes of the projection on axes (X, Y). Edges are turned by the sign of the projected area; where
// that is zero, the closed chain of edges runs along one line both ways, which leaves exactly that line.
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

// The voxels of 2 x 2 that three half-planes leave, bit x + 2 y.
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

// The dominant axis: of the largest component, the first of equals; -1 where the area is zero.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr int small_axis(const triple<std::int64_t>& normal) {
    const std::int64_t x = magnitude(normal[0]), y = magnitude(normal[1]), z = magnitude(normal[2]);
    return (x | y | z) == 0 ? -1 : x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

// What a fragment's position on a small triangle, and its normal, follow from: triangle_frame in fewer bits, relative
// to the lowest voxel of the bounding box.
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

// Bit x where three linear functions of x are all >= 0, for x = 0 .. Length - 1; e: their values at x = Length - 1, s:
// what a step adds. Without a branch, and from the last one down, so that each sign goes to its bit by one shift of two
// words. What is more than the row is for the caller to mask; up to 63 voxels from the corner of a box of at most 32
// the values stay below 2^28.
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
// Where rows of at most 32 columns enter and leave three half-planes, row after row. A half-plane e + a u ends at u =
// -e / a, and wanted is the integer beyond that: the integer next to it in floats is tested by one product, which tells
// it from its neighbour. |e| < 2^28, so a quotient from -16 to 48, which is all that is looked at, is off by less than
// 2^-15.
struct small_row_ends {
    std::int32_t at[3], step[3], slope[3]; // of the next row's first column; to the row after it; to the next column
    float inverse[3];                      // -1 / (64 slope); a slope of zero ends at infinity

    // Rows v0, v0 + row_step, ... from the column u0 on, of half-planes on (u, v), or, turned, on (v, u).
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
    // The columns 0 .. last that the row has, last < 32.
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

// a * b for 0 <= b < 2^32, modulo 2^64: two multiplications of 32 bits.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::int64_t times(std::int64_t a, int b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) * static_cast<std::uint32_t>(b));
}

// ---- conservative ---------------------------------------------------------------------------------------------------

// Exact for |a| < 2^22, by an addition of integers and one of floats.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float small_to_float(std::int32_t a) {
    constexpr std::uint32_t shift = 0x4b400000u; // 1.5 * 2^23
    return exact::sub(core::bit_cast<float>(shift + static_cast<std::uint32_t>(a)), 12582912.0f);
}

// What the plane of a small triangle leaves of a row of voxels, in floats. With S = |n.x| + |n.y| + |n.z| voxels that
// meet the plane are within S / 2 of `middle`, and up to 32 voxels from the corner all that is added, by five
// roundings, stays below 66 S: less than 2^-15.3 S is lost, and 2^-15 S left for it on both sides.
struct near_plane {
    float n[3], middle;  // along x from x0 on; where rows are to be clipped turned so that n[0] >= 0
    float half, inverse; // S / 2; 1 / (64 n[0])

    VOXELPIPE_HD VOXELPIPE_INLINE near_plane(const std::int64_t (&normal)[3], std::int64_t below, std::int64_t above,
                                             int x0, bool clips)
        : n{static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])},
          middle(exact::fma(-n[0], static_cast<float>(x0), exact::mul(0.5f, static_cast<float>(above - below)))),
          half(exact::mul(0.5f, static_cast<float>(above + below))), inverse(0) {
        if (clips && normal[0] < 0) {
            for (float& k : n) k = -k;
            middle = -middle;
        }
        inverse = exact::near_inverse(exact::mul(64.0f, n[0]));
    }
    // Whether the voxels from and to of a row, from x0 on, surely meet the plane, and so all between them.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets(int from, int to, int y, int z) const {
        const float row = row_at(y, z), in = exact::mul(half, 1.0f - 0x1p-14f);
        const float a = exact::fma(n[0], small_to_float(from), row), b = exact::fma(n[0], small_to_float(to), row);
        return a < in && -a < in && b < in && -b < in;
    }
    // Of the voxels from..to of a row, from x0 on, those that are left; `sure`: whether this is so. Along x the plane
    // comes nearer and goes: it leaves what is between two numbers, which are rounded inwards and then looked at: the
    // voxel that is in has to be so surely, and the one before it surely out.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t clip(int from_x, int to_x, int y, int z,
                                                                   bool& sure) const {
        const float row = row_at(y, z);
        const auto from = static_cast<float>(from_x), to = static_cast<float>(to_x);
        const float in = exact::mul(half, 1.0f - 0x1p-14f), out = exact::mul(half, 1.0f + 0x1p-14f);
        const float enters = exact::fma_saturated(-exact::add(half, row), inverse, 0.25f),
                    leaves = exact::fma_saturated(exact::sub(half, row), inverse, 0.25f); // (x + 16) / 64
        const float k = exact::least(exact::greatest(exact::fma_up(enters, 64.0f, -16.0f), from), exact::add(to, 1.0f)),
                    l = exact::greatest(exact::least(exact::fma_down(leaves, 64.0f, -16.0f), to),
                                        exact::sub(from, 1.0f));
        const float at_k = exact::fma(n[0], k, row), at_l = exact::fma(n[0], l, row);
        const bool begins = (k == from) | (exact::sub(at_k, n[0]) < -out),
                   ends = (l == to) | (exact::add(at_l, n[0]) > out);
        const bool is_in = (k > to) | (at_k > -in), stays_in = (l < from) | (at_l < in);
        sure = begins & ends & is_in & stays_in;
        const std::uint32_t bits = ((2u << (exact::to_integer(l) & 31)) - 1) & (~0u << (exact::to_integer(k) & 31));
        return k > l ? 0 : bits;
    }

private:
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float row_at(int y, int z) const {
        return exact::fma(n[1], small_to_float(y), exact::fma(n[2], small_to_float(z), -middle));
    }
};

struct small_conservative {
    small_half_plane xy[3], yz[3], zx[3];
    std::int64_t n[3]; // normal
    // A voxel's lowest corner c meets the plane where n . c + below >= 0 and above - n . c >= 0.
    std::int64_t below, above;

    small_conservative() = default; // for brick_triangle to fill
    VOXELPIPE_HD VOXELPIPE_INLINE small_conservative(const small_triangle& t, int fraction) {
        const triple<std::int64_t> normal = small_normal(t);
        small_projection<0, 1>(t, normal[2] < 0, fraction, xy);
        small_projection<1, 2>(t, normal[0] < 0, fraction, yz);
        small_projection<2, 0>(t, normal[1] < 0, fraction, zx);
        std::int64_t at_plane = 0, positive = 0, negative = 0;
        for (int i = 0; i < 3; ++i) {
            n[i] = normal[i];
            at_plane += n[i] * t.p[0][i];
            positive += positive_part(n[i]);
            negative += negative_part(n[i]);
        }
        below = positive - exact::ceil_shift(at_plane, fraction);
        above = exact::floor_shift(at_plane, fraction) - negative;
    }

    // The covered voxels (x0 .. x1, y, z), bit 0 for x0; at most 32.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t row(int x0, int x1, int y, int z) const {
        if ((yz[0].at(y, z) | yz[1].at(y, z) | yz[2].at(y, z)) < 0) return 0;
        std::int32_t e[6];
        for (int i = 0; i < 3; ++i) {
            e[i] = xy[i].at(x0, y);
            e[3 + i] = zx[i].at(z, x0);
        }
        const std::int64_t depth = n[0] * x0 + n[1] * y + n[2] * z;
        std::int64_t lower = depth + below, upper = above - depth;
        std::uint32_t bits = 0;
        for (int x = 0; x <= x1 - x0; ++x) {
            const std::int32_t outside =
                e[0] | e[1] | e[2] | e[3] | e[4] | e[5] | static_cast<std::int32_t>((lower | upper) >> 32); // signs
            bits |= (static_cast<std::uint32_t>(~outside) >> 31) << x;
            for (int i = 0; i < 3; ++i) {
                e[i] += xy[i].a;
                e[3 + i] += zx[i].b;
            }
            lower += n[0];
            upper -= n[0];
        }
        return bits;
    }

    // What the xy projection leaves of the voxels x0 .. x1 at y, what the zx projection leaves of them at z, whether
    // the yz projection leaves the row (y, z), and what the plane leaves of `limit` in it: a row is the four together.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limit_at_y(int x0, int x1, int y) const {
        return line(xy[0].at(x0, y), xy[1].at(x0, y), xy[2].at(x0, y), xy[0].a, xy[1].a, xy[2].a, x1 - x0);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limit_at_z(int x0, int x1, int z) const {
        return line(zx[0].at(z, x0), zx[1].at(z, x0), zx[2].at(z, x0), zx[0].b, zx[1].b, zx[2].b, x1 - x0);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets_row(int y, int z) const {
        return (yz[0].at(y, z) | yz[1].at(y, z) | yz[2].at(y, z)) >= 0;
    }
    // `limit` is one run of bits, as what projections leave is, and so is what the plane leaves of it: its ends are
    // tested, and mostly nothing else.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t plane_bits(int x0, int y, int z,
                                                                         std::uint32_t limit) const {
        if (limit == 0) return 0;
        int first = exact::lowest_one(limit), last = exact::bit_width(std::uint64_t{limit}) - 1;
        const std::int64_t depth = times(n[0], x0 + first) + times(n[1], y) + times(n[2], z);
        std::int64_t lower = depth + below, upper = above - depth;
        const std::int64_t across = times(n[0], last - first);
        for (std::int64_t a = lower + across, b = upper - across; (a | b) < 0 && last >= first; --last) {
            a -= n[0];
            b += n[0];
        }
        for (; (lower | upper) < 0 && first <= last; ++first) {
            lower += n[0];
            upper -= n[0];
        }
        return first <= last ? ((2u << last) - 1) & ~((1u << first) - 1) : 0;
    }

    // Calls emit(y, z, bits) for the rows of a box of at most 8 voxels along x that two projections and the plane leave
    // something of; bit 0 is box.lo[0]. What the xy and the zx projection leave depends on y or on z alone, so that is
    // found once and not once a row, and the yz projection tells which rows are wanted at all: threads that have a
    // triangle each then go through as many rows as they emit, not through their boxes. 8 x 8 rows of 8 bits at once.
    // Clips: see plane_bits.
    template <bool Clips, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void rows(const small_box& box, Emit&& emit) const {
        const int x0 = box.lo[0], x7 = x0 + 7;
        if (box.hi[0] < x0) return;
        const near_plane plane(n, below, above, x0, Clips);
        const std::uint32_t along = (2u << (box.hi[0] - x0)) - 1;
        for (int y0 = box.lo[1]; y0 <= box.hi[1]; y0 += 8) {
            const int y1 = box.hi[1] < y0 + 7 ? box.hi[1] : y0 + 7;
            const std::uint32_t across = (2u << (y1 - y0)) - 1;
            std::uint64_t by_y = 0;
            for (int y = y1; y >= y0; --y) by_y = by_y << 8 | (along & limits_at_y<8>(x7, y));
            for (int z0 = box.lo[2]; z0 <= box.hi[2]; z0 += 8) {
                const int z1 = box.hi[2] < z0 + 7 ? box.hi[2] : z0 + 7;
                std::uint64_t by_z = 0, met = 0; // rows, bit y + 8 z
                for (int z = z1; z >= z0; --z) {
                    by_z = by_z << 8 | (along & limits_at_z<8>(x7, z));
                    met = met << 8 | (across & rows_at_z<8>(y0 + 7, z));
                }
                for (; met != 0; met &= met - 1) {
                    const int at = exact::lowest_one(met), y = at % 8, z = at / 8;
                    const std::uint32_t limit =
                        static_cast<std::uint32_t>(by_y >> 8 * y) & static_cast<std::uint32_t>(by_z >> 8 * z) & along;
                    if (limit != 0) emit(y0 + y, z0 + z, plane_bits<Clips>(plane, x0, y0 + y, z0 + z, limit));
                }
            }
        }
    }

    // The same for a box of at most 16 voxels a side, all of it at once. `limits` holds 16 words: get(i), set(i, word).
    template <bool Clips, class Limits, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void rows_of_16(const small_box& box, Limits&& limits, Emit&& emit) const {
        if (box.empty()) return;
        const int x0 = box.lo[0], y0 = box.lo[1], z0 = box.lo[2];
        const int last_x = box.hi[0] - x0, last_y = box.hi[1] - y0, last_z = box.hi[2] - z0;
        const near_plane plane(n, below, above, x0, Clips);
        {
            small_row_ends by_y(xy, false, x0, y0, 1);
            for (int y = 0; y <= last_y; ++y) limits.set(y, by_y.next(last_x));
        }
        {
            small_row_ends by_z(zx, true, x0, z0, 1);
            for (int z = 0; z <= last_z; ++z)
                limits.set(z, (z <= last_y ? limits.get(z) : 0) | by_z.next(last_x) << 16);
        }
        std::uint64_t met[4] = {}; // rows, bit y + 16 z
        {
            small_row_ends by_z(yz, false, y0, z0 + last_z, -1);
            for (int z = last_z; z >= 0; --z) {
                for (int k = 3; k > 0; --k) met[k] = met[k] << 16 | met[k - 1] >> 48;
                met[0] = met[0] << 16 | by_z.next(last_y);
            }
        }
        for (int first_z = 0;;) {
            if (met[0] == 0) {
                if ((met[1] | met[2] | met[3]) == 0) break;
                for (int k = 1; k < 4; ++k) met[k - 1] = met[k];
                met[3] = 0;
                first_z += 4;
            } else {
                const int at = exact::lowest_one(met[0]), y = at % 16, z = first_z + at / 16;
                met[0] &= met[0] - 1;
                const std::uint32_t limit = limits.get(y) & limits.get(z) >> 16;
                if (limit != 0) emit(y0 + y, z0 + z, plane_bits<Clips>(plane, x0, y0 + y, z0 + z, limit));
            }
        }
    }

    // The same for boxes of up to 32 voxels a side.
    template <class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void long_rows(const small_box& box, Emit&& emit) const {
        const int x0 = box.lo[0], x1 = box.hi[0];
        for (int y = box.lo[1]; y <= box.hi[1]; ++y) {
            const std::uint32_t at_y = limit_at_y(x0, x1, y);
            if (at_y == 0) continue;
            for (int z = box.lo[2]; z <= box.hi[2]; ++z) {
                if (!meets_row(y, z)) continue;
                const std::uint32_t limit = at_y & limit_at_z(x0, x1, z);
                if (limit != 0) emit(y, z, plane_bits(x0, y, z, limit));
            }
        }
    }

private:
    // The same, from what floats say where they are sure: of whatever the plane leaves, or only whether that is all,
    // which takes fewer registers.
    template <bool Clips>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t plane_bits(const near_plane& plane, int x0, int y, int z,
                                                                         std::uint32_t limit) const {
        const int first = exact::lowest_one(limit), last = exact::highest_one(limit);
        bool sure = false;
        std::uint32_t bits = limit;
        if constexpr (Clips)
            bits = plane.clip(first, last, y, z, sure);
        else
            sure = plane.meets(first, last, y, z);
        return sure ? bits : plane_bits(x0, y, z, limit);
    }
    // What the xy projection leaves of the voxels from x - Length + 1 to x at y, the zx projection of them at z, and
    // the yz projection of the rows from y - Length + 1 to y at z.
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limits_at_y(int x, int y) const {
        return small_line<Length>(xy[0].at(x, y), xy[1].at(x, y), xy[2].at(x, y), xy[0].a, xy[1].a, xy[2].a);
    }
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t limits_at_z(int x, int z) const {
        return small_line<Length>(zx[0].at(z, x), zx[1].at(z, x), zx[2].at(z, x), zx[0].b, zx[1].b, zx[2].b);
    }
    template <int Length>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t rows_at_z(int y, int z) const {
        return small_line<Length>(yz[0].at(y, z), yz[1].at(y, z), yz[2].at(y, z), yz[0].a, yz[1].a, yz[2].a);
    }
    // Bit x where three values, stepped x times, are all >= 0; x = 0 .. last.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE static std::uint32_t line(std::int32_t e0, std::int32_t e1,
                                                                          std::int32_t e2, std::int32_t s0,
                                                                          std::int32_t s1, std::int32_t s2, int last) {
        std::uint32_t bits = 0;
        for (int x = 0; x <= last; ++x) {
            bits |= (static_cast<std::uint32_t>(~(e0 | e1 | e2)) >> 31) << x;
            e0 += s0;
            e1 += s1;
            e2 += s2;
        }
        return bits;
    }
};

// ---- thin -----------------------------------------------------------------------------------------------------------

// One voxel for every touched column of the dominant axis. Not for zero-area triangles.
struct small_thin {
    int axis;
    small_half_plane uv[3];
    // The depth at a column's centre is (depth - nu (2u + 1) - nv (2v + 1)) / (2 nw).
    std::int64_t nu, nv, nw, depth;

    small_thin() = default; // for brick_thin to fill

    VOXELPIPE_HD VOXELPIPE_INLINE small_thin(const small_triangle& t, const triple<std::int64_t>& normal, int axis_,
                                             int fraction)
        : axis(axis_) {
        small_triangle turned{}; // u v w
        for (int i = 0; i < 3; ++i) {
            const triple<std::int32_t> p = to_uvw(axis, t.p[i][0], t.p[i][1], t.p[i][2]);
            for (int k = 0; k < 3; ++k) turned.p[i][k] = p[k];
        }
        triple<std::int64_t> plane = to_uvw(axis, normal[0], normal[1], normal[2]);
        const bool negative = plane[2] < 0;
        small_projection<0, 1>(turned, negative, fraction, uv);
        if (negative) plane = {{-plane[0], -plane[1], -plane[2]}};
        nu = plane[0];
        nv = plane[1];
        nw = plane[2];
        depth = exact::floor_shift(2 * (nu * turned.p[0][0] + nv * turned.p[0][1] + nw * turned.p[0][2]), fraction);
    }

    // Calls emit(u, w) for the covered columns (u0 .. u1, v). All count from the bounding box; w may lie beyond it.
    // Wide: the numbers may be those of a large triangle, whose quotient a double need not hold.
    template <bool Wide = false, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void row(int u0, int u1, int v, Emit&& emit) const {
        std::int32_t e[3];
        for (int i = 0; i < 3; ++i) e[i] = uv[i].at(u0, v);
        const std::int64_t numerator = depth - nu * (2 * u0 + 1) - nv * (2 * v + 1), divisor = 2 * nw;
        std::int32_t w = 0;
        constexpr std::int64_t exact_below = std::int64_t{1} << 52;
        if (!Wide || (numerator < exact_below && numerator > -exact_below)) {
            const double quotient = exact::div(static_cast<double>(numerator), static_cast<double>(divisor));
            w = static_cast<std::int32_t>(quotient);
            w -= static_cast<std::int32_t>(static_cast<double>(w) > quotient); // towards minus infinity
        } else {
            w = static_cast<std::int32_t>(exact::floor_div(numerator, divisor));
        }
        std::int64_t remainder = numerator - w * divisor;
        for (int u = u0; u <= u1; ++u) {
            if ((e[0] | e[1] | e[2]) >= 0) emit(u, w);
            for (int i = 0; i < 3; ++i) e[i] += uv[i].a;
            // The slope is at most one voxel a column.
            remainder -= 2 * nu;
            if (remainder < 0) {
                remainder += divisor;
                --w;
            } else if (remainder >= divisor) {
                remainder -= divisor;
                ++w;
            }
        }
    }

    // u and v for each other: `row`, `columns` and uv then have them the other way round.
    VOXELPIPE_HD VOXELPIPE_INLINE void swap_uv() {
        for (small_half_plane& e : uv) e = {e.b, e.a, e.c};
        const std::int64_t u = nu;
        nu = nv;
        nv = u;
    }

    // Covered columns, row by row, of which some may have been passed.
    struct walk {
        float by_u, by_v, first, of_row; // depths: steps, at the centre of (0, 0), and of this row's first column
        std::uint32_t rows, row;         // what is left: rows, as bits, and columns of this one
        int u0, v0, step, v;
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() const { return (rows | row) == 0; }
    };
    // The covered columns of the rows v0, v0 + step, ... up to v1, of at most 32 columns each. `kept` holds a word for
    // each of the rows, at most 32: get(i), set(i, word). Adds how many columns they are to `count`.
    template <class Kept>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE walk find_columns(int u0, int u1, int v0, int v1, int step, Kept&& kept,
                                                                  std::uint32_t& count) const {
        walk k{};
        {
            small_row_ends ends(uv, false, u0, v0, step);
            int i = 0;
            for (int v = u1 < u0 ? v1 + 1 : v0; v <= v1; v += step, ++i) {
                const std::uint32_t row = ends.next(u1 - u0);
                kept.set(i, row);
                k.rows |= static_cast<std::uint32_t>(row != 0) << i;
                count += static_cast<std::uint32_t>(exact::count_ones(row));
            }
        }
        const float inverse = exact::near_inverse(static_cast<float>(nw));
        k.by_u = exact::mul(-static_cast<float>(nu), inverse);
        k.by_v = exact::mul(-static_cast<float>(nv), inverse);
        k.first = exact::mul(static_cast<float>(depth - nu - nv), exact::mul(0.5f, inverse));
        k.u0 = u0;
        k.v0 = v0;
        k.step = step;
        return k;
    }
    // The next column of a walk that is not done: emit(u, w), and begin_row(v) before the first of a row.
    template <class Kept, class BeginRow, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void next_column(walk& k, Kept&& kept, BeginRow&& begin_row, Emit&& emit) const {
        if (k.row == 0) {
            const int i = exact::highest_one(k.rows);
            k.rows ^= 1u << i;
            k.row = kept.get(i);
            k.v = k.v0 + i * k.step;
            k.of_row = exact::fma(k.by_v, static_cast<float>(k.v), k.first);
            begin_row(k.v);
        }
        const int i = exact::highest_one(k.row), u = k.u0 + i;
        k.row ^= 1u << i;
        // Slopes are at most one, and depths from -1 to 33, so that `first` is below 100, and what is lost on the way
        // below 2^-14 voxel.
        float over = 0;
        std::int32_t w = exact::integer_below(exact::fma(k.by_u, static_cast<float>(u), k.of_row), over);
        if (over < 0x1p-12f || over > 1.0f - 0x1p-12f) w = depth_of(u, k.v, w);
        emit(u, w);
    }
    // All of them: row() for threads that have a triangle each, as small_conservative::rows. First all rows, then one
    // loop over the columns that are left.
    template <class Kept, class BeginRow, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void columns(int u0, int u1, int v0, int v1, int step, Kept&& kept,
                                               BeginRow&& begin_row, Emit&& emit) const {
        std::uint32_t count = 0;
        for (walk k = find_columns(u0, u1, v0, v1, step, kept, count); !k.is_done();)
            next_column(k, kept, begin_row, emit);
    }

private:
    // The depth of a column at its centre, where `near` is at most one off.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t depth_of(int u, int v, std::int32_t near) const {
        const std::int64_t divisor = 2 * nw;
        const std::int64_t remainder = depth - times(nu, 2 * u + 1) - times(nv, 2 * v + 1) - near * divisor;
        return near + static_cast<std::int32_t>(remainder >= divisor) - static_cast<std::int32_t>(remainder < 0);
    }
};

// The depths of the columns (u, v) of 2 x 2 of a bounding box that is at most two voxels deep: w + 1 in two bits, at 2
// u + 4 v. Only for columns that the triangle touches, whose depth at their centre is within a voxel of the triangle's
// own: row() without its division.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t cube_depths(const small_thin& s) {
    const std::int64_t divisor = 2 * s.nw, first = s.depth - s.nu - s.nv;
    std::uint32_t packed = 0;
    for (int v = 0; v < 2; ++v)
        for (int u = 0; u < 2; ++u) {
            const std::int64_t n = first - (u != 0 ? 2 * s.nu : 0) - (v != 0 ? 2 * s.nv : 0);
            const int w =
                static_cast<int>(n >= 0) + static_cast<int>(n >= divisor) + static_cast<int>(n >= 2 * divisor);
            packed |= static_cast<std::uint32_t>(w) << (2 * u + 4 * v);
        }
    return packed;
}

} // namespace voxelpipe::core
