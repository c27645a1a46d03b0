// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage: the voxels in which a triangle has fragments, as spans along its dominant axis. Exact: integers only, no
// epsilon (docs/design.md, "Conservative" and "Thin"; paper section 4).

#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::core {

// floor(numerator / divisor), stepped along a row: each step adds `delta`, |delta| <= divisor, so one correction
// suffices and a row costs one division.
template <class Int>
struct stepped_floor {
    Int quotient, remainder, divisor;

    VOXELPIPE_HD
    constexpr stepped_floor(Int numerator, Int divisor_)
        : quotient(exact::floor_div(numerator, divisor_)), remainder(numerator - quotient * divisor_),
          divisor(divisor_) {}

    VOXELPIPE_HD
    constexpr void step(Int delta) {
        remainder += delta;
        if (remainder < 0) {
            remainder += divisor;
            --quotient;
        } else if (remainder >= divisor) {
            remainder -= divisor;
            ++quotient;
        }
    }
};

// Narrows [lo, hi] to the x with a*x + b*y + c >= 0 for all three half-planes. The result is an interval, so a short
// row is narrowed from its ends; a long one is solved by division. Overloads as edge has them. IsInline: no division is
// a function of its own (exact::floor_div_inline).
template <bool IsInline = false, class Int>
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void narrow_row_of(const half_plane<Int> (&h)[3], Int y, std::int64_t& lo,
                                                           std::int64_t& hi) {
    const Int r[3] = {h[0].b * y + h[0].c, h[1].b * y + h[1].c, h[2].b * y + h[2].c};
    if (hi - lo >= 6) {
        Int first = lo, last = hi;
        for (int i = 0; i < 3; ++i) {
            const Int a = h[i].a;
            if (a > 0) {
                const Int bound = IsInline ? -exact::floor_div_inline<Int>(r[i], a) : exact::ceil_div<Int>(-r[i], a);
                if (bound > first) first = bound;
            } else if (a < 0) {
                const Int bound = IsInline ? exact::floor_div_inline<Int>(r[i], -a) : exact::floor_div<Int>(r[i], -a);
                if (bound < last) last = bound;
            } else if (r[i] < 0) {
                last = first - 1;
            }
            if (first > last) break;
        }
        if (first > last) {
            hi = lo - 1;
        } else {
            lo = static_cast<std::int64_t>(first);
            hi = static_cast<std::int64_t>(last);
        }
        return;
    }
    const auto inside = [&](std::int64_t x) VOXELPIPE_INLINE_LAMBDA {
        const Int i = x;
        return ((h[0].a * i + r[0]) | (h[1].a * i + r[1]) | (h[2].a * i + r[2])) >= 0;
    };
    while (lo <= hi && !inside(lo)) ++lo;
    while (lo < hi && !inside(hi)) --hi;
}
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void narrow_row(const half_plane<std::int64_t> (&h)[3], std::int64_t y,
                                                        std::int64_t& lo, std::int64_t& hi) {
    narrow_row_of(h, y, lo, hi);
}
VOXELPIPE_HD VOXELPIPE_DEVICE_NOINLINE constexpr void narrow_row(const half_plane<int128> (&h)[3], int128 y,
                                                                 std::int64_t& lo, std::int64_t& hi) {
    narrow_row_of(h, y, lo, hi);
}

