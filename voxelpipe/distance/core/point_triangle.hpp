// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The distance of a sample from a closed triangle, by one written formula (docs/design.md, "Distances"): integers
// first (core/seen_triangle.hpp), then operations of one rounding in a fixed order. Every backend gets the same square,
// the same region and the same closest point.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/seen_triangle.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace voxelpipe::core {

// The closest point's place: vertex i, edge i from vertex i to the next one, or the inside of the face.
enum class closest_region : std::uint8_t { vertex_0, vertex_1, vertex_2, edge_0, edge_1, edge_2, face };

struct squared_distance {
    double square; // in world units; within 19.1 * 2^-53 of the exact one, relatively
    closest_region region;
};

// ---- the formula ----------------------------------------------------------------------------------------------------

// How far along edge i the foot of the sample lies, both in units of the edge's square: from its first end, and from
// its second one. Exchanging the ends exchanges the two, bit for bit.
struct edge_feet {
    double from_first, from_second;
};
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE edge_feet feet(const seen_triangle& t, const distance_scale& s, int i) {
    const triple<double>&a = t.vertex[i], &b = t.vertex[i == 2 ? 0 : i + 1], &e = t.edge[i];
    const triple<double> back{{-a[0], -a[1], -a[2]}};
    return {scaled_dot(s.w, back, e), scaled_dot(s.w, b, e)};
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE squared_distance edge_distance(const seen_triangle& t,
                                                                           const distance_scale& s, int i) {
    const int j = i == 2 ? 0 : i + 1;
    const edge_feet f = feet(t, s, i);
    if (!(f.from_first > 0.0)) return {scaled_dot(s.w, t.vertex[i], t.vertex[i]), static_cast<closest_region>(i)};
    if (!(f.from_second > 0.0)) return {scaled_dot(s.w, t.vertex[j], t.vertex[j]), static_cast<closest_region>(j)};
    return {exact::div(scaled_dot(s.g, t.cross[i], t.cross[i]), scaled_dot(s.w, t.edge[i], t.edge[i])),
            static_cast<closest_region>(3 + i)};
}

// Twice the area of the triangle of edge i and the sample's foot in the plane, times the normal's square length.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double face_side(const seen_triangle& t, const distance_scale& s, int i) {
    return scaled_dot(s.g, t.cross[i], t.normal);
}
// True if the foot lies inside of edge i by more than roundings can pretend.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_inside_edge(const seen_triangle& t, const distance_scale& s,
                                                                int i) {
    const triple<double>&p = t.cross[i], &n = t.normal;
    const double x = exact::mul(s.g[0], exact::mul(p[0], n[0])), y = exact::mul(s.g[1], exact::mul(p[1], n[1])),
                 z = exact::mul(s.g[2], exact::mul(p[2], n[2]));
    const double all = ordered_sum(magnitude_of(x), magnitude_of(y), magnitude_of(z));
    return ordered_sum(x, y, z) > exact::mul(0x1p-48, all);
}

// The square of the sample's distance from the closed triangle.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE squared_distance find_distance(const seen_triangle& t,
                                                                           const distance_scale& s) {
    // A triangle without area has a normal of 0, and no foot is inside of its edges.
    if (is_inside_edge(t, s, 0) && is_inside_edge(t, s, 1) && is_inside_edge(t, s, 2)) {
        const double h = exact::mul(s.c, t.volume);
        return {exact::div(exact::mul(h, h), scaled_dot(s.g, t.normal, t.normal)), closest_region::face};
    }
    squared_distance best = edge_distance(t, s, 0);
    for (int i = 1; i < 3; ++i) {
        const squared_distance d = edge_distance(t, s, i);
        if (d.square < best.square) best = d;
    }
    return best;
}

// The root, rounded to float once.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float distance_of(double square) {
    return exact::to_float(exact::sqrt(square));
}

// ---- the closest point ----------------------------------------------------------------------------------------------

