// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding, a sample at a time: the sum of the solid angles of lids over the holes, to within an error, and the
// verdict of the generalized winding number (winding_tree.hpp).

#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/solid/core/row_crossing.hpp>
#include <voxelpipe/solid/core/winding_tree.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// The verdict of a winding number between w - off and w + off: 1 inside, 0 outside, -1 if it may be either.
[[nodiscard]] VOXELPIPE_HD constexpr int verdict_of(fill_rule rule, double w, double off) {
    if (w - off > 0.5) return 1;
    if (rule == fill_rule::nonzero) {
        if (w + off < -0.5) return 1;
        return w + off < 0.5 && w - off > -0.5 ? 0 : -1;
    }
    return w + off < 0.5 ? 0 : -1;
}

// ---- sums -----------------------------------------------------------------------------------------------------------

// The sum over the triangles from `first` to `last`, in units of 2^-bits. Sets `is_on` if the sample lies on one.
[[nodiscard]] VOXELPIPE_HD inline std::int64_t sum_angles(const winding_view& t, const snapped_position& p, int bits,
                                                          std::uint32_t first, std::uint32_t last, bool& is_on) {
    std::int64_t sum = 0;
    // The narrow form is for samples of a grid; every one of these has a narrow triangle with all of its corners there.
    const bool is_sample = is_narrow_in_grid(p, p, p) && p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= 0x1008000 &&
                           p.y <= 0x1008000 && p.z <= 0x1008000;
    for (std::uint32_t i = first; i < last; ++i) {
        const snapped_position* const c = t.corners + 3 * std::size_t{i};
        const seen_angle seen =
            find_angle(see_corners(c[0], c[1], c[2], p, is_sample && is_narrow_in_grid(c[0], c[1], c[2])), t.scale);
        is_on = is_on || seen.is_on;
        sum += angle_units(seen.half, bits);
    }
    return sum;
}

