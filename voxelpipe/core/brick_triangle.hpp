// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a large triangle brick by brick, 16 voxels a side: a test for the bricks in which it can
// have voxels, and for one brick the 32-bit coverage of small_triangle.hpp. Within a brick a half-plane's value changes
// by less than 2^29, so its constant may be clamped to +-2^30 without changing a sign.

#include <voxelpipe/core/small_conservative.hpp>
#include <voxelpipe/core/small_thin.hpp>

namespace voxelpipe::core {

inline constexpr int log2_raster_brick = 4;
inline constexpr int raster_brick_size = 1 << log2_raster_brick;

struct brick_half_plane {
    std::int32_t a, b; // edges of the 64-bit path: below 2^24, with a bit to spare
    std::int64_t c;

    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr std::int64_t at(int x, int y) const {
        return static_cast<std::int64_t>(a) * x + static_cast<std::int64_t>(b) * y + c;
    }
    // True if any voxel of the brick's square, lowest at (x, y), is inside.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool meets(int x, int y) const {
        return at(x, y) + std::int64_t{raster_brick_size - 1} * ((a > 0 ? a : 0) + (b > 0 ? b : 0)) >= 0;
    }
    // The same half-plane with (x, y) as the origin; its signs are exact for voxels -1 to 16.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr small_half_plane from(int x, int y) const {
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        const std::int64_t value = at(x, y);
        return {a, b, static_cast<std::int32_t>(value > limit ? limit : value < -limit ? -limit : value)};
    }
};
static_assert(narrow_edge_bits(16) <= 24, "a brick's half-planes would overflow 32 bits");

// A triangle that fits_narrow, relative to the lowest voxel of its bounding box. All voxels below are relative to that
// too.
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

    // True if the triangle can have voxels in the brick whose lowest voxel is (x, y, z); never false if it has some.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets(int x, int y, int z) const {
        bool all = true;
        for (int i = 0; i < 3; ++i) all = all && xy[i].meets(x, y) && yz[i].meets(y, z) && zx[i].meets(z, x);
        if (!all) return false;
        std::int64_t low = n[0] * x + n[1] * y + n[2] * z, high = low;
        for (int i = 0; i < 3; ++i) {
            low += (raster_brick_size - 1) * negative_part(n[i]);
            high += (raster_brick_size - 1) * positive_part(n[i]);
        }
        return high + below >= 0 && above - low >= 0;
    }

    // The range of voxels along axis w in which the plane can pass the square of a brick column (u, v), widened by one
    // voxel. It only selects what to test, so its roundings do not matter. u = w + 1, v = w + 2 (mod 3).
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
        const std::int64_t low = sum + (raster_brick_size - 1) * (negative_part(nu) + negative_part(nv));
        const std::int64_t high = sum + (raster_brick_size - 1) * (positive_part(nu) + positive_part(nv));
        const double from = static_cast<double>(-below - high) / static_cast<double>(nw);
        const double to = static_cast<double>(above - low) / static_cast<double>(nw);
        first = (from < to ? from : to) - 1.0;
        last = (from < to ? to : from) + 1.0;
    }

    // Coverage within the brick, with its lowest voxel as the origin.
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

// Direction of the rows of columns of a large thin triangle: along u of its dominant axis, or along v.
struct row_axes {
    int dominant;
    bool along_v;

    // Converts (x, y, z) to (along rows, across rows, along the dominant axis), and back.
    template <class T>
    [[nodiscard]] VOXELPIPE_HD constexpr triple<T> to_rows(const T& x, const T& y, const T& z) const {
        const triple<T> uvw = to_uvw(dominant, x, y, z);
        return along_v ? triple<T>{{uvw[1], uvw[0], uvw[2]}} : uvw;
    }
    template <class T>
    [[nodiscard]] VOXELPIPE_HD constexpr triple<T> from_rows(const T& along, const T& across, const T& w) const {
        return to_xyz(dominant, along_v ? across : along, along_v ? along : across, w);
    }
    [[nodiscard]] VOXELPIPE_HD constexpr bool are_along_x() const { return dominant == (along_v ? 1 : 2); }
};

// A large triangle in bricks for thin coverage, in rows of 16 columns of the dominant axis. For triangles with an area.
// Here and in brick_row, u is the axis along the rows.
struct brick_thin {
    brick_half_plane uv[3];
    std::int64_t nu, nv, nw, depth; // as in small_thin
    row_axes axes;
    std::int32_t first[3], last[3]; // the bounding box by these axes: fits 32 bits if it meets a grid

