// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangle setup: three snapped vertices -> dominant axis, bounds, half-planes of the three projections and the plane,
// all exact integers in units of voxels of the triangle's own corner (paper section 4, "fine rasterization").
//
// Axes: w is the dominant axis, u = w + 1 and v = w + 2 (mod 3), so that the orientation is kept.
// A voxel is the closed box [i, i+1]; it meets the closed triangle iff it meets the bounding box, the plane, and in
// each of the three projections the projected triangle (the separating axes of a box and a triangle, grouped by plane).
// In a projection the test at voxel (x, y) is three half-planes a*x + b*y + c >= 0, where c already holds the corner of
// the voxel that lies furthest inside and the division by 2^F: corners are multiples of 2^F, so rounding down is exact.

#include <voxelpipe/core/coverage_rule.hpp>
#include <voxelpipe/core/fixed_point.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The arms of a voxel that a coverage asks for. Code of conservative coverage leaves out the voxels whose arms the
// triangle does not meet, so programs compile nothing for them.
enum class arm_set : std::uint8_t { none, axes, diagonals };
[[nodiscard]] VOXELPIPE_HD constexpr arm_set arms_of(coverage rule) {
    return rule == coverage::crosshair  ? arm_set::axes
           : rule == coverage::diagonal ? arm_set::diagonals
                                        : arm_set::none;
}

// The spans that for_each_span enumerates. columns: for each touched column all voxels that the plane may pass at any
// point of the column's square. These include the thin voxels of every finer grid, so coarse raster uses them for thin
// coverage.
enum class span_rule : std::uint8_t { thin, conservative, columns };

template <class T>
struct triple {
    T v[3];
    VOXELPIPE_HD
    constexpr T& operator[](int i) { return v[i]; }
    VOXELPIPE_HD
    constexpr const T& operator[](int i) const { return v[i]; }
};

// Inclusive box of voxels, x y z; empty if hi < lo.
struct voxel_box {
    triple<std::int64_t> lo, hi;
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]; }
};

[[nodiscard]] VOXELPIPE_HD constexpr voxel_box intersect(const voxel_box& a, const voxel_box& b) {
    voxel_box r{};
    for (int i = 0; i < 3; ++i) {
        r.lo[i] = a.lo[i] > b.lo[i] ? a.lo[i] : b.lo[i];
        r.hi[i] = a.hi[i] < b.hi[i] ? a.hi[i] : b.hi[i];
    }
    return r;
}

// (x, y, z) -> (u, v, w). Written as selects, so that device compilers keep everything in registers.
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr triple<T> to_uvw(int axis, const T& x, const T& y, const T& z) {
    return {axis == 0 ? y : axis == 1 ? z : x, axis == 0 ? z : axis == 1 ? x : y, axis == 0 ? x : axis == 1 ? y : z};
}

// (u, v, w) -> (x, y, z)
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr triple<T> to_xyz(int axis, const T& u, const T& v, const T& w) {
    return {axis == 0 ? w : axis == 1 ? v : u, axis == 0 ? u : axis == 1 ? w : v, axis == 0 ? v : axis == 1 ? u : w};
}

template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr T min3(T a, T b, T c) {
    const T m = a < b ? a : b;
    return m < c ? m : c;
}
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr T max3(T a, T b, T c) {
    const T m = a > b ? a : b;
    return m > c ? m : c;
}
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr T positive_part(T a) {
    return a > 0 ? a : T{0};
}
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr T negative_part(T a) {
    return a < 0 ? a : T{0};
}
template <class T>
[[nodiscard]] VOXELPIPE_HD constexpr T magnitude(T a) {
    return a < 0 ? -a : a;
}

// Voxels (of 2^fraction units) whose closed box meets the triangle's bounding box. A point on a voxel face touches both
// sides: the lowest voxel is ceil(min) - 1.
[[nodiscard]] VOXELPIPE_HD constexpr voxel_box bounds(const snapped_position& a, const snapped_position& b,
                                                      const snapped_position& c, int fraction) {
    voxel_box r{};
    r.lo[0] = exact::ceil_shift(min3(a.x, b.x, c.x), fraction) - 1;
    r.lo[1] = exact::ceil_shift(min3(a.y, b.y, c.y), fraction) - 1;
    r.lo[2] = exact::ceil_shift(min3(a.z, b.z, c.z), fraction) - 1;
    r.hi[0] = exact::floor_shift(max3(a.x, b.x, c.x), fraction);
    r.hi[1] = exact::floor_shift(max3(a.y, b.y, c.y), fraction);
    r.hi[2] = exact::floor_shift(max3(a.z, b.z, c.z), fraction);
    return r;
}