// True if k - sum / 2^bits is inside: at least 1/2, or with fill_rule::nonzero its magnitude.
[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_sum(fill_rule rule, std::int64_t k, std::int64_t sum, int bits) {
    const std::int64_t whole = k - (sum >> bits), part = sum & ((std::int64_t{1} << bits) - 1); // whole - part / 2^bits
    const std::int64_t half = std::int64_t{1} << (bits - 1);
    if (whole >= 2) return true;
    if (whole == 1) return part <= half;
    if (rule != fill_rule::nonzero) return false;
    return whole == 0 ? part >= half : true; // at most -1/2
}

// ---- the tree's lids ------------------------------------------------------------------------------------------------

// A line along x through a point.
struct x_line {
    world_point at;
    double slack;
    // False if the line does not meet the node's ball at or below the point.
    template <class Node>
    [[nodiscard]] VOXELPIPE_HD bool may_meet(const Node& n) const {
        const double y = n.centre[1] - at.x[1], z = n.centre[2] - at.x[2], radius = n.radius + slack;
        return y * y + z * z <= radius * radius * (1.0 + 0x1p-40) && n.centre[0] - radius <= at.x[0];
    }
};
[[nodiscard]] VOXELPIPE_HD inline int lid_below(const snapped_position* c, const snapped_position& p) {
    const bool meets = min3(c[0].y, c[1].y, c[2].y) <= p.y && max3(c[0].y, c[1].y, c[2].y) >= p.y &&
                       min3(c[0].z, c[1].z, c[2].z) <= p.z && max3(c[0].z, c[1].z, c[2].z) >= p.z &&
                       min3(c[0].x, c[1].x, c[2].x) <= p.x;
    return meets ? crossing_below(c[0], c[1], c[2], p) : 0;
}
// What the lids add to the winding number of a point, moved by (e, e^2, e^3): their crossings below it. k_cones: what
// the cones add.
[[nodiscard]] VOXELPIPE_HD inline std::int64_t lids_below(const winding_view& t, const snapped_position& p,
                                                          std::int64_t k_cones) {
    if (t.num_nodes == 0) return k_cones; // there are no other lids
    x_line line{to_world(t, p), 0.0};
    line.slack = 0x1p-48 * (magnitude_of(line.at.x[0]) + magnitude_of(line.at.x[1]) + magnitude_of(line.at.x[2]));
    std::int64_t sum = 0;
    for (std::uint32_t i = 0; i < t.num_nodes;) {
        const winding_node& n = t.nodes[i];
        const bool meets = line.may_meet(n);
        if (meets && n.has_lid != 0) sum += lid_below(t.lids + 3 * std::size_t{i}, p);
        i = meets ? i + 1 : n.behind;
    }
    for (std::uint32_t i = 0; i < t.num_small;) {
        const winding_hole& n = t.holes[i];
        const bool meets = line.may_meet(n);
        if (meets && n.behind == i + 1)
            for (std::uint32_t c = 0; c < n.triangles; ++c)
                sum += lid_below(t.corners + 3 * std::size_t{n.first + c}, p);
        i = meets ? i + 1 : n.behind;
    }
    return sum;
}

// The solid angle of a triangle as seen from a point that is moved by (e, e^2, e^3), to within 2^-36; false on its
// edges, from where it may be any.
[[nodiscard]] VOXELPIPE_HD inline bool find_lid_angle(const winding_view& t, const snapped_position* c,
                                                      const snapped_position& p, double& angle) {
    double v[3][3], length[3], dot[3];
    for (int i = 0; i < 3; ++i) {
        v[i][0] = t.scale.length[0] * static_cast<double>(c[i].x - p.x);
        v[i][1] = t.scale.length[1] * static_cast<double>(c[i].y - p.y);
        v[i][2] = t.scale.length[2] * static_cast<double>(c[i].z - p.z);
        length[i] = exact::sqrt(v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]);
    }
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        dot[i] = v[i][0] * v[j][0] + v[i][1] * v[j][1] + v[i][2] * v[j][2];
    }
    const double volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                          v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                          v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
    const double all = length[0] * length[1] * length[2];
    const double other = all + dot[0] * length[2] + dot[1] * length[0] + dot[2] * length[1];
    // Both have an error of a few units of 2^-53 of `all`.
    if (greater(magnitude_of(volume), other) > 0x1p-8 * all) {
        angle = 2.0 * written_atan2(volume, other);
        return true;
    }
    const seen_triangle seen = see_wide(c[0], c[1], c[2], p);
    const seen_angle exactly = find_angle(seen, t.scale);
    angle = 2.0 * exactly.half;
    if (!exactly.is_on) return true;
    // On the triangle, in whose plane crosses are multiples of the normal. The moved point is in front of it, where its
    // angle is below 0, if the normal's first component is above 0.
    for (int k = 0; k < 3; ++k) {
        const double n = seen.normal[k];
        if (!(n < 0.0 || n > 0.0)) continue;
        angle = n > 0.0 ? -2.0 * pi_as_double : 2.0 * pi_as_double;
        bool is_within = true;
        for (int i = 0; i < 3; ++i)
            is_within = is_within && (n > 0.0 ? seen.cross[i][k] > 0.0 : seen.cross[i][k] < 0.0);
        return is_within;
    }
    return false;
}

