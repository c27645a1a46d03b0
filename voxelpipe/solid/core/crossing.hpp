// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crossings of triangles with rows of voxels: what decides inside and outside (docs/design.md, "Solids"). Exact:
// integers only, no epsilon, and every tie is decided.
//
// A row runs along an axis w through the centres of its voxels; (u, v) are the other two axes, u = w + 1 and v = w + 2
// (mod 3). Every centre is moved by the offset (e, e^2, e^3), e -> 0+, so that no centre lies on a plane, and no row
// meets an edge, of any triangle. Where an expression n . (c - p) is 0 at the unmoved centre c, its sign at the moved
// one is that of the first coefficient that is not 0, in the order of the offset.
//
// Two neighbours see their common edge with opposite coefficients: a row through it crosses exactly one of them, or
// both, or none, as if the edge were beside the row. So on a closed mesh the crossings of a row alternate as those of a
// row in general position do.

#include <voxelpipe/core/primitive.hpp>

#include <cstdint>

namespace voxelpipe {

// The winding numbers that are inside. The winding number of a voxel is the sum of the crossings of its row below its
// centre: +1 where the row, going up, meets a triangle's front, -1 where it meets a back. It is 1 inside a closed mesh
// whose fronts face outward.
enum class fill_rule : std::uint8_t {
    even_odd, // odd
    nonzero,  // not 0
    positive, // above 0
};

namespace core {

[[nodiscard]] VOXELPIPE_HD constexpr bool is_inside(fill_rule rule, std::int64_t winding) {
    return rule == fill_rule::even_odd ? (winding & 1) != 0 : rule == fill_rule::nonzero ? winding != 0 : winding > 0;
}

// The order of the symbolic offset: e along axis First, e^2 along Second, e^3 along Third. The library uses
// centre_offset<0, 1, 2>; the others are for tests that permute the axes of a mesh.
template <int First = 0, int Second = 1, int Third = 2>
struct centre_offset {
    static_assert((1 << First | 1 << Second | 1 << Third) == 7, "voxelpipe: each axis once");
    // True if the offset's product with the coefficients (x, y, z) is above 0; they are not all 0.
    template <class Int>
    [[nodiscard]] VOXELPIPE_HD static constexpr bool is_positive(const triple<Int>& c) {
        return c[First] != 0 ? c[First] > 0 : c[Second] != 0 ? c[Second] > 0 : c[Third] > 0;
    }
};

// Indices from lo to hi; the span is empty if hi < lo.
struct index_span {
    std::int64_t lo, hi;
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return hi < lo; }
};

// The voxels whose moved centres lie between two coordinates of one axis, low <= high, in sub-voxel units: those with
// low <= centre < high, because the offset is positive along every axis. fraction >= 1.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr index_span centres_between(std::int64_t low, std::int64_t high,
                                                                                 int fraction) {
    const std::int64_t half = std::int64_t{1} << (fraction - 1);
    return {exact::ceil_shift(low - half, fraction), exact::ceil_shift(high - half, fraction) - 1};
}

[[nodiscard]] VOXELPIPE_HD constexpr index_span intersect(const index_span& a, const index_span& b) {
    return {a.lo > b.lo ? a.lo : b.lo, a.hi < b.hi ? a.hi : b.hi};
}

