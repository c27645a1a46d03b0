// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle cut by planes of the lattice. A polygon is a cycle of sides: edges of the triangle, and the lines in which
// its plane meets the cutting planes. A corner is where two sides meet, so its coordinates are quotients of exact
// integers, found once, and cutting decides by exact signs alone (docs/design.md, "Cut cells").

#include <voxelpipe/config.hpp>
#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/fixed_point.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

// ---- widths ---------------------------------------------------------------------------------------------------------
// Positions are relative to the lowest voxel that the triangle's bounding box meets, in units of 2^-F voxel. With boxes
// of less than 2^b units, voxel included, products of two differences have 2b bits, the normal's components too, and
// the plane's equation n.(p - v0) three such products of b bits more: 3b + 2 bits.
inline constexpr int narrow_cell_bits = 20; // 62 bits: the 64-bit path
static_assert(3 * narrow_cell_bits + 2 <= 63);
static_assert(3 * (coordinate_bits + 1) + 2 <= 127); // n has at most the bits of the projected box: the 128-bit path

// A triangle by ascending vertices in lexicographic order, so that neither the first vertex nor the orientation changes
// a bit; is_odd tells whether that has reversed it.
template <class Int>
struct cell_triangle {
    std::int64_t p[3][3];  // vertex, axis; relative to the lowest voxel
    std::int64_t base[3];  // that voxel
    std::int64_t reach[3]; // one more than the highest voxel that the box meets with its inside, relative to `base`
    Int n[3];              // normal of the sorted vertices: (p1 - p0) x (p2 - p0)
    int fraction;          // F
    int lifted;            // 1 or 2: the axis across which it lies in its voxels' upper faces; else 0 (lift)
    bool is_odd;
};

