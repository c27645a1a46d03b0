// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bounds of a triangle's distance from eight points at once, in float, around an origin of their own. They only reject;
// what remains is decided by core/point_triangle.hpp.

#include <cpu_ref/distance/triangle_tree.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace voxelpipe::cpu {

struct lane_points {
    lane_floats x, y, z;
};

// A triangle relative to an origin, in units.
//
// The bounds and their error. Let R be a bound of the coordinates of vertices and points relative to the origin. The
// point A + v ab + w ac with v, w >= 0 and v + w <= 1 lies in the triangle whatever v and w are, so its distance is an
// upper bound; and for any direction u of length 1 the least of u.(V_i - s) over the vertices is a lower one. Neither
// depends on how well v, w and u were chosen: slivers only make them weak. What is left is rounding, with 2^-24 R as
// the unit: vertices 1 and points 3 each, ap, ab and ac 2 each, two products of at most 2R 2 each, their sum and the
// last difference 2 and 4, and 4 for a v + w of up to 1 + 2^-23: 26 a component, 46 in length, and less than 40 more
// for length and quotient of a vector of at most 2 sqrt(3) R, and for what callers add to it: below 128, which is 2^-17
// R.
struct local_triangle {
    std::array<float, 3> a, ab, ac;
    float d00, d01, d11;          // products of ab and ac
    float inverse, i00, i11, i22; // of the square of the area, and of ab, ac and ac - ab; 0 instead of infinity
    std::array<float, 3> middle;  // of a ball that holds the triangle
    float radius;                 // enlarged by `error`
    float error;                  // E
    std::uint32_t at;             // its number in the tree
};

// reach: bound of the points' coordinates.
[[nodiscard]] inline local_triangle make_local(const placed_triangle& t, std::uint32_t at, const vector3& origin,
                                               float reach) {
    local_triangle r{};
    r.at = at;
    std::array<std::array<float, 3>, 3> v{};
    float most = reach;
    for (std::size_t i = 0; i < 3; ++i) {
        v[i] = {static_cast<float>(t.vertex[i].x - origin.x), static_cast<float>(t.vertex[i].y - origin.y),
                static_cast<float>(t.vertex[i].z - origin.z)};
        for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::abs(v[i][k]));
    }
    r.error = 0x1p-17f * most;
    const auto inverse_of = [](float f) { return f > 1e-30f && f < 1e30f ? 1.0f / f : 0.0f; };
    float d22 = 0.0f, far = 0.0f;
    for (std::size_t k = 0; k < 3; ++k) {
        r.a[k] = v[0][k];
        r.ab[k] = v[1][k] - v[0][k];
        r.ac[k] = v[2][k] - v[0][k];
        const float bc = v[2][k] - v[1][k];
        r.d00 += r.ab[k] * r.ab[k];
        r.d01 += r.ab[k] * r.ac[k];
        r.d11 += r.ac[k] * r.ac[k];
        d22 += bc * bc;
        r.middle[k] = 0.5f * (std::min({v[0][k], v[1][k], v[2][k]}) + std::max({v[0][k], v[1][k], v[2][k]}));
    }
    for (std::size_t i = 0; i < 3; ++i) {
        float square = 0.0f;
        for (std::size_t k = 0; k < 3; ++k) square += (v[i][k] - r.middle[k]) * (v[i][k] - r.middle[k]);
        far = std::max(far, square);
    }
    r.radius = std::sqrt(far) + r.error;
    r.inverse = inverse_of(r.d00 * r.d11 - r.d01 * r.d01);
    r.i00 = inverse_of(r.d00);
    r.i11 = inverse_of(r.d11);
    r.i22 = inverse_of(d22);
    return r;
}

// Bounds from the ball.
VOXELPIPE_INLINE void ball_bounds(const local_triangle& t, const lane_points& p, lane_floats& lower,
                                  lane_floats& upper) {
    for (std::size_t l = 0; l < lanes; ++l) {
        const float x = p.x[l] - t.middle[0], y = p.y[l] - t.middle[1], z = p.z[l] - t.middle[2];
        const float length = std::sqrt(x * x + y * y + z * z);
        lower[l] = length - t.radius;
        upper[l] = length + t.radius;
    }
}

// Bounds from a point and a direction; see local_triangle.
VOXELPIPE_INLINE void close_bounds(const local_triangle& t, const lane_points& p, lane_floats& lower,
                                   lane_floats& upper) {
    const auto unit = [](float a) { return a > 0.0f ? a < 1.0f ? a : 1.0f : 0.0f; };
    for (std::size_t l = 0; l < lanes; ++l) {
        const float x = p.x[l] - t.a[0], y = p.y[l] - t.a[1], z = p.z[l] - t.a[2];
        const float d1 = t.ab[0] * x + t.ab[1] * y + t.ab[2] * z, d2 = t.ac[0] * x + t.ac[1] * y + t.ac[2] * z;
        const float fv = (t.d11 * d1 - t.d01 * d2) * t.inverse, fw = (t.d00 * d2 - t.d01 * d1) * t.inverse;
        const float t0 = unit(d1 * t.i00), t1 = unit(d2 * t.i11), t2 = unit((d2 - d1 + t.d00 - t.d01) * t.i22);
        const auto square_at = [&](float v, float w) {
            const float qx = x - (v * t.ab[0] + w * t.ac[0]), qy = y - (v * t.ab[1] + w * t.ac[1]),
                        qz = z - (v * t.ab[2] + w * t.ac[2]);
            return qx * qx + qy * qy + qz * qz;
        };
        const float s0 = square_at(t0, 0.0f), s1 = square_at(0.0f, t1), s2 = square_at(1.0f - t2, t2);
        float v = s1 < s0 ? 0.0f : t0, w = s1 < s0 ? t1 : 0.0f;
        const float s01 = s1 < s0 ? s1 : s0;
        v = s2 < s01 ? 1.0f - t2 : v;
        w = s2 < s01 ? t2 : w;
        const bool inside = (fv > 0.0f) & (fw > 0.0f) & (fv + fw < 1.0f);
        v = inside ? fv : v;
        w = inside ? fw : w;
        const float qx = x - (v * t.ab[0] + w * t.ac[0]), qy = y - (v * t.ab[1] + w * t.ac[1]),
                    qz = z - (v * t.ab[2] + w * t.ac[2]);
        const float length = std::sqrt(qx * qx + qy * qy + qz * qz);
        const float to_a = qx * x + qy * y + qz * z;
        const float along_b = qx * t.ab[0] + qy * t.ab[1] + qz * t.ab[2];
        const float along_c = qx * t.ac[0] + qy * t.ac[1] + qz * t.ac[2];
        const float most = std::max(std::max(along_b, along_c), 0.0f);
        const float least = (to_a - most) / std::max(length, 1e-18f);
        upper[l] = length + t.error;
        lower[l] = least - t.error;
    }
}

} // namespace voxelpipe::cpu