// The rows along axis w that a triangle may cross: those whose moved centres lie in its bounding box, cut to `clip`
// (voxels; its interval along w is ignored). Most small triangles have none.
struct row_box {
    index_span u, v;
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return u.empty() || v.empty(); }
};
template <int Axis>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr row_box
rows_within(const snapped_position& a, const snapped_position& b, const snapped_position& c, int fraction,
            const voxel_box& clip) {
    const auto low = to_uvw(Axis, min3(a.x, b.x, c.x), min3(a.y, b.y, c.y), min3(a.z, b.z, c.z));
    const auto high = to_uvw(Axis, max3(a.x, b.x, c.x), max3(a.y, b.y, c.y), max3(a.z, b.z, c.z));
    const auto clip_lo = to_uvw(Axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const auto clip_hi = to_uvw(Axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    return {intersect(centres_between(low[0], high[0], fraction), {clip_lo[0], clip_hi[0]}),
            intersect(centres_between(low[1], high[1], fraction), {clip_lo[1], clip_hi[1]})};
}

// A triangle and the rows along one axis. Rows and voxels count from `origin`, the voxel that holds the lowest corner
// of the bounding box.
//
// Widths, e bits the longest edge: the vertices relative to the origin are below 2^e + 2^F <= 2^(e + 0.1), since
// F + 4 <= e (checked below). An edge function times 2^F is a p_u + b p_v with |a|, |b| <= 2^e, and (a + b) 2^(F - 1):
// less than 2^(2e + 2). The plane times 2^F is three products of a normal's component, at most 2^(2e), with a vertex:
// less than 2^(3e + 1.8), always in 128 bits; divided by 2^F it is less than 2^(3e - F + 1.8), and at a row, where two
// products of a component with an index of at most 2^(e - F) + 1 join it, less than 2^(3e - F + 2.5). The table in
// fixed_point.hpp grants 3e - F + 3 bits to either path.
constexpr bool crossing_widths_hold(int largest_log2) {
    for (int l = 0; l <= largest_log2; ++l) {
        const int f = fraction_bits(1 << l);
        if (f < 1 || f + 4 > narrow_edge_bits(f) || f + 4 > coordinate_bits + 1) return false;
    }
    return true;
}
static_assert(crossing_widths_hold(max_log2_extent), "the bounds of crossing_setup do not hold");

template <class Int>
struct crossing_setup {
    int winding; // of a crossing, going up the row: 1 enters, -1 leaves; 0: parallel to the rows, no crossings
    triple<std::int64_t> origin; // u v w
    half_plane<Int> edge[3];     // the row (u, v) crosses the triangle iff all three are >= 0 there
    triple<Int> plane;           // normal, signed so that plane[2] > 0
    Int plane_offset;    // plane[0] u + plane[1] v + plane[2] w + plane_offset >= 0: voxel w is beyond the triangle
    Int step, step_rest; // plane[0] divided by plane[2], rounded down, and what is left: only if `has_steps`
};

// The half-plane left of p -> q (sign = 1) or right of it (sign = -1) at moved centres.
//   E(i, j) = a (i + 1/2) + b (j + 1/2) - (a p_u + b p_v) / 2^F
// is positive at the moved centre iff E > 0, or E = 0 and the offset is on its positive side. Times 2^F that is an
// integer: a positive tie is kept by E 2^F >= 0 and a negative one left out by E 2^F - 1 >= 0. With i and j whole, the
// division by 2^F may round down.
template <int Axis, class Offset, class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr half_plane<Int>
row_edge(const triple<Int>& p, const triple<Int>& q, int sign, int fraction) {
    const Int a = sign > 0 ? p[1] - q[1] : q[1] - p[1];
    const Int b = sign > 0 ? q[0] - p[0] : p[0] - q[0];
    const bool positive_tie = Offset::is_positive(to_xyz<Int>(Axis, a, b, Int{0}));
    const Int half = (a + b) << (fraction - 1);
    return {a, b, exact::floor_shift<Int>(half - (a * p[0] + b * p[1]) - (positive_tie ? 0 : 1), fraction)};
}

// Int = std::int64_t where fits_narrow, int128 otherwise. Vertices are drawable; fraction >= 1. `has_steps`: whether
// for_each_crossing_in_row will be called with rows of more than one u.
template <int Axis, class Offset, class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr crossing_setup<Int>
setup_crossings(const snapped_position& a, const snapped_position& b, const snapped_position& c, int fraction,
                bool has_steps) {
    crossing_setup<Int> t{};
    const std::int64_t ox = exact::floor_shift(min3(a.x, b.x, c.x), fraction),
                       oy = exact::floor_shift(min3(a.y, b.y, c.y), fraction),
                       oz = exact::floor_shift(min3(a.z, b.z, c.z), fraction);
    t.origin = to_uvw(Axis, ox, oy, oz);
    const auto relative = [&](const snapped_position& q) {
        return to_uvw<Int>(Axis, q.x - (ox << fraction), q.y - (oy << fraction), q.z - (oz << fraction));
    };
    const triple<Int> p[3] = {relative(a), relative(b), relative(c)};
    const Int e1u = p[1][0] - p[0][0], e1v = p[1][1] - p[0][1], e1w = p[1][2] - p[0][2];
    const Int e2u = p[2][0] - p[0][0], e2v = p[2][1] - p[0][1], e2w = p[2][2] - p[0][2];
    const Int nu = e1v * e2w - e1w * e2v, nv = e1w * e2u - e1u * e2w, nw = e1u * e2v - e1v * e2u;
    t.winding = nw == 0 ? 0 : nw < 0 ? 1 : -1;
    if (nw == 0) return t;
    const int sign = nw > 0 ? 1 : -1;
    for (int i = 0; i < 3; ++i) t.edge[i] = row_edge<Axis, Offset, Int>(p[i], p[i == 2 ? 0 : i + 1], sign, fraction);
    t.plane = {sign > 0 ? nu : -nu, sign > 0 ? nv : -nv, sign > 0 ? nw : -nw};
    // As an edge: the moved centre is beyond the plane iff n . (c - p0) > 0, or = 0 with a positive tie.
    const bool positive_tie = Offset::is_positive(to_xyz<Int>(Axis, t.plane[0], t.plane[1], t.plane[2]));
    const int128 half = (static_cast<int128>(t.plane[0]) + t.plane[1] + t.plane[2]) << (fraction - 1);
    t.plane_offset =
        static_cast<Int>(exact::floor_shift<int128>(half - dot128(t.plane, p[0]) - (positive_tie ? 0 : 1), fraction));
    t.step = t.step_rest = 0;
    if (has_steps) {
        t.step = exact::floor_div_inline(t.plane[0], t.plane[2]);
        t.step_rest = t.plane[0] - t.step * t.plane[2];
    }
    return t;
}

// Calls emit(u, first) for each row (u, v), u in `within`, that crosses the triangle: the voxels w >= first of the row
// are beyond it. u, v and first are voxels of the grid, first of any size: it may lie before or behind the grid.
VOXELPIPE_ANY_CALLABLE
template <class Int, class Emit>
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void for_each_crossing_in_row(const crossing_setup<Int>& t, std::int64_t v,
                                                                      const index_span& within, Emit&& emit) {
    std::int64_t lo = within.lo - t.origin[0], hi = within.hi - t.origin[0];
    const Int row = v - t.origin[1];
    narrow_row_of<true>(t.edge, row, lo, hi);
    if (lo > hi) return;
    // The least w with plane . (u, v, w) + offset >= 0 is -floor((plane . (u, v, 0) + offset) / plane[2]).
    const Int at = t.plane[0] * lo + t.plane[1] * row + t.plane_offset;
    Int depth = exact::floor_div_inline(at, t.plane[2]);
    if (lo == hi) {
        emit(t.origin[0] + lo, t.origin[2] - static_cast<std::int64_t>(depth));
        return;
    }
    Int rest = at - depth * t.plane[2];
    for (std::int64_t u = lo;; ++u) {
        emit(t.origin[0] + u, t.origin[2] - static_cast<std::int64_t>(depth));
        if (u == hi) break;
        depth += t.step;
        rest += t.step_rest;
        if (rest >= t.plane[2]) {
            rest -= t.plane[2];
            ++depth;
        }
    }
}

// Whole path for one triangle: calls emit(u, v, first, winding) for each row of `rows` that crosses it. The vertices
// are drawable.
VOXELPIPE_ANY_CALLABLE
template <int Axis, class Offset, class Emit>
VOXELPIPE_HD constexpr void for_each_crossing(const snapped_position& a, const snapped_position& b,
                                              const snapped_position& c, int fraction, const row_box& rows,
                                              Emit&& emit) {
    if (rows.empty()) return;
    VOXELPIPE_CALLS_ANY
    const auto run = [&](const auto& t) {
        if (t.winding == 0) return;
        for (std::int64_t v = rows.v.lo; v <= rows.v.hi; ++v)
            for_each_crossing_in_row(t, v, rows.u,
                                     [&](std::int64_t u, std::int64_t first) { emit(u, v, first, t.winding); });
    };
    VOXELPIPE_CALLS_ANY_END
    const bool has_steps = rows.u.lo != rows.u.hi;
    if (fits_narrow(a, b, c, fraction))
        run(setup_crossings<Axis, Offset, std::int64_t>(a, b, c, fraction, has_steps));
    else
        run(setup_crossings<Axis, Offset, int128>(a, b, c, fraction, has_steps));
}

// True if a drawable triangle takes part in a solid of the grid, of which `whole` is the computed part: its closed box
// meets the part's y and z intervals. Where it lies along x does not matter, for it flips what is behind it. With votes
// (repair::vote) rows along y and z count as well: it meets two of the three intervals.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool meets_rows(const snapped_position& a,
                                                                      const snapped_position& b,
                                                                      const snapped_position& c, int fraction,
                                                                      const voxel_box& whole, bool votes = false) {
    const auto meets = [&](std::int64_t low, std::int64_t high, int axis) {
        return high >= whole.lo[axis] << fraction && low <= (whole.hi[axis] + 1) << fraction;
    };
    const bool y = meets(min3(a.y, b.y, c.y), max3(a.y, b.y, c.y), 1),
               z = meets(min3(a.z, b.z, c.z), max3(a.z, b.z, c.z), 2);
    return (y && z) || (votes && (y || z) && meets(min3(a.x, b.x, c.x), max3(a.x, b.x, c.x), 0));
}

// classify for a triangle of a solid; votes as in meets_rows.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triangle_class classify_for_rows(const snapped_position& a,
                                                                             const snapped_position& b,
                                                                             const snapped_position& c, int fraction,
                                                                             const voxel_box& whole,
                                                                             bool votes = false) {
    const triangle_class kind = classify_positions(a, b, c);
    if (kind != triangle_class::drawn) return kind;
    return meets_rows(a, b, c, fraction, whole, votes) ? triangle_class::drawn : triangle_class::outside;
}

} // namespace core
} // namespace voxelpipe
