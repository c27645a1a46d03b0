// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage of segments and points (docs/design.md, "Points and segments"). Exact: integers only.
//
// A segment runs along its dominant axis w, that of the largest |difference| of its ends (x before y before z where
// they tie). Layer k is the slab k <= w <= k + 1; along it the line moves by at most one voxel in u and v.
//
// Conservative: the voxels whose closed box meets the closed segment. The segment is an interval of its line, and so is
// the part of the line in each of a voxel's three slabs. Intervals of a line have a common point iff every two of them
// have one. So a voxel of layer k is covered iff the segment's part in the layer meets its u slab, and its v slab, and
// the line's projection on u and v meets its square. The first two are a few exact floors a layer, which leave at most
// 3 x 3 voxels; the third is the sign of the line's equation at the square's corners.
//
// Thin: one voxel in every layer that the closed segment meets, at the floor of the line at the layer's centre, also
// where that lies beyond an end. From one layer's centre to the next u and v change by |d_u / d_w| <= 1 and
// |d_v / d_w| <= 1, so their floors change by at most 1: voxels of neighbouring layers are 26-neighbours, and the
// layers of a segment are consecutive. The voxels of a segment are 26-connected.
//
// A segment without length is a point. Thin: the voxel of the floor. Conservative: every voxel whose closed box holds
// it.

#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/triangle_setup.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core {

// True if products of two edges, doubled, fit 64 bits.
[[nodiscard]] VOXELPIPE_HD constexpr bool is_narrow_segment(const snapped_position& a, const snapped_position& b) {
    constexpr std::int64_t limit = std::int64_t{1} << 29;
    return magnitude(b.x - a.x) <= limit && magnitude(b.y - a.y) <= limit && magnitude(b.z - a.z) <= limit;
}

// Positions are relative to voxel `origin`, the lowest of the bounding box; a voxel is 2^fraction units. Int is
// std::int64_t if is_narrow_segment, otherwise int128.
template <class Int>
struct segment_setup {
    int axis, fraction;
    bool is_point;
    triple<std::int64_t> origin, last; // uvw: bounding box, its last voxel relative to the first
    triple<Int> a, d;                  // uvw: first end, and second less first
    Int length;                        // |d[2]|

