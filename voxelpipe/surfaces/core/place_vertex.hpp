// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where the vertex of a sheet lies in its cell, and along which diagonal a quad is cut (docs/design.md, "Surfaces").
// Coordinates of a cell run from 0 to 1 between its samples. Results are 16-bit numbers from 1 to 65535 in units of
// 2^-16: no vertex lies on the border of its cell. Doubles are written operations, the same on every backend.

#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/surfaces/core/edge_crossing.hpp>

#include <cstdint>

namespace voxelpipe::core {

struct cell_place {
    triple<std::uint16_t> q;
};

[[nodiscard]] VOXELPIPE_HD inline std::uint16_t inner_place(std::int64_t q) {
    return static_cast<std::uint16_t>(q < 1 ? 1 : q > 65535 ? 65535 : q);
}

// A point in a cell in units of 2^-24.
using crossing_point = triple<std::uint32_t>;
// The crossing of the edge along `axis` whose lower corner of the cell is `corner`.
[[nodiscard]] VOXELPIPE_HD inline crossing_point point_on_edge(int axis, int corner, std::uint32_t t) {
    crossing_point p{};
    for (int a = 0; a < 3; ++a)
        p[a] = a == axis ? t : static_cast<std::uint32_t>(corner >> a & 1) << edge_crossing::fraction;
    return p;
}

// The mean of the crossings of one sheet.
class sheet_mean {
public:
    VOXELPIPE_HD void add(const crossing_point& p) {
        for (int a = 0; a < 3; ++a) sum_[a] += p[a];
        ++count_;
    }
    // Rounded half up.
    [[nodiscard]] VOXELPIPE_HD cell_place place() const {
        cell_place r{};
        const auto unit = static_cast<std::uint64_t>(count_) << (edge_crossing::fraction - 16);
        for (int a = 0; a < 3; ++a) r.q[a] = inner_place(static_cast<std::int64_t>((2 * sum_[a] + unit) / (2 * unit)));
        return r;
    }
    [[nodiscard]] VOXELPIPE_HD int count() const { return count_; }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t sum(int axis) const { return sum_[axis]; }

private:
    triple<std::uint64_t> sum_{};
    int count_ = 0;
};

// y minimizes y . A y - 2 b . y; A is symmetric and its least eigenvalue is above 0. The mean is the origin.
class plane_fit {
public:
    VOXELPIPE_HD explicit plane_fit(double diagonal)
        : a_{{{{diagonal, 0, 0}}, {{0, diagonal, 0}}, {{0, 0, diagonal}}}} {}

    // A plane with normal n through p.
    VOXELPIPE_HD void add(const triple<double>& n, const triple<double>& p) {
        const double d = exact::fma(n[2], p[2], exact::fma(n[1], p[1], exact::mul(n[0], p[0])));
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) a_[i][j] = exact::fma(n[i], n[j], a_[i][j]);
            b_[i] = exact::fma(n[i], d, b_[i]);
        }
    }

    // By Cholesky's factors.
    [[nodiscard]] VOXELPIPE_HD triple<double> solve() const {
        const double l00 = exact::sqrt(a_[0][0]), l10 = exact::div(a_[0][1], l00), l20 = exact::div(a_[0][2], l00);
        const double l11 = exact::sqrt(exact::fma(-l10, l10, a_[1][1]));
        const double l21 = exact::div(exact::fma(-l20, l10, a_[1][2]), l11);
        const double l22 = exact::sqrt(exact::fma(-l21, l21, exact::fma(-l20, l20, a_[2][2])));
        const double y0 = exact::div(b_[0], l00), y1 = exact::div(exact::fma(-l10, y0, b_[1]), l11);
        const double y2 = exact::div(exact::fma(-l21, y1, exact::fma(-l20, y0, b_[2])), l22);
        const double x2 = exact::div(y2, l22), x1 = exact::div(exact::fma(-l21, x2, y1), l11);
        return {{exact::div(exact::fma(-l20, x2, exact::fma(-l10, x1, y0)), l00), x1, x2}};
    }
    // With y[i] given: the other two.
    VOXELPIPE_HD void solve_two(triple<double>& y, int i) const {
        const int j = i == 0 ? 1 : 0, k = i == 2 ? 1 : 2;
        const double bj = exact::fma(-a_[i][j], y[i], b_[j]), bk = exact::fma(-a_[i][k], y[i], b_[k]);
        const double l00 = exact::sqrt(a_[j][j]), l10 = exact::div(a_[j][k], l00);
        const double l11 = exact::sqrt(exact::fma(-l10, l10, a_[k][k]));
        const double y0 = exact::div(bj, l00), y1 = exact::div(exact::fma(-l10, y0, bk), l11);
        y[k] = exact::div(y1, l11);
        y[j] = exact::div(exact::fma(-l10, y[k], y0), l00);
    }
    // With the other two given: y[k].
    VOXELPIPE_HD void solve_one(triple<double>& y, int k) const {
        const int i = k == 0 ? 1 : 0, j = k == 2 ? 1 : 2;
        y[k] = exact::div(exact::fma(-a_[j][k], y[j], exact::fma(-a_[i][k], y[i], b_[k])), a_[k][k]);
    }
    // What is minimized, at y.
    [[nodiscard]] VOXELPIPE_HD double at(const triple<double>& y) const {
        double sum = 0.0;
        for (int i = 0; i < 3; ++i) {
            const double row = exact::fma(a_[i][2], y[2], exact::fma(a_[i][1], y[1], exact::mul(a_[i][0], y[0])));
            sum = exact::fma(y[i], exact::fma(-2.0, b_[i], row), sum);
        }
        return sum;
    }

