// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coverage of a small triangle in 32-bit integers: the sets of coverage.hpp for a triangle whose bounding box is a few
// voxels, with coordinates that count from that box. Only the set-up multiplies in 64 bits, and the plane, whose normal
// is an area, is kept in 64. Conservative coverage comes as rows of bits along x, whatever the dominant axis: the
// separating axes (bounding box, plane, three projections) do not know one. Nothing branches on the triangle's shape.

#include <voxelpipe/core/triangle_setup.hpp>

#include <cstdint>

namespace voxelpipe::core {

// ---- widths ---------------------------------------------------------------------------------------------------------
// A side of the bounding box has at most 2^e units of 2^-F voxel, so: normal components 2e bits (twice an area is at
// most the projected box), n . p 3e + 1.6 and doubled for thin 3e + 2.6 bits, edge coefficients e bits, their constants
// after the division by 2^F, and every value within the box and one voxel beyond it, 2e + 3 - F bits.
inline constexpr int small_edge_bits = 20;
inline constexpr int small_most_voxels = 32; // a row is one word

// How many voxels a side of a small triangle's bounding box may have.
[[nodiscard]] VOXELPIPE_HD constexpr int small_voxels(int fraction) {
    if (2 * small_edge_bits + 3 - fraction > 31) return 0;
    const int n = 1 << (fraction < small_edge_bits ? small_edge_bits - fraction : 0);
    return n < small_most_voxels ? n : small_most_voxels;
}
static_assert(3 * small_edge_bits + 3 <= 63, "the plane of a small triangle would overflow 64 bits");
static_assert(small_voxels(16) == 16 && small_voxels(14) == 32 && small_voxels(12) == 32 && small_voxels(11) == 0);
// Thin depths are found by one division in double: numerator and divisor are exact (3e + 3 - F and 2e + 2 bits), and a
// quotient below 2^8 that is no integer is further from the next one than the rounding reaches.
static_assert(3 * small_edge_bits + 3 - 12 <= 53 && 2 * small_edge_bits + 2 + 8 <= 52);

// A triangle relative to the corner of the lowest voxel of its bounding box: 0 < p <= 2^small_edge_bits.
struct small_triangle {
    std::int32_t p[3][3]; // [vertex][axis]
};

// The part of the bounding box that is wanted, inclusive, relative to its lowest voxel.
struct small_box {
    int lo[3], hi[3];
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]; }
};

struct small_half_plane {
    std::int32_t a, b, c;
    [[nodiscard]] VOXELPIPE_HD constexpr std::int32_t at(int x, int y) const { return a * x + b * y + c; }
};

// The three half-planes of the projection on axes (X, Y). Edges are turned by the sign of the projected area; where
// that is zero, the closed chain of edges runs along one line both ways, which leaves exactly that line.
template <int X, int Y>
VOXELPIPE_HD VOXELPIPE_INLINE constexpr void small_projection(const small_triangle& t, bool negative, int fraction,
                                                              small_half_plane (&out)[3]) {
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        std::int32_t a = t.p[i][Y] - t.p[j][Y], b = t.p[j][X] - t.p[i][X];
        if (negative) {
            a = -a;
            b = -b;
        }
        const std::int64_t at_vertex =
            static_cast<std::int64_t>(a) * t.p[i][X] + static_cast<std::int64_t>(b) * t.p[i][Y];
        out[i] = {a, b, static_cast<std::int32_t>(-at_vertex >> fraction) + (a > 0 ? a : 0) + (b > 0 ? b : 0)};
    }
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr triple<std::int64_t> small_normal(const small_triangle& t) {
    const std::int64_t e1x = t.p[1][0] - t.p[0][0], e1y = t.p[1][1] - t.p[0][1], e1z = t.p[1][2] - t.p[0][2];
    const std::int64_t e2x = t.p[2][0] - t.p[0][0], e2y = t.p[2][1] - t.p[0][1], e2z = t.p[2][2] - t.p[0][2];
    return {{e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x}};
}

