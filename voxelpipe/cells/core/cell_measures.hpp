// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a triangle's part in a voxel measures beside its cover and volume, for those who ask: moments, areas, and which
// edges reach the voxel (docs/design.md, "Cut cells").

#include <voxelpipe/cells/core/cut_polygon.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

inline constexpr int cell_unit_bits = 44; // u = 2^-44 of a voxel, or of a voxel's face
inline constexpr int area_unit_bits = 40; // areas are multiples of 2^-40 of cell_areas::unit

// The nearest multiple of 2^-bits, halves away from 0, for |v| < 2^(62 - bits).
template <int Bits>
[[nodiscard]] VOXELPIPE_HD inline std::int64_t round_to_units(double v) {
    constexpr auto per_unit = static_cast<double>(std::int64_t{1} << Bits);
    const double magnitude = exact::fma(v < 0.0 ? -v : v, per_unit, 0.5);
    const auto units = static_cast<std::int64_t>(magnitude);
    return v < 0.0 ? -units : units;
}
// R[v]: the nearest multiple of u, halves away from 0, for |v| < 2^18.
[[nodiscard]] VOXELPIPE_HD inline std::int64_t round_to_cell_units(double v) {
    return round_to_units<cell_unit_bits>(v);
}

// ---- what is asked for ----------------------------------------------------------------------------------------------

inline constexpr unsigned needs_centroid = 1, needs_area = 2, needs_sheets = 4, needs_faces = 8; // bits

// What a triangle adds to a row: to the cover before the voxel's upper face, and to the volume within the voxel.
struct cell_terms {
    std::int64_t cover, volume; // a and c, in u
};
// Moments of the cover about the pixel's centre, in u.
struct cover_moment_terms {
    std::int64_t cover_y, cover_z;
};
// Moments of the volume about the voxel's centre, in u.
struct moment_terms {
    std::int64_t volume_x, volume_y, volume_z;
};
// The part's area, and its moments about the voxel's centre.
struct area_terms {
    std::int64_t area, area_x, area_y, area_z;
};
struct sheet_terms {
    std::uint32_t triangle; // in the call
};
template <int>
struct no_terms {};
template <unsigned Needs>
struct terms_of_needs
    : cell_terms,
      std::conditional_t<(Needs & (needs_centroid | needs_faces)) != 0, cover_moment_terms, no_terms<3>>,
      std::conditional_t<(Needs & needs_centroid) != 0, moment_terms, no_terms<0>>,
      std::conditional_t<(Needs & needs_area) != 0, area_terms, no_terms<1>>,
      std::conditional_t<(Needs & needs_sheets) != 0, sheet_terms, no_terms<2>> {};
template <>
struct terms_of_needs<0> : cell_terms {};

template <class Terms>
inline constexpr bool has_cover_moments = std::is_base_of_v<cover_moment_terms, Terms>;
template <class Terms>
inline constexpr bool has_moments = std::is_base_of_v<moment_terms, Terms>;
template <class Terms>
inline constexpr bool has_areas = std::is_base_of_v<area_terms, Terms>;
template <class Terms>
inline constexpr bool has_sheets = std::is_base_of_v<sheet_terms, Terms>;

// ---- moments --------------------------------------------------------------------------------------------------------

// Sums over a pixel's part, or over what a triangle covers of it: of 1, and of y and z from the pixel's centre.
struct pixel_sums {
    std::int64_t cover, y, z;
};

// A polygon's moments about the centre of its voxel, in the projection, positive where n_x < 0: integrals of y and z;
// of y h and z h, where h is the distance along x to the voxel's upper face; and of x over that distance, h (1 - h) /
// 2. Its corners are measured.
struct polygon_moments {
    double cover_y, cover_z, volume_x, volume_y, volume_z;
};
template <bool WithVolume, class Int>
[[nodiscard]] VOXELPIPE_HD polygon_moments sum_moments(const cell_triangle<Int>& t, const cut_corners<Int>& corners,
                                                       const cut_polygon& poly, std::int64_t x_place) {
    polygon_moments s{0.0, 0.0, 0.0, 0.0, 0.0};
    if (poly.count < 3) return s;
    struct corner {
        double y, z, h;
    };
    const auto corner_at = [&](int i) {
        const int k = poly.corner[i];
        corner c{corners.y[k] - 0.5, corners.z[k] - 0.5, 0.0};
        if constexpr (WithVolume) c.h = -corner_value(t, corners.at[k], 0, x_place);
        return c;
    };
    // Sums of products of two linear functions' corners: the integral over a triangle of area A is A / 12 of it.
    const auto products = [](double a0, double a1, double a2, double b0, double b1, double b2) {
        const double own = exact::fma(a0, b0, exact::fma(a1, b1, exact::mul(a2, b2)));
        return exact::fma(a0 + a1 + a2, b0 + b1 + b2, own);
    };
    const corner p = corner_at(0);
    corner q = corner_at(1);
    for (int i = 2; i < poly.count; ++i) {
        const corner r = corner_at(i);
        const double twice = exact::fma(q.z - p.z, r.y - p.y, -exact::mul(q.y - p.y, r.z - p.z));
        s.cover_y = exact::fma(twice, p.y + q.y + r.y, s.cover_y);
        s.cover_z = exact::fma(twice, p.z + q.z + r.z, s.cover_z);
        if constexpr (WithVolume) {
            s.volume_y = exact::fma(twice, products(p.y, q.y, r.y, p.h, q.h, r.h), s.volume_y);
            s.volume_z = exact::fma(twice, products(p.z, q.z, r.z, p.h, q.h, r.h), s.volume_z);
            const double squares = products(p.h, q.h, r.h, p.h, q.h, r.h);
            s.volume_x = exact::fma(twice, exact::fma(p.h + q.h + r.h, 4.0, -squares), s.volume_x);
        }
        q = r;
    }
    s.cover_y = exact::div(s.cover_y, 6.0);
    s.cover_z = exact::div(s.cover_z, 6.0);
    s.volume_x = exact::div(s.volume_x, 48.0);
    s.volume_y = exact::div(s.volume_y, 24.0);
    s.volume_z = exact::div(s.volume_z, 24.0);
    return s;
}