// Weights of the three vertices: 1 at a vertex; t and 1 - t on an edge; on a face each side over their sum.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triple<double>
closest_weights(const seen_triangle& t, const distance_scale& s, closest_region region) {
    triple<double> r{{0.0, 0.0, 0.0}};
    const int i = static_cast<int>(region);
    if (region == closest_region::face) {
        const double side[3] = {face_side(t, s, 0), face_side(t, s, 1), face_side(t, s, 2)};
        const double sum = ordered_sum(side[0], side[1], side[2]);
        // Edge k lies opposite of vertex k + 2.
        r[2] = exact::div(side[0], sum);
        r[0] = exact::div(side[1], sum);
        r[1] = exact::div(side[2], sum);
    } else if (i >= 3) {
        const int first = i - 3, second = first == 2 ? 0 : first + 1;
        const double part = exact::div(feet(t, s, first).from_first, scaled_dot(s.w, t.edge[first], t.edge[first]));
        r[second] = lesser(part, 1.0);
        r[first] = add_doubles(1.0, -r[second]);
    } else {
        r[i] = 1.0;
    }
    return r;
}

// u x v, each component one product and one fused step.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triple<double> cross_product(const triple<double>& u,
                                                                         const triple<double>& v) {
    return {{exact::fma(u[1], v[2], -exact::mul(u[2], v[1])), exact::fma(u[2], v[0], -exact::mul(u[0], v[2])),
             exact::fma(u[0], v[1], -exact::mul(u[1], v[0]))}};
}

// From the sample to the closest point, in world units. Accurate relative to its own length, however small: on an edge
// e x (A x e) / e.e, on the face the normal times the volume over its square. Zeros are +0.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triple<double> to_closest(const seen_triangle& t, const distance_scale& s,
                                                                      closest_region region) {
    triple<double> r{};
    const int i = static_cast<int>(region);
    if (region == closest_region::face) {
        const double part = exact::div(exact::mul(s.c, t.volume), scaled_dot(s.g, t.normal, t.normal));
        for (int k = 0; k < 3; ++k) r[k] = exact::mul(exact::mul(s.area[k], t.normal[k]), part);
    } else if (i >= 3) {
        triple<double> e{}, p{};
        for (int k = 0; k < 3; ++k) {
            e[k] = exact::mul(s.length[k], t.edge[i - 3][k]);
            p[k] = exact::mul(s.area[k], t.cross[i - 3][k]);
        }
        const double square = scaled_dot(s.w, t.edge[i - 3], t.edge[i - 3]);
        const triple<double> foot = cross_product(e, p);
        for (int k = 0; k < 3; ++k) r[k] = exact::div(foot[k], square);
    } else {
        for (int k = 0; k < 3; ++k) r[k] = exact::mul(s.length[k], t.vertex[i][k]);
    }
    for (int k = 0; k < 3; ++k)
        if (!(r[k] < 0.0 || r[k] > 0.0)) r[k] = 0.0;
    return r;
}

// Unit normal in world space, (B - A) x (C - A), as fragment::normal has it; 0 without area. factors: normal_factors of
// the grid.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE glm::vec3 unit_normal(const seen_triangle& t,
                                                                  const triple<double>& factors) {
    const double x = exact::mul(t.normal[0], factors[0]), y = exact::mul(t.normal[1], factors[1]),
                 z = exact::mul(t.normal[2], factors[2]);
    const double square = exact::fma(z, z, exact::fma(y, y, exact::mul(x, x)));
    if (!(square > 0.0)) return glm::vec3(0.0f);
    const double length = exact::sqrt(square);
    const auto component = [&](double a) { return a < 0.0 || a > 0.0 ? exact::to_float(exact::div(a, length)) : 0.0f; };
    return {component(x), component(y), component(z)};
}

// 1: the sample lies where the normal points to; -1: behind the triangle's plane; 0: in it, or the triangle has no
// area.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE int side_of(const seen_triangle& t) {
    return t.volume < 0.0 ? 1 : t.volume > 0.0 ? -1 : 0;
}

} // namespace voxelpipe::core
