// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What one triangle adds to the voxels of its rows, in multiples of u = 2^-44: covers of pixels by edge terms, covers
// before planes, and the volume in front of a voxel's upper face. Rows run along x; a pixel is a square of y and z
// (docs/design.md, "Cut cells").

#include <voxelpipe/cells/core/cell_measures.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The edge term of a pixel, from a vertex to a later one: R[integral over the edge's z in [k, k + 1] of min(max(j + 1 -
// y(z), 0), 1) dz], negative if z falls; and with moments the integrals of y and z from the pixel's centre over what
// that covers, else 0. A function of the edge and the pixel alone. y and z: the pixel's lowest corner in the triangle's
// units.
template <bool WithMoments, class Int>
[[nodiscard]] VOXELPIPE_HD pixel_sums edge_terms(const cell_triangle<Int>& t, int first, int last, std::int64_t y,
                                                 std::int64_t z) {
    const std::int64_t size = std::int64_t{1} << t.fraction;
    const bool falls = t.p[last][2] < t.p[first][2];
    const int low = falls ? last : first, high = falls ? first : last;
    const std::int64_t y0 = t.p[low][1] - y, z0 = t.p[low][2] - z, y1 = t.p[high][1] - y, z1 = t.p[high][2] - z;
    const std::int64_t begin = z0 > 0 ? z0 : 0, end = z1 < size ? z1 : size;
    if (begin >= end) return {0, 0, 0};
    const auto sign = [&](std::int64_t cover, std::int64_t of_y, std::int64_t of_z) {
        return falls ? pixel_sums{-cover, -of_y, -of_z} : pixel_sums{cover, of_y, of_z};
    };
    // A height is a multiple of 2^-F, the part of an edge within the pixel and the moment of a height ones of 2^-(2F +
    // 1).
    const std::int64_t half_square = std::int64_t{1} << (cell_unit_bits - 2 * t.fraction - 1);
    const auto height = [&] {
        return sign((end - begin) << (cell_unit_bits - t.fraction), 0,
                    WithMoments ? (end - begin) * (begin + end - size) * half_square : 0);
    };
    if (y0 >= size && y1 >= size) return {0, 0, 0};
    if (y0 <= 0 && y1 <= 0) return height();
    const bool is_whole = y0 >= 0 && y0 <= size && y1 >= 0 && y1 <= size && begin == z0 && end == z1;
    const std::int64_t of_whole = is_whole ? (2 * size - y0 - y1) * (end - begin) * half_square : 0;
    if (!WithMoments && is_whole) return sign(of_whole, 0, 0);

    // y at a z, times the edge's height: exact.
    const auto rise = static_cast<Int>(z1 - z0), run = static_cast<Int>(y1 - y0);
    const auto y_at = [&](std::int64_t at) { return static_cast<Int>(y0) * rise + run * static_cast<Int>(at - z0); };
    const Int y_begin = y_at(begin), y_end = y_at(end), whole = static_cast<Int>(size) * rise;
    if (y_begin >= whole && y_end >= whole) return {0, 0, 0};
    if (y_begin <= 0 && y_end <= 0) return height();
    const double voxel = core::bit_cast<double>(static_cast<std::uint64_t>(1023 - t.fraction) << 52); // 2^-F
    // z, in voxels, where y is that of a side of the pixel, within the edge's part.
    const auto z_at = [&](std::int64_t side) {
        const Int n = static_cast<Int>(z0) * run + rise * static_cast<Int>(side - y0);
        const double at = exact::div(exact::mul(exact::to_double(n), voxel), exact::to_double(run));
        const double lo = exact::mul(exact::to_double(begin), voxel), hi = exact::mul(exact::to_double(end), voxel);
        return at < lo ? lo : at > hi ? hi : at;
    };
    const auto y_in_voxels = [&](Int y_times_rise) {
        return exact::div(exact::mul(exact::to_double(y_times_rise), voxel), exact::to_double(rise));
    };
    double from = exact::mul(exact::to_double(begin), voxel), to = exact::mul(exact::to_double(end), voxel);
    double beside = 0.0; // height of the part that lies below the pixel in y
    double f_from = 0.0, f_to = 0.0, beside_z = 0.0;
    const auto middle_of = [](double p, double q) { return exact::fma(p + q, 0.5, -0.5); }; // from the pixel's
    if (y_begin <= 0) { // crosses the lower side upward
        const double at = z_at(0);
        beside = at - from;
        if constexpr (WithMoments) beside_z = exact::mul(beside, middle_of(from, at));
        from = at;
        f_from = 1.0;
    } else if (y_begin >= whole) {
        from = z_at(size);
    } else {
        f_from = 1.0 - y_in_voxels(y_begin);
    }
    if (y_end <= 0) {
        const double at = z_at(0);
        beside = to - at;
        if constexpr (WithMoments) beside_z = exact::mul(beside, middle_of(at, to));
        to = at;
        f_to = 1.0;
    } else if (y_end >= whole) {
        to = z_at(size);
    } else {
        f_to = 1.0 - y_in_voxels(y_end);
    }
    const std::int64_t cover =
        is_whole ? of_whole : round_to_cell_units(exact::fma(to - from, exact::mul(f_from + f_to, 0.5), beside));
    if constexpr (!WithMoments) return sign(cover, 0, 0);
    // f is linear from `from` to `to`: integrals of f (1 - f) / 2, and of f times z.
    const double sum = f_from + f_to, squares = exact::fma(f_from, f_from, exact::mul(f_to, sum));
    const double of_y = exact::mul(to - from, exact::fma(sum, 3.0, exact::mul(squares, -2.0)));
    const double z_from = from - 0.5, z_to = to - 0.5;
    const double twice_z =
        exact::fma(f_from, exact::fma(z_from, 2.0, z_to), exact::mul(f_to, exact::fma(z_to, 2.0, z_from)));
    const double of_z = exact::fma(exact::div(to - from, 6.0), twice_z, beside_z);
    return sign(cover, round_to_cell_units(exact::div(of_y, 12.0)), round_to_cell_units(of_z));
}

