// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "triangles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace oracle {
namespace {

using position = std::array<double, 3>; // in fixed-point units; integers wherever a class promises to be exact
using corners = std::array<position, 3>;

position operator+(const position& a, const position& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
position operator*(double s, const position& a) { return {s * a[0], s * a[1], s * a[2]}; }

class maker {
public:
    maker(splitmix64& random, const test_grid& where)
        : random_(random), dense_(where.dense), exact_(where.exact), unit_(std::ldexp(1.0, fraction_bits(where.g))) {
        const bool everywhere = where.focus.hi[0] == 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            begin_[axis] = everywhere ? 0 : where.focus.lo[axis];
            size_[axis] = everywhere ? where.g.extent[axis] : where.focus.hi[axis] - where.focus.lo[axis];
            largest_ = std::max(largest_, static_cast<double>(where.g.extent[axis]));
        }
    }

    corners make(triangle_class kind) {
        switch (kind) {
        case triangle_class::small:
            return around(inside(0.0), scale(1e-3, 4.0));
        case triangle_class::medium:
            return around(inside(0.0), scale(1.0, reach()));
        case triangle_class::large:
            return large();
        case triangle_class::sliver:
            return sliver();
        case triangle_class::needle:
            return needle();
        case triangle_class::point: {
            const position p = random_.one_in(2) ? rounded(inside(0.1)) : lattice_point(random_.between(0, 3));
            return {p, p, p};
        }
        case triangle_class::segment: {
            corners c = around(inside(0.0), scale(1e-3, reach()));
            if (random_.one_in(2)) c = {lattice_near(c[0], 3), lattice_near(c[1], random_.between(0, 3)), c[2]};
            c[2] = c[random_.below(2)];
            std::swap(c[2], c[random_.below(3)]);
            return c;
        }
        case triangle_class::collinear:
            return collinear();
        case triangle_class::corner_vertices:
            return on_voxels(3);
        case triangle_class::edge_vertices:
            return on_voxels(2);
        case triangle_class::face_vertices:
            return on_voxels(1);
        case triangle_class::edge_in_face:
            return in_face(2);
        case triangle_class::face_plane:
            return in_face(3);
        case triangle_class::half_lattice:
            return half_lattice();
        case triangle_class::diagonal_plane:
            return diagonal_plane();
        case triangle_class::grazing:
            return grazing();
        case triangle_class::lattice:
            return lattice();
        case triangle_class::partly_outside:
            return around(on_border(), scale(0.1, reach()));
        case triangle_class::wholly_outside:
            return wholly_outside();
        case triangle_class::powers_of_two:
            return powers_of_two();
        case triangle_class::far_away:
            return far_away();
        case triangle_class::dropped:
            return around(inside(0.0), scale(1e-3, reach())); // made bad as floats
        }
        return {};
    }

private:
    double first_unit(std::size_t axis) const { return unit_ * begin_[axis]; }
    double last_unit(std::size_t axis) const { return unit_ * (begin_[axis] + size_[axis]); }
    // The largest size of a triangle in voxels, which limits the work.
    double reach() const {
        const double longest = std::max({size_[0], size_[1], size_[2]});
        return dense_ ? longest : std::min(longest, 64.0);
    }

    // Log-uniform between lo and hi voxels, in fixed-point units.
    double scale(double lo, double hi) {
        return unit_ * std::exp2(random_.uniform(std::log2(lo), std::log2(std::max(lo, hi))));
    }

    position direction() { // not uniform on the sphere, but everywhere on it
        return {random_.uniform(-1.0, 1.0), random_.uniform(-1.0, 1.0), random_.uniform(-1.0, 1.0)};
    }

    // A position in the grid (or its part), or outside it by at most the fraction `margin` of its size.
    position inside(double margin) {
        position p{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double across = random_.uniform(-margin, 1.0 + margin);
            p[axis] = first_unit(axis) + across * (last_unit(axis) - first_unit(axis));
        }
        return p;
    }

    position on_border() {
        position p = inside(0.05);
        const std::size_t axis = random_.below(3);
        p[axis] = random_.one_in(2) ? first_unit(axis) : last_unit(axis);
        return p;
    }

    static position rounded(position p) {
        for (double& x : p) x = std::nearbyint(x);
        return p;
    }

    corners around(const position& centre, double size) {
        corners c;
        for (position& p : c) p = centre + size * direction();
        // Most positions are off the lattice, so that snapping must sometimes decide between neighbours.
        if (random_.one_in(4))
            for (position& p : c) p = rounded(p);
        return c;
    }

    // Puts `axes` randomly chosen coordinates of a position on multiples of a voxel, the others on the lattice.
    position lattice_near(position p, std::int64_t axes) {
        p = rounded(p);
        std::array<std::size_t, 3> order = {0, 1, 2};
        std::swap(order[0], order[random_.below(3)]);
        std::swap(order[1], order[1 + random_.below(2)]);
        for (std::int64_t n = 0; n < axes; ++n) {
            double& x = p[order[static_cast<std::size_t>(n)]];
            x = std::nearbyint(x / unit_) * unit_;
        }
        return p;
    }
    position lattice_point(std::int64_t axes) { return lattice_near(inside(0.02), axes); }

    corners on_voxels(std::int64_t axes) {
        corners c = around(inside(0.0), scale(0.5, std::min(reach(), 16.0)));
        for (position& p : c) p = lattice_near(p, axes);
        return c;
    }

    corners in_face(std::size_t vertices) {
        corners c = around(inside(0.0), scale(0.25, std::min(reach(), 24.0)));
        const std::size_t axis = random_.below(3);
        for (position& p : c) p = rounded(p);
        double plane = std::nearbyint(c[0][axis] / unit_) * unit_;
        if (random_.one_in(4)) { // on the border of the grid
            const double border = random_.one_in(2) ? first_unit(axis) : last_unit(axis);
            for (position& p : c) p[axis] += border - plane;
            plane = border;
        }
        for (std::size_t vertex = 0; vertex < vertices; ++vertex) c[vertex][axis] = plane;
        if (random_.one_in(3)) // an axis-parallel edge of it, often along voxel edges
            c[1][(axis + 1) % 3] = c[0][(axis + 1) % 3] = std::nearbyint(c[0][(axis + 1) % 3] / unit_) * unit_;
        std::swap(c[2], c[random_.below(3)]);
        return c;
    }

    corners large() {
        const double size = scale(1.0, 1e3) * largest_;
        corners c = around(inside(0.0), size);
        if (!random_.one_in(4)) { // bring the plane through the grid: move a point of the triangle to a point in it
            const double a = random_.unit();
            const double b = random_.unit() * (1.0 - a);
            const position at = (1.0 - a - b) * c[0] + a * c[1] + b * c[2];
            const position shift = inside(0.0) + -1.0 * at;
            for (position& p : c) p = p + shift;
        }
        return c;
    }

    corners sliver() {
        const position a = inside(0.05);
        const position along = scale(0.5, reach()) * direction();
        const double height = random_.one_in(2) ? random_.uniform(1.0, 8.0) : scale(1e-3, 0.1);
        corners c = {a, a + along, a + random_.uniform(-0.2, 1.2) * along + height * direction()};
        if (random_.one_in(2))
            for (position& p : c) p = rounded(p);
        return c;
    }

    corners needle() {
        const position a = rounded(inside(0.05));
        const position off = {static_cast<double>(random_.between(-2, 2)), static_cast<double>(random_.between(-2, 2)),
                              static_cast<double>(random_.between(-2, 2))};
        const double length = random_.one_in(8) ? scale(1.0, 100.0) * largest_ : scale(0.5, reach());
        return {a, a + off, rounded(a + length * direction())};
    }

    corners collinear() {
        const position a = random_.one_in(2) ? lattice_point(random_.between(1, 3)) : rounded(inside(0.0));
        position step{};
        for (double& x : step) x = static_cast<double>(random_.between(-3, 3));
        if (random_.one_in(2)) step = rounded((unit_ * 0.25) * step);
        const double limit = std::max(1.0, std::floor(reach() * unit_ / std::max(1.0, std::fabs(step[0]) + 1.0) / 8.0));
        const auto range = static_cast<std::int64_t>(std::min(limit, 64.0));
        return {a, a + static_cast<double>(random_.between(-range, range)) * step,
                a + static_cast<double>(random_.between(-range, range)) * step};
    }

    corners half_lattice() {
        corners c = around(inside(0.0), scale(1.0, std::min(reach(), 16.0)));
        const double step = unit_ * (random_.one_in(2) ? 0.5 : 1.0);
        for (position& p : c)
            for (double& x : p) x = std::nearbyint(x / step) * step;
        return c;
    }

    // Edges in a plane x = +-y (+ const), or x +- y +- z = const: ties of the dominant axis.
    corners diagonal_plane() {
        const double size = scale(0.25, std::min(reach(), 24.0));
        corners c;
        c[0] = random_.one_in(2) ? lattice_point(3) : rounded(inside(0.0));
        const std::size_t axis = random_.below(3);
        const bool three = random_.one_in(2);
        const double sign_a = random_.one_in(2) ? 1.0 : -1.0;
        const double sign_b = three ? (random_.one_in(2) ? 1.0 : -1.0) : 0.0;
        for (std::size_t vertex = 1; vertex < 3; ++vertex) {
            position d = rounded(size * direction());
            if (random_.one_in(3)) d = rounded((1.0 / unit_) * d), d = unit_ * d;
            d[axis] = sign_a * d[(axis + 1) % 3] + sign_b * d[(axis + 2) % 3];
            c[vertex] = c[0] + d;
        }
        return c;
    }

    // Through (or up to) a point exactly on a voxel edge or corner, the rest of the triangle on one side of it.
    corners grazing() {
        const position touch = lattice_point(random_.between(2, 3));
        position along{}, away{};
        const double size = random_.one_in(2) ? 16.0 : unit_ / 4;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            along[axis] = std::nearbyint(size * random_.uniform(-4.0, 4.0));
            away[axis] = std::nearbyint(size * random_.uniform(-8.0, 8.0));
        }
        const auto before = static_cast<double>(random_.between(0, 3)); // 0: a vertex sits on the point
        const auto after = static_cast<double>(random_.between(1, 3));
        return {touch + -before * along, touch + after * along, touch + away};
    }