    VOXELPIPE_HD constexpr segment_setup(const snapped_position& p, const snapped_position& q, int fraction_)
        : fraction(fraction_) {
        const std::int64_t dx = q.x - p.x, dy = q.y - p.y, dz = q.z - p.z;
        const std::int64_t mx = magnitude(dx), my = magnitude(dy), mz = magnitude(dz);
        axis = mx >= my && mx >= mz ? 0 : my >= mz ? 1 : 2;
        is_point = mx == 0 && my == 0 && mz == 0;
        const voxel_box box = bounds(p, q, q, fraction);
        origin = to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
        last = to_uvw(axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
        a = to_uvw<Int>(axis, p.x - (box.lo[0] << fraction), p.y - (box.lo[1] << fraction),
                        p.z - (box.lo[2] << fraction));
        d = to_uvw<Int>(axis, dx, dy, dz);
        length = magnitude(d[2]);
    }

    // The coordinate u or v (i = 0 or 1) of the line where w = s / scale, as `numerator` / (scale * length).
    [[nodiscard]] VOXELPIPE_HD constexpr Int numerator(int i, Int s, Int scale) const {
        const Int along = d[2] < 0 ? -(s - scale * a[2]) : s - scale * a[2];
        return scale * a[i] * length + along * d[i];
    }
};

// Calls emit(u, v, w), absolute voxel indices, for each covered voxel within `clip` (x y z). Voxels come by ascending
// w.
VOXELPIPE_ANY_CALLABLE
template <coverage Rule, class Int, class Emit>
VOXELPIPE_HD constexpr void for_each_segment_voxel(const segment_setup<Int>& t, const voxel_box& clip, Emit&& emit) {
    const triple<std::int64_t> clip_lo = to_uvw(t.axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const triple<std::int64_t> clip_hi = to_uvw(t.axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    triple<std::int64_t> lo{}, hi{}; // of the clip, relative to the origin
    for (int i = 0; i < 3; ++i) {
        lo[i] = clip_lo[i] - t.origin[i];
        hi[i] = clip_hi[i] - t.origin[i];
    }
    const auto out = [&](std::int64_t u, std::int64_t v, std::int64_t w)
                         VOXELPIPE_INLINE_LAMBDA { emit(t.origin[0] + u, t.origin[1] + v, t.origin[2] + w); };
    const std::int64_t w_first = lo[2] > 0 ? lo[2] : 0, w_last = hi[2] < t.last[2] ? hi[2] : t.last[2];
    if (t.is_point) {
        if constexpr (Rule == coverage::thin) {
            std::int64_t p[3]{};
            for (int i = 0; i < 3; ++i) {
                p[i] = static_cast<std::int64_t>(exact::floor_shift(t.a[i], t.fraction));
                if (p[i] < lo[i] || p[i] > hi[i]) return;
            }
            out(p[0], p[1], p[2]);
        } else {
            for (std::int64_t w = w_first; w <= w_last; ++w)
                for (std::int64_t v = lo[1] > 0 ? lo[1] : 0; v <= hi[1] && v <= t.last[1]; ++v)
                    for (std::int64_t u = lo[0] > 0 ? lo[0] : 0; u <= hi[0] && u <= t.last[0]; ++u) out(u, v, w);
        }
        return;
    }
    const Int voxel = Int{1} << t.fraction;
    if constexpr (Rule == coverage::thin) {
        const Int divisor = (2 * t.length) << t.fraction;
        for (std::int64_t w = w_first; w <= w_last; ++w) {
            const Int centre = (2 * Int{w} + 1) << t.fraction; // doubled
            const auto u = static_cast<std::int64_t>(exact::floor_div<Int>(t.numerator(0, centre, 2), divisor)),
                       v = static_cast<std::int64_t>(exact::floor_div<Int>(t.numerator(1, centre, 2), divisor));
            if (u >= lo[0] && u <= hi[0] && v >= lo[1] && v <= hi[1]) out(u, v, w);
        }
        return;
    }
    const Int divisor = t.length << t.fraction;
    const Int end = t.a[2] + t.d[2], bottom = end < t.a[2] ? end : t.a[2], top = end < t.a[2] ? t.a[2] : end;
    // The line's equation in u and v, at the corner (u, v): d_u (v - a_v) - d_v (u - a_u). Over a square it spans from
    // `least` to `most` more than at its lowest corner.
    const Int step_u = -t.d[1] * voxel, step_v = t.d[0] * voxel;
    const Int least = negative_part(step_u) + negative_part(step_v),
              most = positive_part(step_u) + positive_part(step_v);
    const Int at_origin = t.d[1] * t.a[0] - t.d[0] * t.a[1];
    for (std::int64_t w = w_first; w <= w_last; ++w) {
        const Int low = Int{w} * voxel, high = low + voxel;
        const Int s0 = bottom > low ? bottom : low, s1 = top < high ? top : high;
        std::int64_t first[2]{}, final[2]{};
        for (int i = 0; i < 2; ++i) {
            const Int n0 = t.numerator(i, s0, 1), n1 = t.numerator(i, s1, 1);
            const Int n_min = n0 < n1 ? n0 : n1, n_max = n0 < n1 ? n1 : n0;
            first[i] = static_cast<std::int64_t>(exact::ceil_div<Int>(n_min, divisor)) - 1; // a face touches both sides
            final[i] = static_cast<std::int64_t>(exact::floor_div<Int>(n_max, divisor));
            if (first[i] < lo[i]) first[i] = lo[i];
            if (final[i] > hi[i]) final[i] = hi[i];
        }
        for (std::int64_t v = first[1]; v <= final[1]; ++v)
            for (std::int64_t u = first[0]; u <= final[0]; ++u) {
                const Int corner = at_origin + Int{u} * step_u + Int{v} * step_v;
                if (corner + least <= 0 && corner + most >= 0) out(u, v, w);
            }
    }
}

// The weights (1 - t, t, 0) of a segment at the centre of layer w: quotients of exact integers, rounded to double, then
// to float. (1, 0, 0) for a point.
template <class Int>
[[nodiscard]] VOXELPIPE_HD glm::vec3 segment_weights(const segment_setup<Int>& t, std::int64_t w) {
    if (t.is_point) return {1.0f, 0.0f, 0.0f};
    const Int centre = static_cast<Int>(2 * (w - t.origin[2]) + 1) << t.fraction; // doubled
    const Int of_b = centre - 2 * t.a[2], of_a = 2 * t.d[2] - of_b;
    const double length = exact::to_double(2 * t.d[2]);
    return {exact::to_float(exact::div(exact::to_double(of_a), length)),
            exact::to_float(exact::div(exact::to_double(of_b), length)), 0.0f};
}

} // namespace voxelpipe::core