// The cover of a pixel by a triangle, positive where n_x < 0, and its moments: the sums of its three edge terms, of the
// sorted triangle.
template <bool WithMoments, class Int>
[[nodiscard]] VOXELPIPE_HD pixel_sums pixel_cover(const cell_triangle<Int>& t, std::int64_t y, std::int64_t z) {
    const pixel_sums a = edge_terms<WithMoments>(t, 0, 1, y, z), b = edge_terms<WithMoments>(t, 1, 2, y, z),
                     c = edge_terms<WithMoments>(t, 0, 2, y, z);
    return {a.cover + b.cover - c.cover, a.y + b.y - c.y, a.z + b.z - c.z};
}

// A polygon within a pixel: minus its area in the projection, positive where n_x < 0; and minus the integral of the
// distance along x to the plane at x_place, which lies no further than a voxel. Its corners are measured.
struct polygon_sums {
    double cover, volume;
};
template <bool WithVolume, class Int>
[[nodiscard]] VOXELPIPE_HD polygon_sums sum_polygon(const cell_triangle<Int>& t, const cut_corners<Int>& corners,
                                                    const cut_polygon& poly, std::int64_t x_place) {
    polygon_sums s{0.0, 0.0};
    if (poly.count < 3) return s;
    const auto x_of = [&](int i) {
        if constexpr (WithVolume)
            return -corner_value(t, corners.at[poly.corner[i]], 0, x_place);
        else
            return 0.0;
    };
    const double y0 = corners.y[poly.corner[0]], z0 = corners.z[poly.corner[0]], x0 = x_of(0);
    double dy = corners.y[poly.corner[1]] - y0, dz = corners.z[poly.corner[1]] - z0;
    double x1 = x_of(1);
    for (int i = 2; i < poly.count; ++i) {
        const double ey = corners.y[poly.corner[i]] - y0, ez = corners.z[poly.corner[i]] - z0;
        const double x2 = x_of(i);
        const double twice = exact::fma(dz, ey, -exact::mul(dy, ez));
        s.cover = exact::fma(twice, 0.5, s.cover);
        if constexpr (WithVolume) s.volume = exact::fma(twice, x0 + x1 + x2, s.volume);
        dy = ey;
        dz = ez;
        x1 = x2;
    }
    if constexpr (WithVolume) s.volume = exact::div(s.volume, 6.0);
    return s;
}

