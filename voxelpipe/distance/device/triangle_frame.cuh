// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle in axes of its own, and the distance of a point from it in float, with a proved bound of its error. It
// only rejects: what it leaves is decided by core/point_triangle.hpp. Lengths are in units of the largest voxel size.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/distance/core/point_triangle.hpp>

#include <cstdint>

namespace voxelpipe::device {

// The triangle lies in the plane of X and Y, at (0, 0), (l, 0) and (p, q): its longest edge along X, so 0 <= p <= l,
// and q >= 0. u and v are the directions from (0, 0) and from (l, 0) to (p, q), with lengths u_length and v_length.
struct alignas(16) triangle_frame {
    std::int32_t origin[3]; // snapped position of (0, 0)
    std::uint32_t is_wide;  // 1: no other member is valid, because positions do not fit 32 bits
    float x_axis[3], l;
    float y_axis[3], p;
    float z_axis[3], q;
    float ux, uy, u_length, vx;
    float vy, v_length, unused[2];
};
static_assert(sizeof(triangle_frame) == 96);

// A length of the frame's numbers. The error of measure() is at most frame_error times the sum of the magnitudes of the
// point's three coordinates, the reach and l.
//
// Proof. Let r = 2^-24, and let R be that sum. A point is a brick's or an octant's centre plus an offset to a sample.
// - The centre minus the origin is an exact integer, rounded to float and scaled by a rounded factor: 3 r of the vector
//   in length. Offsets are exact halves times a rounded voxel size: 2 r. Together at most 3 r R.
// - Axes come from exact edges and an exact normal in double, so slivers have them as exact as others; rounding them to
//   float turns a vector by at most r per coordinate, 2 r R in length.
// - Each coordinate is three products of the centre, summed, and three more of the offset: 6 roundings of at most R
//   each, together 6 sqrt(3) r R < 11 r R in length.
// So the point is off by at most 16 r R. The triangle's numbers l, p and q are rounded: its corners are off by at most
// 1.5 r R, and so is every point of it. Directions u and v and their lengths: 3 r R for points of an edge.
// - The distance from an edge is that from the point at t along it: t is off by at most 4 r R whatever it is, which
//   moves the point on the edge and the distance by no more; differences and squares add 2 r R and 2 r of the
//   distance, their sum with z^2 and the root 2 r of it.
// - The inside. A point that counts as inside has y > 0 and both products of one sign. With x < 0 the first one is a
// sum
//   of two numbers that are not negative, as p >= 0 and q >= 0, so no rounding makes it negative; likewise x > l with
//   the second. Therefore 0 <= x <= l, and products and directions are off by at most 5 r R: the point lies beyond an
//   edge by no more, and beyond both at the corner (p, q), whose angle is the greatest and so at least 60 degrees, by
//   at most twice that, 10 r R. Where an inside point counts as outside, an edge is as near as that.
// The sum is below 16 + 1.5 + 3 + 4 + 2 + 4 + 10 = 40.5 r R. The bound is 64 r R; what remains holds for the roundings
// of those who add and compare, and for approximate roots.
inline constexpr float frame_error = 0x1p-18f;

// Scales of snapped positions: units of the largest voxel size.
struct frame_scale {
    double exact[3]; // a sub-voxel unit
    float unit[3];   // the same, rounded
    float voxel[3];  // a voxel
};

// a, b, c: within 2^30 of the first voxel.
[[nodiscard]] VOXELPIPE_HD inline triangle_frame make_triangle_frame(const core::snapped_position& a,
                                                                     const core::snapped_position& b,
                                                                     const core::snapped_position& c,
                                                                     const frame_scale& scale) {
    const std::int64_t v[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
    double edge[3][3], square[3];
    for (int i = 0; i < 3; ++i) {
        square[i] = 0.0;
        for (int k = 0; k < 3; ++k) {
            edge[i][k] = static_cast<double>(v[(i + 1) % 3][k] - v[i][k]) * scale.exact[k];
            square[i] += edge[i][k] * edge[i][k];
        }
    }
    const int first = square[0] >= square[1] && square[0] >= square[2] ? 0 : square[1] >= square[2] ? 1 : 2;
    // The normal of the plane: differences have 31 bits, so 64 hold the products' difference.
    double z[3], z_square = 0.0;
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const int128 n = static_cast<int128>(v[1][i] - v[0][i]) * (v[2][j] - v[0][j]) -
                         static_cast<int128>(v[1][j] - v[0][j]) * (v[2][i] - v[0][i]);
        z[k] = exact::to_double(n) * scale.exact[i] * scale.exact[j];
        z_square += z[k] * z[k];
    }
    triangle_frame f{};
    for (int k = 0; k < 3; ++k) f.origin[k] = static_cast<std::int32_t>(v[first][k]);
    double x[3] = {1.0, 0.0, 0.0}, y[3];
    const double* const longest = edge[first];
    const double* const last = edge[(first + 2) % 3]; // towards the origin
    double l = exact::sqrt(square[first]);
    if (l > 0.0)
        for (int k = 0; k < 3; ++k) x[k] = longest[k] / l;
    const bool has_area = z_square > 0.0;
    if (has_area) {
        const double length = exact::sqrt(z_square);
        for (int k = 0; k < 3; ++k) z[k] /= length;
    } else { // any that is perpendicular
        const double m[3] = {x[0] < 0 ? -x[0] : x[0], x[1] < 0 ? -x[1] : x[1], x[2] < 0 ? -x[2] : x[2]};
        const int k = m[0] <= m[1] && m[0] <= m[2] ? 0 : m[1] <= m[2] ? 1 : 2;
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double length = exact::sqrt(x[i] * x[i] + x[j] * x[j]);
        z[k] = 0.0;
        z[i] = -x[j] / length;
        z[j] = x[i] / length;
    }
    double p = 0.0, q = 0.0;
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        y[k] = z[i] * x[j] - z[j] * x[i];
        p -= last[k] * x[k];
    }
    for (int k = 0; k < 3; ++k) q -= last[k] * y[k];
    p = p < 0.0 ? 0.0 : p > l ? l : p;
    q = !has_area || q < 0.0 ? 0.0 : q;
    const double u_length = exact::sqrt(p * p + q * q), v_length = exact::sqrt((l - p) * (l - p) + q * q);
    for (int k = 0; k < 3; ++k) {
        f.x_axis[k] = static_cast<float>(x[k]);
        f.y_axis[k] = static_cast<float>(y[k]);
        f.z_axis[k] = static_cast<float>(z[k]);
    }
    f.l = static_cast<float>(l);
    f.p = static_cast<float>(p);
    f.q = static_cast<float>(q);
    f.ux = u_length > 0.0 ? static_cast<float>(p / u_length) : 1.0f;
    f.uy = u_length > 0.0 ? static_cast<float>(q / u_length) : 0.0f;
    f.u_length = static_cast<float>(u_length);
    f.vx = v_length > 0.0 ? static_cast<float>((p - l) / v_length) : -1.0f;
    f.vy = v_length > 0.0 ? static_cast<float>(q / v_length) : 0.0f;
    f.v_length = static_cast<float>(v_length);
    return f;
}

