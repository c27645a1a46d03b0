// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding, a brick of 8^3 samples at a time. Where the cones of all holes cover less than half of what is seen
// from anywhere in a brick, or a box of them, the winding numbers of rows decide. Where no triangle of the mesh meets
// the box of a brick's samples, their generalized winding number w is smooth; where no cone does, their sum S of solid
// angles is. Then one sample in the middle and bounds on derivatives decide most bricks. In bricks beside small holes,
// each sample sums up the near ones. The bounds only save work, as in winding_tree.hpp.

#include <voxelpipe/solid/core/winding_angles.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

inline constexpr int winding_brick = 8, log2_winding_brick = 3;
// Boxes of bricks that are decided as a whole, where they can be: samples along each axis.
inline constexpr int small_winding_box = 16, large_winding_box = 32;

// What there is in the box of a brick's samples, or may be.
enum winding_mark : std::uint8_t { meets_mesh = 1, meets_cones = 2, has_samples_on_cones = 4 };

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int64_t floor_to_int64(double a) {
    const auto i = static_cast<std::int64_t>(a);
    return i - static_cast<std::int64_t>(static_cast<double>(i) > a);
}

// A triangle over the plane that it is largest in, in doubles; w is the axis with the largest normal.
struct upright_triangle {
    int axis;
    triple<std::int64_t> p[3]; // u v w
    triple<double> normal;
    int sign; // of normal[2]; 0: no area

