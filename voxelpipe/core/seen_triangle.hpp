// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle as seen from a sample: exact integers, each rounded to double once, then operations of one rounding in a
// fixed order. Distances (distance/core/point_triangle.hpp) and solid angles (solid/core/solid_angle.hpp) are made of
// them. A sum of three doubles is (least + middle) + greatest: neither the order of axes nor of vertices shows, and no
// compiler contracts it, because what is added comes from a minimum or a maximum.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/triangle_setup.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace voxelpipe::core {

// Lengths of a unit of snapped positions, and what the formula needs of them; rounded on the host, once.
struct distance_scale {
    triple<double> length; // s: world units a sub-voxel unit, per axis
    triple<double> area;   // s_j s_k: turns normals of grid space into world normals
    triple<double> w;      // s^2
    triple<double> g;      // (s_j s_k)^2
    double c;              // s_x s_y s_z
};

// Voxel sizes from 2^-100 to 2^100 keep every number of the formula normal.
[[nodiscard]] inline bool are_measurable(const glm::dvec3& voxel_size) {
    for (int i = 0; i < 3; ++i)
        if (!(voxel_size[i] >= 0x1p-100 && voxel_size[i] <= 0x1p100)) return false;
    return true;
}

// voxel_size: are_measurable. fraction: F of the grid.
[[nodiscard]] inline distance_scale make_distance_scale(const glm::dvec3& voxel_size, int fraction) {
    distance_scale r{};
    for (int i = 0; i < 3; ++i) r.length[i] = std::ldexp(voxel_size[i], -fraction);
    for (int i = 0; i < 3; ++i) {
        r.w[i] = exact::mul(r.length[i], r.length[i]);
        r.area[i] = exact::mul(r.length[(i + 1) % 3], r.length[(i + 2) % 3]);
        r.g[i] = exact::mul(r.area[i], r.area[i]);
    }
    double s[3] = {r.length[0], r.length[1], r.length[2]};
    std::sort(s, s + 3);
    r.c = exact::mul(exact::mul(s[0], s[1]), s[2]);
    return r;
}

// a + b with one rounding. On the host neither may be a product that the compiler sees.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double add_doubles(double a, double b) {
#if defined(__CUDA_ARCH__)
    return __dadd_rn(a, b);
#else
    return a + b;
#endif
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double lesser(double a, double b) { return b < a ? b : a; }
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double greater(double a, double b) { return a < b ? b : a; }
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double magnitude_of(double a) { return a < 0.0 ? -a : a; }

// (least + middle) + greatest.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double ordered_sum(double a, double b, double c) {
    const double low = lesser(a, b), high = greater(a, b);
    const double least = lesser(low, c), other = greater(low, c);
    return add_doubles(add_doubles(least, lesser(other, high)), greater(other, high));
}

// sum of f_i (a_i b_i), each product with one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double scaled_dot(const triple<double>& f, const triple<double>& a,
                                                              const triple<double>& b) {
    return ordered_sum(exact::mul(f[0], exact::mul(a[0], b[0])), exact::mul(f[1], exact::mul(a[1], b[1])),
                       exact::mul(f[2], exact::mul(a[2], b[2])));
}

// A triangle as seen from a sample: exact integers, each rounded to double once.
struct seen_triangle {
    triple<triple<double>> vertex; // A, B, C: vertices minus sample
    triple<triple<double>> edge;   // B - A, C - B, A - C
    triple<triple<double>> cross;  // A x B, B x C, C x A
    triple<double> normal;         // their sum, (B - A) x (C - A)
    double volume;                 // normal . A
};

// ---- the integers ---------------------------------------------------------------------------------------------------

// The narrow form: components of vertices minus sample and of edges of at most 2^25, as all triangles of a grid have
// them. Crosses and normals are at most 2^51, so doubles hold them, and every operation below is exact: compilers may
// contract them. The volume needs 78 bits: normal = high * 2^26 + low, with |high| <= 2^25 and 0 <= low < 2^26, makes
// two sums below 3 * 2^51 that are exact, and their one sum rounds the volume once.
inline constexpr std::int64_t narrow_distance_limit = std::int64_t{1} << 25;

// True if the triangle has a narrow form for all samples from 0 to `most`, which are coordinates of snapped positions.
// A grid's part has most = extent << F, at most 2^24 + 2^15.
[[nodiscard]] VOXELPIPE_HD constexpr bool is_narrow(const snapped_position& a, const snapped_position& b,
                                                    const snapped_position& c, const triple<std::int64_t>& most) {
    const triple<std::int64_t> low{{min3(a.x, b.x, c.x), min3(a.y, b.y, c.y), min3(a.z, b.z, c.z)}};
    const triple<std::int64_t> high{{max3(a.x, b.x, c.x), max3(a.y, b.y, c.y), max3(a.z, b.z, c.z)}};
    for (int k = 0; k < 3; ++k)
        if (low[k] < most[k] - narrow_distance_limit || high[k] > narrow_distance_limit ||
            high[k] - low[k] > narrow_distance_limit)
            return false;
    return true;
}