    corners lattice() {
        const position centre = lattice_point(3);
        const std::int64_t range = std::int64_t{1} << random_.between(1, 12);
        corners c;
        for (position& p : c)
            for (std::size_t axis = 0; axis < 3; ++axis)
                p[axis] = centre[axis] + static_cast<double>(random_.between(-range, range));
        return c;
    }

    corners wholly_outside() {
        const std::size_t axis = random_.below(3);
        position centre = inside(0.5);
        const double size = scale(0.01, reach());
        // From just beside the border, within a fixed-point unit, to far off.
        const double gap = random_.one_in(3) ? static_cast<double>(random_.between(0, 2)) : scale(1e-3, 4.0);
        corners c;
        const bool above = random_.one_in(2);
        const double border = above ? last_unit(axis) : first_unit(axis);
        for (position& p : c) {
            p = rounded(centre + size * direction());
            const double off = gap + (random_.one_in(2) ? 0.0 : std::nearbyint(size * random_.unit()));
            p[axis] = std::nearbyint(above ? border + off : border - off);
        }
        return c;
    }

    // Every axis of the bounding box is 2^k units, give or take two; a point of the triangle is in the grid.
    corners powers_of_two() {
        const std::int64_t bits = random_.between(14, 34);
        const position at = rounded(inside(0.0));
        corners c;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto k =
                static_cast<int>(random_.one_in(2) ? bits : random_.between(std::max<std::int64_t>(bits - 3, 8), bits));
            const double length = std::ldexp(1.0, k) + static_cast<double>(random_.between(-2, 2));
            std::array<double, 3> side = {0.0, length, std::nearbyint(length * random_.unit())};
            std::swap(side[2], side[random_.below(3)]);
            std::swap(side[1], side[random_.below(2)]);
            // A third of each side away from its middle at most, which keeps the point inside for most triangles.
            const double centre = std::nearbyint((side[0] + side[1] + side[2]) / 3.0);
            for (std::size_t vertex = 0; vertex < 3; ++vertex) c[vertex][axis] = at[axis] - centre + side[vertex];
        }
        return c;
    }

    corners far_away() {
        const double farthest = exact_ ? 0x1p40 : 0x1.fffp39; // the limit itself, where floats reach it exactly
        corners c;
        const std::size_t near = random_.below(4); // up to two vertices stay near the grid
        for (std::size_t vertex = 0; vertex < 3; ++vertex) {
            const double size = std::exp2(random_.uniform(24.0, 39.9));
            c[vertex] = vertex < near ? inside(0.5) : size * direction();
            if (vertex >= near && random_.one_in(16))
                c[vertex][random_.below(3)] = random_.one_in(2) ? farthest : -farthest;
        }
        if (near == 0 || near == 3) { // through the grid: the third vertex opposite to the others
            const position at = inside(0.0);
            c[2] = at + -1.0 * (c[0] + c[1]);
            for (double& x : c[2]) x = std::clamp(x, -0.999 * farthest, 0.999 * farthest);
        }
        std::swap(c[2], c[random_.below(3)]);
        return c;
    }

    splitmix64& random_;
    std::array<int, 3> begin_{}, size_{}; // where to put triangles, in voxels
    double largest_ = 1.0;                // of the grid's extents
    bool dense_;
    bool exact_;
    double unit_; // fixed-point units in a voxel
};

