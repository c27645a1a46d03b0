// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crosshair and diagonal coverage (Laine 2013; docs/design.md, "Crosshair and diagonal"). The arms of a voxel are
// segments through its centre, of direction s and from end to end of the voxel: crosshair, the three along the axes,
// from face to face; diagonal, the four from corner to corner. A voxel is covered iff the triangle meets an arm that is
// not parallel to its plane. The arm of the voxel at i, with centre c, meets it iff the projection of c along s lies in
// the closed projected triangle, and the plane n . (x - p) = 0 passes between the arm's ends: |2 n . (c - p)| <= 2^F
// |n . s|. Closed: a triangle that meets the end of an arm covers all voxels with that end.
//
// With A = n . (2 i + 1) and r = 2 n . p / 2^F the second test is A - |n . s| <= floor(r) and ceil(r) <= A + |n . s|.
//
// A column along the dominant axis w has at most four covered voxels: |n . s| <= 3 n_w, and A grows by 2 n_w from voxel
// to voxel. (Crosshair: |n . s| <= n_w, at most two.) So a column is one division, as for thin coverage. The columns
// are among those that the projected triangle touches, because each arm of a voxel lies in the voxel's own column.
//
// Separation: neighbours by a face share an end of two crosshair arms, and neighbours by a face, an edge or a corner
// one of two diagonals. So a 6-connected (26-connected) path of voxels is a chain of halves of arms. Where the chain
// passes from one side of a closed surface to the other, it meets a triangle on an arm that is not parallel to it; the
// closed tests leave no gap between triangles, nor between the halves of a step.

#include <voxelpipe/core/coverage.hpp>

#include <cstdint>

namespace voxelpipe::core {

// An arm's direction s: 1 along axis `pivot`, shear[0] along pivot + 1 and shear[1] along pivot + 2 (mod 3). The
// projection along s takes a point to its other two coordinates less shear times that of the pivot.
struct arm {
    int pivot, shear[2];
    [[nodiscard]] VOXELPIPE_HD constexpr int x() const { return pivot == 2 ? 0 : pivot + 1; }
    [[nodiscard]] VOXELPIPE_HD constexpr int y() const { return pivot == 0 ? 2 : pivot - 1; }
    // n . s
    template <class Int>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr Int along(const triple<Int>& n) const {
        return n[pivot] + shear[0] * n[x()] + shear[1] * n[y()];
    }
};
inline constexpr int max_arms = 4;
[[nodiscard]] VOXELPIPE_HD constexpr int num_arms(arm_set set) { return set == arm_set::diagonals ? 4 : 3; }
// The dominant axis comes first: it decides most crosshairs.
[[nodiscard]] VOXELPIPE_HD constexpr arm arm_of(arm_set set, int k) {
    if (set == arm_set::diagonals) return {2, {(k & 1) != 0 ? -1 : 1, (k & 2) != 0 ? -1 : 1}};
    return {k == 0 ? 2 : k - 1, {0, 0}};
}

// Widths, e bits the longest edge: sheared coordinates have one bit more than coordinates, so an edge function times
// 2^F is below 2^(2e + 4). A +- |n . s| is the doubled plane at a voxel's corner, as conservative coverage has it. The
// numerator of a column's division is below 2^(3e - F + 3.4), and 3e - F <= 59 on the 64-bit path.
template <class Int>
struct arm_setup : triangle_frame<Int> {
    arm_set set;
    triple<std::int64_t> last;           // highest voxel of the bounding box
    half_plane<Int> touched[3];          // on (u, v): squares that meet the projected triangle
    half_plane<Int> centre[max_arms][3]; // [k]: voxels whose centres lie in the projection along arm k
    Int reach[max_arms];                 // |n . s|
    Int longest;                         // the largest of these
    triple<Int> plane;                   // the normal, its last component positive
    Int plane_low, plane_high;           // ceil(r), floor(r)

