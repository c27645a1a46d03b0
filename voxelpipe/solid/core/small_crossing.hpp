// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crossings of a small triangle with rows along x, without wide numbers: those of crossing.hpp for a triangle whose
// bounding box is at most small_voxels (small_triangle.hpp) along each axis. Half-planes are kept in 32 bits, the plane
// in 64, and nothing is divided.

#include <voxelpipe/core/small_triangle.hpp>
#include <voxelpipe/solid/core/crossing.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Coordinates and voxels count from `origin`, the voxel that holds the lowest corner of the bounding box.
//
// Widths, e <= small_edge_bits bits a side: an edge function times 2^F is below 2^(2e + 2), in 64 bits; divided by 2^F
// and at a row of the box it is below 2^(e + 6.1), as a side has at most 32 voxels. The plane times 2^F is below
// 2^(3e + 1.8) plus 3 * 2^(2e + F - 1), and F <= e where a side has more than one voxel; a side of one voxel has e = F.
// So all of it stays below 2^62.
struct small_crossings {
    int winding;              // 1: rows enter, -1: they leave, 0: parallel to the rows, no crossings
    small_half_plane edge[3]; // on (y, z): the row crosses the triangle iff all three are >= 0 there
    triple<std::int64_t> plane;
    std::int64_t offset; // plane . (x, y, z) + offset >= 0: voxel x is beyond; plane[0] > 0
    float inverse;       // about -1 / plane[0]

    // t: relative to the origin, 0 <= p <= 2^small_edge_bits. fraction >= 1.
    VOXELPIPE_HD VOXELPIPE_INLINE small_crossings(const small_triangle& t, int fraction)
        : winding(0), edge{}, plane(small_normal(t)), offset(0), inverse(0) {
        if (plane[0] == 0) return;
        const bool is_negative = plane[0] < 0;
        winding = is_negative ? 1 : -1;
        if (is_negative) plane = {{-plane[0], -plane[1], -plane[2]}};
        for (int i = 0; i < 3; ++i) {
            const int j = i == 2 ? 0 : i + 1;
            std::int32_t a = t.p[i][2] - t.p[j][2], b = t.p[j][1] - t.p[i][1];
            if (is_negative) {
                a = -a;
                b = -b;
            }
            // The offset's order is that of centre_offset<>.
            const int negative_tie = a != 0 ? static_cast<int>(a < 0) : static_cast<int>(b <= 0);
            const std::int64_t half = static_cast<std::int64_t>(a + b) << (fraction - 1);
            const std::int64_t at_vertex =
                static_cast<std::int64_t>(a) * t.p[i][1] + static_cast<std::int64_t>(b) * t.p[i][2];
            edge[i] = {a, b, static_cast<std::int32_t>((half - at_vertex - negative_tie) >> fraction)};
        }
        // A tie of the plane is positive, because plane[0] is.
        const std::int64_t at_vertex = plane[0] * t.p[0][0] + plane[1] * t.p[0][1] + plane[2] * t.p[0][2];
        offset = exact::floor_shift(((plane[0] + plane[1] + plane[2]) << (fraction - 1)) - at_vertex, fraction);
        inverse = -exact::near_inverse(exact::to_float(plane[0]));
    }

    // The part of the plane that rows of one z share.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int64_t of_line(int z) const {
        return offset + times(plane[2], z);
    }
    // The first voxel beyond the triangle in a row that crosses it; y >= 0. The crossing is within the triangle's box,
    // so the quotient's magnitude is below 40 and its float is off by less than 2^-14: the nearest integer is the
    // wanted one or the one before, which one product decides.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t first_beyond(std::int64_t line, int y) const {
        const std::int64_t at = line + times(plane[1], y);
        const std::int32_t near = exact::to_integer(exact::mul(exact::to_float(at), inverse));
        return near + static_cast<std::int32_t>(plane[0] * near + at < 0);
    }
};

// Calls emit(y, z, first) for all rows that cross a small triangle: y from y0 to y1, at most 32, and z from z0 to z1.
// All are relative to its origin.
VOXELPIPE_ANY_CALLABLE
template <class Emit>
VOXELPIPE_HD VOXELPIPE_INLINE void for_each_small_crossing(const small_crossings& t, int y0, int y1, int z0, int z1,
                                                           Emit&& emit) {
    if (t.winding == 0) return;
    small_row_ends ends(t.edge, false, y0, z0, 1);
    for (int z = z0; z <= z1; ++z) {
        const std::int64_t line = t.of_line(z);
        for (std::uint32_t rows = ends.next(y1 - y0); rows != 0; rows &= rows - 1) {
            const int y = y0 + exact::lowest_one(rows);
            emit(y, z, t.first_beyond(line, y));
        }
    }
}

} // namespace voxelpipe::core
