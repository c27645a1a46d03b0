// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: whether the generalized winding number w of a sample is at least 1/2 (docs/design.md, "Solids"). By
// definition it is k, the winding number of the mesh with the cones of close_holes, less the sum S of the cones' solid
// angles over 4 pi, a sum of integers. Few samples need that sum. Any other lids over the same holes give the same w:
// here the cones of holes with few edges, and for others those of a tree, in which a chain of edges of a hole has one
// triangle and two halves, so that a chain that is far counts as a whole. The bounds only save work: a verdict that
// they allow is that of the sum.

#include <voxelpipe/solid/core/solid_angle.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// A chain of edges of a hole, or several holes, in a ball; world units. Its lids are its own triangle, from the chain's
// first vertex to a middle one and to the last, and those of the nodes within.
struct winding_node {
    double centre[3];
    double radius;
    double area;             // of its lids, rounded up
    double vector_area[3];   // of its lids: half the crosses of edges
    double length;           // of its edges, rounded up
    std::uint32_t behind;    // number of the node behind those within this one; a leaf's is the next
    std::uint16_t has_lid;   // a triangle of its own
    std::uint16_t is_closed; // whole holes
};

// Whole holes, or a closed walk along edges of one, with the part of its cone over them; in a ball, world units.
struct winding_hole {
    double centre[3];
    double radius;           // of a ball around the cones' triangles
    double area;             // of these, rounded up
    double vector_area[3];   // of these: half the crosses of edges
    std::uint32_t behind;    // number of the node behind those within this one; a leaf's is the next
    std::uint32_t first;     // number of the first of these triangles
    std::uint32_t triangles; // how many they are
};
// Closed walks of no more edges have no lids but their cones.
inline constexpr std::uint32_t most_small_edges = 16;

// The holes of a body, in a backend's memory. Not owned.
struct winding_view {
    // Edges of holes with many of them: the first node has all; within a node are its two halves.
    const winding_node* nodes = nullptr;
    std::uint32_t num_nodes = 0;
    const snapped_position* lids = nullptr; // three a node
    // Two trees, one behind the other: holes of few edges, then those with nodes.
    const winding_hole* holes = nullptr;
    std::uint32_t num_small = 0, num_holes = 0; // nodes of the first tree, and of both
    const snapped_position* corners = nullptr;  // of the cones' triangles, three each
    std::uint32_t num_triangles = 0;
    std::uint32_t has_all = 1; // no hole is left open, which would cast shadows along rows
    distance_scale scale{};
};

struct world_point {
    double x[3];
};
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE world_point to_world(const winding_view& t, const snapped_position& p) {
    return {{exact::mul(t.scale.length[0], static_cast<double>(p.x)),
             exact::mul(t.scale.length[1], static_cast<double>(p.y)),
             exact::mul(t.scale.length[2], static_cast<double>(p.z))}};
}

inline constexpr double four_pi = 4.0 * pi_as_double;
// More than what roundings of the bounds can amount to, as winding numbers.
[[nodiscard]] VOXELPIPE_HD constexpr double winding_margin(std::uint32_t num_triangles) {
    return 0x1p-20 + 0x1p-40 * num_triangles;
}

// The vector from a point to a node's centre, and its length.
struct node_offset {
    double d[3], length;
};
template <class Node>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE node_offset offset_of(const Node& n, const world_point& p) {
    node_offset o{};
    for (int k = 0; k < 3; ++k) o.d[k] = n.centre[k] - p.x[k];
    o.length = exact::sqrt(o.d[0] * o.d[0] + o.d[1] * o.d[1] + o.d[2] * o.d[2]);
    return o;
}

// The solid angle of small lids that are far, by their vector area; o: from the point to their ball.
template <class Node>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double far_angle(const Node& n, const node_offset& o) {
    return (n.vector_area[0] * o.d[0] + n.vector_area[1] * o.d[1] + n.vector_area[2] * o.d[2]) /
           (o.length * o.length * o.length);
}

// ---- bounds ---------------------------------------------------------------------------------------------------------

