// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Thin coverage of a bounding box of at most two voxels a side, all columns at once: in single precision with a flag
// that is false if rounding may matter (corner_signs.hpp has the conservative part), and in integers for the rest. The
// columns along the dominant axis are the cells of its projection; edges rule one out only by the centre of the box.
// The depth is the plane's at a column's centre; in floats it is a quotient whose error grows with the ratio of the
// box's area to the triangle's.

#include <voxelpipe/core/corner_signs.hpp>
#include <voxelpipe/core/small_thin.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Voxels of a box of 2 x 2 x 2 and its neighbours along `axis`: the columns u + 2 v, where u and v are the other two
// axes in the order x, y, z, and for each column its depth w + 1, 0 to 3, in two bits at 2 (u + 2 v).
struct thin_cube {
    int axis; // -1 if the triangle has no area: then the other members are meaningless
    std::uint32_t columns, depths;
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE int depth(int column) const {
        return static_cast<int>(depths >> 2 * column & 3u) - 1;
    }
    // Voxel (x, y, z) of a column, relative to the box's lowest voxel.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triple<int> voxel(int column) const {
        const int u = column & 1, v = column >> 1, w = depth(column);
        return {axis == 0 ? w : u, axis == 0 ? u : axis == 1 ? w : v, axis == 2 ? w : v};
    }
};
// The columns of a box of `last_u` + 1 by `last_v` + 1.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t quad_of(int last_u, int last_v) {
    return (last_u != 0 ? 15u : 5u) & (last_v != 0 ? 15u : 3u);
}

// t: relative to the box's lowest voxel; last: its highest voxel, relative to that, 0 or 1 each.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE thin_cube thin_cube_by_integers(const small_triangle& t,
                                                                            const int (&last)[3], int fraction) {
    const triple<std::int64_t> normal = small_normal(t);
    const int axis = small_axis(normal);
    if (axis < 0) return {axis, 0, 0};
    const small_thin s(t, normal, axis, fraction);
    std::uint32_t columns = quad_bits(s.uv), depths = cube_depths(s);
    if (axis == 1) { // z x
        columns = (columns & 9u) | (columns << 1 & 4u) | (columns >> 1 & 2u);
        depths = (depths & 0xc3u) | (depths << 2 & 0x30u) | (depths >> 2 & 0x0cu);
    }
    // No index that differs by lane, last[...]: that would put boxes into local memory.
    const int last_u = axis == 0 ? last[1] : last[0], last_v = axis == 2 ? last[1] : last[2];
    return {axis, columns & quad_of(last_u, last_v), depths};
}

// The same from vertices in units of 2^-fraction voxel; lo: the box's lowest voxel. Never sure for a triangle without
// area. 12 <= fraction <= 20.
// Rounding, with vertices d relative to the centre, |d| <= 2^F, and E = 2^(2F - 22): a component of the normal is a
// rounded product of sides up to 2^(F + 1) subtracted from another, at most 2^(2F + 2) by its meaning, and rounded, so
// it is off by at most E. Which of two components is larger needs 2 E and the rounding of their difference. If the
// dominant one, n_w, is the largest, a slope n_u / n_w is off by 2 E / |n_w| plus 2^-21 for the reciprocal and the
// product. The depth at a column's centre, where u and v are at most 1.5 voxels from the vertex, is off by three times
// as much for each of the two, 2^-21 for the sum at the box's centre, which is below 4 voxels, and 2^-20 for the step
// from there: 12 E / |n_w| + 2^-18. The depth is sure if it is further than that from an integer.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE thin_cube thin_cube_by_signs(const std::int32_t (&q)[3][3],
                                                                         const std::int32_t (&lo)[3],
                                                                         const int (&last)[3], int fraction,
                                                                         bool& sure) {
    const std::int32_t centre[3] = {(lo[0] + 1) << fraction, (lo[1] + 1) << fraction, (lo[2] + 1) << fraction};
    const corner_vertices v(q, centre);
    float along[3], across[3]; // two sides
    for (int k = 0; k < 3; ++k) {
        along[k] = exact::sub(v.d[k][1], v.d[k][0]);
        across[k] = exact::sub(v.d[k][2], v.d[k][0]);
    }
    const auto normal = [&](int a, int b) VOXELPIPE_INLINE_LAMBDA {
        return exact::fma(along[a], across[b], -exact::mul(along[b], across[a]));
    };
    const float nx = normal(1, 2), ny = normal(2, 0), nz = normal(0, 1);
    const bool is_x = exact::absolute(nx) > exact::max(exact::absolute(ny), exact::absolute(nz));
    const bool is_y = !is_x && exact::absolute(ny) > exact::absolute(nz), is_z = !is_x && !is_y;
    const float nu = is_x ? ny : nx, nv = is_z ? ny : nz, nw = is_x ? nx : is_y ? ny : nz;
    const float limit = power_of_two(2 * fraction - 18); // 16 E
    sure = exact::sub(exact::absolute(nw), exact::max(exact::absolute(nu), exact::absolute(nv))) > limit;

    const int last_u = is_x ? last[1] : last[0], last_v = is_z ? last[1] : last[2];
    float u[3], w[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = is_x ? v.d[1][i] : v.d[0][i];
        w[i] = is_z ? v.d[1][i] : v.d[2][i]; // along v
    }
    const corner_edges e(u, w);
    const bool has_corner = (last_u & last_v) != 0;
    sure = sure && (!has_corner || e.smallest() > limit);
    const std::uint32_t out = fold_bytes(behind_centre(e, lower_x, lower_y));
    const std::uint32_t columns = quad_of(last_u, last_v) & ~(has_corner ? out : 0);

    const float inverse = exact::near_inverse(nw), by_u = exact::mul(-nu, inverse), by_v = exact::mul(-nv, inverse);
    const float above = exact::fma(-by_u, u[0],
                                   exact::fma(-by_v, w[0],
                                              is_x   ? v.d[0][0]
                                              : is_y ? v.d[1][0]
                                                     : v.d[2][0]));
    const float at_centre = exact::mul(above, power_of_two(-fraction));
    const float low = exact::fma(-0.5f, by_v, at_centre), high = exact::fma(0.5f, by_v, at_centre);
    const float at[4] = {exact::fma(-0.5f, by_u, low), exact::fma(0.5f, by_u, low), exact::fma(-0.5f, by_u, high),
                         exact::fma(0.5f, by_u, high)};
    std::uint32_t depths = 0;
    float furthest = 0; // distance of touched columns' depths from the middle between two integers
    for (int i = 0; i < 4; ++i) {
        float over = 0;
        const std::int32_t depth = exact::integer_below(at[i], over);
        depths |= (static_cast<std::uint32_t>(depth) & 3u) << 2 * i;
        const float off = exact::absolute(exact::sub(over, 0.5f));
        furthest = exact::max(furthest, (columns >> i & 1u) != 0 ? off : 0.0f);
    }
    sure = sure && exact::fma(limit, exact::absolute(inverse), exact::add(furthest, 0x1p-17f)) < 0.5f;
    return {is_x ? 0 : is_y ? 1 : 2, columns, depths ^ 0xaau}; // from below the centre to below the box: 2
}

} // namespace voxelpipe::core
