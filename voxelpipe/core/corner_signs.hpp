// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Conservative coverage of a bounding box of at most two or three voxels a side, by the signs of a few single-precision
// numbers, with a flag that is false if rounding may have changed one: then small_triangle.hpp decides.
//
// Among the axes that separate a voxel from a triangle (coverage.hpp), the edges and the plane rule a voxel out by
// their value at one of its corners, the one furthest inside. In a bounding box that the triangle touches on all sides,
// only inner corners of the box can do that. For a corner on the box's border, an edge would put the whole triangle
// beyond a plane between the box's voxels, so that the triangle would not touch a side. For the plane, a projection
// rules the voxel out as well: with n >= 0 and the box's end at x, n . (x, y, z) < n . p and p.x <= x for all points p
// of the triangle imply n.y p.y + n.z p.z > n.y y + n.z z, which separates the two in the yz projection, where edges
// and box are enough. A box of 2 x 2 x 2 voxels has one inner corner, the centre. An edge rules out the column behind
// the centre, against its inward normal, if the centre lies outside of it; the plane rules out the voxel behind the
// centre. With vertices d relative to the centre, all nine edges at the centre are components of d_i x d_j, their sum
// is the normal n, and n . d_0 is the plane. A projection along which the box is one voxel wide is decided by the box
// alone.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/small_triangle.hpp>

#include <cstdint>

namespace voxelpipe::core {

// 2^e as a float, -126 <= e <= 127.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float power_of_two(int e) {
    return core::bit_cast<float>(static_cast<std::uint32_t>(127 + e) << 23);
}
// A byte of ones for each negative number, from the lowest byte up; the fourth byte repeats the first.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t sign_bytes(float a, float b, float c) {
    const std::uint32_t u = core::bit_cast<std::uint32_t>(a), v = core::bit_cast<std::uint32_t>(b),
                        w = core::bit_cast<std::uint32_t>(c);
#if defined(__CUDA_ARCH__)
    std::uint32_t two, three; // 8 + k selects the sign of byte k
    asm("prmt.b32 %0, %1, %2, 0x00fb;" : "=r"(two) : "r"(u), "r"(v));
    asm("prmt.b32 %0, %1, %2, 0x0f10;" : "=r"(three) : "r"(two), "r"(w));
    return three;
#else
    return (u >> 31) * 0xff0000ffu | (v >> 31) * 0xff00u | (w >> 31) * 0xff0000u;
#endif
}
// All ones if the number is negative.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t sign_word(float a) {
    return static_cast<std::uint32_t>(core::bit_cast<std::int32_t>(a) >> 31);
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float min_magnitude(float a, float b) {
#if defined(__CUDA_ARCH__)
    return fminf(fabsf(a), fabsf(b));
#else
    const float x = a < 0 ? -a : a, y = b < 0 ? -b : b;
    return x < y ? x : y;
#endif
}

// Vertices relative to one corner, in units of 2^-fraction voxel, as floats.
struct corner_vertices {
    float d[3][3]; // [axis][vertex]

    VOXELPIPE_HD VOXELPIPE_INLINE corner_vertices(const std::int32_t (&q)[3][3], const std::int32_t (&corner)[3]) {
        for (int k = 0; k < 3; ++k)
            for (int v = 0; v < 3; ++v) d[k][v] = small_to_float(q[v][k] - corner[k]);
    }
};

// The three edges of one projection, on axes a and b, relative to the corner.
struct corner_edges {
    float along_a[3], along_b[3]; // edge vectors
    float at_corner[3];           // edge values
    float normal;
    std::uint32_t
        turned; // all ones if the normal is negative: then edges run the other way round, and inside is negative

