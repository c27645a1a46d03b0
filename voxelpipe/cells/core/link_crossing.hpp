// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where triangles cross the links between the moved centres of neighbouring voxels (docs/design.md, "Links"). Exact:
// integers only, every tie is decided.
//
// The lines of one direction d through all centres are the rows of solid/core/crossing.hpp in sheared coordinates: with
// a pivot axis w, d_w = 1, the projection along d takes a point to its two other coordinates less d_u and d_v times
// that of the pivot, and the line through voxel (u, v, w) has the number (u - d_u w, v - d_v w). Centres are moved by
// the offset (e, e^2, e^3) as there, so that a line crosses exactly one, both or none of the triangles at an edge: the
// plane of d and an edge has a normal that is not 0 unless the edge runs along d, and then the triangle is parallel to
// d. Along the line the voxels from `first` on are beyond the triangle, and the link from the one before to `first`
// crosses it.
//
// Widths, e bits the longest edge: sheared coordinates have one bit more than coordinates, so an edge function times
// 2^F is below 2^(2e + 4). The plane at a line is two products of a normal's component with a number of at most
// 2^(e - F + 1) + 2, and its offset, below 2^(3e - F + 1.8): less than 2^(3e - F + 3.4), and 3e - F <= 59 on the 64-bit
// path.

#include <voxelpipe/core/arms.hpp>
#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/surfaces/core/edge_crossing.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe {

// Step from a voxel to its neighbour k, 0 to 25: 6 through faces, then 12 through edges, then 8 through corners.
// Neighbours k and k ^ 1 are opposite each other; of the two the even one's first component that is not 0 is 1.
[[nodiscard]] VOXELPIPE_HD constexpr glm::ivec3 link_direction(int k) {
    constexpr signed char even[13][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0},  {1, -1, 0},
                                         {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1}, {1, 1, 1},
                                         {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};
    const signed char* const d = even[k >> 1];
    const int sign = (k & 1) != 0 ? -1 : 1;
    return {sign * d[0], sign * d[1], sign * d[2]};
}

namespace core {

// An even direction as an arm: its pivot is the first axis along which it goes.
[[nodiscard]] VOXELPIPE_HD constexpr arm arm_of_link(const glm::ivec3& d) {
    if (d.x != 0) return {0, {d.y, d.z}};
    if (d.y != 0) return {1, {d.z, d.x}};
    return {2, {d.x, d.y}};
}

// A triangle and what all directions share. Int: std::int64_t if fits_narrow, otherwise int128.
template <class Int>
struct link_triangle {
    int fraction;
    triple<std::int64_t> origin; // the voxel that holds the lowest corner of the bounding box
    triple<Int> p[3];            // relative to it
    triple<Int> normal;