[[nodiscard]] VOXELPIPE_HD inline bool is_before(const snapped_position& a, const snapped_position& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

// True if the 64-bit path is exact.
[[nodiscard]] VOXELPIPE_HD inline bool is_narrow_cell(const snapped_position& a, const snapped_position& b,
                                                      const snapped_position& c, int fraction) {
    const auto fits = [&](std::int64_t u, std::int64_t v, std::int64_t w) {
        const std::int64_t lo = (u < v ? u : v) < w ? (u < v ? u : v) : w,
                           hi = (u > v ? u : v) > w ? (u > v ? u : v) : w;
        return hi - lo + (std::int64_t{2} << fraction) < std::int64_t{1} << narrow_cell_bits;
    };
    return fits(a.x, b.x, c.x) && fits(a.y, b.y, c.y) && fits(a.z, b.z, c.z);
}

template <class Int>
[[nodiscard]] VOXELPIPE_HD cell_triangle<Int> make_cell_triangle(snapped_position a, snapped_position b,
                                                                 snapped_position c, int fraction) {
    cell_triangle<Int> t{};
    const auto order = [&](snapped_position& u, snapped_position& v) {
        if (!is_before(v, u)) return;
        const snapped_position w = u;
        u = v;
        v = w;
        t.is_odd = !t.is_odd;
    };
    order(a, b);
    order(b, c);
    order(a, b);
    const std::int64_t all[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
    t.fraction = fraction;
    for (int i = 0; i < 3; ++i) {
        std::int64_t lo = all[0][i], hi = all[0][i];
        for (int v = 1; v < 3; ++v) {
            lo = all[v][i] < lo ? all[v][i] : lo;
            hi = all[v][i] > hi ? all[v][i] : hi;
        }
        t.base[i] = lo >> fraction;
        t.reach[i] = -(-hi >> fraction) - t.base[i];
        for (int v = 0; v < 3; ++v) t.p[v][i] = all[v][i] - (t.base[i] << fraction);
    }
    const auto d = [&](int v, int i) { return static_cast<Int>(t.p[v][i] - t.p[0][i]); };
    t.n[0] = d(1, 1) * d(2, 2) - d(1, 2) * d(2, 1);
    t.n[1] = d(1, 2) * d(2, 0) - d(1, 0) * d(2, 2);
    t.n[2] = d(1, 0) * d(2, 1) - d(1, 1) * d(2, 0);
    return t;
}

// Takes a triangle in a lattice plane across y or z, which covers nothing, for the voxels below that plane: its area is
// theirs. A triangle without area stays as it is.
template <class Int>
VOXELPIPE_HD void lift(cell_triangle<Int>& t) {
    for (int axis = 1; axis < 3; ++axis) {
        if (t.reach[axis] != 0 || t.n[axis] == 0) continue;
        --t.base[axis];
        ++t.reach[axis];
        for (int v = 0; v < 3; ++v) t.p[v][axis] += std::int64_t{1} << t.fraction;
        t.lifted = axis;
    }
}

// The six cutting planes of a polygon: axis plane / 2, at its place in the triangle's units.
struct cutting_planes {
    std::int64_t at[6];
};
inline constexpr int first_plane_side = 3; // sides 0 to 2 are edges: side i runs from vertex i to vertex (i + 1) % 3

// A corner relative to the triangle's base: quotients of exact integers, in the triangle's units.
template <class Int>
struct cut_corner {
    Int numerator[3], denominator[3]; // no denominator is 0
};

// The corners of a triangle and of the polygons that it is cut to.
template <class Int>
struct cut_corners {
    static constexpr int most =
        15; // three, and two more a plane: two planes of a layer, two of a pixel, two of a voxel
    cut_corner<Int> at[most];
    double y[most], z[most]; // from the lowest corner of a pixel, in voxels, of the corners that were measured
    int count;
};

struct cut_polygon {
    static constexpr int most = 9; // three corners, and one more a plane
    int count;
    std::uint8_t corner[most]; // its number in the cut_corners
    std::uint8_t side[most];   // the side that follows it
};

// The triangle as a polygon, whose corners become the first ones.
template <class Int>
[[nodiscard]] VOXELPIPE_HD cut_polygon whole_triangle(const cell_triangle<Int>& t, cut_corners<Int>& corners) {
    cut_polygon p{};
    p.count = corners.count = 3;
    for (int i = 0; i < 3; ++i) {
        p.corner[i] = p.side[i] = static_cast<std::uint8_t>(i);
        for (int axis = 0; axis < 3; ++axis) {
            corners.at[i].numerator[axis] = static_cast<Int>(t.p[i][axis]);
            corners.at[i].denominator[axis] = 1;
        }
    }
    return p;
}

// Where a side meets a plane that it is not parallel to.
template <class Int>
VOXELPIPE_HD void find_corner(const cell_triangle<Int>& t, const cutting_planes& planes, int side, int plane,
                              cut_corner<Int>& c) {
    const int b = plane / 2, next = 9 >> 2 * b & 3, last = 18 >> 2 * b & 3; // (b + 1) % 3 and (b + 2) % 3
    const std::int64_t place = planes.at[plane];
    c.numerator[b] = static_cast<Int>(place);
    c.denominator[b] = 1;
    if (side < first_plane_side) { // an edge
        const auto &p = t.p[side], &q = t.p[side == 2 ? 0 : side + 1];
        const auto along = static_cast<Int>(q[b] - p[b]), part = static_cast<Int>(place - p[b]);
        c.numerator[next] = static_cast<Int>(p[next]) * along + static_cast<Int>(q[next] - p[next]) * part;
        c.numerator[last] = static_cast<Int>(p[last]) * along + static_cast<Int>(q[last] - p[last]) * part;
        c.denominator[next] = c.denominator[last] = along;
        return;
    }
    // The triangle's plane on the line of two planes.
    const int g = side - first_plane_side, a = g / 2, axis = 3 - a - b;
    c.numerator[a] = static_cast<Int>(planes.at[g]);
    c.denominator[a] = 1;
    const Int rest = t.n[a] * static_cast<Int>(planes.at[g] - t.p[0][a]) + t.n[b] * static_cast<Int>(place - t.p[0][b]);
    c.numerator[axis] = t.n[axis] * static_cast<Int>(t.p[0][axis]) - rest;
    c.denominator[axis] = t.n[axis];
}

// The sign of a corner's coordinate minus a place.
template <class Int>
[[nodiscard]] VOXELPIPE_HD int corner_side(const cut_corner<Int>& c, int axis, std::int64_t place) {
    const Int d = c.denominator[axis], n = c.numerator[axis] - static_cast<Int>(place) * d;
    const int s = static_cast<int>(n > 0) - static_cast<int>(n < 0);
    return d < 0 ? -s : s;
}

// 2^-F.
template <class Int>
[[nodiscard]] VOXELPIPE_HD double voxels_in_unit(const cell_triangle<Int>& t) {
    return core::bit_cast<double>(static_cast<std::uint64_t>(1023 - t.fraction) << 52);
}

// A coordinate of a corner minus a place, in voxels: exact numerator and denominator, one division.
template <class Int>
[[nodiscard]] VOXELPIPE_HD double corner_value(const cell_triangle<Int>& t, const cut_corner<Int>& c, int axis,
                                               std::int64_t place) {
    const Int d = c.denominator[axis], n = c.numerator[axis] - static_cast<Int>(place) * d;
    return exact::div(exact::mul(exact::to_double(n), voxels_in_unit(t)), exact::to_double(d)); // the product is exact
}

// Sets a corner's y and z from a pixel's lowest corner.
template <class Int>
VOXELPIPE_HD void measure_corner(const cell_triangle<Int>& t, cut_corners<Int>& corners, int i, std::int64_t y,
                                 std::int64_t z) {
    corners.y[i] = corner_value(t, corners.at[i], 1, y);
    corners.z[i] = corner_value(t, corners.at[i], 2, z);
}

// The part of a polygon with coordinates not above (is_upper) or not below a plane. Closed: a part may be a segment or
// a point. plane: its number, whose place is in `planes`. New corners are added to the others.
template <class Int>
VOXELPIPE_HD void cut(const cell_triangle<Int>& t, const cutting_planes& planes, int plane, bool is_upper,
                      cut_corners<Int>& corners, cut_polygon& poly) {
    const int axis = plane / 2;
    const auto number = static_cast<std::uint8_t>(first_plane_side + plane);
    int inside[cut_polygon::most]; // sign: 1 within, 0 in the plane, -1 beyond
    bool has_beyond = false;
    for (int i = 0; i < poly.count; ++i) {
        const int s = corner_side(corners.at[poly.corner[i]], axis, planes.at[plane]);
        inside[i] = is_upper ? -s : s;
        has_beyond = has_beyond || inside[i] < 0;
    }
    if (!has_beyond) return;
    cut_polygon r{};
    const auto add = [&](int corner, std::uint8_t side) {
        if (r.count == cut_polygon::most) return; // never: a convex polygon gains one corner a plane
        r.corner[r.count] = static_cast<std::uint8_t>(corner);
        r.side[r.count++] = side;
    };
    const auto add_crossing = [&](std::uint8_t of, std::uint8_t side) {
        if (corners.count == cut_corners<Int>::most) return; // never: it is crossed at most twice
        find_corner(t, planes, of, plane, corners.at[corners.count]);
        add(corners.count++, side);
    };
    for (int i = 0; i < poly.count; ++i) {
        const int here = inside[i], next = inside[i + 1 == poly.count ? 0 : i + 1];
        const std::uint8_t side = poly.side[i];
        if (here >= 0) add(poly.corner[i], here == 0 && next < 0 ? number : side);
        if (here > 0 && next < 0) add_crossing(side, number);
        if (here < 0 && next > 0) add_crossing(side, side);
    }
    poly = r;
}

} // namespace voxelpipe::core