void make_bad(splitmix64& random, const grid& g, world_triangle& t) {
    const std::size_t axis = random.below(3);
    float& p = t.v[random.below(3)][axis];
    const double limit = 0x1p40 / std::ldexp(1.0, fraction_bits(g)) * g.voxel_size[axis];
    switch (random.below(5)) {
    case 0:
        p = std::numeric_limits<float>::quiet_NaN();
        break;
    case 1:
        p = std::numeric_limits<float>::infinity();
        break;
    case 2:
        p = -std::numeric_limits<float>::infinity();
        break;
    case 3:
        p = random.one_in(2) ? std::numeric_limits<float>::max() : std::numeric_limits<float>::lowest();
        break;
    default: {
        const double beyond = limit * (1.0 + 0x1p-20 + random.unit()) + 2 * std::fabs(g.origin[axis]);
        p = static_cast<float>(random.one_in(2) ? beyond : -beyond);
    }
    }
}

} // namespace

std::string_view name(triangle_class kind) {
    static constexpr std::array<std::string_view, all_triangle_classes.size()> names = {
        "small",          "medium",        "large",           "sliver",        "needle",        "point",
        "segment",        "collinear",     "corner_vertices", "edge_vertices", "face_vertices", "edge_in_face",
        "face_plane",     "half_lattice",  "diagonal_plane",  "grazing",       "lattice",       "partly_outside",
        "wholly_outside", "powers_of_two", "far_away",        "dropped",
    };
    return names[static_cast<std::size_t>(kind)];
}

