// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The common part of shading a triangle's fragments in a tile, computed once and kept in shared memory: weights
// are linear functions of the column, in integers, and a quotient is a product with a reciprocal, corrected to the bits
// of the division that core/interpolate.hpp defines.

#include <voxelpipe/device/scene/fragment_shade.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Has the members that fragment_source and core::unit_normal read of a triangle's frame.
struct tile_setup {
    std::int64_t at_origin[2];         // numerators of weights 1 and 2 at the tile's first column
    core::triple<std::int64_t> normal; // uvw order
    double inverse;                    // of the denominator, 2 * normal[2]
    std::int32_t by_u[2], by_v[2];     // the numerators' steps from column to column, divided by 2^(fraction + 1)
    glm::uvec3 index;
    std::int8_t axis, fraction;
    bool zero_area;

    // Frame: small_frame or triangle_frame<int64>; du, dv: the tile's first column in the frame's voxels.
    template <class Frame>
    __device__ VOXELPIPE_INLINE void set(const Frame& t, const glm::uvec3& index_, std::int64_t du, std::int64_t dv) {
        normal = t.normal;
        index = index_;
        axis = static_cast<std::int8_t>(t.axis);
        fraction = static_cast<std::int8_t>(t.fraction);
        zero_area = t.zero_area;
        inverse = zero_area ? 0 : exact::div(1.0, exact::to_double(2 * normal[2]));
        for (int k = 0; k < 2; ++k) {
            const auto &p = t.p[k == 0 ? 2 : 0], &q = t.p[k];
            const std::int64_t a = static_cast<std::int64_t>(p[1]) - q[1], b = static_cast<std::int64_t>(q[0]) - p[0];
            by_u[k] = static_cast<std::int32_t>(a);
            by_v[k] = static_cast<std::int32_t>(b);
            at_origin[k] = a * ((2 * du + 1) * (std::int64_t{1} << t.fraction) - 2 * static_cast<std::int64_t>(p[0])) +
                           b * ((2 * dv + 1) * (std::int64_t{1} << t.fraction) - 2 * static_cast<std::int64_t>(p[1]));
        }
    }

    // At column (u, v) of the tile.
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::vec3 barycentric(int u, int v) const {
        if (zero_area) return glm::vec3(1.0f / 3.0f);
        const double area = exact::to_double(2 * normal[2]);
        std::int64_t n[2];
        for (int k = 0; k < 2; ++k)
            n[k] = at_origin[k] + (static_cast<std::int64_t>(by_u[k]) * u + static_cast<std::int64_t>(by_v[k]) * v) *
                                      (std::int64_t{2} << fraction);
        const auto weight = [&](std::int64_t numerator) VOXELPIPE_INLINE_LAMBDA {
            const double x = exact::to_double(numerator);
            double quotient = exact::mul(x, inverse); // within two units in the last place
            for (int i = 0; i < 2; ++i) // the first step leaves one unit, the second none (Markstein 1990)
                quotient = exact::fma(exact::fma(-area, quotient, x), inverse, quotient);
            return exact::to_float(quotient);
        };
        return {weight(2 * normal[2] - n[0] - n[1]), weight(n[0]), weight(n[1])};
    }
};

// The shader's output for a fragment of primitive `id` at voxel (x, y, z); (i, j, k): the same within the tile.
template <class Scene>
__device__ VOXELPIPE_INLINE auto shade_in_tile(const Scene& s, const tile_setup& t, std::uint32_t id, int i, int j,
                                               int k, int x, int y, int z) {
    loaded_triangle tri; // positions are not set
    tri.draw = s.geo.find_draw(id);
    const draw_geometry& d = s.geo.draw(tri.draw);
    const auto at = d.triangles.find(id - d.first_primitive);
    tri.triangle = at.triangle;
    tri.instance = at.instance;
    tri.index = t.index;
    const auto p = core::to_uvw(static_cast<int>(t.axis), i, j, k);
    fragment_source<Scene> source(s, tri, id);
    source.begin_triangle(t);
    source.begin_column(t.barycentric(p[0], p[1]));
    return source.shade(x, y, z);
}

} // namespace voxelpipe::device