// The sum of the solid angles of a hole's cone as seen from a point, triangle by triangle; false as find_lid_angle.
[[nodiscard]] VOXELPIPE_HD inline bool find_cone_angle(const winding_view& t, const winding_hole& n,
                                                       const snapped_position& p, double& sum) {
    for (std::uint32_t c = 0; c < n.triangles; ++c) {
        double angle = 0.0;
        if (!find_lid_angle(t, t.corners + 3 * std::size_t{n.first + c}, p, angle)) return false;
        sum += angle;
    }
    return true;
}
// The lids' solid angles over 4 pi as seen from a point: turns, to within `error`. But for whole steps at the lids they
// are smooth beside the holes' edges: in the ball of radius `reach` around the point, the gradient is at most `slope`
// and second derivatives at most `curve`; negative if the ball meets an edge.
struct lid_angles {
    double turns, error, slope, curve;
    bool is_known;
};
// most: what each node may add to the error, and to slope times reach, that is not opened. with_small: holes without
// nodes count too.
//
// The solid angle of lids in a ball of radius R at a distance d is vector area . (c - p) / d^3 to within area * 2 R /
// (d - R)^3, because the gradient of (y - p) / |y - p|^3 has norm 2 / |y - p|^3, and second derivatives 6 / |y - p|^4.
// The gradient of all angles is also the line integral of r x dl / |r|^3 along the edges. Of whole holes the lesser
// bound counts; chains have another boundary beside, which the others' cancels.
[[nodiscard]] VOXELPIPE_HD inline lid_angles find_lid_angles(const winding_view& t, const snapped_position& p,
                                                             double reach, double most, bool with_small = true) {
    const world_point at = to_world(t, p);
    const double limit = most * four_pi;
    double sum = 0.0, error = winding_margin(t.num_triangles) * four_pi, slope = 0.0, curve = 0.0;
    lid_angles r{0.0, 0.0, 0.0, 0.0, true};
    bool is_smooth = true;
    for (std::uint32_t i = 0; i < t.num_nodes;) {
        const winding_node& n = t.nodes[i];
        const node_offset o = offset_of(n, at);
        const double gap = o.length - n.radius, near = gap - reach;
        const bool is_leaf = n.behind == i + 1;
        const bool is_far = gap > 0.0 && 2.0 * n.area * n.radius <= limit * gap * gap * gap;
        double slope_of = 0.0, curve_of = 0.0;
        if (reach > 0.0) {
            const double inverse = 1.0 / near, square = inverse * inverse;
            const double least = n.is_closed != 0 ? 0.0 : n.length;
            slope_of = lesser(n.length, greater(least, 2.0 * n.area * inverse)) * square;
            curve_of = lesser(2.0 * n.length, greater(2.0 * least, 6.0 * n.area * inverse)) * square * inverse;
        }
        const bool is_flat = near > 0.0 && reach * slope_of <= limit;
        if (is_leaf || (is_far && is_flat)) {
            is_smooth = is_smooth && near > 0.0;
            slope += slope_of;
            curve += curve_of;
            if (is_far) {
                const double cube = 1.0 / (o.length * o.length * o.length), further = o.length / gap;
                sum += (n.vector_area[0] * o.d[0] + n.vector_area[1] * o.d[1] + n.vector_area[2] * o.d[2]) * cube;
                error += 2.0 * n.area * n.radius * cube * (further * further * further);
                i = n.behind;
                continue;
            }
        }
        if (n.has_lid != 0) {
            double angle = 0.0;
            if (!find_lid_angle(t, t.lids + 3 * std::size_t{i}, p, angle)) {
                r.is_known = false;
                return r;
            }
            sum += angle;
            error += 0x1p-36;
        }
        ++i;
    }
    const std::uint32_t num_small = with_small ? t.num_small : 0;
    for (std::uint32_t i = 0; i < num_small;) {
        const winding_hole& n = t.holes[i];
        const node_offset o = offset_of(n, at);
        const double gap = o.length - n.radius, near = gap - reach, off = 2.0 * n.area * n.radius;
        const bool is_leaf = n.behind == i + 1;
        const bool is_far = gap > 0.0 && off <= limit * gap * gap * gap;
        double slope_of = 0.0, curve_of = 0.0;
        if (reach > 0.0) {
            const double inverse = 1.0 / near;
            slope_of = 2.0 * n.area * inverse * inverse * inverse;
            curve_of = 3.0 * slope_of * inverse;
        }
        if (is_leaf || (is_far && near > 0.0 && reach * slope_of <= limit)) {
            is_smooth = is_smooth && near > 0.0;
            slope += slope_of;
            curve += curve_of;
            if (is_far) {
                sum += far_angle(n, o);
                error += off / (gap * gap * gap);
                i = n.behind;
                continue;
            }
            if (!find_cone_angle(t, n, p, sum)) {
                r.is_known = false;
                return r;
            }
            error += n.triangles * 0x1p-36;
        }
        ++i;
    }
    r.turns = sum / four_pi;
    r.error = error / four_pi;
    r.slope = is_smooth ? slope / four_pi * (1.0 + 0x1p-20) : -1.0;
    r.curve = is_smooth ? curve / four_pi * (1.0 + 0x1p-20) : -1.0;
    return r;
}

