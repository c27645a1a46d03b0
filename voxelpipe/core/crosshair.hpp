// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crosshair coverage (Laine 2013; docs/design.md, "Crosshair"). The arms of a voxel are the three segments through its
// centre, each from face to face along an axis. A voxel is covered iff the triangle meets an arm that is not parallel
// to its plane. The arm along axis d of the voxel at i, with centre c, meets it iff the projection of c along d lies in
// the closed projected triangle, and the plane n . (x - p) = 0 passes between the arm's ends: |2 n . (c - p)| <= 2^F
// |n_d|. Closed: a triangle that meets the end of an arm covers both voxels.
//
// With A = n . (2 i + 1) and r = 2 n . p / 2^F the second test is A - |n_d| <= floor(r) and ceil(r) <= A + |n_d|.
//
// At most two voxels of a column along the dominant axis w are covered, neighbours: |n_d| <= n_w for every d, so the
// plane passes between the ends of the arm along w too, and two such voxels share the point where it does. So a column
// is one division, as for thin coverage, of which a crosshair covers a part: the columns are among those that the
// projected triangle touches, because each arm of a voxel lies in the voxel's own column.
//
// Separation: a 6-connected path of voxels is a chain of arms along its steps, half an arm of each voxel to their
// common face. Where the chain passes from one side of a closed surface to the other, it meets a triangle on an arm
// that is not parallel to it; the closed tests leave no gap between triangles, nor between the halves of a step.

#include <voxelpipe/core/coverage.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Widths: those of thin coverage. The half-planes are those of crossing.hpp, without the symbolic offset.
template <class Int>
struct crosshair_setup : triangle_frame<Int> {
    triple<std::int64_t> last;    // highest voxel of the bounding box
    half_plane<Int> touched[3];   // on (u, v): squares that meet the projected triangle
    half_plane<Int> centre[3][3]; // [d]: voxels whose centres lie in the projection along d; coordinates d + 1, d + 2
    triple<Int> plane;            // the normal, its last component positive
    Int plane_low, plane_high;    // ceil(r), floor(r)

    // Whether the arm along d of voxel i = (u, v, w) meets the triangle; a = plane . (2 i + 1).
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool meets_arm(int d, const triple<Int>& i, Int a) const {
        const Int reach = magnitude(plane[d]);
        if (reach == 0 || a - reach > plane_high || a + reach < plane_low) return false;
        const Int x = i[d == 2 ? 0 : d + 1], y = i[d == 0 ? 2 : d - 1];
        return (centre[d][0].at(x, y) | centre[d][1].at(x, y) | centre[d][2].at(x, y)) >= 0;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool covers(Int u, Int v, Int w) const {
        const triple<Int> i{{u, v, w}};
        const Int a = plane[0] * (2 * u + 1) + plane[1] * (2 * v + 1) + plane[2] * (2 * w + 1);
        return meets_arm(2, i, a) || meets_arm(0, i, a) || meets_arm(1, i, a);
    }
};

// Int: std::int64_t if fits_narrow, otherwise int128. Vertices are drawable; fraction >= 1.
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr crosshair_setup<Int>
setup_crosshair(const snapped_position& a, const snapped_position& b, const snapped_position& c, int fraction) {
    crosshair_setup<Int> t{};
    const voxel_box box = bounds(a, b, c, fraction);
    set_up_frame(t, box, a, b, c, fraction);
    if (t.zero_area) return t; // covers nothing
    t.last = to_uvw(t.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
    projection(t.p, 0, 1, t.normal[2], fraction, t.touched);
    for (int d = 0; d < 3; ++d) {
        const int x = d == 2 ? 0 : d + 1, y = d == 0 ? 2 : d - 1, sign = t.normal[d] > 0 ? 1 : -1;
        if (t.normal[d] == 0) continue;
        for (int k = 0; k < 3; ++k) {
            const triple<Int>&p = t.p[k], &q = t.p[k == 2 ? 0 : k + 1];
            const Int ea = sign > 0 ? p[y] - q[y] : q[y] - p[y], eb = sign > 0 ? q[x] - p[x] : p[x] - q[x];
            const Int half = (ea + eb) << (fraction - 1);
            t.centre[d][k] = {ea, eb, exact::floor_shift<Int>(half - (ea * p[x] + eb * p[y]), fraction)};
        }
    }
    t.plane = t.normal;
    if (t.plane[2] < 0) t.plane = {{-t.plane[0], -t.plane[1], -t.plane[2]}};
    const int128 twice = 2 * dot128(t.plane, t.p[0]);
    t.plane_low = static_cast<Int>(exact::ceil_shift(twice, fraction));
    t.plane_high = static_cast<Int>(exact::floor_shift(twice, fraction));
    return t;
}

// Calls emit(u, v, w_first, w_last) for every column with covered voxels inside `clip` (x y z, voxels), each column
// once. u, v and w are absolute.
VOXELPIPE_ANY_CALLABLE
template <class Int, class Emit>
VOXELPIPE_HD constexpr void for_each_crosshair_span(const crosshair_setup<Int>& t, const voxel_box& clip, Emit&& emit) {
    if (t.zero_area) return;
    const triple<std::int64_t> clip_lo = to_uvw(t.axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const triple<std::int64_t> clip_hi = to_uvw(t.axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    triple<std::int64_t> lo{}, hi{};
    for (int i = 0; i < 3; ++i) {
        lo[i] = clip_lo[i] - t.origin[i] > 0 ? clip_lo[i] - t.origin[i] : 0;
        hi[i] = clip_hi[i] - t.origin[i] < t.last[i] ? clip_hi[i] - t.origin[i] : t.last[i];
        if (hi[i] < lo[i]) return;
    }
    for (std::int64_t v = lo[1]; v <= hi[1]; ++v) {
        std::int64_t u_lo = lo[0], u_hi = hi[0];
        narrow_row(t.touched, Int{v}, u_lo, u_hi);
        if (u_lo > u_hi) continue;
        // The highest voxel whose arm along w the plane meets; the one below as well if it passes through their face.
        stepped_floor<Int> depth(t.plane_high - t.plane[0] * (2 * Int{u_lo} + 1) - t.plane[1] * (2 * Int{v} + 1),
                                 2 * t.plane[2]);
        for (std::int64_t u = u_lo;; ++u) {
            const bool is_tie = depth.remainder == 0 && t.plane_low == t.plane_high;
            const auto top = static_cast<std::int64_t>(depth.quotient);
            std::int64_t first = top - (is_tie ? 1 : 0), last = top;
            if (first < lo[2]) first = lo[2];
            if (last > hi[2]) last = hi[2];
            while (first <= last && !t.covers(Int{u}, Int{v}, Int{first})) ++first;
            while (first < last && !t.covers(Int{u}, Int{v}, Int{last})) --last;
            if (first <= last) emit(t.origin[0] + u, t.origin[1] + v, t.origin[2] + first, t.origin[2] + last);
            if (u == u_hi) break;
            depth.step(-2 * t.plane[0]);
        }
    }
}

} // namespace voxelpipe::core
