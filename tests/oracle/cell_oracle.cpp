// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_oracle.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

namespace oracle {
namespace {

using wide = wide_int<9>;

// a s + b t + c >= 0, where the triangle is v0 + s (v1 - v0) + t (v2 - v0).
struct half_plane {
    std::int64_t a, b, c;
};
// (s, t) = (s / w, t / w), w > 0.
struct corner {
    int128 s, t, w;
};

int128 at(const half_plane& h, const corner& p) { return h.a * p.s + h.b * p.t + h.c * p.w; }

// A convex polygon: corners in order, and the line that follows each.
struct polygon {
    std::vector<corner> corners;
    std::vector<half_plane> lines;
};

corner meet(const half_plane& g, const half_plane& h) {
    const int128 w = static_cast<int128>(g.a) * h.b - static_cast<int128>(g.b) * h.a;
    const int128 s = static_cast<int128>(g.b) * h.c - static_cast<int128>(g.c) * h.b;
    const int128 t = static_cast<int128>(g.c) * h.a - static_cast<int128>(g.a) * h.c;
    return w < 0 ? corner{-s, -t, -w} : corner{s, t, w};
}

polygon clip(const polygon& p, const half_plane& h) {
    polygon r;
    const std::size_t n = p.corners.size();
    for (std::size_t i = 0; i < n; ++i) {
        const int128 here = at(h, p.corners[i]), next = at(h, p.corners[(i + 1) % n]);
        if (here >= 0) {
            r.corners.push_back(p.corners[i]);
            r.lines.push_back(here == 0 && next < 0 ? h : p.lines[i]);
        }
        if ((here > 0 && next < 0) || (here < 0 && next > 0)) {
            r.corners.push_back(meet(p.lines[i], h));
            r.lines.push_back(next < 0 ? h : p.lines[i]);
        }
    }
    return r;
}

long double to_real(const wide& a) {
    // The upper 128 bits; the rest is below any bound that is tested.
    const int drop = a.bit_width() > 126 ? a.bit_width() - 126 : 0;
    wide top;
    for (int i = a.bit_width() - 1; i >= drop; --i) top = top.shifted_left(1) + wide(a.bit(i) ? 1 : 0);
    const long double magnitude = std::ldexp(static_cast<long double>(top.to_int128()), drop);
    return a.sign() < 0 ? -magnitude : magnitude;
}

// The integral over the polygon, in parameters, of 1 or of a linear function, as the sum of its triangles.
long double integrate(const polygon& p, const half_plane* function) {
    long double sum = 0.0L;
    for (std::size_t i = 1; i + 1 < p.corners.size(); ++i) {
        const corner &o = p.corners[0], &g = p.corners[i], &h = p.corners[i + 1];
        const auto minus = [&](const corner& q, int128 of_q, int128 of_o) {
            return wide(of_q) * wide(o.w) - wide(of_o) * wide(q.w);
        };
        const wide twice = minus(g, g.s, o.s) * minus(h, h.t, o.t) - minus(g, g.t, o.t) * minus(h, h.s, o.s);
        const wide w = wide(o.w) * wide(g.w) * wide(h.w);
        if (function == nullptr) {
            sum += to_real(twice) / to_real(wide(2) * w * wide(o.w));
        } else {
            const wide total = wide(at(*function, o)) * wide(g.w) * wide(h.w) +
                               wide(at(*function, g)) * wide(o.w) * wide(h.w) +
                               wide(at(*function, h)) * wide(o.w) * wide(g.w);
            sum += to_real(twice * total) / to_real(wide(6) * w * wide(o.w) * w);
        }
    }
    return sum;
}

// The integral of the product of two linear functions.
long double integrate(const polygon& p, const half_plane& f, const half_plane& g) {
    long double sum = 0.0L;
    for (std::size_t i = 1; i + 1 < p.corners.size(); ++i) {
        const corner &o = p.corners[0], &q = p.corners[i], &r = p.corners[i + 1];
        const auto minus = [&](const corner& c, int128 of_c, int128 of_o) {
            return wide(of_c) * wide(o.w) - wide(of_o) * wide(c.w);
        };
        const wide twice = minus(q, q.s, o.s) * minus(r, r.t, o.t) - minus(q, q.t, o.t) * minus(r, r.s, o.s);
        const long double area = to_real(twice) / to_real(wide(2) * wide(o.w) * wide(o.w) * wide(q.w) * wide(r.w));
        // At the corners, with one denominator, which is w.
        const wide w = wide(o.w) * wide(q.w) * wide(r.w);
        const auto values = [&](const half_plane& h) {
            return std::array<wide, 3>{wide(at(h, o)) * wide(q.w) * wide(r.w), wide(at(h, q)) * wide(o.w) * wide(r.w),
                                       wide(at(h, r)) * wide(o.w) * wide(q.w)};
        };
        const auto a = values(f), b = values(g);
        const wide total = (a[0] + a[1] + a[2]) * (b[0] + b[1] + b[2]) + a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        sum += area / 12.0L * to_real(total) / (to_real(w) * to_real(w));
    }
    return sum;
}

} // namespace

cell_part cell_of(const lattice_triangle& t, int fraction_bits, const std::array<int, 3>& voxel) {
    const std::int64_t size = std::int64_t{1} << fraction_bits;
    // coordinate - place, or place - coordinate
    const auto side = [&](int axis, std::int64_t place, int sign) {
        const auto i = static_cast<std::size_t>(axis);
        return half_plane{sign * (t[1][i] - t[0][i]), sign * (t[2][i] - t[0][i]), sign * (t[0][i] - place)};
    };
    polygon column{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 0}, {-1, -1, 1}, {1, 0, 0}}};
    for (int axis = 1; axis < 3; ++axis) {
        const std::int64_t place = voxel[static_cast<std::size_t>(axis)] * size;
        column = clip(clip(column, side(axis, place, 1)), side(axis, place + size, -1));
    }
    const std::int64_t lower = voxel[0] * size, upper = lower + size;
    const half_plane above_lower = side(0, lower, 1), below_upper = side(0, upper, -1);
    const polygon below = clip(column, side(0, lower, -1)), within = clip(clip(column, above_lower), below_upper);
    bool is_flat = true; // all of it lies in the voxel's lower face, and belongs to the voxel below
    for (const corner& c : within.corners) is_flat = is_flat && at(above_lower, c) == 0;
    // Integrals over parameters times this are integrals over y and z, in voxels.
    const std::int64_t n_x = (t[1][1] - t[0][1]) * (t[2][2] - t[0][2]) - (t[1][2] - t[0][2]) * (t[2][1] - t[0][1]);
    const long double scale = -std::ldexp(static_cast<long double>(n_x), -2 * fraction_bits);
    cell_part part{};
    part.cover = scale * integrate(below, nullptr);
    part.fraction = part.cover;
    if (!is_flat) part.fraction += scale * std::ldexp(integrate(within, &below_upper), -fraction_bits);
    part.touches = !within.corners.empty();
    part.touches_face = false;
    for (const corner& c : within.corners) part.touches_face = part.touches_face || at(above_lower, c) == 0;

    const auto from_centre = [&](int axis) { // twice
        half_plane h = side(axis, voxel[static_cast<std::size_t>(axis)] * size, 1);
        return half_plane{2 * h.a, 2 * h.b, 2 * h.c - size};
    };
    for (int axis = 1; axis < 3; ++axis) {
        const half_plane h = from_centre(axis);
        long double& m = part.moment[static_cast<std::size_t>(axis)];
        m = scale * std::ldexp(integrate(below, &h), -fraction_bits - 1);
        part.cover_moment[static_cast<std::size_t>(axis) - 1] = m;
        if (!is_flat) m += scale * std::ldexp(integrate(within, h, below_upper), -2 * fraction_bits - 1);
    }
    // Of t (1 - t) / 2, where t is the distance from the lower face.
    if (!is_flat)
        part.moment[0] = scale * std::ldexp(integrate(within, above_lower, below_upper), -2 * fraction_bits - 1);

    for (int axis = 0; axis < 3; ++axis) {
        bool is_in_lower = true;
        for (const corner& c : within.corners)
            is_in_lower = is_in_lower && at(side(axis, voxel[static_cast<std::size_t>(axis)] * size, 1), c) == 0;
        if (is_in_lower) return part;
    }
    long double squares = 0.0L;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const auto n = static_cast<long double>((t[1][j] - t[0][j]) * (t[2][k] - t[0][k]) -
                                                (t[1][k] - t[0][k]) * (t[2][j] - t[0][j]));
        squares += n * n;
    }
    const long double twice = std::ldexp(std::sqrt(squares), -2 * fraction_bits); // the triangle's area
    part.area = twice * integrate(within, nullptr);
    for (int axis = 0; axis < 3; ++axis) {
        const half_plane h = from_centre(axis);
        part.area_moment[static_cast<std::size_t>(axis)] =
            twice * std::ldexp(integrate(within, &h), -fraction_bits - 1);
    }
    return part;
}

} // namespace oracle