// Calls emit(u, v, w_first, w_last) for every column with covered voxels inside `clip` (x y z, in voxels of the setup's
// fraction). u, v and w are absolute voxel indices. Spans of one triangle do not overlap.
VOXELPIPE_ANY_CALLABLE
template <span_rule Rule, class Int, class Emit>
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void for_each_span(const triangle_setup<Int>& t, const voxel_box& clip,
                                                           Emit&& emit) {
    const triple<std::int64_t> clip_lo = to_uvw(t.axis, clip.lo[0], clip.lo[1], clip.lo[2]);
    const triple<std::int64_t> clip_hi = to_uvw(t.axis, clip.hi[0], clip.hi[1], clip.hi[2]);
    triple<std::int64_t> lo{}, hi{};
    for (int i = 0; i < 3; ++i) {
        lo[i] = clip_lo[i] - t.origin[i];
        hi[i] = clip_hi[i] - t.origin[i];
        // A thin fragment may leave the bounding box along w: its depth is the plane's at the column's centre.
        if (i == 2 && Rule != span_rule::conservative) continue;
        if (lo[i] < 0) lo[i] = 0;
        if (hi[i] > t.last[i]) hi[i] = t.last[i];
    }
    if (hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]) return;

    if (t.zero_area) {
        // A segment or a point. Each step along its longest axis touches a handful of voxels.
        if constexpr (Rule == span_rule::conservative) {
            for (std::int64_t w = lo[2]; w <= hi[2]; ++w) {
                std::int64_t v_lo = lo[1], v_hi = hi[1], u_lo = lo[0], u_hi = hi[0];
                // Rows run along the first coordinate of a projection: (v, w) fits, (w, u) has to be swapped.
                narrow_row(t.vw, Int{w}, v_lo, v_hi);
                half_plane<Int> uw[3] = {{t.wu[0].b, t.wu[0].a, t.wu[0].c},
                                         {t.wu[1].b, t.wu[1].a, t.wu[1].c},
                                         {t.wu[2].b, t.wu[2].a, t.wu[2].c}};
                narrow_row(uw, Int{w}, u_lo, u_hi);
                if (u_lo > u_hi) continue;
                for (std::int64_t v = v_lo; v <= v_hi; ++v) {
                    std::int64_t a = u_lo, b = u_hi;
                    narrow_row(t.uv, Int{v}, a, b);
                    for (std::int64_t u = a; u <= b; ++u)
                        emit(t.origin[0] + u, t.origin[1] + v, t.origin[2] + w, t.origin[2] + w);
                }
            }
        }
        return;
    }

    const Int nu = t.plane[0], nv = t.plane[1], nw = t.plane[2];
    for (std::int64_t v = lo[1]; v <= hi[1]; ++v) {
        std::int64_t u_lo = lo[0], u_hi = hi[0];
        narrow_row(t.uv, Int{v}, u_lo, u_hi);
        if (u_lo > u_hi) continue;
        if constexpr (Rule == span_rule::thin) {
            // floor of the plane's depth at the column's centre, all terms doubled
            stepped_floor<Int> depth(t.plane_high - nu * (2 * Int{u_lo} + 1) - nv * (2 * Int{v} + 1), 2 * nw);
            for (std::int64_t u = u_lo;; ++u) {
                if (depth.quotient >= lo[2] && depth.quotient <= hi[2]) {
                    const std::int64_t w = t.origin[2] + static_cast<std::int64_t>(depth.quotient);
                    emit(t.origin[0] + u, t.origin[1] + v, w, w);
                }
                if (u == u_hi) break;
                depth.step(-2 * nu);
            }
        } else {
            // Voxels whose slab the plane can pass within the column's square, decided by the square's corners: w from
            // floor((low - 1) / nw) to floor(high / nw).
            const Int row = nu * u_lo + nv * v;
            Int low = t.plane_low - row - positive_part(nu) - positive_part(nv);
            Int high = t.plane_high - row - negative_part(nu) - negative_part(nv);
            // The other two projections at (v, w) and (w, u): terms in v are fixed here, terms in u are stepped.
            Int r[3]{}, s[3]{};
            if constexpr (Rule == span_rule::conservative) {
                for (int i = 0; i < 3; ++i) {
                    r[i] = t.vw[i].a * v + t.vw[i].c;
                    s[i] = t.wu[i].b * u_lo + t.wu[i].c;
                }
            }
            // The result is non-negative iff all of these numbers are.
            const auto sides = [&](Int w) VOXELPIPE_INLINE_LAMBDA {
                return (t.vw[0].b * w + r[0]) | (t.vw[1].b * w + r[1]) | (t.vw[2].b * w + r[2]) |
                       (t.wu[0].a * w + s[0]) | (t.wu[1].a * w + s[1]) | (t.wu[2].a * w + s[2]);
            };
            VOXELPIPE_CALLS_ANY
            const auto out = [&](std::int64_t u, Int w0, Int w1) VOXELPIPE_INLINE_LAMBDA {
                emit(t.origin[0] + u, t.origin[1] + v, t.origin[2] + static_cast<std::int64_t>(w0),
                     t.origin[2] + static_cast<std::int64_t>(w1));
            };
            VOXELPIPE_CALLS_ANY_END
            if (Rule == span_rule::conservative && sizeof(Int) == sizeof(std::int64_t) && hi[2] - lo[2] < 4) {
                // Few voxels deep: testing each end against the plane costs less than two divisions. Triangles that
                // need 128 bits are too few for code of their own.
                for (std::int64_t u = u_lo; u <= u_hi; ++u) {
                    const auto inside = [&](Int w) VOXELPIPE_INLINE_LAMBDA {
                        const Int depth = nw * w;
                        return (sides(w) | (depth + nw - low) | (high - depth)) >= 0;
                    };
                    Int w0 = lo[2], w1 = hi[2];
                    while (w0 <= w1 && !inside(w0)) ++w0;
                    if (w0 <= w1) {
                        while (w0 < w1 && !inside(w1)) --w1;
                        out(u, w0, w1);
                    }
                    low -= nu;
                    high -= nu;
                    for (int i = 0; i < 3; ++i) s[i] += t.wu[i].b;
                }
                continue;
            }
            stepped_floor<Int> first(low - 1, nw);
            stepped_floor<Int> last(high, nw);
            for (std::int64_t u = u_lo;; ++u) {
                Int w0 = first.quotient, w1 = last.quotient;
                if (w0 < lo[2]) w0 = lo[2];
                if (w1 > hi[2]) w1 = hi[2];
                if constexpr (Rule == span_rule::conservative) {
                    // The sides cut at most one or two voxels off the ends.
                    while (w0 <= w1 && sides(w0) < 0) ++w0;
                    while (w0 < w1 && sides(w1) < 0) --w1;
                    for (int i = 0; i < 3; ++i) s[i] += t.wu[i].b;
                }
                if (w0 <= w1) out(u, w0, w1);
                if (u == u_hi) break;
                first.step(-nu);
                last.step(-nu);
            }
        }
    }
}

[[nodiscard]] VOXELPIPE_HD constexpr span_rule to_rule(coverage c) {
    return c == coverage::thin ? span_rule::thin : span_rule::conservative;
}

// The whole path for one triangle: picks the integer width, sets up, enumerates. Calls emit(setup, u, v, w_first,
// w_last) with either width of setup.
VOXELPIPE_ANY_CALLABLE
template <span_rule Rule, class Emit>
VOXELPIPE_HD constexpr void rasterize(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                      int fraction, const voxel_box& clip, Emit&& emit) {
    const auto run = [&](const auto& t) {
        for_each_span<Rule>(
            t, clip, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) { emit(t, u, v, w0, w1); });
    };
    if (fits_narrow(a, b, c, fraction))
        run(setup_triangle<Rule, std::int64_t>(a, b, c, fraction));
    else
        run(setup_triangle<Rule, int128>(a, b, c, fraction));
}

} // namespace voxelpipe::core