struct frame_point {
    float x, y, z;
};
// A point that is an integer of snapped positions in each coordinate, as centres of bricks and octants are.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE frame_point to_frame(const triangle_frame& f, const frame_scale& scale,
                                                                 std::int32_t x, std::int32_t y, std::int32_t z) {
    const float ox = static_cast<float>(x - f.origin[0]) * scale.unit[0],
                oy = static_cast<float>(y - f.origin[1]) * scale.unit[1],
                oz = static_cast<float>(z - f.origin[2]) * scale.unit[2];
    return {f.x_axis[0] * ox + f.x_axis[1] * oy + f.x_axis[2] * oz,
            f.y_axis[0] * ox + f.y_axis[1] * oy + f.y_axis[2] * oz,
            f.z_axis[0] * ox + f.z_axis[1] * oy + f.z_axis[2] * oz};
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float magnitude(float a) { return a < 0.0f ? -a : a; }
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float error_at(const triangle_frame& f, const frame_point& p, float reach) {
    return frame_error * (magnitude(p.x) + magnitude(p.y) + magnitude(p.z) + reach + f.l);
}

// The vector to the point from the closest point of the triangle, whose length is the distance.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE frame_point from_closest(const triangle_frame& f, const frame_point& at) {
    const auto cut = [](float t, float length) VOXELPIPE_INLINE_LAMBDA {
        return t < 0.0f ? 0.0f : t > length ? length : t;
    };
    const float x = at.x, y = at.y, w = x - f.l;
    const bool is_inside = (y > 0.0f) & (f.ux * y - f.uy * x < 0.0f) & (f.vx * y - f.vy * w > 0.0f);
    if (is_inside) return {0.0f, 0.0f, at.z};
    const float tu = cut(x * f.ux + y * f.uy, f.u_length), tv = cut(w * f.vx + y * f.vy, f.v_length);
    const float ax = x - tu * f.ux, ay = y - tu * f.uy, bx = w - tv * f.vx, by = y - tv * f.vy;
    frame_point r{x - cut(x, f.l), y, at.z};
    float least = r.x * r.x + y * y;
    if (ax * ax + ay * ay < least) {
        r = {ax, ay, at.z};
        least = ax * ax + ay * ay;
    }
    if (bx * bx + by * by < least) r = {bx, by, at.z};
    return r;
}