    [[nodiscard]] VOXELPIPE_HD static upright_triangle of(const snapped_position& a, const snapped_position& b,
                                                          const snapped_position& c) {
        const std::int64_t e1[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, e2[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
        double n[3];
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            n[k] = exact::to_double(static_cast<int128>(e1[i]) * e2[j] - static_cast<int128>(e1[j]) * e2[i]);
        }
        upright_triangle t{};
        t.axis = magnitude_of(n[1]) > magnitude_of(n[0]) ? 1 : 0;
        if (magnitude_of(n[2]) > magnitude_of(n[t.axis])) t.axis = 2;
        t.normal = to_uvw(t.axis, n[0], n[1], n[2]);
        t.p[0] = to_uvw(t.axis, a.x, a.y, a.z);
        t.p[1] = to_uvw(t.axis, b.x, b.y, b.z);
        t.p[2] = to_uvw(t.axis, c.x, c.y, c.z);
        t.sign = t.normal[2] > 0.0 ? 1 : t.normal[2] < 0.0 ? -1 : 0;
        return t;
    }
    // False if the projection is further than `half` from (u, v) along an axis.
    [[nodiscard]] VOXELPIPE_HD bool may_meet(double u, double v, double half) const {
        for (int i = 0; i < 3; ++i) {
            const triple<std::int64_t>&from = p[i], &to = p[i == 2 ? 0 : i + 1];
            const auto du = static_cast<double>(to[0] - from[0]), dv = static_cast<double>(to[1] - from[1]);
            const double u0 = u - static_cast<double>(from[0]), v0 = v - static_cast<double>(from[1]);
            const double side = sign > 0 ? du * v0 - dv * u0 : dv * u0 - du * v0;
            const double reach = half + 0x1p-40 * (magnitude_of(u0) + magnitude_of(v0));
            if (side < -reach * (magnitude_of(du) + magnitude_of(dv))) return false;
        }
        return true;
    }
    // The plane's w over (u, v); `off` is more than its error.
    [[nodiscard]] VOXELPIPE_HD double depth(double u, double v, double& off) const {
        const double u0 = u - static_cast<double>(p[0][0]), v0 = v - static_cast<double>(p[0][1]);
        off = 0x1p-40 * (magnitude_of(u0) + magnitude_of(v0) + magnitude_of(static_cast<double>(p[0][2])));
        return static_cast<double>(p[0][2]) - (normal[0] * u0 + normal[1] * v0) / normal[2];
    }
};

// Ranges of bricks or samples that a triangle's bounding box meets, per axis.
struct winding_box {
    index_span of[3];
    [[nodiscard]] VOXELPIPE_HD bool empty() const { return of[0].empty() || of[1].empty() || of[2].empty(); }
};
// Boxes from first << log2 to (first << log2) + length, moved by half a voxel; sub-voxel units.
[[nodiscard]] VOXELPIPE_HD inline winding_box boxes_within(const snapped_position& a, const snapped_position& b,
                                                           const snapped_position& c, const triple<std::int64_t>& count,
                                                           int fraction, int log2, std::int64_t length) {
    const std::int64_t half = std::int64_t{1} << (fraction - 1);
    const triple<std::int64_t> low{{min3(a.x, b.x, c.x), min3(a.y, b.y, c.y), min3(a.z, b.z, c.z)}};
    const triple<std::int64_t> high{{max3(a.x, b.x, c.x), max3(a.y, b.y, c.y), max3(a.z, b.z, c.z)}};
    winding_box r{};
    for (int k = 0; k < 3; ++k)
        r.of[k] = intersect(
            index_span{exact::ceil_shift(low[k] - half - length, log2), exact::floor_shift(high[k] - half, log2)},
            index_span{0, count[k] - 1});
    return r;
}
[[nodiscard]] VOXELPIPE_HD constexpr triple<std::int64_t> bricks_of(const triple<std::int64_t>& extent) {
    return {{(extent[0] + winding_brick - 1) / winding_brick, (extent[1] + winding_brick - 1) / winding_brick,
             (extent[2] + winding_brick - 1) / winding_brick}};
}

// Calls visit(x, y, z) for every brick that the box of its samples meets the triangle, and for few others; every
// `lanes`th column of bricks from `lane` on. A triangle without area meets none: it adds nothing to a sum of angles.
VOXELPIPE_ANY_CALLABLE
template <class Visit>
VOXELPIPE_HD void visit_bricks(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                               const triple<std::int64_t>& extent, int fraction, std::int64_t lane, std::int64_t lanes,
                               const Visit& visit) {
    const int log2 = fraction + log2_winding_brick;
    const std::int64_t length = std::int64_t{winding_brick - 1} << fraction;
    const winding_box box = boxes_within(a, b, c, bricks_of(extent), fraction, log2, length);
    if (box.empty()) return;
    if (box.of[0].lo == box.of[0].hi && box.of[1].lo == box.of[1].hi && box.of[2].lo == box.of[2].hi) {
        if (lane == 0) visit(box.of[0].lo, box.of[1].lo, box.of[2].lo);
        return;
    }
    const upright_triangle t = upright_triangle::of(a, b, c);
    if (t.sign == 0) return;
    const auto range = to_uvw(t.axis, box.of[0], box.of[1], box.of[2]);
    const double size = static_cast<double>(std::int64_t{1} << log2), half = 0.5 * static_cast<double>(length);
    const double spread = (magnitude_of(t.normal[0]) + magnitude_of(t.normal[1])) / magnitude_of(t.normal[2]) * half;
    const std::int64_t across = range[0].hi - range[0].lo + 1, columns = across * (range[1].hi - range[1].lo + 1);
    // The middles of bricks are at whole multiples of `size` and half of one.
    for (std::int64_t i = lane; i < columns; i += lanes) {
        const std::int64_t u = range[0].lo + i % across, v = range[1].lo + i / across;
        const double at_u = (static_cast<double>(u) + 0.5) * size, at_v = (static_cast<double>(v) + 0.5) * size;
        if (!t.may_meet(at_u, at_v, half + 1.0)) continue;
        double off = 0.0;
        const double w = t.depth(at_u, at_v, off), reach = spread * (1.0 + 0x1p-20) + half + off + 1.0;
        const double low = (w - reach) / size - 0.5, high = (w + reach) / size - 0.5;
        std::int64_t first = range[2].lo, last = range[2].hi;
        if (low > static_cast<double>(first)) first = low < 0x1p60 ? -floor_to_int64(-low) : last + 1;
        if (high < static_cast<double>(last)) last = high > -0x1p60 ? floor_to_int64(high) : first - 1;
        for (std::int64_t d = first; d <= last; ++d) {
            const auto brick = to_xyz(t.axis, u, v, d);
            visit(brick[0], brick[1], brick[2]);
        }
    }
}

// Calls visit(x, y, z) for every sample of the grid that lies on the closed triangle, if that has an area; lanes as
// visit_bricks.
VOXELPIPE_ANY_CALLABLE
template <class Visit>
VOXELPIPE_HD void visit_samples_on(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                   const triple<std::int64_t>& extent, int fraction, std::int64_t lane,
                                   std::int64_t lanes, const Visit& visit) {
    const winding_box box = boxes_within(a, b, c, extent, fraction, fraction, 0);
    if (box.empty()) return;
    const upright_triangle t = upright_triangle::of(a, b, c);
    if (t.sign == 0) return;
    const auto range = to_uvw(t.axis, box.of[0], box.of[1], box.of[2]);
    const std::int64_t across = range[0].hi - range[0].lo + 1, columns = across * (range[1].hi - range[1].lo + 1);
    const std::int64_t middle = std::int64_t{1} << (fraction - 1);
    const auto edge = [&](int i, std::int64_t u, std::int64_t v) {
        const triple<std::int64_t>&from = t.p[i], &to = t.p[i == 2 ? 0 : i + 1];
        const int128 side =
            static_cast<int128>(to[0] - from[0]) * (v - from[1]) - static_cast<int128>(to[1] - from[1]) * (u - from[0]);
        return t.sign > 0 ? side >= 0 : side <= 0;
    };
    for (std::int64_t i = lane; i < columns; i += lanes) {
        const std::int64_t u = ((range[0].lo + i % across) << fraction) + middle,
                           v = ((range[1].lo + i / across) << fraction) + middle;
        const auto at_u = static_cast<double>(u), at_v = static_cast<double>(v);
        if (!t.may_meet(at_u, at_v, 1.0)) continue;
        double off = 0.0;
        const double depth = t.depth(at_u, at_v, off);
        if (!(magnitude_of(depth) < 0x1p60)) continue;
        const std::int64_t index = exact::floor_shift(exact::round_to_int64(depth), fraction);
        if (index < range[2].lo || index > range[2].hi) continue;
        const std::int64_t w = (index << fraction) + middle;
        if (magnitude_of(depth - static_cast<double>(w)) > off + 0.5) continue;
        // n . (p - a) = 0, in integers.
        int128 over = 0;
        for (int k = 0; k < 3; ++k) {
            const int e = k == 2 ? 0 : k + 1, f = k == 0 ? 2 : k - 1;
            const int128 n = static_cast<int128>(t.p[1][e] - t.p[0][e]) * (t.p[2][f] - t.p[0][f]) -
                             static_cast<int128>(t.p[1][f] - t.p[0][f]) * (t.p[2][e] - t.p[0][e]);
            over += n * ((k == 0 ? u : k == 1 ? v : w) - t.p[0][k]);
        }
        if (over != 0 || !edge(0, u, v) || !edge(1, u, v) || !edge(2, u, v)) continue;
        const auto at = to_xyz(t.axis, range[0].lo + i % across, range[1].lo + i / across, index);
        visit(at[0], at[1], at[2]);
    }
}

// Samples of a brick, or a box of them, of which some may not be drawn: from `first` on, `count` along each axis,
// `step` apart.
struct winding_samples {
    snapped_position first;
    int count[3];
    std::int64_t step;