    VOXELPIPE_HD VOXELPIPE_INLINE corner_edges(const float (&a)[3], const float (&b)[3]) {
        for (int v = 0; v < 3; ++v) {
            const int w = v == 2 ? 0 : v + 1;
            along_a[v] = exact::sub(a[w], a[v]);
            along_b[v] = exact::sub(b[w], b[v]);
            at_corner[v] = exact::fma(a[v], b[w], -exact::mul(b[v], a[w]));
        }
        normal = exact::add(exact::add(at_corner[0], at_corner[1]), at_corner[2]);
        turned = sign_word(normal);
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float smallest() const {
        return min_magnitude(min_magnitude(at_corner[0], at_corner[1]), min_magnitude(at_corner[2], normal));
    }
    // Bytes of ones, one per edge: outside(): the corner lies outside the edge; lower_a(): the cell behind it is the
    // lower one along a; upper_b(): the upper one along b. Inside is to the left: an edge along -b has it at +a, so the
    // cell behind is the lower one.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t outside() const {
        return sign_bytes(at_corner[0], at_corner[1], at_corner[2]) ^ turned;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t lower_a() const {
        return sign_bytes(along_b[0], along_b[1], along_b[2]) ^ turned;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t upper_b() const {
        return sign_bytes(along_a[0], along_a[1], along_a[2]) ^ turned;
    }
};

struct sure_bits {
    std::uint32_t bits;
    bool sure; // otherwise `bits` is meaningless
};

// ---- boxes of 2 x 2 x 2 ---------------------------------------------------------------------------------------------

// In a box of 2 x 2 x 2 voxels x + 2 y + 4 z, those that are lower along each axis, in every byte.
inline constexpr std::uint32_t lower_x = 0x55555555u, lower_y = 0x33333333u, lower_z = 0x0f0f0f0fu;

// All voxels x + 2 y + 4 z of a box with `last` + 1 voxels a side.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t cube_of(const int (&last)[3]) {
    return (last[0] != 0 ? 0xffu : 0x55u) & (last[1] != 0 ? 0xffu : 0x33u) & (last[2] != 0 ? 0xffu : 0x0fu);
}
// The columns that edges rule out. lower_of_a, lower_of_b: the lower voxels along a and b.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t behind_centre(const corner_edges& e, std::uint32_t lower_of_a,
                                                                        std::uint32_t lower_of_b) {
    return e.outside() & (e.lower_a() ^ ~lower_of_a) & (e.upper_b() ^ lower_of_b);
}
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t fold_bytes(std::uint32_t bytes) {
    bytes |= bytes >> 16;
    return (bytes | bytes >> 8) & 0xffu;
}

// Covered voxels x + 2 y + 4 z of a bounding box of at most 2 x 2 x 2 voxels. q: vertices in units of 2^-fraction
// voxel; lo: the box's lowest voxel; last: its highest, relative to lo, 0 or 1 each. fraction <= 20.
// Rounding: |d| <= 2^F, so products, and with them the signs of d_i x d_j, are off by at most 2^(2F - 25). The normal
// is the sum of three such terms up to 2^(2F + 2) and off by less than 2^(2F - 20); n . d_0 by less than 2^(3F - 18).
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE sure_bits cube_bits_by_signs(const std::int32_t (&q)[3][3],
                                                                         const std::int32_t (&lo)[3],
                                                                         const int (&last)[3], int fraction) {
    const std::int32_t centre[3] = {(lo[0] + 1) << fraction, (lo[1] + 1) << fraction, (lo[2] + 1) << fraction};
    const corner_vertices v(q, centre);
    const corner_edges xy(v.d[0], v.d[1]), yz(v.d[1], v.d[2]), zx(v.d[2], v.d[0]);
    const float limit = power_of_two(2 * fraction - 19);
    bool sure = true;
    std::uint32_t out = 0;
    const auto rule_out = [&](const corner_edges& e, int a, int b, std::uint32_t lower_of_a, std::uint32_t lower_of_b)
                              VOXELPIPE_INLINE_LAMBDA {
                                  const bool wanted = (last[a] & last[b]) != 0;
                                  sure = sure && (!wanted || e.smallest() > limit);
                                  out |= wanted ? behind_centre(e, lower_of_a, lower_of_b) : 0;
                              };
    rule_out(xy, 0, 1, lower_x, lower_y);
    rule_out(yz, 1, 2, lower_y, lower_z);
    rule_out(zx, 2, 0, lower_z, lower_x);
    const float plane =
        exact::fma(yz.normal, v.d[0][0], exact::fma(zx.normal, v.d[1][0], exact::mul(xy.normal, v.d[2][0])));
    const bool wanted = (last[0] & last[1] & last[2]) != 0;
    sure = sure && (!wanted || min_magnitude(plane, plane) > power_of_two(3 * fraction - 17));
    const std::uint32_t above =
        sign_word(plane); // the plane is above the centre: then the voxel behind is the upper one
    out |= (yz.turned ^ above ^ lower_x) & (zx.turned ^ above ^ lower_y) & (xy.turned ^ above ^ lower_z) &
           (wanted ? 0xffu : 0u);
    return {cube_of(last) & ~fold_bytes(out), sure};
}