// Bounds of the sum of the magnitudes of the cones' angles, and so of that of S: where it stays below half of 4 pi, the
// verdict is that of k. A triangle at a distance d covers at most its area / d^2.
[[nodiscard]] VOXELPIPE_HD constexpr double half_turn(const winding_view& t) {
    return (0.5 - winding_margin(t.num_triangles)) * four_pi;
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double most_angle(const winding_hole& hole, const world_point& p,
                                                              double reach) {
    const double gap = offset_of(hole, p).length - hole.radius - reach;
    return gap > 0.0 ? hole.area / (gap * gap) : 2.0 * four_pi;
}
// True if the cones of all holes cover less than half from all points of a ball; false if they may cover more.
[[nodiscard]] VOXELPIPE_HD inline bool is_below_half(const winding_view& t, const world_point& p, double reach = 0.0) {
    const double limit = half_turn(t);
    double sum = 0.0;
    for (std::uint32_t i = 0; i < t.num_holes;) {
        const winding_hole& n = t.holes[i];
        const double gap = offset_of(n, p).length - n.radius - reach;
        const double most = gap > 0.0 ? n.area / (gap * gap) : 2.0 * four_pi;
        // Its bound does not matter, or is not much more than those of its parts.
        const bool is_one =
            n.behind == i + 1 || most <= 0x1p-9 * four_pi || (gap >= 1.5 * n.radius && most <= 0x1p-4 * four_pi);
        if (!is_one) {
            ++i;
            continue;
        }
        sum += most;
        if (!(sum < limit)) return false;
        i = n.behind;
    }
    return true;
}

// The holes near a ball, and the sum of the angles of all others' cones: from any point of the ball it is `angle`, to
// within `error`.
//
// A triangle set in a ball of radius R whose vector area is N has, from a point at a distance d, the angle N . r / d^3
// to within area * 2 R / (d - R)^3 (find_lid_angles); from all points that are at most `reach` away from that one, to
// within area * 2 (R + reach) / (d - R - reach)^3. It also is at most area / (d - R - reach)^2.
struct near_holes {
    static constexpr std::uint32_t most = 256; // in a list
    struct sum {
        double angle, error;
    };
    sum far[2] = {{0.0, 0.0}, {0.0, 0.0}}; // of small holes, and of large ones, which have nodes
    std::uint32_t count = 0;               // more than `most`: not all are listed
    std::uint16_t has_large = 0;           // among those that are near
    std::uint16_t is_coarse = 0;           // one of them is as large as the ball
};
// list: their numbers; has room for near_holes::most. most_error: what each group of holes may add to the error. Many
// are far.
[[nodiscard]] VOXELPIPE_HD inline near_holes find_near_holes(const winding_view& t, const world_point& p, double reach,
                                                             std::uint32_t* list, double most_error = 0x1p-10) {
    near_holes r;
    r.far[0].error = winding_margin(t.num_triangles) * four_pi;
    for (std::uint32_t i = 0; i < t.num_holes;) {
        const winding_hole& n = t.holes[i];
        const node_offset o = offset_of(n, p);
        const double gap = o.length - n.radius - reach;
        const bool is_leaf = n.behind == i + 1;
        if (gap > 0.0) {
            const double inverse = 1.0 / gap, bound = n.area * inverse * inverse;
            const double off = 2.0 * bound * (n.radius + reach) * inverse;
            if (lesser(bound, off) <= (is_leaf ? 0x1p-8 : most_error) * four_pi) {
                near_holes::sum& far = r.far[i < t.num_small ? 0 : 1];
                far.error += lesser(bound, off);
                if (off < bound) far.angle += far_angle(n, o);
                i = n.behind;
                continue;
            }
        }
        if (is_leaf) {
            if (r.count < near_holes::most) list[r.count] = i;
            ++r.count;
            if (n.triangles > most_small_edges) r.has_large = 1;
            if (n.radius > reach) r.is_coarse = 1;
        }
        ++i;
    }
    return r;
}
// True if the cones of all holes cover less than half from all points of a ball within that of `near`.
[[nodiscard]] VOXELPIPE_HD inline bool is_below_half(const winding_view& t, const near_holes& near,
                                                     const std::uint32_t* list, const world_point& p, double reach) {
    if (near.count > near_holes::most) return false;
    const double limit = half_turn(t);
    double sum = magnitude_of(near.far[0].angle + near.far[1].angle) + near.far[0].error + near.far[1].error;
    for (std::uint32_t i = 0; i < near.count && sum < limit; ++i) sum += most_angle(t.holes[list[i]], p, reach);
    return sum < limit;
}

} // namespace voxelpipe::core