private:
    triple<triple<double>> a_;
    triple<double> b_{};
};

// The point x that minimizes sum (n . (x - p))^2 + 2^-10 m |x - mean|^2 over the m crossings p with normals n of a
// sheet. Points are relative to the mean, in units of the samples' spacing.
class sheet_planes {
public:
    VOXELPIPE_HD explicit sheet_planes(const sheet_mean& of)
        : fit_(exact::mul(static_cast<double>(of.count()), 1.0 / 1024)) {
        for (int a = 0; a < 3; ++a) {
            mean_[a] = exact::div(exact::mul(static_cast<double>(of.sum(a)), unit), static_cast<double>(of.count()));
            low_[a] = -mean_[a];
            high_[a] = 1.0 - mean_[a];
        }
    }
    // A crossing; in the order of their edges.
    VOXELPIPE_HD void add(const crossing_point& at, float nx, float ny, float nz) {
        const triple<double> n{{exact::to_double(nx), exact::to_double(ny), exact::to_double(nz)}};
        triple<double> p{};
        for (int a = 0; a < 3; ++a) p[a] = exact::fma(static_cast<double>(at[a]), unit, -mean_[a]);
        fit_.add(n, p);
    }
    [[nodiscard]] VOXELPIPE_HD triple<double> least() const { return fit_.solve(); }
    // Whether a point lies in the cell.
    [[nodiscard]] VOXELPIPE_HD bool has(const triple<double>& y) const {
        return is_within(y, 0) && is_within(y, 1) && is_within(y, 2);
    }
    // The least of the minima on the cell's 6 faces, 12 edges and 8 corners, in this order, that lie in the cell; the
    // first of several.
    [[nodiscard]] VOXELPIPE_HD triple<double> least_on_border() const {
        triple<double> best{};
        bool found = false;
        double least = 0.0;
        const auto offer = [&](const triple<double>& y) {
            const double value = fit_.at(y);
            if (found && !(value < least)) return;
            found = true;
            least = value;
            best = y;
        };
        for (int f = 0; f < 6; ++f) {
            const int i = f / 2, j = i == 0 ? 1 : 0, k = i == 2 ? 1 : 2;
            triple<double> y{};
            y[i] = f % 2 == 0 ? low_[i] : high_[i];
            fit_.solve_two(y, i);
            if (is_within(y, j) && is_within(y, k)) offer(y);
        }
        for (int e = 0; e < 12; ++e) {
            const int k = e / 4, i = k == 0 ? 1 : 0, j = k == 2 ? 1 : 2;
            triple<double> y{};
            y[i] = (e & 1) == 0 ? low_[i] : high_[i];
            y[j] = (e & 2) == 0 ? low_[j] : high_[j];
            fit_.solve_one(y, k);
            if (is_within(y, k)) offer(y);
        }
        for (int c = 0; c < 8; ++c)
            offer({{(c & 1) == 0 ? low_[0] : high_[0], (c & 2) == 0 ? low_[1] : high_[1],
                    (c & 4) == 0 ? low_[2] : high_[2]}});
        return best;
    }
    [[nodiscard]] VOXELPIPE_HD cell_place place(const triple<double>& y) const {
        cell_place r{};
        for (int a = 0; a < 3; ++a) r.q[a] = inner_place(exact::round_to_int64(exact::mul(mean_[a] + y[a], 65536.0)));
        return r;
    }

private:
    static constexpr double unit = 1.0 / (1 << edge_crossing::fraction);
    [[nodiscard]] VOXELPIPE_HD bool is_within(const triple<double>& y, int a) const {
        return y[a] >= low_[a] && y[a] <= high_[a];
    }