// True for a bounding box one voxel wide along two axes. Then every voxel of it is covered conservatively, because the
// triangle is connected and reaches both ends.
[[nodiscard]] VOXELPIPE_HD constexpr bool is_line_of_voxels(const voxel_box& bounding_box) {
    int wide = 0;
    for (int i = 0; i < 3; ++i) wide += bounding_box.hi[i] != bounding_box.lo[i] ? 1 : 0;
    return wide <= 1;
}

// True if the 64-bit path is exact for this triangle (fixed_point.hpp, table of widths). Depends on its size only, not
// its position.
[[nodiscard]] VOXELPIPE_HD constexpr bool fits_narrow(const snapped_position& a, const snapped_position& b,
                                                      const snapped_position& c, int fraction) {
    const std::int64_t limit = std::int64_t{1} << narrow_edge_bits(fraction < 16 ? fraction : 16);
    return max3(a.x, b.x, c.x) - min3(a.x, b.x, c.x) <= limit && max3(a.y, b.y, c.y) - min3(a.y, b.y, c.y) <= limit &&
           max3(a.z, b.z, c.z) - min3(a.z, b.z, c.z) <= limit;
}

template <class Int>
struct half_plane {
    Int a, b, c;
    [[nodiscard]] VOXELPIPE_HD constexpr Int at(Int x, Int y) const { return a * x + b * y + c; }
};

// Determines a fragment's position on its triangle, and the triangle's normal.
template <class Int>
struct triangle_frame {
    int axis;                    // w; the longest side of a zero-area triangle
    int fraction;                // F
    bool zero_area;              // after snapping
    triple<std::int64_t> origin; // voxel of the local origin, uvw order: the bounding box's first
    triple<Int> p[3];            // vertices relative to origin, sub-voxel units, uvw order; each > 0
    triple<Int> normal;          // (p1 - p0) x (p2 - p0), uvw order
};

template <class Int>
struct triangle_setup : triangle_frame<Int> {
    triple<std::int64_t> last;    // last voxel of the bounding box, relative to origin; the first is 0
    half_plane<Int> uv[3];        // edge i runs from vertex i to vertex i + 1
    half_plane<Int> vw[3], wu[3]; // conservative only
    triple<Int> plane;            // normal, signed so that plane[2] > 0
    Int plane_low, plane_high;    // ceil and floor of plane . p0 / 2^F; thin: both floor(2 * plane . p0 / 2^F)
};