    VOXELPIPE_HD constexpr link_triangle(const snapped_position& a, const snapped_position& b,
                                         const snapped_position& c, int f)
        : fraction(f), origin{{exact::floor_shift(min3(a.x, b.x, c.x), f), exact::floor_shift(min3(a.y, b.y, c.y), f),
                               exact::floor_shift(min3(a.z, b.z, c.z), f)}} {
        const auto relative = [&](const snapped_position& q) {
            return triple<Int>{{static_cast<Int>(q.x - (origin[0] << f)), static_cast<Int>(q.y - (origin[1] << f)),
                                static_cast<Int>(q.z - (origin[2] << f))}};
        };
        p[0] = relative(a);
        p[1] = relative(b);
        p[2] = relative(c);
        const Int ux = p[1][0] - p[0][0], uy = p[1][1] - p[0][1], uz = p[1][2] - p[0][2];
        const Int vx = p[2][0] - p[0][0], vy = p[2][1] - p[0][1], vz = p[2][2] - p[0][2];
        normal = {{uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx}};
    }
};

// Calls emit(v), the lower voxel of a link of the even direction d that crosses the triangle, for each such link of
// which an end lies in the grid, and for others beyond it. v counts from the grid.
VOXELPIPE_ANY_CALLABLE
template <class Int, class Emit>
VOXELPIPE_HD constexpr void for_each_link(const link_triangle<Int>& t, const glm::ivec3& d, const glm::ivec3& extent,
                                          Emit&& emit) {
    const arm s = arm_of_link(d);
    const Int facing = s.along(t.normal);
    if (facing == 0) return;
    const int x = s.x(), y = s.y(), f = t.fraction;
    const Int a = s.shear[0], b = s.shear[1];
    const bool faces_up = facing > 0;
    Int px[3]{}, py[3]{};
    for (int i = 0; i < 3; ++i) {
        px[i] = t.p[i][x] - a * t.p[i][s.pivot];
        py[i] = t.p[i][y] - b * t.p[i][s.pivot];
    }
    // The lines whose centres lie in the projection's bounding box and that the grid or a neighbour of it has.
    const auto lines = [&](const Int(&q)[3], int axis, int shear) {
        const std::int64_t half = static_cast<std::int64_t>(1 - shear) << (f - 1);
        const std::int64_t base = t.origin[axis] - shear * t.origin[s.pivot];
        const index_span met{exact::ceil_shift(static_cast<std::int64_t>(min3(q[0], q[1], q[2])) - half, f),
                             exact::floor_shift(static_cast<std::int64_t>(max3(q[0], q[1], q[2])) - half, f)};
        const std::int64_t along = extent[s.pivot],
                           low = shear > 0   ? -along
                                 : shear < 0 ? -1
                                             : 0,
                           high = shear > 0   ? 1
                                  : shear < 0 ? along
                                              : 0;
        return intersect(met, {-1 + low - base, extent[axis] + high - base});
    };
    const index_span columns = lines(px, x, s.shear[0]), rows = lines(py, y, s.shear[1]);
    if (columns.empty() || rows.empty()) return;
    // The offset's sign for coefficients along x, y and the pivot.
    const auto is_positive = [&](Int of_x, Int of_y, Int of_pivot) {
        triple<Int> c{};
        c[x] = of_x;
        c[y] = of_y;
        c[s.pivot] = of_pivot;
        return centre_offset<>::is_positive(c);
    };
    half_plane<Int> edge[3]{};
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        const Int ea = faces_up ? py[i] - py[j] : py[j] - py[i], eb = faces_up ? px[j] - px[i] : px[i] - px[j];
        const Int half = (ea * (1 - a) + eb * (1 - b)) << (f - 1);
        const Int tie = is_positive(ea, eb, -(a * ea + b * eb)) ? 0 : 1;
        edge[i] = {ea, eb, exact::floor_shift<Int>(half - (ea * px[i] + eb * py[i]) - tie, f)};
    }
    const triple<Int> n = faces_up ? t.normal : triple<Int>{{-t.normal[0], -t.normal[1], -t.normal[2]}};
    const Int step = faces_up ? facing : -facing;
    const int128 half = (static_cast<int128>(n[0]) + n[1] + n[2]) << (f - 1);
    const int128 tie = centre_offset<>::is_positive(n) ? 0 : 1;
    const Int offset = static_cast<Int>(exact::floor_shift<int128>(half - dot128(n, t.p[0]) - tie, f));
    for (std::int64_t row = rows.lo; row <= rows.hi; ++row) {
        std::int64_t lo = columns.lo, hi = columns.hi;
        narrow_row(edge, Int{row}, lo, hi);
        for (std::int64_t column = lo; column <= hi; ++column) {
            const Int at = n[x] * column + n[y] * row + offset;
            const auto before = -static_cast<std::int64_t>(exact::floor_div<Int>(at, step)) - 1;
            glm::ivec3 v{};
            const std::int64_t w = t.origin[s.pivot] + before, u = t.origin[x] + column + s.shear[0] * before,
                               r = t.origin[y] + row + s.shear[1] * before;
            // Beyond the neighbours of the grid there is no link of it; so an int holds the voxel.
            if (w < -1 || w > extent[s.pivot] || u < -1 || u > extent[x] || r < -1 || r > extent[y]) continue;
            v[s.pivot] = static_cast<int>(w);
            v[x] = static_cast<int>(u);
            v[y] = static_cast<int>(r);
            emit(v);
        }
    }
}

// Where the plane with normal n through `a` crosses the link of direction d from the unmoved centre `from`, in units of
// the link: the limit of the moved link's position, so 0 to 1. n . d is not 0. Products of 83 and 41 bits, three of
// them: less than 2^126; the denominator is less than 2^(84.6 + F).
[[nodiscard]] VOXELPIPE_HD inline edge_position position_on_link(const exact_normal& n, const snapped_position& a,
                                                                 const snapped_position& from, const glm::ivec3& d,
                                                                 int fraction) {
    const int128 dot = n.x * (a.x - from.x) + n.y * (a.y - from.y) + n.z * (a.z - from.z);
    const int128 depth = n.x * d.x + n.y * d.y + n.z * d.z;
    return {static_cast<uint128>(depth > 0 ? dot : -dot), static_cast<uint128>(depth > 0 ? depth : -depth) << fraction};
}

[[nodiscard]] VOXELPIPE_HD constexpr int width_of(uint128 n) {
    const auto high = static_cast<std::uint64_t>(n >> 64), low = static_cast<std::uint64_t>(n);
    std::uint64_t left = high != 0 ? high : low;
    int width = high != 0 ? 64 : 0;
    for (int step = 32; step != 0; step >>= 1)
        if (left >> step != 0) {
            left >>= step;
            width += step;
        }
    return width + static_cast<int>(left);
}

// The float nearest to a position, 0 to 1, ties to even: one rounding. 0, which is the position of a crossing that only
// the offset moves away from the centre, gives 2^-126, the least normal float. Numerator and denominator are below
// 2^101, so that no other position is less than 2^-101.
[[nodiscard]] VOXELPIPE_HD inline float to_link_fraction(const edge_position& p) {
    if (p.numerator == 0) return 0x1p-126f;
    // A quotient of 25 or 26 bits, and whether something is left, which the conversion to float rounds once.
    const int shift = width_of(p.denominator) - width_of(p.numerator) + 25;
    const uint128 numerator = p.numerator << shift, quotient = numerator / p.denominator;
    const bool has_rest = quotient * p.denominator != numerator;
    const auto digits = static_cast<std::int64_t>(2 * quotient + (has_rest ? 1 : 0));
    // 2^-(shift + 1), an exact factor.
    const float scale = core::bit_cast<float>(static_cast<std::uint32_t>(127 - (shift + 1)) << 23);
    return exact::mul(exact::to_float(digits), scale);
}

} // namespace core
} // namespace voxelpipe
