// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage within a box of at most 32 voxels a side, as columns of bits: the sets of coverage.hpp, from tables instead
// of voxel by voxel. Each of the three projections restricts the voxels of a row to an interval that depends on that
// row alone, so a column (u, v) is the intersection of three: the (v, w) projection at v, the (w, u) projection at u,
// and the voxels that the plane passes in the column. Short rows are tested voxel by voxel without branches. Host code,
// tuned for CPUs.

#include <cpu_ref/lanes.hpp>
#include <voxelpipe/core/coverage.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The lowest n bits, 0 <= n <= 32.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t low_bits(int n) {
    return static_cast<std::uint32_t>((std::uint64_t{1} << n) - 1);
}

// Three half-planes along a row; the values at x are k * x + r.
template <class Int>
struct row_lines {
    Int k[3], r[3];
    VOXELPIPE_HD constexpr void step(const Int (&by)[3]) {
        r[0] += by[0];
        r[1] += by[1];
        r[2] += by[2];
    }
};

// Bit x is set if all three are >= 0, for x = 0 .. n - 1, 1 <= n <= 32. The bits are an interval.
template <class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::uint32_t row_bits(const row_lines<Int>& h, int n) {
    std::uint32_t bits = 0;
    if (n <= 12) {
        Int f0 = h.r[0], f1 = h.r[1], f2 = h.r[2];
        for (int base = 0; base < n; base += 4)
            for (int j = 0; j < 4; ++j) {
                bits |= static_cast<std::uint32_t>((f0 | f1 | f2) >= 0) << (base + j);
                f0 += h.k[0];
                f1 += h.k[1];
                f2 += h.k[2];
            }
        return bits & low_bits(n);
    }
    Int first = 0, last = n - 1;
    for (int i = 0; i < 3; ++i) {
        if (h.k[i] > 0) {
            if (h.r[i] < 0) {
                const Int bound = exact::ceil_div<Int>(-h.r[i], h.k[i]);
                if (bound > first) first = bound;
            }
        } else if (h.k[i] < 0) {
            if (h.r[i] < 0) return 0;
            const Int bound = exact::floor_div<Int>(h.r[i], -h.k[i]);
            if (bound < last) last = bound;
        } else if (h.r[i] < 0) {
            return 0;
        }
        if (first > last) return 0;
    }
    return low_bits(static_cast<int>(last) + 1) & ~low_bits(static_cast<int>(first));
}

// row_bits for `rows` rows, each one step after the previous. `small`: all values up to three beyond the ends of the
// rows, and one row beyond the last, are below 2^31 in magnitude; then four voxels are tested at once.
template <class Lanes = lanes32, class Int>
inline void row_bits_of(row_lines<Int> h, const Int (&step)[3], int rows, int n, bool small, std::uint32_t* out) {
    if (!small) {
        for (int row = 0; row < rows; ++row, h.step(step)) out[row] = row_bits(h, n);
        return;
    }
    const std::uint32_t inside = low_bits(n);
    for (int x = 0; x < n; x += 4) {
        Lanes f[3], by[3];
        for (int i = 0; i < 3; ++i) {
            f[i] = Lanes::line(static_cast<std::int32_t>(h.r[i] + x * h.k[i]), static_cast<std::int32_t>(h.k[i]));
            by[i] = Lanes::all(static_cast<std::int32_t>(step[i]));
        }
        for (int row = 0; row < rows; ++row) {
            const std::uint32_t bits = (nonnegative(f[0], f[1], f[2]) << x) & inside;
            out[row] = x == 0 ? bits : out[row] | bits;
            for (int i = 0; i < 3; ++i) f[i] = f[i] + by[i];
        }
    }
}

// True if a bounding box with these last voxels has `small` rows: edges are below 2^22 units, the sum of two products
// with positions of the same size below 2^45, hence c below 2^29 + 2^23; a and b times a coordinate of at most 66 are
// below 2^29 each.
[[nodiscard]] VOXELPIPE_HD constexpr bool has_small_rows(std::int64_t last_x, std::int64_t last_y, int fraction) {
    return last_x < 64 && last_y < 64 && fraction <= 16;
}

// floor(numerator / divisor) along a line of equal steps, |delta| <= divisor. An upward step is one whole minus a
// downward step, so one branchless correction suffices.
template <class Int>
struct floor_line {
    Int quotient, remainder;

    VOXELPIPE_HD constexpr floor_line(Int numerator, Int divisor)
        : quotient(exact::floor_div(numerator, divisor)), remainder(numerator - quotient * divisor) {}
};
template <class Int>
struct floor_step {
    Int quotient, remainder, divisor;

