// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a large triangle brick by brick, 16 voxels a side: a test that tells which bricks it can
// have voxels in, and for one of them the 32-bit coverage of small_triangle.hpp. Within a brick a half-plane's value
// moves by less than 2^29, so that its constant may be cut to +-2^30 without changing a sign.

#include <voxelpipe/core/small_conservative.hpp>
#include <voxelpipe/core/small_thin.hpp>

namespace voxelpipe::core {

inline constexpr int log2_brick = 4;
inline constexpr int brick_size = 1 << log2_brick;

struct brick_half_plane {
    std::int32_t a, b; // edges of the 64-bit path: below 2^24, with a bit to spare
    std::int64_t c;

    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::int64_t at(int x, int y) const {
        return static_cast<std::int64_t>(a) * x + static_cast<std::int64_t>(b) * y + c;
    }
    // Whether any voxel of the brick's square, lowest at (x, y), is inside.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool meets(int x, int y) const {
        return at(x, y) + std::int64_t{brick_size - 1} * ((a > 0 ? a : 0) + (b > 0 ? b : 0)) >= 0;
    }
    // The same half-plane with (x, y) as the origin, exact in its signs for voxels -1 .. 16.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr small_half_plane from(int x, int y) const {
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        const std::int64_t value = at(x, y);
        return {a, b, static_cast<std::int32_t>(value > limit ? limit : value < -limit ? -limit : value)};
    }
};
static_assert(narrow_edge_bits(16) <= 24, "a brick's half-planes would overflow 32 bits");

// A triangle that fits_narrow, relative to the lowest voxel of its bounding box, as are all voxels below.
struct brick_triangle {
    brick_half_plane xy[3], yz[3], zx[3];
    std::int64_t n[3];         // normal
    std::int64_t below, above; // as in small_conservative

    brick_triangle() = default;
    VOXELPIPE_HD brick_triangle(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                const voxel_box& box, int fraction) {
        const std::int64_t o[3] = {box.lo[0] << fraction, box.lo[1] << fraction, box.lo[2] << fraction};
        const std::int64_t p[3][3] = {{a.x - o[0], a.y - o[1], a.z - o[2]},
                                      {b.x - o[0], b.y - o[1], b.z - o[2]},
                                      {c.x - o[0], c.y - o[1], c.z - o[2]}};
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            n[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        }
        project<0, 1>(p, n[2] < 0, fraction, xy);
        project<1, 2>(p, n[0] < 0, fraction, yz);
        project<2, 0>(p, n[1] < 0, fraction, zx);
        std::int64_t positive = 0, negative = 0;
        int128 at_plane = 0;
        for (int k = 0; k < 3; ++k) {
            at_plane += static_cast<int128>(n[k]) * p[0][k];
            positive += positive_part(n[k]);
            negative += negative_part(n[k]);
        }
        below = positive - static_cast<std::int64_t>(exact::ceil_shift(at_plane, fraction));
        above = static_cast<std::int64_t>(exact::floor_shift(at_plane, fraction)) - negative;
    }

    // Whether the triangle can have voxels in the brick whose lowest voxel is (x, y, z); true wherever it has.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets(int x, int y, int z) const {
        bool all = true;
        for (int i = 0; i < 3; ++i) all = all && xy[i].meets(x, y) && yz[i].meets(y, z) && zx[i].meets(z, x);
        if (!all) return false;
        std::int64_t low = n[0] * x + n[1] * y + n[2] * z, high = low;
        for (int i = 0; i < 3; ++i) {
            low += (brick_size - 1) * negative_part(n[i]);
            high += (brick_size - 1) * positive_part(n[i]);
        }
        return high + below >= 0 && above - low >= 0;
    }

    // The voxels of axis w that the plane can pass within the square of a brick column (u, v), widened by a voxel; for
    // choosing what to test, so that its roundings do not matter. u = w + 1, v = w + 2 (mod 3).
    VOXELPIPE_HD VOXELPIPE_INLINE void depths(int w, int u, int v, double& first, double& last) const {
        const std::int64_t nu = w == 0   ? n[1]
                                : w == 1 ? n[2]
                                         : n[0],
                           nv = w == 0   ? n[2]
                                : w == 1 ? n[0]
                                         : n[1],
                           nw = w == 0   ? n[0]
                                : w == 1 ? n[1]
                                         : n[2];
        if (nw == 0) {
            first = -1e9;
            last = 1e9;
            return;
        }
        const std::int64_t sum = nu * u + nv * v;
        const std::int64_t low = sum + (brick_size - 1) * (negative_part(nu) + negative_part(nv));
        const std::int64_t high = sum + (brick_size - 1) * (positive_part(nu) + positive_part(nv));
        const double from = static_cast<double>(-below - high) / static_cast<double>(nw);
        const double to = static_cast<double>(above - low) / static_cast<double>(nw);
        first = (from < to ? from : to) - 1.0;
        last = (from < to ? to : from) + 1.0;
    }

    // Coverage within the brick, whose lowest voxel becomes the origin.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE small_conservative at(int x, int y, int z) const {
        small_conservative s;
        const std::int64_t depth = n[0] * x + n[1] * y + n[2] * z;
        for (int i = 0; i < 3; ++i) {
            s.xy[i] = xy[i].from(x, y);
            s.yz[i] = yz[i].from(y, z);
            s.zx[i] = zx[i].from(z, x);
            s.n[i] = n[i];
        }
        s.below = below + depth;
        s.above = above - depth;
        return s;
    }