// A plane that has the triangle on one side. A point's distance from the triangle is at least its height above the
// plane, whatever the plane's direction: the triangle's farthest point in that direction, a vertex, bounds it.
struct frame_plane {
    float height;  // of the point that the plane was made for
    float rise[3]; // of the height by a step of one voxel along each axis
};
// direction: of the plane's upper side, of any length that is not 0. The error of heights, of this point and of those
// within the reach, is at most that of error_at: the point is off by 16 r R at most (frame_error), vertices by 1.5 r R,
// axes by 2 r R; the direction's length is off by 8 r, also by an approximate root; products and sums are 6 + 4 + 6
// roundings of R.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE frame_plane make_plane(const triangle_frame& f, const frame_scale& scale,
                                                                   const frame_point& at, const frame_point& direction,
                                                                   float length) {
    const float x = direction.x / length, y = direction.y / length, z = direction.z / length;
    const float second = x * f.l, third = x * f.p + y * f.q;
    float farthest = second > 0.0f ? second : 0.0f;
    farthest = third > farthest ? third : farthest;
    frame_plane r{x * at.x + y * at.y + z * at.z - farthest, {}};
    for (int k = 0; k < 3; ++k) r.rise[k] = (x * f.x_axis[k] + y * f.y_axis[k] + z * f.z_axis[k]) * scale.voxel[k];
    return r;
}

// The square of the point's distance from the triangle.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float measure(const triangle_frame& f, const frame_point& at) {
    const auto cut = [](float t, float length) VOXELPIPE_INLINE_LAMBDA {
        return t < 0.0f ? 0.0f : t > length ? length : t;
    };
    const float x = at.x, y = at.y, w = x - f.l;
    const float dx = x - cut(x, f.l);
    const float base = dx * dx + y * y;
    const float tu = cut(x * f.ux + y * f.uy, f.u_length), tv = cut(w * f.vx + y * f.vy, f.v_length);
    const float ax = x - tu * f.ux, ay = y - tu * f.uy, bx = w - tv * f.vx, by = y - tv * f.vy;
    const float a = ax * ax + ay * ay, b = bx * bx + by * by;
    const bool is_inside = (y > 0.0f) & (f.ux * y - f.uy * x < 0.0f) & (f.vx * y - f.vy * w > 0.0f);
    float least = a < base ? a : base;
    least = b < least ? b : least;
    return (is_inside ? 0.0f : least) + at.z * at.z;
}

} // namespace voxelpipe::device