    VOXELPIPE_HD constexpr floor_step(Int delta, Int divisor_)
        : quotient(delta > 0 ? 1 : 0), remainder(delta > 0 ? delta - divisor_ : delta), divisor(divisor_) {}
    VOXELPIPE_HD VOXELPIPE_INLINE constexpr void operator()(floor_line<Int>& at) const {
        at.remainder += remainder;
        const Int borrow = at.remainder >> (sizeof(Int) * 8 - 1); // -1 or 0
        at.remainder += divisor & borrow;
        at.quotient += quotient + borrow;
    }
};

// Calls emit(u, v, bits) for every column with covered voxels of `clip` (x y z, at most 32 voxels a side). u, v and the
// bits (along w) are relative to clip's lowest corner. Each column is emitted once.
template <span_rule Rule, class Int, class Emit>
VOXELPIPE_INLINE void for_each_column(const triangle_setup<Int>& t, const voxel_box& clip, Emit&& emit) {
    static_assert(Rule != span_rule::columns);
    constexpr bool thin = Rule == span_rule::thin;
    const triple<std::int64_t> clip_lo = to_uvw(t.axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const triple<std::int64_t> clip_hi = to_uvw(t.axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    int first[3], count[3]; // within the clip box
    Int at[3];              // the same corner in the setup's coordinates
    for (int i = 0; i < 3; ++i) {
        // A thin fragment may leave the bounding box along w: its depth is the plane's at the column's centre.
        const bool whole = i == 2 && thin;
        const std::int64_t lo = whole || clip_lo[i] > t.origin[i] ? clip_lo[i] : t.origin[i];
        const std::int64_t end = t.origin[i] + t.last[i];
        const std::int64_t hi = whole || clip_hi[i] < end ? clip_hi[i] : end;
        if (hi < lo) return;
        first[i] = static_cast<int>(lo - clip_lo[i]);
        count[i] = static_cast<int>(hi - lo) + 1;
        at[i] = lo - t.origin[i];
    }
    if (t.zero_area) {
        if constexpr (!thin)
            for_each_span<Rule>(t, clip, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                const auto a = static_cast<int>(w0 - clip_lo[2]), b = static_cast<int>(w1 - clip_lo[2]);
                emit(static_cast<int>(u - clip_lo[0]), static_cast<int>(v - clip_lo[1]),
                     low_bits(b + 1) & ~low_bits(a));
            });
        return;
    }

    const Int nu = t.plane[0], nv = t.plane[1], nw = t.plane[2];
    const bool small = has_small_rows(max3(t.last[0], t.last[1], t.last[2]), 0, t.fraction);
    std::uint32_t uv_bits[32], vw_bits[32], wu_bits[32]; // rows along u at v, along w at v, along w at u
    const auto rows = [&](const half_plane<Int>(&h)[3], bool along_first, int x, int y, int num_rows, int n,
                          std::uint32_t* out) VOXELPIPE_INLINE_LAMBDA {
        row_lines<Int> line;
        Int step[3];
        for (int i = 0; i < 3; ++i) {
            line.k[i] = along_first ? h[i].a : h[i].b;
            line.r[i] = h[i].at(at[x], at[y]);
            step[i] = along_first ? h[i].b : h[i].a;
        }
        row_bits_of(line, step, num_rows, n, small, out);
    };
    rows(t.uv, true, 0, 1, count[1], count[0], uv_bits);
    if constexpr (!thin) {
        rows(t.vw, false, 1, 2, count[1], count[2], vw_bits);
        rows(t.wu, true, 2, 0, count[0], count[2], wu_bits);
    }

    // Depth of the plane, in voxels of the part. Thin: at the column's centre, all terms doubled. Conservative: the
    // lowest voxel whose slab the plane can pass within the column's square; the highest is floor((numerator + spread)
    // / nw), and spread <= 2 nw + 1.
    constexpr int twice = thin ? 2 : 1;
    const Int divisor = twice * nw;
    const Int numerator = thin ? t.plane_high - nu * (2 * at[0] + 1) - nv * (2 * at[1] + 1)
                               : t.plane_low - nu * at[0] - nv * at[1] - positive_part(nu) - positive_part(nv) - 1;
    Int spread = thin ? 0 : t.plane_high - t.plane_low + magnitude(nu) + magnitude(nv) + 1, whole_spread = 0;
    for (; spread >= nw && !thin; spread -= nw) ++whole_spread;

    const floor_step<Int> step_u(-twice * nu, divisor), step_v(-twice * nv, divisor);
    floor_line<Int> row(numerator, divisor);
    row.quotient -= at[2]; // at[2] may be far from the bounding box for thin coverage, so it is no factor of a product
    for (int v = 0; v < count[1]; ++v, step_v(row)) {
        const std::uint32_t columns = uv_bits[v];
        std::uint32_t row_limit = 0;
        if constexpr (!thin) row_limit = vw_bits[v];
        if (columns == 0 || (!thin && row_limit == 0)) continue;
        floor_line<Int> depth = row;
        int u = 0;
        for (; ((columns >> u) & 1u) == 0; ++u) step_u(depth);
        for (;;) {
            if constexpr (thin) {
                if (depth.quotient >= 0 && depth.quotient < count[2])
                    emit(first[0] + u, first[1] + v, 1u << static_cast<int>(depth.quotient));
            } else {
                Int lowest = depth.quotient;
                Int highest = lowest + whole_spread + static_cast<Int>(depth.remainder + spread >= nw);
                if (lowest < 0) lowest = 0;
                if (highest > count[2] - 1) highest = count[2] - 1;
                if (lowest <= highest) {
                    const std::uint32_t bits = low_bits(static_cast<int>(highest) + 1) &
                                               ~low_bits(static_cast<int>(lowest)) & row_limit & wu_bits[u];
                    if (bits != 0) emit(first[0] + u, first[1] + v, bits << first[2]);
                }
            }
            if (++u == 32 || ((columns >> u) & 1u) == 0) break;
            step_u(depth);
        }
    }
}

// The axis along which a bounding box is one voxel thick; -1 if it is thicker along every axis. A voxel of such a box
// is covered iff, seen along that axis, its square meets the projected triangle, because the triangle lies within the
// voxel's thickness.
[[nodiscard]] VOXELPIPE_HD constexpr int slab_axis(const voxel_box& bounding_box) {
    for (int i = 2; i >= 0; --i)
        if (bounding_box.hi[i] == bounding_box.lo[i]) return i;
    return -1;
}

// Conservative coverage of such a triangle within `clip` (at most 32 voxels a side): calls emit(q, bits) for every row
// of covered voxels, with bits along p. (p, q) are (y, z), (x, z) or (x, y) for axis = x, y, z; both are relative to
// clip's lowest corner. Int must be wide enough for the triangle.
template <class Int, class Emit>
VOXELPIPE_INLINE void for_each_slab_row(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                        int fraction, int axis, const voxel_box& bounding_box, const voxel_box& clip,
                                        Emit&& emit) {
    const int p = axis == 0 ? 1 : 0, q = axis == 2 ? 1 : 2;
    const voxel_box part = intersect(bounding_box, clip);
    if (part.empty()) return;
    const std::int64_t op = bounding_box.lo[p] << fraction, oq = bounding_box.lo[q] << fraction;
    const auto to_local = [&](const snapped_position& v) {
        return triple<Int>{{(axis == 0 ? v.y : v.x) - op, (axis == 2 ? v.y : v.z) - oq, 0}};
    };
    const triple<Int> vertices[3] = {to_local(a), to_local(b), to_local(c)};
    const Int area = (vertices[1][0] - vertices[0][0]) * (vertices[2][1] - vertices[0][1]) -
                     (vertices[1][1] - vertices[0][1]) * (vertices[2][0] - vertices[0][0]);
    half_plane<Int> lines[3];
    projection(vertices, 0, 1, area, fraction, lines);
    row_lines<Int> row;
    Int step[3];
    for (int i = 0; i < 3; ++i) {
        row.k[i] = lines[i].a;
        row.r[i] = lines[i].at(part.lo[p] - bounding_box.lo[p], part.lo[q] - bounding_box.lo[q]);
        step[i] = lines[i].b;
    }
    const auto rows = static_cast<int>(part.hi[q] - part.lo[q]) + 1, n = static_cast<int>(part.hi[p] - part.lo[p]) + 1;
    const auto first = static_cast<int>(part.lo[q] - clip.lo[q]), shift = static_cast<int>(part.lo[p] - clip.lo[p]);
    const bool small =
        has_small_rows(bounding_box.hi[p] - bounding_box.lo[p], bounding_box.hi[q] - bounding_box.lo[q], fraction);
    std::uint32_t bits[32];
    row_bits_of(row, step, rows, n, small, bits);
    for (int i = 0; i < rows; ++i)
        if (bits[i] != 0) emit(first + i, bits[i] << shift);
}

} // namespace voxelpipe::core