    // True if arm k of voxel i = (u, v, w) meets the triangle; a = plane . (2 i + 1).
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool meets_arm(int k, const triple<Int>& i, Int a) const {
        if (reach[k] == 0 || a - reach[k] > plane_high || a + reach[k] < plane_low) return false;
        const arm s = arm_of(set, k);
        const Int x = i[s.x()] - s.shear[0] * i[s.pivot], y = i[s.y()] - s.shear[1] * i[s.pivot];
        return (centre[k][0].at(x, y) | centre[k][1].at(x, y) | centre[k][2].at(x, y)) >= 0;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool covers(Int u, Int v, Int w) const {
        const triple<Int> i{{u, v, w}};
        const Int a = plane[0] * (2 * u + 1) + plane[1] * (2 * v + 1) + plane[2] * (2 * w + 1);
        for (int k = 0; k < num_arms(set); ++k)
            if (meets_arm(k, i, a)) return true;
        return false;
    }
};

// Int: std::int64_t if fits_narrow, otherwise int128. Vertices are drawable; fraction >= 1; set is not none.
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr arm_setup<Int> setup_arms(const snapped_position& a, const snapped_position& b,
                                                               const snapped_position& c, int fraction, arm_set set) {
    arm_setup<Int> t; // not zeroed: that takes a twentieth of a call
    t.set = set;
    t.longest = 0;
    const voxel_box box = bounds(a, b, c, fraction);
    set_up_frame(t, box, a, b, c, fraction);
    if (t.zero_area) return t; // covers nothing
    t.last = to_uvw(t.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
    projection(t.p, 0, 1, t.normal[2], fraction, t.touched);
    for (int k = 0; k < num_arms(set); ++k) {
        const arm s = arm_of(set, k);
        const Int facing = s.along(t.normal);
        t.reach[k] = magnitude(facing);
        if (t.reach[k] > t.longest) t.longest = t.reach[k];
        if (facing == 0) continue;
        for (int j = 0; j < 3; ++j) {
            const triple<Int>&p = t.p[j], &q = t.p[j == 2 ? 0 : j + 1];
            const Int px = p[s.x()] - s.shear[0] * p[s.pivot], py = p[s.y()] - s.shear[1] * p[s.pivot];
            const Int qx = q[s.x()] - s.shear[0] * q[s.pivot], qy = q[s.y()] - s.shear[1] * q[s.pivot];
            const Int ea = facing > 0 ? py - qy : qy - py, eb = facing > 0 ? qx - px : px - qx;
            const Int half = (ea * (1 - s.shear[0]) + eb * (1 - s.shear[1])) << (fraction - 1);
            t.centre[k][j] = {ea, eb, exact::floor_shift<Int>(half - (ea * px + eb * py), fraction)};
        }
    }
    t.plane = t.normal;
    if (t.plane[2] < 0) t.plane = {{-t.plane[0], -t.plane[1], -t.plane[2]}};
    const int128 twice = 2 * dot128(t.plane, t.p[0]);
    t.plane_low = static_cast<Int>(exact::ceil_shift(twice, fraction));
    t.plane_high = static_cast<Int>(exact::floor_shift(twice, fraction));
    return t;
}

// Calls emit(u, v, w_first, w_last) for every run of covered voxels of a column inside `clip` (x y z, voxels), by
// ascending w. A column has at most two: where the triangle's plane holds two diagonals of a voxel, it may be left out
// between two that are covered. u, v and w are absolute.
VOXELPIPE_ANY_CALLABLE
template <class Int, class Emit>
VOXELPIPE_HD constexpr void for_each_arm_span(const arm_setup<Int>& t, const voxel_box& clip, Emit&& emit) {
    if (t.zero_area) return;
    const triple<std::int64_t> clip_lo = to_uvw(t.axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const triple<std::int64_t> clip_hi = to_uvw(t.axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    triple<std::int64_t> lo{}, hi{};
    for (int i = 0; i < 3; ++i) {
        lo[i] = clip_lo[i] - t.origin[i] > 0 ? clip_lo[i] - t.origin[i] : 0;
        hi[i] = clip_hi[i] - t.origin[i] < t.last[i] ? clip_hi[i] - t.origin[i] : t.last[i];
        if (hi[i] < lo[i]) return;
    }
    const Int step = 2 * t.plane[2], rounding = t.plane_low - t.plane_high;
    for (std::int64_t v = lo[1]; v <= hi[1]; ++v) {
        std::int64_t u_lo = lo[0], u_hi = hi[0];
        narrow_row(t.touched, Int{v}, u_lo, u_hi);
        if (u_lo > u_hi) continue;
        // The highest voxel that the longest arm joins to the plane, A <= plane_high + longest; the lower ones as long
        // as A >= plane_low - longest.
        stepped_floor<Int> depth(t.plane_high + t.longest - t.plane[0] * (2 * Int{u_lo} + 1) -
                                     t.plane[1] * (2 * Int{v} + 1) - t.plane[2],
                                 step);
        for (std::int64_t u = u_lo;; ++u) {
            auto last = static_cast<std::int64_t>(depth.quotient), first = last;
            for (Int rest = 2 * t.longest - depth.remainder - rounding; rest >= step; rest -= step) --first;
            if (first < lo[2]) first = lo[2];
            if (last > hi[2]) last = hi[2];
            while (first <= last) {
                while (first <= last && !t.covers(Int{u}, Int{v}, Int{first})) ++first;
                std::int64_t end = first;
                while (end <= last && t.covers(Int{u}, Int{v}, Int{end})) ++end;
                if (first < end) emit(t.origin[0] + u, t.origin[1] + v, t.origin[2] + first, t.origin[2] + end - 1);
                first = end + 1; // voxel `end` is not covered, or is behind the last
            }
            if (u == u_hi) break;
            depth.step(-2 * t.plane[0]);
        }
    }
}

} // namespace voxelpipe::core