// ---- areas ----------------------------------------------------------------------------------------------------------

// The areas of a voxel's faces across its axes, of which the greatest is 1 to 4 times `unit`, in turned axes.
struct cell_areas {
    double face[3]; // in `unit`s
    double side;    // a power of two in the world's units; the unit of areas is its square
};

// A triangle's area by its greatest projection: the axis, and how many times larger the area is, in units of areas.
struct area_ratio {
    int axis;
    double ratio;
};
template <class Int>
[[nodiscard]] VOXELPIPE_HD area_ratio ratio_of(const cell_triangle<Int>& t, const cell_areas& areas) {
    area_ratio r{0, 0.0};
    const auto size = [&](int i) { return t.n[i] < 0 ? -t.n[i] : t.n[i]; };
    for (int i = 1; i < 3; ++i)
        if (size(i) > size(r.axis)) r.axis = i;
    if (t.n[r.axis] == 0) return r;
    const double whole = exact::to_double(size(r.axis));
    double squares = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double v = exact::mul(exact::div(exact::to_double(size(i)), whole), areas.face[i]);
        squares = exact::fma(v, v, squares);
    }
    r.ratio = exact::sqrt(squares);
    return r;
}

// The area of a polygon, and its moments about the centre of the voxel at `base`, in the triangle's units.
template <class Int>
[[nodiscard]] VOXELPIPE_HD area_terms sum_areas(const cell_triangle<Int>& t, const cut_corners<Int>& corners,
                                                const cut_polygon& poly, const std::int64_t (&base)[3],
                                                const area_ratio& of) {
    if (poly.count < 3) return {0, 0, 0, 0};
    const int u = of.axis == 2 ? 0 : of.axis + 1, v = of.axis == 0 ? 2 : of.axis - 1;
    struct corner {
        double at[3];
    };
    const auto corner_at = [&](int i) {
        corner c{};
        for (int a = 0; a < 3; ++a) c.at[a] = corner_value(t, corners.at[poly.corner[i]], a, base[a]) - 0.5;
        return c;
    };
    double area = 0.0, moment[3] = {0.0, 0.0, 0.0};
    const corner p = corner_at(0);
    corner q = corner_at(1);
    for (int i = 2; i < poly.count; ++i) {
        const corner r = corner_at(i);
        const double twice =
            exact::fma(q.at[u] - p.at[u], r.at[v] - p.at[v], -exact::mul(q.at[v] - p.at[v], r.at[u] - p.at[u]));
        const double size = exact::mul(twice < 0.0 ? -twice : twice, of.ratio);
        area = exact::fma(size, 0.5, area);
        for (int a = 0; a < 3; ++a) moment[a] = exact::fma(size, p.at[a] + q.at[a] + r.at[a], moment[a]);
        q = r;
    }
    const auto round = [](double of_sum) { return round_to_units<area_unit_bits>(exact::div(of_sum, 6.0)); };
    return {round_to_units<area_unit_bits>(area), round(moment[0]), round(moment[1]), round(moment[2])};
}

// ---- edges ----------------------------------------------------------------------------------------------------------

// True if a segment meets a closed voxel, whose lowest corner is `base`. Exact: no plane across an axis, or along the
// segment and an axis, parts them.
[[nodiscard]] VOXELPIPE_HD inline bool edge_meets_voxel(const snapped_position& a, const snapped_position& b,
                                                        const std::int64_t (&base)[3], int fraction) {
    const std::int64_t size = std::int64_t{1} << fraction;
    const auto magnitude = [](auto v) { return v < 0 ? -v : v; };
    // Twice the distance of the middles, and the segment's vector.
    const std::int64_t c[3] = {a.x + b.x - 2 * base[0] - size, a.y + b.y - 2 * base[1] - size,
                               a.z + b.z - 2 * base[2] - size};
    const std::int64_t d[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    for (int i = 0; i < 3; ++i) {
        if (magnitude(c[i]) > size + magnitude(d[i])) return false;
        const int j = i == 2 ? 0 : i + 1, k = i == 0 ? 2 : i - 1;
        const int128 apart = static_cast<int128>(c[j]) * d[k] - static_cast<int128>(c[k]) * d[j];
        if (magnitude(apart) > static_cast<int128>(size) * (magnitude(d[j]) + magnitude(d[k]))) return false;
    }
    return true;
}

} // namespace voxelpipe::core