    brick_thin() = default;
    VOXELPIPE_HD brick_thin(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                            const voxel_box& box, const row_axes& axes_, int fraction)
        : axes(axes_) {
        const auto low = axes.to_rows(box.lo[0], box.lo[1], box.lo[2]),
                   high = axes.to_rows(box.hi[0], box.hi[1], box.hi[2]);
        for (int k = 0; k < 3; ++k) {
            first[k] = static_cast<std::int32_t>(low[k]);
            last[k] = static_cast<std::int32_t>(high[k]);
        }
        const auto to_local = [&](const snapped_position& v) {
            return to_uvw<std::int64_t>(axes.dominant, v.x - (box.lo[0] << fraction), v.y - (box.lo[1] << fraction),
                                        v.z - (box.lo[2] << fraction));
        };
        const triple<std::int64_t> p[3] = {to_local(a), to_local(b), to_local(c)};
        std::int64_t n[3];
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            n[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        }
        const int sign = n[2] < 0 ? -1 : 1;
        for (int i = 0; i < 3; ++i) {
            const int j = i == 2 ? 0 : i + 1;
            const half_plane<std::int64_t> h = edge(p[i][0], p[i][1], p[j][0], p[j][1], sign, fraction);
            const auto by_u = static_cast<std::int32_t>(h.a), by_v = static_cast<std::int32_t>(h.b);
            uv[i] = {axes.along_v ? by_v : by_u, axes.along_v ? by_u : by_v, h.c};
        }
        nu = sign * n[axes.along_v ? 1 : 0];
        nv = sign * n[axes.along_v ? 0 : 1];
        nw = sign * n[2];
        depth = static_cast<std::int64_t>(
            exact::floor_shift(2 * sign *
                                   (static_cast<int128>(n[0]) * p[0][0] + static_cast<int128>(n[1]) * p[0][1] +
                                    static_cast<int128>(n[2]) * p[0][2]),
                               fraction));
    }

    // Coverage with columns counted from (u, v).
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE small_thin from(int u, int v) const {
        small_thin s;
        s.axis = axes.dominant;
        for (int i = 0; i < 3; ++i) s.uv[i] = uv[i].from(u, v);
        s.nu = nu;
        s.nv = nv;
        s.nw = nw;
        s.depth = depth - 2 * (nu * u + nv * v);
        return s;
    }
    // True if any of the 16 columns from (u, v) on may be touched.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool meets_row(int u, int v) const {
        bool all = true;
        for (int i = 0; i < 3; ++i)
            all = all && uv[i].at(u, v) + std::int64_t{raster_brick_size - 1} * (uv[i].a > 0 ? uv[i].a : 0) >= 0;
        return all;
    }
};

// The covered columns of a row of at most raster_brick_size, which are consecutive, and their depths, which ascend or
// descend. Values that are equal for all rows of the triangle are passed to its functions.
struct brick_row {
    std::int64_t plane = 0;    // small_thin::depth; columns and depths are relative to the row's position
    float by_u = 0, first = 0; // depths in floats: slope per column; depth of column 0
    std::uint32_t columns = 0; // bit mask
    std::int32_t base = 0;     // the row's position: a depth near its first column's, from the bounding box

    brick_row() = default; // no columns
    // Columns from .. to, at most raster_brick_size of them, from (u, v) on.
    VOXELPIPE_HD VOXELPIPE_INLINE brick_row(const brick_thin& t, int u, int v, int from, int to) {
        small_thin s = t.from(u, v);
        // Floats resolve depths of up to some twenty voxels. Any base within a voxel or two will do, and this one is: a
        // triangle that fits_narrow has up to 2^11 voxels a side, of which three roundings lose less than 2^-8.
        base = static_cast<std::int32_t>(exact::mul(static_cast<float>(s.depth - s.nu - s.nv),
                                                    exact::mul(0.5f, exact::near_inverse(static_cast<float>(s.nw)))));
        s.depth -= base * (2 * s.nw);
        struct {
            std::uint32_t word;
            VOXELPIPE_HD VOXELPIPE_INLINE void set(int, std::uint32_t w) { word = w; }
        } kept{};
        std::uint32_t count = 0;
        const small_thin::walk walk = s.find_columns(from, to, 0, 0, 1, kept, count);
        plane = s.depth;
        by_u = walk.by_u;
        first = walk.first;
        columns = kept.word << from;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE int first_column() const { return exact::lowest_one(columns); }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE int last_column() const { return exact::highest_one(columns); }
    // Relative to `base`. Here and below, t is the row's triangle.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t depth(const brick_thin& t, int column) const {
        return small_thin::depth_of(t.nu, t.nv, t.nw, plane, by_u, first, column, 0);
    }
    // The last column, up to `last`, with the same depth as this one.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE int last_of_depth(const brick_thin& t, std::int32_t of_column,
                                                                  int column, int last) const {
        if (depth(t, last) == of_column) return last;
        // About where the next depth begins, in floats.
        const float edge = exact::sub(static_cast<float>(of_column + (by_u > 0.0f ? 1 : 0)), first),
                    at = exact::mul(edge, exact::near_inverse(by_u));
        auto end =
            static_cast<int>(exact::max(exact::min(at, static_cast<float>(last - 1)), static_cast<float>(column)));
        while (end > column && depth(t, end) != of_column) --end;
        while (depth(t, end + 1) == of_column) ++end;
        return end;
    }
};

} // namespace voxelpipe::core