    // Those of a grid whose indices are `index` and up to `side` - 1 more along each axis.
    [[nodiscard]] VOXELPIPE_HD static winding_samples of_box(const int (&index)[3], int side, const int (&extent)[3],
                                                             int fraction) {
        winding_samples s{};
        s.step = std::int64_t{1} << fraction;
        s.first = {s.step * index[0] + s.step / 2, s.step * index[1] + s.step / 2, s.step * index[2] + s.step / 2};
        for (int k = 0; k < 3; ++k) s.count[k] = extent[k] - index[k] < side ? extent[k] - index[k] : side;
        return s;
    }

    // Indices of the sample in the middle.
    [[nodiscard]] VOXELPIPE_HD int middle(int k) const { return count[k] / 2; }
    [[nodiscard]] VOXELPIPE_HD snapped_position at(int x, int y, int z) const {
        return {first.x + x * step, first.y + y * step, first.z + z * step};
    }
};

// A ball around samples, world units.
struct winding_ball {
    world_point at;
    double reach;

    [[nodiscard]] VOXELPIPE_HD static winding_ball around(const winding_view& t, const winding_samples& s) {
        winding_ball b{to_world(t, s.first), 0.0};
        for (int k = 0; k < 3; ++k) {
            const double half = 0.5 * t.scale.length[k] * static_cast<double>(s.step) * (s.count[k] - 1);
            b.at.x[k] += half;
            b.reach += half * half;
        }
        b.reach = exact::sqrt(b.reach) * (1.0 + 0x1p-20);
        return b;
    }
};
// True if the cones cover less than half from anywhere among the samples: their verdicts are those of rows.
[[nodiscard]] VOXELPIPE_HD inline bool is_below_half(const winding_view& t, const winding_samples& s) {
    const winding_ball b = winding_ball::around(t, s);
    return is_below_half(t, b.at, b.reach);
}

// What is known of all samples of a brick.
struct winding_verdict {
    enum kinds : std::uint32_t {
        outside,
        inside,
        beyond,  // the verdict of a sample is that of k - whole
        number,  // w is base + slope . (indices from the middle), to within `off`
        sum,     // S is
        unknown, // each for itself
    };
    kinds kind = unknown;
    std::int64_t whole = 0;
    double base = 0.0, slope[3] = {0.0, 0.0, 0.0}, off = 0.0;
    near_holes near;
};

// Looks for a verdict of all samples where the lids have a smooth sum. Arguments as judge_brick().
VOXELPIPE_HD inline void judge_smooth_brick(const winding_view& t, const winding_samples& s, std::int64_t k,
                                            std::int64_t k_cones, unsigned marks, fill_rule rule, winding_verdict& r) {
    // In the shadow of a hole that is left open k may change anywhere.
    const bool has_mesh = (marks & meets_mesh) != 0 || t.has_all == 0, has_cones = (marks & meets_cones) != 0;
    if (has_mesh && has_cones) return;
    const int m[3] = {s.middle(0), s.middle(1), s.middle(2)};
    double side[3], reach = 0.0;
    for (int i = 0; i < 3; ++i) {
        side[i] = t.scale.length[i] * static_cast<double>(s.step) * m[i]; // downward; upward it is no more
        reach += side[i] * side[i];
    }
    reach = exact::sqrt(reach) * (1.0 + 0x1p-20);
    const snapped_position p = s.at(m[0], m[1], m[2]);
    const lid_angles lids = find_lid_angles(t, p, reach, 0x1p-8);
    if (!lids.is_known || lids.slope < 0.0) return;
    const double w = static_cast<double>(k - k_cones + lids_below(t, p, k_cones)) - lids.turns;
    const double off = lids.error + lids.slope * reach;
    const double sum = static_cast<double>(k) - w;
    const double whole = static_cast<double>(exact::round_to_int64(sum));
    if (!has_mesh) {
        const int verdict = verdict_of(rule, w, off);
        r.kind = verdict == 1 ? winding_verdict::inside : winding_verdict::outside;
        if (verdict >= 0) return;
    } else if (magnitude_of(sum - whole) + off < 0.5) {
        r.kind = winding_verdict::beyond;
        r.whole = static_cast<std::int64_t>(whole);
        return;
    }
    r.kind = winding_verdict::unknown;
    // Linear to within half the second derivative times a square, of the sample and of the ends that give the slope.
    const double bend = lids.curve * reach * reach;
    if (!(bend < 0.25)) return;
    const lid_angles here = find_lid_angles(t, p, 0.0, 0x1p-14);
    if (!here.is_known) return;
    r.base = w + lids.turns - here.turns;
    double error = here.error;
    for (int i = 0; i < 3; ++i) {
        if (m[i] == 0) continue;
        const lid_angles there =
            find_lid_angles(t, s.at(i == 0 ? 0 : m[0], i == 1 ? 0 : m[1], i == 2 ? 0 : m[2]), 0.0, 0x1p-14);
        if (!there.is_known || !(there.error < 0x1p-6) || !(lids.slope * side[i] < 0.4)) return;
        double change = here.turns - there.turns; // of w, but for whole steps at the lids
        change -= static_cast<double>(exact::round_to_int64(change));
        r.slope[i] = -change / m[i];
        error += there.error;
    }
    r.off = bend + 4.0 * error;
    r.kind = winding_verdict::number;
    if (has_mesh) {
        r.kind = winding_verdict::sum;
        r.base = static_cast<double>(k) - r.base;
        for (double& slope : r.slope) slope = -slope;
    }
}

// k, k_cones: of the sample in the middle. marks: of the brick. list: gets the numbers of near holes; has room for
// near_holes::most.
[[nodiscard]] VOXELPIPE_HD inline winding_verdict judge_brick(const winding_view& t, const winding_samples& s,
                                                              std::int64_t k, std::int64_t k_cones, unsigned marks,
                                                              fill_rule rule, std::uint32_t* list) {
    winding_verdict r;
    const winding_ball ball = winding_ball::around(t, s);
    r.near = find_near_holes(t, ball.at, ball.reach, list);
    if (is_below_half(t, r.near, list, ball.at, ball.reach)) {
        r.kind = winding_verdict::beyond; // by nothing
        return r;
    }
    if (r.near.count <= near_holes::most && r.near.has_large == 0 && r.near.is_coarse == 0)
        return r; // nothing is smooth beside holes that are smaller than the brick: their edges are in it
    judge_smooth_brick(t, s, k, k_cones, marks, rule, r);
    // Samples that are left may be anywhere beside 1/2.
    if (r.kind == winding_verdict::unknown && r.near.has_large != 0)
        r.near = find_near_holes(t, ball.at, ball.reach, list, 0x1p-13);
    return r;
}

// The verdict of a sample of the brick, at these indices from the brick's first: 1 inside, 0 outside, -1 if what is
// known of the brick does not tell. list: what judge_brick() has listed.
[[nodiscard]] VOXELPIPE_HD inline int try_sample(const winding_view& t, const winding_samples& s,
                                                 const winding_verdict& brick, const std::uint32_t* list, int x, int y,
                                                 int z, const winding_sample& of, fill_rule rule) {
    if (of.is_on_cone) return is_inside(rule, of.k) ? 1 : 0;
    switch (brick.kind) {
    case winding_verdict::outside:
        return 0;
    case winding_verdict::inside:
        return 1;
    case winding_verdict::beyond:
        return (rule == fill_rule::nonzero ? of.k != brick.whole : of.k > brick.whole) ? 1 : 0;
    case winding_verdict::number:
    case winding_verdict::sum: {
        const double linear = brick.base + (x - s.middle(0)) * brick.slope[0] + (y - s.middle(1)) * brick.slope[1] +
                              (z - s.middle(2)) * brick.slope[2];
        const double w = brick.kind == winding_verdict::number ? linear : static_cast<double>(of.k) - linear;
        const int verdict = verdict_of(rule, w, brick.off);
        if (verdict >= 0) return verdict;
        break;
    }
    case winding_verdict::unknown:
        break;
    }
    const snapped_position p = s.at(x, y, z);
    if (is_below_half(t, brick.near, list, to_world(t, p), 0.0)) return is_inside(rule, of.k) ? 1 : 0;
    return verdict_by_near_holes(t, brick.near, list, p, of, rule);
}
// The verdict of any sample.
[[nodiscard]] VOXELPIPE_HD inline bool judge_sample(const winding_view& t, const winding_samples& s,
                                                    const winding_verdict& brick, const std::uint32_t* list, int x,
                                                    int y, int z, const winding_sample& of, fill_rule rule) {
    const int verdict = try_sample(t, s, brick, list, x, y, z, of, rule);
    if (verdict >= 0) return verdict != 0;
    return is_inside_by_winding(t, s.at(x, y, z), of, rule, brick.near.count > near_holes::most);
}

} // namespace voxelpipe::core