// The pixels and voxels of a crop, in the triangle's units.
struct cell_box {
    std::int64_t lo[3], hi[3]; // voxels, relative to the triangle's base; `hi` is one more than the last
};
template <class Int>
[[nodiscard]] VOXELPIPE_HD cell_box make_cell_box(const cell_triangle<Int>& t, const std::int64_t (&extent)[3]) {
    cell_box b{};
    for (int i = 0; i < 3; ++i) {
        b.lo[i] = -t.base[i];
        b.hi[i] = extent[i] - t.base[i];
    }
    return b;
}

// Voxels along x that a polygon's part in its pixel column meets: those whose open interval (i, i + 1] it reaches.
struct cell_span {
    std::int64_t first, last;
};
template <class Int>
[[nodiscard]] VOXELPIPE_HD cell_span span_of(const cell_triangle<Int>& t, const cut_corners<Int>& corners,
                                             const cut_polygon& poly) {
    double lo = 0.0, hi = 0.0;
    for (int i = 0; i < poly.count; ++i) {
        const double x = corner_value(t, corners.at[poly.corner[i]], 0, 0);
        lo = i == 0 || x < lo ? x : lo;
        hi = i == 0 || x > hi ? x : hi;
    }
    // Within 2^-10 of a lattice plane exact signs decide.
    const auto floor_of = [](double v) {
        const auto n = static_cast<std::int64_t>(v);
        return n - static_cast<std::int64_t>(static_cast<double>(n) > v);
    };
    const auto all = [&](std::int64_t plane, int sign) { // sign 1: no corner below the plane, -1: none above
        for (int i = 0; i < poly.count; ++i)
            if (corner_side(corners.at[poly.corner[i]], 0, plane << t.fraction) * sign < 0) return false;
        return true;
    };
    std::int64_t first = floor_of(lo - 0x1p-10), last = -floor_of(-hi - 0x1p-10) - 1;
    if (floor_of(lo + 0x1p-10) != first && all(first + 1, 1)) ++first;
    if (-floor_of(-hi + 0x1p-10) - 1 != last && all(last, -1)) --last;
    return {first < last ? first : last, last};
}

// Sets what a triangle's part within a voxel measures. corner: the voxel's lowest, in the triangle's units. The part's
// corners are measured.
template <class Terms, class Int>
VOXELPIPE_HD void add_parts(const cell_triangle<Int>& t, const cut_corners<Int>& corners, const cut_polygon& part,
                            const std::int64_t (&corner)[3], const area_ratio& areas, Terms& terms) {
    const auto round = [&](double v) { return t.is_odd ? -round_to_cell_units(v) : round_to_cell_units(v); };
    const std::int64_t upper = corner[0] + (std::int64_t{1} << t.fraction);
    terms.volume = round(sum_polygon<true>(t, corners, part, upper).volume);
    if constexpr (has_moments<Terms>) {
        const polygon_moments m = sum_moments<true>(t, corners, part, upper);
        terms.volume_x = round(m.volume_x);
        terms.volume_y = round(m.volume_y);
        terms.volume_z = round(m.volume_z);
    }
    if constexpr (has_areas<Terms>) static_cast<area_terms&>(terms) = sum_areas(t, corners, part, corner, areas);
}