// Covered voxels of a box that is one voxel wide along at least one axis: one projection decides them.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE sure_bits quad_bits_by_signs(const std::int32_t (&q)[3][3],
                                                                         const std::int32_t (&lo)[3],
                                                                         const int (&last)[3], int fraction) {
    const bool in_yz = last[0] == 0, in_zx = !in_yz && last[1] == 0;
    const auto a_of = [&](std::int32_t x, std::int32_t y, std::int32_t z) VOXELPIPE_INLINE_LAMBDA {
        return in_yz ? y : in_zx ? z : x;
    };
    const auto b_of = [&](std::int32_t x, std::int32_t y, std::int32_t z) VOXELPIPE_INLINE_LAMBDA {
        return in_yz ? z : in_zx ? x : y;
    };
    const std::int32_t centre_a = (a_of(lo[0], lo[1], lo[2]) + 1) << fraction,
                       centre_b = (b_of(lo[0], lo[1], lo[2]) + 1) << fraction;
    float a[3], b[3];
    for (int v = 0; v < 3; ++v) {
        a[v] = small_to_float(a_of(q[v][0], q[v][1], q[v][2]) - centre_a);
        b[v] = small_to_float(b_of(q[v][0], q[v][1], q[v][2]) - centre_b);
    }
    const corner_edges e(a, b);
    const std::uint32_t lower_of_a = in_yz   ? lower_y
                                     : in_zx ? lower_z
                                             : lower_x,
                        lower_of_b = in_yz   ? lower_z
                                     : in_zx ? lower_x
                                             : lower_y;
    return {cube_of(last) & ~fold_bytes(behind_centre(e, lower_of_a, lower_of_b)),
            e.smallest() > power_of_two(2 * fraction - 19)};
}

// ---- boxes of 3 x 3 x 3 ---------------------------------------------------------------------------------------------

// Parts of a box of 3 x 3 x 3 that are ruled out: cells of two axes, numbered with factors 1 and 3 (in the order of
// their names: the first axis has factor 1, but z of zx has 3), and voxels x + 3 y + 9 z.
struct ruled_out {
    std::uint32_t xy, yz, zx, plane;
    bool sure; // otherwise the others are meaningless
};

// The cells that edges rule out by the inner corners (1, 1), (2, 1), (1, 2) and (2, 2); e is relative to the first.
// Axis a has factor 1 and b has 3, or the reverse if Swapped. `least`: the smallest magnitude that a sign depends on.
template <bool Swapped>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t behind_four(const corner_edges& e, float one, float& least) {
    float next_a[3], next_b[3], next_both[3];
    least = e.smallest();
    for (int v = 0; v < 3; ++v) {
        next_a[v] = exact::fma(-one, e.along_b[v], e.at_corner[v]);
        next_b[v] = exact::fma(one, e.along_a[v], e.at_corner[v]);
        next_both[v] = exact::fma(one, e.along_a[v], next_a[v]);
        least = min_magnitude(least, min_magnitude(next_a[v], min_magnitude(next_b[v], next_both[v])));
    }
    // Bits of a byte for each edge: the corners, at the position of the lower cell behind them. If the upper cell is
    // behind, the bit moves by 1 within the byte for the axis `near`, and by 3 after the bytes are combined for the
    // axis `far`.
    constexpr std::uint32_t bit_a = Swapped ? 0x08080808u : 0x02020202u, bit_b = Swapped ? 0x02020202u : 0x08080808u;
    const std::uint32_t corners = (e.outside() & 0x01010101u) |
                                  ((sign_bytes(next_a[0], next_a[1], next_a[2]) ^ e.turned) & bit_a) |
                                  ((sign_bytes(next_b[0], next_b[1], next_b[2]) ^ e.turned) & bit_b) |
                                  ((sign_bytes(next_both[0], next_both[1], next_both[2]) ^ e.turned) & 0x10101010u);
    const std::uint32_t upper_a = ~e.lower_a(), upper_b = e.upper_b();
    const std::uint32_t upper_near = Swapped ? upper_b : upper_a, upper_far = Swapped ? upper_a : upper_b;
    const std::uint32_t moved = (corners & ~upper_near) | (corners << 1 & upper_near);
    return fold_bytes(moved & ~upper_far) | fold_bytes(moved & upper_far) << 3;
}

