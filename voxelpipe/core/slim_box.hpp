// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a slim bounding box, of at most two voxels a side but possibly three along one axis, by the
// signs at its inner corners (corner_signs.hpp): the centre of 2 x 2 x 2 voxels and, if the box is three voxels long,
// the next corner along that axis. Values at the next corner follow from the same vertex differences, one voxel
// further.

#include <voxelpipe/core/corner_signs.hpp>

#include <cstdint>

namespace voxelpipe::core {

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr bool is_slim(const int (&last)[3]) {
    const int in_two = (last[0] & last[1]) | (last[1] & last[2]) | (last[2] & last[0]);
    return max3(last[0], last[1], last[2]) <= 2 && (in_two & 2) == 0;
}

// The covered voxels of a slim box, in rows along x of four bits each; row i starts at bit 4 i. Row numbers are y + 2
// z; if the box is long along y, z + 2 y.
struct slim_rows {
    std::uint32_t bits; // 0 if floats cannot decide
    bool along_y;
    static constexpr int count = 6;
};

// q: vertices in units of 2^-fraction voxel; lo: the box's lowest voxel; last: its highest, relative to lo. The box
// must be slim. fraction <= 20. Rounding errors are at most those in a box of three voxels a side (rule_out_by_signs).
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE slim_rows slim_rows_by_signs(const std::int32_t (&q)[3][3],
                                                                         const std::int32_t (&lo)[3],
                                                                         const int (&last)[3], int fraction) {
    // Permutes the axes: a is the long one and, unless that is x, c is x. Coverage is the same for a mirrored triangle.
    const bool along_x = last[0] == 2, along_y = last[1] == 2;
    float d[3][3]; // [axis][vertex], relative to the lowest inner corner
    int side[3];   // of the box, in voxels, minus one
    {
        const std::int32_t corner[3] = {(lo[0] + 1) << fraction, (lo[1] + 1) << fraction, (lo[2] + 1) << fraction};
        const auto a_of = [&](std::int32_t x, std::int32_t y, std::int32_t z) VOXELPIPE_INLINE_LAMBDA {
            return along_x ? x : along_y ? y : z;
        };
        const auto b_of = [&](std::int32_t y, std::int32_t z) VOXELPIPE_INLINE_LAMBDA { return along_y ? z : y; };
        const auto c_of = [&](std::int32_t x, std::int32_t z) VOXELPIPE_INLINE_LAMBDA { return along_x ? z : x; };
        for (int v = 0; v < 3; ++v) {
            const std::int32_t x = q[v][0] - corner[0], y = q[v][1] - corner[1], z = q[v][2] - corner[2];
            d[0][v] = small_to_float(a_of(x, y, z));
            d[1][v] = small_to_float(b_of(y, z));
            d[2][v] = small_to_float(c_of(x, z));
        }
        side[0] = a_of(last[0], last[1], last[2]);
        side[1] = b_of(last[1], last[2]);
        side[2] = c_of(last[0], last[2]);
    }
    const bool is_long = side[0] == 2, has_ab = (side[0] != 0) & (side[1] != 0),
               has_ca = (side[0] != 0) & (side[2] != 0), has_bc = (side[1] & side[2]) != 0,
               has_abc = has_ab & (side[2] != 0);
    const float one = power_of_two(fraction), limit = power_of_two(2 * fraction - 16),
                plane_limit = power_of_two(3 * fraction - 12);
    float least = 2 * limit, min_plane = 2 * plane_limit; // smallest magnitudes that a sign depends on
    // Voxels ruled out behind the first corner and behind the next one, a + 2 b + 4 c from each, in every byte.
    std::uint32_t first = 0, next = 0;
    const auto rule_out = [&](const corner_edges& e, bool wanted, std::uint32_t lower_of_first,
                              std::uint32_t lower_of_second) VOXELPIPE_INLINE_LAMBDA {
        least = min_magnitude(least, wanted ? e.smallest() : 2 * limit);
        first |= behind_centre(e, lower_of_first, lower_of_second) & (wanted ? ~0u : 0u);
    };
    // Edge values at the next corner are those at the first plus `step` times `along`.
    const auto rule_out_next = [&](const corner_edges& e, bool wanted, float step, const float(&along)[3],
                                   std::uint32_t lower_of_first,
                                   std::uint32_t lower_of_second) VOXELPIPE_INLINE_LAMBDA {
        float at[3];
        for (int v = 0; v < 3; ++v) at[v] = exact::fma(step, along[v], e.at_corner[v]);
        least = min_magnitude(least, wanted ? min_magnitude(at[0], min_magnitude(at[1], at[2])) : 2 * limit);
        next |= (sign_bytes(at[0], at[1], at[2]) ^ e.turned) & (e.lower_a() ^ ~lower_of_first) &
                (e.upper_b() ^ lower_of_second) & (wanted ? ~0u : 0u);
    };
    const corner_edges ab(d[0], d[1]), ca(d[2], d[0]), bc(d[1], d[2]);
    rule_out(bc, has_bc, lower_y, lower_z);
    next = first;
    rule_out(ab, has_ab, lower_x, lower_y);
    rule_out(ca, has_ca, lower_z, lower_x);
    rule_out_next(ab, has_ab & is_long, -one, ab.along_b, lower_x, lower_y);
    rule_out_next(ca, has_ca & is_long, one, ca.along_a, lower_z, lower_x);
    const auto rule_out_by_plane = [&](float at, bool wanted, std::uint32_t& out) VOXELPIPE_INLINE_LAMBDA {
        const std::uint32_t above =
            sign_word(at); // the plane is above the corner: then the voxel behind is the upper one
        min_plane = min_magnitude(min_plane, wanted ? at : 2 * plane_limit);
        out |= (bc.turned ^ above ^ lower_x) & (ca.turned ^ above ^ lower_y) & (ab.turned ^ above ^ lower_z) &
               (wanted ? 0xffu : 0u);
    };
    const float plane = exact::fma(bc.normal, d[0][0], exact::fma(ca.normal, d[1][0], exact::mul(ab.normal, d[2][0])));
    rule_out_by_plane(plane, has_abc, first);
    rule_out_by_plane(exact::fma(-one, bc.normal, plane), has_abc & is_long, next);
    const bool sure = least > limit && min_plane > plane_limit;

    // Both as a + 4 b + 8 c, each in 16 bits, then combined.
    std::uint32_t w = ((first | first >> 16) & 0xffffu) | ((next | next << 16) & 0xffff0000u);
    w = (w | w >> 8) & 0x00ff00ffu;
    w = (w & 0x000f000fu) | (w & 0x00f000f0u) << 4;
    w = (w & 0x03030303u) | (w & 0x0c0c0c0cu) << 2;
    const std::uint32_t along_a = (2u << side[0]) - 1, of_b = side[1] != 0 ? 0x11u : 1u,
                        of_c = side[2] != 0 ? 0x101u : 1u;
    const std::uint32_t cells = along_a * of_b * of_c & ~(w | w >> 15);
    // Rows along c: 8 a + 4 b + c.
    const std::uint32_t across =
        (cells & 0x2211u) | (cells & 0x1100u) >> 7 | (cells & 0x4422u) << 7 | (cells & 0x0044u) << 14;
    return {sure ? along_x ? cells : across : 0, along_y};
}

} // namespace voxelpipe::core