// Calls visit(y, z, i, terms) for each voxel of a pixel in which a part of the triangle lies, relative to its base: i
// from lo[0] - 1, which stands for all voxels before the box, to hi[0], for all behind it.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Int, class Visit>
VOXELPIPE_HD void for_each_cell_of_pixel(const cell_triangle<Int>& t, const cut_polygon& column, cutting_planes& planes,
                                         cut_corners<Int>& corners, const cell_box& box, const area_ratio& areas,
                                         std::int64_t j, std::int64_t k, Visit&& visit) {
    const std::int64_t y = j << t.fraction, z = k << t.fraction;
    const auto oriented = [&](std::int64_t v) { return t.is_odd ? -v : v; };
    pixel_sums row = pixel_cover<has_cover_moments<Terms>>(t, y, z);
    row = {oriented(row.cover), oriented(row.y), oriented(row.z)};
    cell_span span{-1, -1}; // in the lower plane of the lowest voxel
    if (t.reach[0] > 1)
        span = span_of(t, corners, column);
    else
        for (int c = 0; c < column.count; ++c)
            if (corner_side(corners.at[column.corner[c]], 0, 0) > 0) span = {0, 0};
    const int num_corners = corners.count;
    for (int c = 0; c < column.count; ++c) measure_corner(t, corners, column.corner[c], y, z);
    const auto cut_at = [&](int plane, std::int64_t place, cut_polygon& poly) {
        const int known = corners.count;
        planes.at[plane] = place << t.fraction;
        cut(t, planes, plane, plane == 1, corners, poly);
        for (int c = known; c < corners.count; ++c) measure_corner(t, corners, c, y, z);
    };
    const std::int64_t before_box = box.lo[0] - 1;
    pixel_sums so_far{0, 0, 0}; // B at the lower face of the next voxel
    std::int64_t i = span.first;
    if (i < box.lo[0]) i = before_box;
    while (true) {
        if (i >= box.hi[0]) { // all that lies behind
            Terms terms{};
            terms.cover = row.cover - so_far.cover;
            if constexpr (has_cover_moments<Terms>) {
                terms.cover_y = row.y - so_far.y;
                terms.cover_z = row.z - so_far.z;
            }
            visit(j, k, box.hi[0], terms);
            return;
        }
        const std::int64_t upper = i + 1;
        const bool is_last = upper > span.last;
        Terms terms{};
        cut_polygon lower = column;
        corners.count = num_corners;
        if (!is_last) cut_at(1, upper, lower);
        pixel_sums before = row;
        if (!is_last) {
            before.cover = oriented(round_to_cell_units(sum_polygon<false>(t, corners, lower, 0).cover));
            if constexpr (has_cover_moments<Terms>) {
                const polygon_moments m = sum_moments<false>(t, corners, lower, 0);
                before.y = oriented(round_to_cell_units(m.cover_y));
                before.z = oriented(round_to_cell_units(m.cover_z));
            }
        }
        terms.cover = before.cover - so_far.cover;
        if constexpr (has_cover_moments<Terms>) {
            terms.cover_y = before.y - so_far.y;
            terms.cover_z = before.z - so_far.z;
        }
        so_far = before;
        if (i != before_box) {
            if (i != span.first) cut_at(0, i, lower);
            const std::int64_t corner[3] = {i << t.fraction, y, z};
            add_parts(t, corners, lower, corner, areas, terms);
        }
        visit(j, k, i, terms);
        if (is_last) return;
        i = upper;
    }
}

// True if a polygon that was cut to a pixel meets its inside.
template <class Int>
[[nodiscard]] VOXELPIPE_HD bool meets_inside(const cell_triangle<Int>& t, const cutting_planes& planes,
                                             const cut_corners<Int>& corners, const cut_polygon& poly) {
    for (int plane = 2; plane < 6; ++plane) {
        if (plane / 2 == t.lifted) continue; // all of it lies in the pixel's upper side
        bool has_any = false;
        for (int i = 0; i < poly.count && !has_any; ++i) {
            const int s = corner_side(corners.at[poly.corner[i]], plane / 2, planes.at[plane]);
            has_any = plane % 2 == 0 ? s > 0 : s < 0;
        }
        if (!has_any) return false;
    }
    return true;
}