const std::vector<test_grid>& test_grids() {
    static const std::vector<test_grid> grids = {
        {{{0, 0, 0}, {0.03125, 0.03125, 0.03125}, {32, 32, 32}}, "cube_32", true, true},
        {{{-1, -1, -1}, {0.125, 0.125, 0.125}, {16, 16, 16}}, "cube_16_centred", true, true},
        {{{0.5, -2, 4}, {0.25, 0.5, 0.125}, {33, 7, 20}}, "odd_anisotropic_dyadic", true, true},
        {{{0, 0, 0}, {1, 1, 1}, {1, 1, 1}}, "one_voxel", true, true},
        {{{0, 0, 0}, {1, 1, 1}, {40, 1, 24}}, "flat", true, true},
        {{{0.1, 0.2, -0.7}, {0.3, 0.3, 0.3}, {5, 1, 9}}, "odd_small", false, true},
        {{{-3.7, 12.25, 142.857142857}, {0.11, 0.037, 0.29}, {24, 17, 40}}, "anisotropic", false, true},
        {{{1000.0, -2000.0, 512.0}, {0.01, 0.01, 0.01}, {48, 64, 32}}, "far_from_origin", false, true},
        {{{0, 0, 0}, {0.0009765625, 0.0009765625, 0.0009765625}, {1024, 700, 512}}, "thousand", true, false},
        {{{-1, -1, -1}, {0.0005, 0.0005, 0.0005}, {4096, 4096, 4096}}, "largest", false, false},
        {{{0, 0, 0}, {2, 4, 1}, {257, 300, 511}}, "odd_hundreds", true, false},
    };
    return grids;
}

test_grid focused(const test_grid& where, const region& part) {
    test_grid result = where;
    result.focus = part;
    result.dense = true;
    for (std::size_t axis = 0; axis < 3; ++axis) result.dense = result.dense && part.hi[axis] - part.lo[axis] <= 64;
    return result;
}

std::array<float, 3> to_world(const grid& g, const std::array<double, 3>& units) {
    const double to_voxels = std::ldexp(1.0, -fraction_bits(g));
    std::array<float, 3> world{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        world[axis] = static_cast<float>(g.origin[axis] + units[axis] * to_voxels * g.voxel_size[axis]);
    return world;
}

world_triangle make_triangle(splitmix64& random, const test_grid& where, triangle_class kind) {
    const corners c = maker(random, where).make(kind);
    world_triangle t{};
    // The classes put special vertices first; any vertex may be the special one.
    const std::size_t turn = random.below(3);
    const bool flip = random.one_in(2);
    for (std::size_t vertex = 0; vertex < 3; ++vertex) {
        const std::size_t from = flip ? (turn + 3 - vertex) % 3 : (turn + vertex) % 3;
        const std::array<float, 3> p = to_world(where.g, c[from]);
        std::copy(p.begin(), p.end(), t.v[vertex]);
    }
    if (kind == triangle_class::dropped) make_bad(random, where.g, t);
    return t;
}

} // namespace oracle
