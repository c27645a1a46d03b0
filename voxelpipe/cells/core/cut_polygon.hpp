// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle cut by planes of the lattice. A polygon is a cycle of sides: edges of the triangle, and the lines in which
// its plane meets the cutting planes. A corner is the pair of sides that meet there, so its coordinates are quotients
// of exact integers, and cutting decides by exact signs alone (docs/design.md, "Cut cells").

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

struct cut_polygon {
    static constexpr int most = 9; // three corners, and one more a plane
    int count;
    std::uint8_t from[most], to[most]; // the sides whose crossing a corner is
    std::uint8_t side[most];           // the side that follows the corner
};

[[nodiscard]] VOXELPIPE_HD inline cut_polygon whole_triangle() {
    cut_polygon p{};
    p.count = 3;
    for (int i = 0; i < 3; ++i) {
        p.from[i] = static_cast<std::uint8_t>((i + 2) % 3);
        p.to[i] = p.side[i] = static_cast<std::uint8_t>(i);
    }
    return p;
}

// A coordinate of a corner minus a place, as a fraction whose denominator is not 0.
template <class Int>
struct corner_fraction {
    Int numerator, denominator;
};

template <class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE corner_fraction<Int> corner_minus(const cell_triangle<Int>& t,
                                                                              const cutting_planes& planes, int from,
                                                                              int to, int axis, std::int64_t place) {
    if (from < first_plane_side && to < first_plane_side) { // edges i - 1 and i meet in vertex i
        const int v = (from + 1) % 3 == to ? to : from;
        return {static_cast<Int>(t.p[v][axis] - place), 1};
    }
    if (from >= first_plane_side && (from - first_plane_side) / 2 == axis)
        return {static_cast<Int>(planes.at[from - first_plane_side] - place), 1};
    if (to >= first_plane_side && (to - first_plane_side) / 2 == axis)
        return {static_cast<Int>(planes.at[to - first_plane_side] - place), 1};
    if (from < first_plane_side || to < first_plane_side) { // an edge and a plane
        const int e = from < first_plane_side ? from : to,
                  plane = (from < first_plane_side ? to : from) - first_plane_side;
        const int b = plane / 2, p = e, q = (e + 1) % 3;
        const auto along = static_cast<Int>(t.p[q][b] - t.p[p][b]);
        return {static_cast<Int>(t.p[p][axis] - place) * along +
                    static_cast<Int>(t.p[q][axis] - t.p[p][axis]) * static_cast<Int>(planes.at[plane] - t.p[p][b]),
                along};
    }
    // The triangle's plane on the line of two planes.
    const int f = from - first_plane_side, g = to - first_plane_side;
    const Int rest = t.n[f / 2] * static_cast<Int>(planes.at[f] - t.p[0][f / 2]) +
                     t.n[g / 2] * static_cast<Int>(planes.at[g] - t.p[0][g / 2]);
    return {-(rest + t.n[axis] * static_cast<Int>(place - t.p[0][axis])), t.n[axis]};
}

// The sign of a corner's coordinate minus a place.
template <class Int>
[[nodiscard]] VOXELPIPE_HD int corner_side(const cell_triangle<Int>& t, const cutting_planes& planes,
                                           const cut_polygon& poly, int corner, int axis, std::int64_t place) {
    const auto f = corner_minus(t, planes, poly.from[corner], poly.to[corner], axis, place);
    const int s = static_cast<int>(f.numerator > 0) - static_cast<int>(f.numerator < 0);
    return f.denominator < 0 ? -s : s;
}

// A coordinate of a corner minus a place, in voxels: exact numerator and denominator, one division.
template <class Int>
[[nodiscard]] VOXELPIPE_HD double corner_value(const cell_triangle<Int>& t, const cutting_planes& planes,
                                               const cut_polygon& poly, int corner, int axis, std::int64_t place) {
    const auto f = corner_minus(t, planes, poly.from[corner], poly.to[corner], axis, place);
    const double voxel = core::bit_cast<double>(static_cast<std::uint64_t>(1023 - t.fraction) << 52); // 2^-F
    const double numerator = exact::mul(exact::to_double(f.numerator), voxel);                        // exact
    return f.denominator == 1 ? numerator : exact::div(numerator, exact::to_double(f.denominator));
}

// The part of a polygon with coordinates not above (is_upper) or not below a plane. Closed: a part may be a segment or
// a point. plane: its number, whose place is in `planes`.
template <class Int>
VOXELPIPE_HD void cut(const cell_triangle<Int>& t, const cutting_planes& planes, int plane, bool is_upper,
                      cut_polygon& poly) {
    const int axis = plane / 2;
    const auto number = static_cast<std::uint8_t>(first_plane_side + plane);
    int inside[cut_polygon::most]; // sign: 1 within, 0 in the plane, -1 beyond
    bool has_beyond = false;
    for (int i = 0; i < poly.count; ++i) {
        const int s = corner_side(t, planes, poly, i, axis, planes.at[plane]);
        inside[i] = is_upper ? -s : s;
        has_beyond = has_beyond || inside[i] < 0;
    }
    if (!has_beyond) return;
    cut_polygon r{};
    const auto add = [&](std::uint8_t from, std::uint8_t to, std::uint8_t side) {
        if (r.count == cut_polygon::most) return; // never: a convex polygon gains one corner a plane
        r.from[r.count] = from;
        r.to[r.count] = to;
        r.side[r.count++] = side;
    };
    for (int i = 0; i < poly.count; ++i) {
        const int here = inside[i], next = inside[i + 1 == poly.count ? 0 : i + 1];
        const std::uint8_t side = poly.side[i];
        if (here >= 0) add(poly.from[i], poly.to[i], here == 0 && next < 0 ? number : side);
        if (here > 0 && next < 0) add(side, number, number);
        if (here < 0 && next > 0) add(side, number, side);
    }
    poly = r;
}

} // namespace voxelpipe::core