// The same for a triangle within one voxel, in closed form: its cover is exact, and so is the numerator of its volume.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Int, class Visit>
VOXELPIPE_HD void visit_only_cell(const cell_triangle<Int>& t, const cell_box& box, const area_ratio& areas,
                                  Visit&& visit) {
    for (int axis = 1; axis < 3; ++axis)
        if (box.lo[axis] > 0 || box.hi[axis] <= 0) return;
    const auto n = static_cast<std::int64_t>(t.is_odd ? t.n[0] : -t.n[0]); // at most 2^(2F)
    const bool is_before = box.lo[0] > 0, is_behind = !is_before && box.hi[0] <= 0,
               is_within = !is_before && !is_behind;
    Terms terms{};
    if constexpr (has_moments<Terms> || has_areas<Terms>) {
        const std::int64_t corner[3] = {0, 0, 0};
        if (is_within) {
            cut_corners<Int> corners;
            const cut_polygon whole = whole_triangle(t, corners);
            for (int c = 0; c < 3; ++c) measure_corner(t, corners, c, 0, 0);
            add_parts(t, corners, whole, corner, areas, terms);
        }
    }
    if constexpr (has_cover_moments<Terms>) { // of edges within the pixel these are rounded, unlike their covers
        const pixel_sums row = pixel_cover<true>(t, 0, 0);
        terms.cover_y = t.is_odd ? -row.y : row.y;
        terms.cover_z = t.is_odd ? -row.z : row.z;
    }
    terms.cover = n * (std::int64_t{1} << (cell_unit_bits - 2 * t.fraction - 1));
    if (is_within) {
        const std::int64_t depths = (std::int64_t{3} << t.fraction) - t.p[0][0] - t.p[1][0] - t.p[2][0];
        const double unit = core::bit_cast<double>(static_cast<std::uint64_t>(1023 - 3 * t.fraction) << 52); // 2^-3F
        terms.volume = round_to_cell_units(exact::div(exact::mul(exact::to_double(n * depths), unit), 6.0));
    }
    visit(std::int64_t{0}, std::int64_t{0}, is_before ? box.lo[0] - 1 : is_behind ? box.hi[0] : 0, terms);
}

// The layers of pixels with one z that a triangle meets within a box, and the pixels' y.
struct cell_pixels {
    std::int64_t z_first, z_end, y_first, y_end;
};
template <class Int>
[[nodiscard]] VOXELPIPE_HD cell_pixels pixels_of(const cell_triangle<Int>& t, const cell_box& box) {
    const auto later = [](std::int64_t p, std::int64_t q) { return p > q ? p : q; };
    const auto earlier = [](std::int64_t p, std::int64_t q) { return p < q ? p : q; };
    return {later(box.lo[2], 0), earlier(box.hi[2], t.reach[2]), later(box.lo[1], 0), earlier(box.hi[1], t.reach[1])};
}
// At least the number of pixels that for_each_cell_of_layer looks at in any layer: of a triangle that is cut to layers,
// its widest section, as far as its edges go beside it within a layer, and those at the ends.
template <class Int>
[[nodiscard]] VOXELPIPE_HD std::int64_t most_pixels_of_layer(const cell_triangle<Int>& t, const cell_pixels& all) {
    const std::int64_t most = all.y_end - all.y_first;
    if (t.reach[2] < 2 || most < 4) return most;
    const double voxel = voxels_in_unit(t);
    double beside = 0.0, height = 0.0;
    for (int e = 0; e < 3; ++e) {
        const auto &p = t.p[e], &q = t.p[e == 2 ? 0 : e + 1];
        const double y = exact::to_double(q[1] > p[1] ? q[1] - p[1] : p[1] - q[1]) * voxel,
                     z = exact::to_double(q[2] > p[2] ? q[2] - p[2] : p[2] - q[2]) * voxel;
        beside += z > 1.0 ? y / z : y;
        height = z > height ? z : height;
    }
    const double area = exact::to_double(t.n[0] < 0 ? -t.n[0] : t.n[0]) * voxel * voxel; // twice the projection's
    const double pixels = area / height + beside + 3.0; // a layer is cut: the height is not 0
    return pixels < exact::to_double(most) ? static_cast<std::int64_t>(pixels) : most;
}

