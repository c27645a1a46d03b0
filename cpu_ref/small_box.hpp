// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a triangle with a small bounding box: the sets of coverage.hpp, as rows of bits along x,
// without a dominant axis, divisions, or branches on the data except the end of one loop. A voxel of the bounding box
// is covered iff it passes the three projections and the plane (triangle_setup.hpp): three tables of rows, and two
// linear functions along x. Host code, tuned for CPUs.

#include <cpu_ref/lanes.hpp>
#include <voxelpipe/core/triangle_setup.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// True if all sides of a bounding box are at most `size` voxels.
[[nodiscard]] VOXELPIPE_HD constexpr bool is_within(const voxel_box& box, int size) {
    return max3(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]) < size;
}

// One projection of a small triangle onto (x, y): bits along x of the rows y = 0 .. Size - 1. Coordinates are relative
// to the bounding box; `negative` is -1 if the projection's area is negative, else 0.
template <int Size, class Lanes>
VOXELPIPE_INLINE void small_projection(const std::int32_t (&x)[3], const std::int32_t (&y)[3], std::int32_t negative,
                                       int fraction, std::uint32_t (&rows)[std::size_t{Size}]) {
    Lanes f[3], step[3], block[3];
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        const std::int32_t a = ((y[i] - y[j]) ^ negative) - negative, b = ((x[j] - x[i]) ^ negative) - negative;
        const std::int64_t product = std::int64_t{a} * x[i] + std::int64_t{b} * y[i];
        const auto c = static_cast<std::int32_t>(exact::floor_shift(-product, fraction));
        f[i] = Lanes::line(c + (a & ~(a >> 31)) + (b & ~(b >> 31)), a);
        step[i] = Lanes::all(b);
        block[i] = Lanes::all(4 * a);
    }
    for (int row = 0; row < Size; ++row) {
        rows[row] = nonnegative(f[0], f[1], f[2]);
        if constexpr (Size > 4) {
            static_assert(Size == 8);
            rows[row] |= nonnegative(f[0] + block[0], f[1] + block[1], f[2] + block[2]) << 4;
        }
        for (int i = 0; i < 3; ++i) f[i] = f[i] + step[i];
    }
}

// Calls emit(y, z, bits) for rows of voxels within `clip`, with bits along x, possibly none. y, z and the bits are
// relative to clip's lowest corner; clip is at most 32 voxels a side. all = bounds(a, b, c, fraction) must be within
// Size. Returns false, without emitting, if a projection has no area.
// Widths, for Size = 8 and F <= 16: positions and edges are at most 2^19 units; a normal's component, twice the area of
// a projection, at most 2^38; its product with a position at most 2^57, three of them below 2^59. A projection's row:
// a, b at most 2^19, c at most 2^40 / 2^16 + 2^20, a and b times a coordinate of at most 8 at most 2^22: 27 bits.
template <int Size, class Lanes = lanes32, class WideLanes = lanes64, class Emit>
VOXELPIPE_INLINE bool for_each_small_row(const snapped_position& a, const snapped_position& b,
                                         const snapped_position& c, int fraction, const voxel_box& all,
                                         const voxel_box& clip, Emit&& emit) {
    const std::int64_t ox = all.lo[0] << fraction, oy = all.lo[1] << fraction, oz = all.lo[2] << fraction;
    const auto at = [](std::int64_t p, std::int64_t o)
                        VOXELPIPE_INLINE_LAMBDA { return static_cast<std::int32_t>(p - o); };
    const std::int32_t x[3] = {at(a.x, ox), at(b.x, ox), at(c.x, ox)}, y[3] = {at(a.y, oy), at(b.y, oy), at(c.y, oy)},
                       z[3] = {at(a.z, oz), at(b.z, oz), at(c.z, oz)};
    const std::int64_t e1x = x[1] - x[0], e1y = y[1] - y[0], e1z = z[1] - z[0];
    const std::int64_t e2x = x[2] - x[0], e2y = y[2] - y[0], e2z = z[2] - z[0];
    const std::int64_t nx = e1y * e2z - e1z * e2y, ny = e1z * e2x - e1x * e2z, nz = e1x * e2y - e1y * e2x;
    if ((nx == 0) | (ny == 0) | (nz == 0)) return false;

    const auto sign = [](std::int64_t n) VOXELPIPE_INLINE_LAMBDA { return static_cast<std::int32_t>(n >> 63); };
    std::uint32_t xy[std::size_t{Size}], xz[std::size_t{Size}], yz[std::size_t{Size}];
    small_projection<Size, Lanes>(x, y, sign(nz), fraction, xy);
    small_projection<Size, Lanes>(x, z, ~sign(ny), fraction, xz); // (x, z) is left-handed
    small_projection<Size, Lanes>(y, z, sign(nx), fraction, yz);

    // Bounds of the plane: low + n . corner >= 0 and high - n . corner >= 0, with the voxel's furthest corners
    // included.
    const std::int64_t d = nx * x[0] + ny * y[0] + nz * z[0];
    const std::int64_t negatives = (nx & (nx >> 63)) + (ny & (ny >> 63)) + (nz & (nz >> 63));
    const std::int64_t positives = nx + ny + nz - negatives;
    const std::int64_t low = positives - exact::ceil_shift(d, fraction),
                       high = exact::floor_shift(d, fraction) - negatives;

    // Rows within clip.
    const voxel_box here = intersect(all, clip);
    if (here.empty()) return true;
    const auto first_y = static_cast<int>(here.lo[1] - all.lo[1]), last_y = static_cast<int>(here.hi[1] - all.lo[1]);
    const auto first_z = static_cast<int>(here.lo[2] - all.lo[2]), last_z = static_cast<int>(here.hi[2] - all.lo[2]);
    const auto y_clip = (2u << last_y) - (1u << first_y);
    std::uint64_t rows = 0; // bit y + Size * z
    for (int k = 0; k < Size; ++k) rows |= static_cast<std::uint64_t>(yz[k] & y_clip) << (k * Size);
    rows &= ~std::uint64_t{0} >> (63 - (last_z * Size + Size - 1));
    rows &= ~std::uint64_t{0} << (first_z * Size);
    const auto shift = static_cast<int>(all.lo[0] - clip.lo[0]) + Size; // >= 1: the box meets clip
    const auto x_clip = (2u << (here.hi[0] - clip.lo[0])) - 1u;
    const auto to_y = static_cast<int>(all.lo[1] - clip.lo[1]), to_z = static_cast<int>(all.lo[2] - clip.lo[2]);

    const WideLanes along[2] = {WideLanes::line(0, nx), WideLanes::line(4 * nx, nx)};
    for (; rows != 0; rows &= rows - 1) {
        const int row = std::countr_zero(rows), j = row % Size, k = row / Size;
        const std::int64_t r = ny * j + nz * k;
        const WideLanes l = WideLanes::all(low + r), h = WideLanes::all(high - r);
        std::uint32_t bits = nonnegative(l + along[0], h - along[0]);
        if constexpr (Size > 4) bits |= nonnegative(l + along[1], h - along[1]) << 4;
        bits &= xy[j] & xz[k];
        emit(to_y + j, to_z + k, static_cast<std::uint32_t>((std::uint64_t{bits} << shift) >> Size) & x_clip);
    }
    return true;
}

} // namespace voxelpipe::core