// ---- conservative ---------------------------------------------------------------------------------------------------

struct small_conservative {
    small_half_plane xy[3], yz[3], zx[3];
    std::int64_t n[3]; // normal
    std::int64_t below,
        above; // a voxel's lowest corner c meets the plane where n . c + below >= 0 and above - n . c >= 0

    VOXELPIPE_HD VOXELPIPE_INLINE small_conservative(const small_triangle& t, int fraction) {
        const triple<std::int64_t> normal = small_normal(t);
        small_projection<0, 1>(t, normal[2] < 0, fraction, xy);
        small_projection<1, 2>(t, normal[0] < 0, fraction, yz);
        small_projection<2, 0>(t, normal[1] < 0, fraction, zx);
        std::int64_t at_plane = 0, positive = 0, negative = 0;
        for (int i = 0; i < 3; ++i) {
            n[i] = normal[i];
            at_plane += n[i] * t.p[0][i];
            positive += positive_part(n[i]);
            negative += negative_part(n[i]);
        }
        below = positive - exact::ceil_shift(at_plane, fraction);
        above = exact::floor_shift(at_plane, fraction) - negative;
    }

    // The covered voxels (x0 .. x1, y, z), bit 0 for x0; at most 32.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t row(int x0, int x1, int y, int z) const {
        if ((yz[0].at(y, z) | yz[1].at(y, z) | yz[2].at(y, z)) < 0) return 0;
        std::int32_t e[6];
        for (int i = 0; i < 3; ++i) {
            e[i] = xy[i].at(x0, y);
            e[3 + i] = zx[i].at(z, x0);
        }
        const std::int64_t depth = n[0] * x0 + n[1] * y + n[2] * z;
        std::int64_t lower = depth + below, upper = above - depth;
        std::uint32_t bits = 0;
        for (int x = 0; x <= x1 - x0; ++x) {
            const std::int32_t outside =
                e[0] | e[1] | e[2] | e[3] | e[4] | e[5] | static_cast<std::int32_t>((lower | upper) >> 32); // signs
            bits |= (static_cast<std::uint32_t>(~outside) >> 31) << x;
            for (int i = 0; i < 3; ++i) {
                e[i] += xy[i].a;
                e[3 + i] += zx[i].b;
            }
            lower += n[0];
            upper -= n[0];
        }
        return bits;
    }
};

// ---- thin -----------------------------------------------------------------------------------------------------------

// One voxel for every touched column of the dominant axis. Not for zero-area triangles.
struct small_thin {
    int axis;
    small_half_plane uv[3];
    std::int64_t nu, nv, nw, depth; // depth: at the column's centre, doubled: (depth - nu (2u+1) - nv (2v+1)) / (2 nw)

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

    // Calls emit(u, w) for the covered columns (u0 .. u1, v). All count from the bounding box; w may lie beyond it.
    template <class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void row(int u0, int u1, int v, Emit&& emit) const {
        std::int32_t e[3];
        for (int i = 0; i < 3; ++i) e[i] = uv[i].at(u0, v);
        const std::int64_t numerator = depth - nu * (2 * u0 + 1) - nv * (2 * v + 1), divisor = 2 * nw;
        const double quotient = exact::div(static_cast<double>(numerator), static_cast<double>(divisor));
        auto w = static_cast<std::int32_t>(quotient);
        w -= static_cast<std::int32_t>(static_cast<double>(w) > quotient); // towards minus infinity
        std::int64_t remainder = numerator - w * divisor;
        for (int u = u0; u <= u1; ++u) {
            if ((e[0] | e[1] | e[2]) >= 0) emit(u, w);
            for (int i = 0; i < 3; ++i) e[i] += uv[i].a;
            // The slope is at most one voxel a column.
            remainder -= 2 * nu;
            if (remainder < 0) {
                remainder += divisor;
                --w;
            } else if (remainder >= divisor) {
                remainder -= divisor;
                ++w;
            }
        }
    }
};

} // namespace voxelpipe::core