// q: vertices in units of 2^-fraction voxel; lo: the box's lowest voxel; last: its highest, relative to lo, 0 to 2
// each. fraction <= 20. A corner on the border of a smaller box rules out, up to rounding, only what is ruled out
// anyway.
// Rounding: |d| <= 2^(F + 1), so edges at corners are up to 2^(2F + 4) and off by less than 2^(2F - 19); the normal is
// up to 2^(2F + 4) and off by less than 2^(2F - 18); the plane is up to 2^(3F + 7) and off by less than 2^(3F - 14).
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE ruled_out rule_out_by_signs(const std::int32_t (&q)[3][3],
                                                                        const std::int32_t (&lo)[3],
                                                                        const int (&last)[3], int fraction) {
    const std::int32_t corner[3] = {(lo[0] + 1) << fraction, (lo[1] + 1) << fraction, (lo[2] + 1) << fraction};
    const corner_vertices v(q, corner);
    const corner_edges xy(v.d[0], v.d[1]), yz(v.d[1], v.d[2]), zx(v.d[2], v.d[0]);
    const float one = power_of_two(fraction), limit = power_of_two(2 * fraction - 16);
    ruled_out out{};
    out.sure = true;
    const auto wanted = [&](int a, int b, float least, std::uint32_t cells) VOXELPIPE_INLINE_LAMBDA {
        const bool has_corners = last[a] != 0 && last[b] != 0;
        out.sure = out.sure && (!has_corners || least > limit);
        return has_corners ? cells : 0;
    };
    float least;
    std::uint32_t cells = behind_four<false>(xy, one, least);
    out.xy = wanted(0, 1, least, cells);
    cells = behind_four<false>(yz, one, least);
    out.yz = wanted(1, 2, least, cells);
    cells = behind_four<true>(zx, one, least);
    out.zx = wanted(2, 0, least, cells);

    // The plane at the eight inner corners; positive if they are below it.
    float at[8]; // x + 2 y + 4 z
    at[0] = exact::fma(yz.normal, v.d[0][0], exact::fma(zx.normal, v.d[1][0], exact::mul(xy.normal, v.d[2][0])));
    at[1] = exact::fma(-one, yz.normal, at[0]);
    for (int i = 0; i < 2; ++i) at[2 + i] = exact::fma(-one, zx.normal, at[i]);
    for (int i = 0; i < 4; ++i) at[4 + i] = exact::fma(-one, xy.normal, at[i]);
    float min_plane = at[0];
    std::uint32_t above = 0; // corners above the plane
    for (int i = 0; i < 8; ++i) {
        min_plane = min_magnitude(min_plane, at[i]);
        above |= sign_word(at[i]) & (1u << (i % 2 + i / 2 % 2 * 3 + i / 4 * 9));
    }
    constexpr std::uint32_t corners = 033033;
    static_assert(corners == (1u | 2u | 8u | 16u) * 513u);
    // The voxel behind a corner that is below the plane is the lower one along an axis with a positive normal
    // component.
    const std::uint32_t behind = (yz.turned & 1u) + (zx.turned & 3u) + (xy.turned & 9u);
    const bool has_corners = last[0] != 0 && last[1] != 0 && last[2] != 0;
    out.sure = out.sure && (!has_corners || min_plane > power_of_two(3 * fraction - 12));
    out.plane = has_corners ? (corners & ~above) << behind | above << (13 - behind) : 0;
    return out;
}

// Visits the rows of the box that are not ruled out, one by one.
class row_walk_3 {
public:
    row_walk_3() = default; // no rows
    VOXELPIPE_HD VOXELPIPE_INLINE row_walk_3(const ruled_out& out, const small_box& box)
        : along_((2u << box.hi[0]) - (1u << box.lo[0])), first_(box.lo[0]), xy_(out.xy), zx_(out.zx),
          plane_(out.plane) {
        const std::uint32_t rows = (2u << box.hi[1]) - (1u << box.lo[1]); // y + 3 z
        left_ = (box.lo[2] == 0 ? rows : 0) | (box.lo[2] <= 1 && box.hi[2] >= 1 ? rows << 3 : 0) |
                (box.hi[2] == 2 ? rows << 6 : 0);
        left_ &= ~out.yz;
    }
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE bool is_done() const { return left_ == 0; }
    // Calls emit(y, z, bits) for the next row unless it is empty; bit 0 is box.lo[0].
    template <class Emit>
    VOXELPIPE_HD VOXELPIPE_INLINE void next(Emit&& emit) {
        const int at = exact::lowest_one(left_), z = at * 11 >> 5, y = at - 3 * z; // a third, exact below 11
        left_ &= left_ - 1;
        const std::uint32_t bits = along_ & ~(xy_ >> 3 * y | zx_ >> 3 * z | plane_ >> 3 * at) & 7u;
        if (bits != 0) emit(y, z, bits >> first_);
    }

private:
    std::uint32_t left_ = 0, along_ = 0;
    int first_ = 0;
    std::uint32_t xy_ = 0, zx_ = 0, plane_ = 0;
};

// Calls emit(y, z, bits) for the rows of the box that are not empty; bit 0 is box.lo[0].
template <class Emit>
VOXELPIPE_HD VOXELPIPE_INLINE void rows_of_three(const ruled_out& out, const small_box& box, Emit&& emit) {
    for (row_walk_3 rows(out, box); !rows.is_done();) rows.next(emit);
}

} // namespace voxelpipe::core
