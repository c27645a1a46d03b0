// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// World positions become fixed point here, once; from then on only integers decide coverage (docs/design.md,
// "Snapping"). Defines the sub-voxel format, the snapping formula and the table of integer widths that the rest of
// core/ relies on.

#include <voxelpipe/config.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/exact.hpp>

#include <cstdint>

namespace voxelpipe::core {

// A position in units of 2^-F voxel. For a vertex that cannot be drawn, x holds one of the two marks.
struct snapped_position {
    std::int64_t x, y, z;
};
inline constexpr std::int64_t nonfinite_mark = INT64_MIN;
inline constexpr std::int64_t too_far_mark = INT64_MIN + 1;

// ---- the table of widths --------------------------------------------------------------------------------------------
// F = fraction bits, L = log2 of the largest extent (rounded up), e = bits of the largest edge of a triangle. A
// triangle's normal component is twice the area of its projection, hence at most the area of the projected box: 2e
// bits. In voxel units the plane at a voxel needs 3 * 2^(2e) * 2^e / 2^F, doubled for the voxel centre: 3e - F + 2.6
// bits.
inline constexpr int max_log2_extent = 20;   // a million voxels per axis
inline constexpr int coordinate_bits = 40;   // |q| <= 2^40: positions beyond are "too far"
inline constexpr int narrow_plane_bits = 62; // the 64-bit path keeps a bit to spare

[[nodiscard]] VOXELPIPE_HD constexpr int ceil_log2(std::int64_t n) {
    int bits = 0;
    while ((std::int64_t{1} << bits) < n) ++bits;
    return bits;
}

// F = min(16, 24 - L): float32 positions have no more precision than this at the far end of such a grid.
[[nodiscard]] VOXELPIPE_HD constexpr int fraction_bits(int largest_extent) {
    const int l = ceil_log2(largest_extent);
    return l < 8 ? 16 : 24 - l;
}

// The largest e for which the 64-bit path is exact. The bounds: edge functions (2e + 2 bits, before the shift by F),
// barycentric numerators (2e + 4 bits, exact in a double too), the plane (3e - F + 2.6 bits).
[[nodiscard]] VOXELPIPE_HD constexpr int narrow_edge_bits(int fraction) {
    const int plane = (narrow_plane_bits - 3 + fraction) / 3;
    return plane < 24 ? plane : 24;
}

constexpr bool widths_hold(int largest_log2, bool narrow) {
    for (int l = 0; l <= largest_log2; ++l) {
        const int f = fraction_bits(1 << l);
        const int e = narrow ? narrow_edge_bits(f) : coordinate_bits + 1;
        const int bits = narrow ? 63 : 127;         // without sign
        if (f < 1) return false;                    // thin coverage halves a voxel
        if (2 * e + 4 > bits) return false;         // edge functions and barycentric numerators
        if (narrow && 2 * e + 4 > 53) return false; // ... exact in a double
        if (3 * e - f + 3 > bits) return false;     // plane in voxel units, doubled
        if (3 * e + 3 > 127) return false;          // n . p before the shift: always 128 bits
        if (coordinate_bits + 1 > 62) return false; // differences of coordinates in 64 bits
    }
    return true;
}
static_assert(widths_hold(max_log2_extent, true), "the 64-bit path would overflow");
static_assert(widths_hold(max_log2_extent, false), "the 128-bit path would overflow");
static_assert(fraction_bits(1024) == 14 && fraction_bits(128) == 16 && fraction_bits(1) == 16);
static_assert(fraction_bits(257) == 15 && fraction_bits(4096) == 12);
static_assert(narrow_edge_bits(14) == 24 && narrow_edge_bits(13) == 24 && narrow_edge_bits(12) == 23);

// ---- snapping -------------------------------------------------------------------------------------------------------

// World to sub-voxel units, per axis: q = rne((double(p) - origin) * scale). Computed once on the host.
struct snap_transform {
    double origin[3];
    double scale[3];        // 2^F / voxel_size, rounded once
    std::int64_t offset[3]; // first voxel of the rasterised part of the grid, in sub-voxel units
    int fraction;           // F
    double shift[3];        // exact::rounding_shift of the offsets
};

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_finite(float a) {
    return (core::bit_cast<std::uint32_t>(a) & 0x7f800000u) != 0x7f800000u;
}

// The snapped position relative to the first voxel of the rasterised part, or a mark if it cannot be drawn.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE snapped_position snap(const snap_transform& t, float x, float y, float z) {
    constexpr double limit = static_cast<double>(std::int64_t{1} << coordinate_bits);
    if (!(is_finite(x) && is_finite(y) && is_finite(z))) return {nonfinite_mark, 0, 0};
    // A subtraction that feeds a product cannot be contracted, so these remain two roundings under every flag.
    const double a = exact::mul(exact::to_double(x) - t.origin[0], t.scale[0]);
    const double b = exact::mul(exact::to_double(y) - t.origin[1], t.scale[1]);
    const double c = exact::mul(exact::to_double(z) - t.origin[2], t.scale[2]);
    const bool near = a <= limit && a >= -limit && b <= limit && b >= -limit && c <= limit && c >= -limit;
    if (!near) return {too_far_mark, 0, 0};
    return {exact::round_to_int64(a) - t.offset[0], exact::round_to_int64(b) - t.offset[1],
            exact::round_to_int64(c) - t.offset[2]};
}

// snap() in 32 bits, relative to the part's first voxel. Returns false if a coordinate of the whole grid reaches 2^30
// units or is NaN; snap() then distinguishes these. An offset lies in the grid, so it is below 2^25, because F + L <=
// 24; it is even, because F > 0.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool snap_int32(const snap_transform& t, float x, float y, float z,
                                                            std::int32_t (&q)[3]) {
    const double a = exact::mul(exact::to_double(x) - t.origin[0], t.scale[0]);
    const double b = exact::mul(exact::to_double(y) - t.origin[1], t.scale[1]);
    const double c = exact::mul(exact::to_double(z) - t.origin[2], t.scale[2]);
    q[0] = exact::round_to_int32(a, t.shift[0]);
    q[1] = exact::round_to_int32(b, t.shift[1]);
    q[2] = exact::round_to_int32(c, t.shift[2]);
    // Compares magnitudes by their high words without the sign; infinities and NaNs are largest. The shift by one is a
    // multiplication, because first passes are bound by the unit that does all other bit operations.
    constexpr std::uint32_t limit = 0x41d00000u * 2u; // 2^30
    const std::uint32_t ha = exact::high_word(a) * 2u, hb = exact::high_word(b) * 2u, hc = exact::high_word(c) * 2u;
    const std::uint32_t most = ha > hb ? ha : hb;
    return (most > hc ? most : hc) < limit;
}
[[nodiscard]] VOXELPIPE_HD constexpr bool is_drawable(const snapped_position& p) { return p.x > too_far_mark; }

} // namespace voxelpipe::core
