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

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

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

// Four floats side by side: SSE2 registers where the compiler has them.
#if defined(__SSE2__)
struct four {
    __m128 v;
    [[nodiscard]] static four all(float a) { return {_mm_set1_ps(a)}; }
    [[nodiscard]] static four load(const float* p) { return {_mm_loadu_ps(p)}; }
    void store(float* p) const { _mm_storeu_ps(p, v); }
    friend four operator+(four a, four b) { return {_mm_add_ps(a.v, b.v)}; }
    friend four operator-(four a, four b) { return {_mm_sub_ps(a.v, b.v)}; }
    friend four operator*(four a, four b) { return {_mm_mul_ps(a.v, b.v)}; }
    friend four operator/(four a, four b) { return {_mm_div_ps(a.v, b.v)}; }
    friend four operator<(four a, four b) { return {_mm_cmplt_ps(a.v, b.v)}; } // a mask
    friend four operator&(four a, four b) { return {_mm_and_ps(a.v, b.v)}; }   // of masks
    [[nodiscard]] static four select(four mask, four yes, four no) {
        return {_mm_or_ps(_mm_and_ps(mask.v, yes.v), _mm_andnot_ps(mask.v, no.v))};
    }
    // Both give the second argument where one is NaN.
    [[nodiscard]] static four min(four a, four b) { return {_mm_min_ps(a.v, b.v)}; }
    [[nodiscard]] static four max(four a, four b) { return {_mm_max_ps(a.v, b.v)}; }
    [[nodiscard]] static four root(four a) { return {_mm_sqrt_ps(a.v)}; }
    [[nodiscard]] static unsigned bits(four mask) { return static_cast<unsigned>(_mm_movemask_ps(mask.v)); }
};
#else
struct four {
    std::array<float, 4> v;
    template <class F>
    [[nodiscard]] static four of(const F& f) {
        return {{f(0), f(1), f(2), f(3)}};
    }
    [[nodiscard]] static four all(float a) { return {{a, a, a, a}}; }
    [[nodiscard]] static four load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
    void store(float* p) const { std::copy(v.begin(), v.end(), p); }
    friend four operator+(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] + b.v[i]; });
    }
    friend four operator-(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] - b.v[i]; });
    }
    friend four operator*(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] * b.v[i]; });
    }
    friend four operator/(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] / b.v[i]; });
    }
    friend four operator<(const four& a, const four& b) { // a mask: 1 or 0
        return of([&](std::size_t i) { return a.v[i] < b.v[i] ? 1.0f : 0.0f; });
    }
    friend four operator&(const four& a, const four& b) { return a * b; } // of masks
    [[nodiscard]] static four select(const four& mask, const four& yes, const four& no) {
        return of([&](std::size_t i) { return mask.v[i] != 0.0f ? yes.v[i] : no.v[i]; });
    }
    // Both give the second argument where one is NaN.
    [[nodiscard]] static four min(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
    }
    [[nodiscard]] static four max(const four& a, const four& b) {
        return of([&](std::size_t i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
    }
    [[nodiscard]] static four root(const four& a) {
        return of([&](std::size_t i) { return std::sqrt(a.v[i]); });
    }
    [[nodiscard]] static unsigned bits(const four& mask) {
        unsigned r = 0;
        for (std::size_t i = 0; i < 4; ++i) r |= static_cast<unsigned>(mask.v[i] != 0.0f) << i;
        return r;
    }
};
#endif

// Bounds from the ball.
VOXELPIPE_INLINE void ball_bounds(const local_triangle& t, const lane_points& p, lane_floats& lower,
                                  lane_floats& upper) {
    for (std::size_t l = 0; l < lanes; l += 4) {
        const four x = four::load(&p.x[l]) - four::all(t.middle[0]), y = four::load(&p.y[l]) - four::all(t.middle[1]),
                   z = four::load(&p.z[l]) - four::all(t.middle[2]);
        const four length = four::root(x * x + y * y + z * z), radius = four::all(t.radius);
        (length - radius).store(&lower[l]);
        (length + radius).store(&upper[l]);
    }
}

// Bounds from a point and a direction; see local_triangle.
VOXELPIPE_INLINE void close_bounds(const local_triangle& t, const lane_points& p, lane_floats& lower,
                                   lane_floats& upper) {
    const four zero = four::all(0.0f), one = four::all(1.0f);
    const auto unit = [&](four a) { return four::min(four::max(a, zero), one); };
    const four abx = four::all(t.ab[0]), aby = four::all(t.ab[1]), abz = four::all(t.ab[2]);
    const four acx = four::all(t.ac[0]), acy = four::all(t.ac[1]), acz = four::all(t.ac[2]);
    const four d00 = four::all(t.d00), d01 = four::all(t.d01), d11 = four::all(t.d11), i = four::all(t.inverse);
    for (std::size_t l = 0; l < lanes; l += 4) {
        const four x = four::load(&p.x[l]) - four::all(t.a[0]), y = four::load(&p.y[l]) - four::all(t.a[1]),
                   z = four::load(&p.z[l]) - four::all(t.a[2]);
        const four d1 = abx * x + aby * y + abz * z, d2 = acx * x + acy * y + acz * z;
        const four fv = (d11 * d1 - d01 * d2) * i, fw = (d00 * d2 - d01 * d1) * i;
        const four inside = (zero < fv) & (zero < fw) & (fv + fw < one);
        four v = fv, w = fw;
        if (four::bits(inside) != 15u) {
            const four t0 = unit(d1 * four::all(t.i00)), t1 = unit(d2 * four::all(t.i11)),
                       t2 = unit((d2 - d1 + d00 - d01) * four::all(t.i22)), rest = one - t2;
            const auto square_at = [&](four m, four n) {
                const four qx = x - (m * abx + n * acx), qy = y - (m * aby + n * acy), qz = z - (m * abz + n * acz);
                return qx * qx + qy * qy + qz * qz;
            };
            const four s0 = square_at(t0, zero), s1 = square_at(zero, t1), s2 = square_at(rest, t2);
            const four first = s1 < s0, third = s2 < four::min(s0, s1);
            const four ev = four::select(third, rest, four::select(first, zero, t0));
            const four ew = four::select(third, t2, four::select(first, t1, zero));
            v = four::select(inside, fv, ev);
            w = four::select(inside, fw, ew);
        }
        const four qx = x - (v * abx + w * acx), qy = y - (v * aby + w * acy), qz = z - (v * abz + w * acz);
        const four length = four::root(qx * qx + qy * qy + qz * qz);
        const four along_b = qx * abx + qy * aby + qz * abz, along_c = qx * acx + qy * acy + qz * acz;
        const four along = qx * x + qy * y + qz * z - four::max(four::max(along_b, along_c), zero);
        const four error = four::all(t.error);
        (length + error).store(&upper[l]);
        (along / four::max(length, four::all(1e-18f)) - error).store(&lower[l]);
    }
}

} // namespace voxelpipe::cpu