// ---- verdicts -------------------------------------------------------------------------------------------------------

// What is known of a sample beside its place.
struct winding_sample {
    std::int64_t k;       // its winding number, with the cones
    std::int64_t k_cones; // what the cones add to it
    bool is_on_cone;      // on a closed triangle of one that has an area
};

// The verdict of a sample in the ball of `near` that lies on no cone: 1 inside, 0 outside, -1 if its near holes do not
// tell.
[[nodiscard]] VOXELPIPE_HD inline int verdict_by_near_holes(const winding_view& t, const near_holes& near,
                                                            const std::uint32_t* list, const snapped_position& p,
                                                            const winding_sample& s, fill_rule rule) {
    if (near.count > near_holes::most) return -1;
    const world_point at = to_world(t, p);
    double sum = near.far[0].angle, error = near.far[0].error;
    for (std::uint32_t i = 0; i < near.count; ++i) {
        const winding_hole& n = t.holes[list[i]];
        if (near.has_large != 0 && list[i] >= t.num_small) continue;
        const node_offset o = offset_of(n, at);
        const double gap = o.length - n.radius, off = 2.0 * n.area * n.radius;
        if (gap > 0.0 && off <= 0x1p-7 * four_pi * gap * gap * gap) {
            error += off / (gap * gap * gap);
            sum += far_angle(n, o);
            continue;
        }
        if (!find_cone_angle(t, n, p, sum)) return -1;
        error += n.triangles * 0x1p-36;
    }
    if (near.has_large == 0)
        return verdict_of(rule, static_cast<double>(s.k) - (sum + near.far[1].angle) / four_pi,
                          (error + near.far[1].error) / four_pi);
    // With the lids of large holes in place of their cones.
    const double w = static_cast<double>(s.k - s.k_cones + lids_below(t, p, s.k_cones)) - sum / four_pi;
    double most = 0x1p-4;
    for (int i = 0; i < 3; ++i, most *= 0x1p-4) {
        const lid_angles lids = find_lid_angles(t, p, 0.0, most, false);
        if (!lids.is_known) break;
        const int verdict = verdict_of(rule, w - lids.turns, lids.error + error / four_pi);
        if (verdict >= 0) return verdict;
        if (lids.error < error / (4.0 * four_pi)) break;
    }
    return -1;
}

// tries_bound: whether the cones are likely to be small beside the distance to them.
[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_winding(const winding_view& t, const snapped_position& p,
                                                            const winding_sample& s, fill_rule rule,
                                                            bool tries_bound = true) {
    if (t.num_triangles == 0 || s.is_on_cone) return is_inside(rule, s.k);
    if (tries_bound && is_below_half(t, to_world(t, p))) return is_inside(rule, s.k);
    const std::int64_t k = s.k - s.k_cones + lids_below(t, p, s.k_cones); // of the mesh with the tree's lids
    constexpr int steps = 7;                                              // to 2^-24
    double most = 0x1p-6;
    for (int i = 0; i < steps; ++i, most *= 0x1p-3) {
        const lid_angles lids = find_lid_angles(t, p, 0.0, most);
        if (!lids.is_known) break;
        const int verdict = verdict_of(rule, static_cast<double>(k) - lids.turns, lids.error);
        if (verdict >= 0) return verdict != 0;
    }
    bool is_on = false;
    const int bits = angle_bits(t.num_triangles);
    const std::int64_t sum = sum_angles(t, p, bits, 0, t.num_triangles, is_on);
    return is_on ? is_inside(rule, s.k) : is_inside_by_sum(rule, s.k, sum, bits);
}

} // namespace voxelpipe::core
