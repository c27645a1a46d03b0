// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Thin coverage of a small triangle (small_triangle.hpp), as voxels of the columns along its dominant axis.

#include <voxelpipe/core/small_triangle.hpp>

#include <cstdint>

namespace voxelpipe::core {

// One voxel for every touched column of the dominant axis. Not for zero-area triangles.
struct small_thin {
    int axis;
    small_half_plane uv[3];
    // The depth at a column's centre is (depth - nu (2u + 1) - nv (2v + 1)) / (2 nw).
    std::int64_t nu, nv, nw, depth;

    small_thin() = default; // brick_thin sets the members

    VOXELPIPE_HD VOXELPIPE_INLINE small_thin(const small_triangle& t, const triple<std::int64_t>& normal, int axis_,
                                             int fraction)
        : axis(axis_) {
        small_triangle turned{}; // u v w
        for (int i = 0; i < 3; ++i) {
            const triple<std::int32_t> p = to_uvw(axis, t.p[i][0], t.p[i][1], t.p[i][2]);
            for (int k = 0; k < 3; ++k) turned.p[i][k] = p[k];
        }
        triple<std::int64_t> plane = to_uvw(axis, normal[0], normal[1], normal[2]);
        const bool negative = plane[2] < 0;
        small_projection<0, 1>(turned, negative, fraction, uv);
        if (negative) plane = {{-plane[0], -plane[1], -plane[2]}};
        nu = plane[0];
        nv = plane[1];
        nw = plane[2];
        depth = exact::floor_shift(2 * (nu * turned.p[0][0] + nv * turned.p[0][1] + nw * turned.p[0][2]), fraction);
    }

    // Swaps u and v, also for uv and `columns`.
    VOXELPIPE_HD VOXELPIPE_INLINE void swap_uv() {
        for (small_half_plane& e : uv) e = {e.b, e.a, e.c};
        const std::int64_t u = nu;
        nu = nv;
        nv = u;
    }

    // A position in the covered columns, row by row.
    struct walk {
        float by_u, by_v, first, of_row; // depths: steps; at the centre of (0, 0); at this row's first column
        std::uint32_t rows, row;         // remaining rows, as bits; remaining columns of this row
        int u0, v0, step, v;
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() const { return (rows | row) == 0; }
    };
    // Finds the covered columns of the rows v0, v0 + step, ... up to v1, with at most 32 columns each. `kept` holds a
    // word for each of the at most 32 rows: get(i), set(i, word). Adds the number of columns to `count`.
    template <class Kept>
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE walk find_columns(int u0, int u1, int v0, int v1, int step, Kept&& kept,
                                                                  std::uint32_t& count) const {
        walk k{};
        {
            small_row_ends ends(uv, false, u0, v0, step);
            int i = 0;
            for (int v = u1 < u0 ? v1 + 1 : v0; v <= v1; v += step, ++i) {
                const std::uint32_t row = ends.next(u1 - u0);
                kept.set(i, row);
                k.rows |= static_cast<std::uint32_t>(row != 0) << i;
                count += static_cast<std::uint32_t>(exact::count_ones(row));
            }
        }
        const float inverse = exact::near_inverse(static_cast<float>(nw));
        k.by_u = exact::mul(-static_cast<float>(nu), inverse);
        k.by_v = exact::mul(-static_cast<float>(nv), inverse);
        k.first = exact::mul(static_cast<float>(depth - nu - nv), exact::mul(0.5f, inverse));
        k.u0 = u0;
        k.v0 = v0;
        k.step = step;
        return k;
    }
    // Visits the next column of a walk that is not done: calls emit(u, w), and begin_row(v) before the first column of
    // a row.
    template <class Kept, class BeginRow, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void next_column(walk& k, Kept&& kept, BeginRow&& begin_row, Emit&& emit) const {
        if (k.row == 0) {
            const int i = exact::highest_one(k.rows);
            k.rows ^= 1u << i;
            k.row = kept.get(i);
            k.v = k.v0 + i * k.step;
            k.of_row = exact::fma(k.by_v, static_cast<float>(k.v), k.first);
            begin_row(k.v);
        }
        const int i = exact::highest_one(k.row), u = k.u0 + i;
        k.row ^= 1u << i;
        emit(u, depth_of(nu, nv, nw, depth, k.by_u, k.of_row, u, k.v));
    }
    // The depth of touched column u of row v; first + by_u * u is about that, in floats.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE static std::int32_t depth_of(std::int64_t nu, std::int64_t nv,
                                                                             std::int64_t nw, std::int64_t depth,
                                                                             float by_u, float first, int u, int v) {
        // Slopes are at most one and depths from -1 to 33, so `first` is below 100 and the error below 2^-14 voxel.
        float over = 0;
        const std::int32_t w = exact::integer_below(exact::fma(by_u, static_cast<float>(u), first), over);
        if (over >= 0x1p-12f && over <= 1.0f - 0x1p-12f) return w;
        const std::int64_t divisor = 2 * nw; // w is at most one off
        const std::int64_t remainder = depth - times(nu, 2 * u + 1) - times(nv, 2 * v + 1) - w * divisor;
        return w + static_cast<std::int32_t>(remainder >= divisor) - static_cast<std::int32_t>(remainder < 0);
    }
    // Visits all covered columns, for threads with a triangle each, as small_conservative::rows does: first all rows,
    // then one loop over the remaining columns.
    template <class Kept, class BeginRow, class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void columns(int u0, int u1, int v0, int v1, int step, Kept&& kept,
                                               BeginRow&& begin_row, Emit&& emit) const {
        std::uint32_t count = 0;
        for (walk k = find_columns(u0, u1, v0, v1, step, kept, count); !k.is_done();)
            next_column(k, kept, begin_row, emit);
    }
};

// The depths of the columns (u, v) of 2 x 2 of a bounding box that is at most two voxels deep: w + 1 in two bits, at 2
// u + 4 v. Valid for columns that the triangle touches: their depth at the centre is within a voxel of the triangle's
// own depths, so no division is needed.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t cube_depths(const small_thin& s) {
    const std::int64_t divisor = 2 * s.nw, first = s.depth - s.nu - s.nv;
    std::uint32_t packed = 0;
    for (int v = 0; v < 2; ++v)
        for (int u = 0; u < 2; ++u) {
            const std::int64_t n = first - (u != 0 ? 2 * s.nu : 0) - (v != 0 ? 2 * s.nv : 0);
            const int w =
                static_cast<int>(n >= 0) + static_cast<int>(n >= divisor) + static_cast<int>(n >= 2 * divisor);
            packed |= static_cast<std::uint32_t>(w) << (2 * u + 4 * v);
        }
    return packed;
}

} // namespace voxelpipe::core