    triple<double> mean_{}, low_{}, high_{};
    plane_fit fit_;
};

// The crossings of one sheet: at most 7, in the order of their edges.
class sheet_points {
public:
    static constexpr int most = 7;

    // A crossing of the edge along `axis` whose lower corner of the cell is `corner`.
    VOXELPIPE_HD void add(int axis, int corner, const edge_crossing& c) {
        points_[count_] = point_on_edge(axis, corner, c.t);
        mean_.add(points_[count_]);
        normals_[count_] = {{c.nx, c.ny, c.nz}};
        ++count_;
    }
    [[nodiscard]] VOXELPIPE_HD cell_place mean() const { return mean_.place(); }
    // Where sheet_planes is least in the cell.
    [[nodiscard]] VOXELPIPE_HD cell_place sharp() const {
        sheet_planes planes(mean_);
        for (int i = 0; i < count_; ++i) planes.add(points_[i], normals_[i][0], normals_[i][1], normals_[i][2]);
        const triple<double> y = planes.least();
        return planes.place(planes.has(y) ? y : planes.least_on_border());
    }

private:
    crossing_point points_[most];
    triple<float> normals_[most];
    sheet_mean mean_;
    int count_ = 0;
};

// ---- quads ----------------------------------------------------------------------------------------------------------

// A vertex in units of 2^-16 of the samples' spacing.
struct lattice_vertex {
    std::int64_t x, y, z;
};
[[nodiscard]] VOXELPIPE_HD inline std::int64_t diagonal_square(const lattice_vertex& a, const lattice_vertex& b) {
    const std::int64_t x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    return x * x + y * y + z * z;
}
// The cosine between the normals of the triangles a b c and a c d; -1 if one has no area. Components of edges are
// below 2^18, so that their products are exact.
[[nodiscard]] VOXELPIPE_HD inline double fold_cosine(const lattice_vertex& a, const lattice_vertex& b,
                                                     const lattice_vertex& c, const lattice_vertex& d) {
    const auto normal = [&](const lattice_vertex& p, const lattice_vertex& q) {
        const std::int64_t ux = p.x - a.x, uy = p.y - a.y, uz = p.z - a.z, vx = q.x - a.x, vy = q.y - a.y,
                           vz = q.z - a.z;
        return triple<double>{{exact::to_double(uy * vz - uz * vy), exact::to_double(uz * vx - ux * vz),
                               exact::to_double(ux * vy - uy * vx)}};
    };
    const auto dot = [](const triple<double>& m, const triple<double>& n) {
        return exact::fma(m[2], n[2], exact::fma(m[1], n[1], exact::mul(m[0], n[0])));
    };
    const triple<double> m = normal(b, c), n = normal(c, d);
    const double lengths = exact::mul(dot(m, m), dot(n, n));
    return lengths > 0.0 ? exact::div(dot(m, n), exact::sqrt(lengths)) : -1.0;
}

// True if the quad a b c d is cut from a to c, false if from b to d. `folds`: where the triangles' normals agree
// better; then, or without it, along the shorter diagonal; a tie is cut from a.
[[nodiscard]] VOXELPIPE_HD inline bool is_cut_from_first(const lattice_vertex& a, const lattice_vertex& b,
                                                         const lattice_vertex& c, const lattice_vertex& d, bool folds) {
    if (folds) {
        const double from_a = fold_cosine(a, b, c, d), from_b = fold_cosine(b, c, d, a);
        if (from_a != from_b) return from_a > from_b;
    }
    return diagonal_square(a, c) <= diagonal_square(b, d);
}

} // namespace voxelpipe::core