private:
    template <int X, int Y>
    VOXELPIPE_HD VOXELPIPE_INLINE static void project(const std::int64_t (&p)[3][3], bool negative, int fraction,
                                                      brick_half_plane (&out)[3]) {
        for (int i = 0; i < 3; ++i) {
            const int j = i == 2 ? 0 : i + 1;
            std::int64_t a = p[i][Y] - p[j][Y], b = p[j][X] - p[i][X];
            if (negative) {
                a = -a;
                b = -b;
            }
            const std::int64_t constant = exact::floor_shift(-(a * p[i][X] + b * p[i][Y]), fraction);
            out[i] = {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b),
                      constant + positive_part(a) + positive_part(b)};
        }
    }
};

// The same for thin coverage, in rows of 16 columns of the dominant axis. For triangles that have an area.
struct brick_thin {
    int axis;
    brick_half_plane uv[3];
    std::int64_t nu, nv, nw, depth; // as in small_thin

    brick_thin() = default;
    VOXELPIPE_HD brick_thin(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                            const voxel_box& box, int axis_, int fraction)
        : axis(axis_) {
        const auto place = [&](const snapped_position& v) {
            return to_uvw<std::int64_t>(axis_, v.x - (box.lo[0] << fraction), v.y - (box.lo[1] << fraction),
                                        v.z - (box.lo[2] << fraction));
        };
        const triple<std::int64_t> p[3] = {place(a), place(b), place(c)};
        std::int64_t n[3];
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            n[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        }
        const int sign = n[2] < 0 ? -1 : 1;
        for (int i = 0; i < 3; ++i) {
            const int j = i == 2 ? 0 : i + 1;
            const half_plane<std::int64_t> h = edge(p[i][0], p[i][1], p[j][0], p[j][1], sign, fraction);
            uv[i] = {static_cast<std::int32_t>(h.a), static_cast<std::int32_t>(h.b), h.c};
        }
        nu = sign * n[0];
        nv = sign * n[1];
        nw = sign * n[2];
        depth = static_cast<std::int64_t>(
            exact::floor_shift(2 * (static_cast<int128>(nu) * p[0][0] + static_cast<int128>(nv) * p[0][1] +
                                    static_cast<int128>(nw) * p[0][2]),
                               fraction));
    }

    // Columns count from (u, v) in what this gives.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE small_thin from(int u, int v) const {
        small_thin s;
        s.axis = axis;
        for (int i = 0; i < 3; ++i) s.uv[i] = uv[i].from(u, v);
        s.nu = nu;
        s.nv = nv;
        s.nw = nw;
        s.depth = depth - 2 * (nu * u + nv * v);
        return s;
    }
    // Whether any of the 16 columns from (u, v) on may be touched.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets_row(int u, int v) const {
        bool all = true;
        for (int i = 0; i < 3; ++i)
            all = all && uv[i].at(u, v) + std::int64_t{brick_size - 1} * (uv[i].a > 0 ? uv[i].a : 0) >= 0;
        return all;
    }
};

// The covered columns of a row of at most brick_size, one after the other.
struct brick_row {
    // A word of a walk over one row (small_thin::walk).
    struct kept_row {
        std::uint32_t word;
        VOXELPIPE_HD VOXELPIPE_INLINE void set(int, std::uint32_t w) { word = w; }
        [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t get(int) const { return word; }
    };
    small_thin s; // columns and depths count from the row's place
    small_thin::walk left{};
    kept_row kept{};
    std::int32_t base = 0;   // the row's place: a depth that its first column's is near, from the bounding box
    std::uint32_t count = 0; // of columns, before the first is taken

    brick_row() = default; // none
    // Columns first .. last, of which none is beyond brick_size, from (u, v) on.
    VOXELPIPE_HD VOXELPIPE_INLINE brick_row(const brick_thin& t, int u, int v, int first, int last) : s(t.from(u, v)) {
        // Floats tell depths of up to some twenty voxels. Whatever is within a voxel does.
        const std::int64_t divisor = 2 * s.nw;
        base = static_cast<std::int32_t>(
            exact::div(static_cast<double>(s.depth - s.nu - s.nv), static_cast<double>(divisor)));
        s.depth -= base * divisor;
        left = s.find_columns(first, last, 0, 0, 1, kept, count);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() const { return left.is_done(); }
    // The next one, where it is not done: emit(column, depth from `base`), the last column first.
    template <class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void next(Emit&& emit) {
        s.next_column(
            left, kept, [](int) VOXELPIPE_INLINE_LAMBDA {}, emit);
    }
};

} // namespace voxelpipe::core