// The half-plane left of p -> q (sign = 1) or right of it (sign = -1), both in one projection. An overload for each
// width: few triangles need 128 bits, and their code out of line makes kernels quicker to compile.
template <class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr half_plane<Int> edge_of(Int px, Int py, Int qx, Int qy, int sign,
                                                                              int fraction) {
    const Int a = sign > 0 ? py - qy : qy - py;
    const Int b = sign > 0 ? qx - px : px - qx;
    const Int c = exact::floor_shift<Int>(-(a * px + b * py), fraction) + positive_part(a) + positive_part(b);
    return {a, b, c};
}
[[nodiscard]] VOXELPIPE_HD constexpr half_plane<std::int64_t> edge(std::int64_t px, std::int64_t py, std::int64_t qx,
                                                                   std::int64_t qy, int sign, int fraction) {
    return edge_of(px, py, qx, qy, sign, fraction);
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_DEVICE_NOINLINE constexpr half_plane<int128>
edge(int128 px, int128 py, int128 qx, int128 qy, int sign, int fraction) {
    return edge_of(px, py, qx, qy, sign, fraction);
}

// The three half-planes of the triangle's projection on axes (x, y); `area` is its doubled signed area. A projection
// without area is a segment or a point: then two half-planes enclose its line, and the third is always true.
template <class Int>
VOXELPIPE_HD constexpr void projection(const triple<Int> (&p)[3], int x, int y, Int area, int fraction,
                                       half_plane<Int> (&out)[3]) {
    if (area != 0) {
        const int sign = area > 0 ? 1 : -1;
        out[0] = edge(p[0][x], p[0][y], p[1][x], p[1][y], sign, fraction);
        out[1] = edge(p[1][x], p[1][y], p[2][x], p[2][y], sign, fraction);
        out[2] = edge(p[2][x], p[2][y], p[0][x], p[0][y], sign, fraction);
        return;
    }
    // All edges lie on one line; any edge that is not a point defines it.
    const bool first = p[0][x] != p[1][x] || p[0][y] != p[1][y];
    const triple<Int>& s = first ? p[0] : p[1];
    const triple<Int>& t = first ? p[1] : p[2];
    out[0] = edge(s[x], s[y], t[x], t[y], 1, fraction);
    out[1] = edge(s[x], s[y], t[x], t[y], -1, fraction);
    out[2] = {Int{0}, Int{0}, Int{0}};
}

// n . p in 128 bits, whatever Int is: the one wide product of a triangle.
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr int128 dot128(const triple<Int>& n, const triple<Int>& p) {
    return static_cast<int128>(n[0]) * p[0] + static_cast<int128>(n[1]) * p[1] + static_cast<int128>(n[2]) * p[2];
}

// Sets up a frame. Int: std::int64_t if fits_narrow, otherwise int128. Vertices must be drawable; fraction >= 1. box:
// bounds(a, b, c, fraction).
template <class Int>
VOXELPIPE_HD constexpr void set_up_frame(triangle_frame<Int>& t, const voxel_box& box, const snapped_position& a,
                                         const snapped_position& b, const snapped_position& c, int fraction) {
    t.fraction = fraction;
    const std::int64_t ox = box.lo[0] << fraction, oy = box.lo[1] << fraction, oz = box.lo[2] << fraction;

    const Int e1x = b.x - a.x, e1y = b.y - a.y, e1z = b.z - a.z;
    const Int e2x = c.x - a.x, e2y = c.y - a.y, e2z = c.z - a.z;
    const Int nx = e1y * e2z - e1z * e2y, ny = e1z * e2x - e1x * e2z, nz = e1x * e2y - e1y * e2x;
    const Int mx = magnitude(nx), my = magnitude(ny), mz = magnitude(nz);
    t.zero_area = mx == 0 && my == 0 && mz == 0;
    if (!t.zero_area) {
        t.axis = mx >= my && mx >= mz ? 0 : my >= mz ? 1 : 2;
    } else {
        const std::int64_t lx = max3(a.x, b.x, c.x) - min3(a.x, b.x, c.x);
        const std::int64_t ly = max3(a.y, b.y, c.y) - min3(a.y, b.y, c.y);
        const std::int64_t lz = max3(a.z, b.z, c.z) - min3(a.z, b.z, c.z);
        t.axis = lx >= ly && lx >= lz ? 0 : ly >= lz ? 1 : 2;
    }
    t.origin = to_uvw(t.axis, box.lo[0], box.lo[1], box.lo[2]);
    t.p[0] = to_uvw<Int>(t.axis, a.x - ox, a.y - oy, a.z - oz);
    t.p[1] = to_uvw<Int>(t.axis, b.x - ox, b.y - oy, b.z - oz);
    t.p[2] = to_uvw<Int>(t.axis, c.x - ox, c.y - oy, c.z - oz);
    t.normal = to_uvw<Int>(t.axis, nx, ny, nz);
}
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr triangle_frame<Int>
make_frame(const snapped_position& a, const snapped_position& b, const snapped_position& c, int fraction) {
    triangle_frame<Int> t{};
    set_up_frame(t, bounds(a, b, c, fraction), a, b, c, fraction);
    return t;
}

// The arguments are those of set_up_frame.
template <span_rule Rule, class Int>
[[nodiscard]] VOXELPIPE_HD constexpr triangle_setup<Int>
setup_triangle(const snapped_position& a, const snapped_position& b, const snapped_position& c, int fraction) {
    triangle_setup<Int> t; // every member that the rule uses is set below
    const voxel_box box = bounds(a, b, c, fraction);
    set_up_frame(t, box, a, b, c, fraction);
    t.last = to_uvw(t.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
    projection(t.p, 0, 1, t.normal[2], fraction, t.uv);
    if constexpr (Rule == span_rule::conservative) {
        projection(t.p, 1, 2, t.normal[0], fraction, t.vw);
        projection(t.p, 2, 0, t.normal[1], fraction, t.wu);
    }
    t.plane = t.normal;
    if (t.plane[2] < 0) t.plane = {-t.plane[0], -t.plane[1], -t.plane[2]};
    const auto divide = [&](auto d) VOXELPIPE_INLINE_LAMBDA {
        if constexpr (Rule == span_rule::thin) {
            t.plane_low = t.plane_high = static_cast<Int>(exact::floor_shift(2 * d, fraction));
        } else {
            t.plane_low = static_cast<Int>(exact::ceil_shift(d, fraction));
            t.plane_high = static_cast<Int>(exact::floor_shift(d, fraction));
        }
    };
    if (sizeof(Int) == 8 && max3(t.last[0], t.last[1], t.last[2]) < (std::int64_t{1} << 19 >> fraction)) {
        // A small triangle's product fits: factors of 38 and 20 bits, three of them, doubled.
        divide(t.plane[0] * t.p[0][0] + t.plane[1] * t.p[0][1] + t.plane[2] * t.p[0][2]);
    } else {
        divide(dot128(t.plane, t.p[0]));
    }
    return t;
}

} // namespace voxelpipe::core