struct narrow_triangle {
    triple<triple<double>> vertex; // snapped
    triple<triple<double>> edge;
    triple<double> normal, normal_high, normal_low;
};

// True if the triangle has a narrow form for every sample whose coordinates are from 0 to 2^24 + 2^15, as those of a
// grid are. (2^24 + 2^23 minus 0, and 2^24 + 2^15 plus 2^23, are below 2^25.)
[[nodiscard]] VOXELPIPE_HD constexpr bool is_narrow_in_grid(const snapped_position& a, const snapped_position& b,
                                                            const snapped_position& c) {
    constexpr std::int64_t low = -(std::int64_t{1} << 23) + (std::int64_t{1} << 15),
                           high = (std::int64_t{1} << 24) + (std::int64_t{1} << 23) - 1;
    return min3(a.x, b.x, c.x) >= low && max3(a.x, b.x, c.x) <= high && min3(a.y, b.y, c.y) >= low &&
           max3(a.y, b.y, c.y) <= high && min3(a.z, b.z, c.z) >= low && max3(a.z, b.z, c.z) <= high;
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE narrow_triangle make_narrow(const snapped_position& a,
                                                                        const snapped_position& b,
                                                                        const snapped_position& c) {
    narrow_triangle t{};
    t.vertex[0] = {{static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)}};
    t.vertex[1] = {{static_cast<double>(b.x), static_cast<double>(b.y), static_cast<double>(b.z)}};
    t.vertex[2] = {{static_cast<double>(c.x), static_cast<double>(c.y), static_cast<double>(c.z)}};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) t.edge[i][k] = t.vertex[i == 2 ? 0 : i + 1][k] - t.vertex[i][k];
    for (int k = 0; k < 3; ++k) {
        const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
        // (B - A) x (C - B)
        const double n = t.edge[0][i] * t.edge[1][j] - t.edge[0][j] * t.edge[1][i];
        const auto whole = static_cast<std::int64_t>(n);
        t.normal[k] = n;
        t.normal_high[k] = static_cast<double>(whole >> 26);
        t.normal_low[k] = static_cast<double>(whole & ((std::int64_t{1} << 26) - 1));
    }
    return t;
}

// x, y, z: the sample, an integer each.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE seen_triangle see(const narrow_triangle& t, double x, double y, double z) {
    seen_triangle s{};
    for (int i = 0; i < 3; ++i) s.vertex[i] = {{t.vertex[i][0] - x, t.vertex[i][1] - y, t.vertex[i][2] - z}};
    s.edge = t.edge;
    for (int i = 0; i < 3; ++i) {
        const triple<double>&v = s.vertex[i], &e = t.edge[i]; // v x (v + e) = v x e
        s.cross[i] = {{v[1] * e[2] - v[2] * e[1], v[2] * e[0] - v[0] * e[2], v[0] * e[1] - v[1] * e[0]}};
    }
    s.normal = t.normal;
    const triple<double>& v = s.vertex[0];
    const double high = t.normal_high[0] * v[0] + t.normal_high[1] * v[1] + t.normal_high[2] * v[2];
    const double low = t.normal_low[0] * v[0] + t.normal_low[1] * v[1] + t.normal_low[2] * v[2];
    // The product with a power of two is exact, so a fused sum and a plain one round alike.
    s.volume = high * 0x1p26 + low;
    return s;
}

// The wide form: vertices and samples of up to 2^40, in 128 bits. Differences are at most 2^41, crosses 2^83, the
// volume below 2^126.
[[nodiscard]] VOXELPIPE_HD inline seen_triangle see_wide(const snapped_position& a, const snapped_position& b,
                                                         const snapped_position& c, const snapped_position& sample) {
    const triple<std::int64_t> v[3] = {{{a.x - sample.x, a.y - sample.y, a.z - sample.z}},
                                       {{b.x - sample.x, b.y - sample.y, b.z - sample.z}},
                                       {{c.x - sample.x, c.y - sample.y, c.z - sample.z}}};
    seen_triangle s{};
    triple<int128> n{};
    for (int i = 0; i < 3; ++i) {
        const triple<std::int64_t>&p = v[i], &q = v[i == 2 ? 0 : i + 1];
        for (int k = 0; k < 3; ++k) {
            const int u = k == 2 ? 0 : k + 1, w = k == 0 ? 2 : k - 1;
            const int128 cross = static_cast<int128>(p[u]) * q[w] - static_cast<int128>(p[w]) * q[u];
            n[k] += cross;
            s.cross[i][k] = exact::to_double(cross);
            s.vertex[i][k] = static_cast<double>(p[k]);
            s.edge[i][k] = static_cast<double>(q[k] - p[k]);
        }
    }
    for (int k = 0; k < 3; ++k) s.normal[k] = exact::to_double(n[k]);
    s.volume = exact::to_double(n[0] * v[0][0] + n[1] * v[0][1] + n[2] * v[0][2]);
    return s;
}

} // namespace voxelpipe::core