// Calls visit(y, z, i, terms), as for_each_cell_of_pixel, for the voxels of a layer: of all its pixels, or of the one
// with this number (one: 0 to most_pixels_of_layer - 1), which there may not be. whole: with its three corners.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Int, class Visit>
VOXELPIPE_HD void for_each_cell_of_layer(const cell_triangle<Int>& t, const cut_polygon& whole, cutting_planes& planes,
                                         cut_corners<Int>& corners, const cell_box& box, const area_ratio& areas,
                                         const cell_pixels& all, std::int64_t k, std::int64_t one, Visit&& visit) {
    cut_polygon layer = whole;
    corners.count = 3;
    std::int64_t j_first = all.y_first, j_end = all.y_end;
    planes.at[4] = k << t.fraction;
    planes.at[5] = (k + 1) << t.fraction;
    if (t.reach[2] > 1) {
        if (k > 0) cut(t, planes, 4, false, corners, layer);
        if (k + 1 < t.reach[2]) cut(t, planes, 5, true, corners, layer);
        if (layer.count == 0) return;
        if (t.reach[1] > 2) { // the pixels between the layer's ends, and one beyond where these are close to a side
            double lo = 0.0, hi = 0.0;
            for (int i = 0; i < layer.count; ++i) {
                const double y = corner_value(t, corners.at[layer.corner[i]], 1, 0);
                lo = i == 0 || y < lo ? y : lo;
                hi = i == 0 || y > hi ? y : hi;
            }
            const auto first = static_cast<std::int64_t>(lo - 0x1p-10),
                       end = static_cast<std::int64_t>(hi + 0x1p-10) + 1;
            j_first = first > j_first ? first : j_first;
            j_end = end < j_end ? end : j_end;
        }
    }
    if (one >= 0) {
        j_first += one;
        j_end = j_first + 1 < j_end ? j_first + 1 : j_end;
    }
    const int num_corners = corners.count;
    for (std::int64_t j = j_first; j < j_end; ++j) {
        cut_polygon column = layer;
        corners.count = num_corners;
        planes.at[2] = j << t.fraction;
        planes.at[3] = (j + 1) << t.fraction;
        if (t.reach[1] > 1) {
            if (j > 0) cut(t, planes, 2, false, corners, column);
            if (j + 1 < t.reach[1]) cut(t, planes, 3, true, corners, column);
        }
        if (t.reach[1] > 1 || t.reach[2] > 1)
            if (!meets_inside(t, planes, corners, column)) continue;
        for_each_cell_of_pixel<Terms>(t, column, planes, corners, box, areas, j, k, visit);
    }
}

// True if a triangle lies within one voxel.
template <class Int>
[[nodiscard]] VOXELPIPE_HD bool is_in_one_cell(const cell_triangle<Int>& t) {
    return t.reach[0] == 1 && t.reach[1] == 1 && t.reach[2] == 1;
}

// Calls visit(y, z, i, terms) for all voxels in which a part of a triangle lies, as for_each_cell_of_pixel. areas: what
// area_terms need.
VOXELPIPE_ANY_CALLABLE
template <class Terms = cell_terms, class Int, class Visit>
VOXELPIPE_HD void for_each_cell(const cell_triangle<Int>& t, const cell_box& box, Visit&& visit,
                                const area_ratio& areas = {0, 0.0}) {
    if (is_in_one_cell(t)) {
        visit_only_cell<Terms>(t, box, areas, visit);
        return;
    }
    cutting_planes planes{};
    cut_corners<Int> corners;
    const cut_polygon whole = whole_triangle(t, corners);
    const cell_pixels all = pixels_of(t, box);
    for (std::int64_t k = all.z_first; k < all.z_end; ++k)
        for_each_cell_of_layer<Terms>(t, whole, planes, corners, box, areas, all, k, -1, visit);
}

} // namespace voxelpipe::core
