// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where the voxels lie in space: extent, origin and voxel size, all run-time values, no power of two, no cube.
// fit() makes a grid around positions; grid::crop() names a part of a grid whose result is the crop of the whole.

#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/status.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace voxelpipe {

// Voxel (i, j, k) is the closed box from origin + (i, j, k) * voxel_size to origin + (i + 1, j + 1, k + 1) *
// voxel_size.
struct grid {
    static constexpr int max_extent = 1 << core::max_log2_extent; // voxels an axis

    glm::dvec3 origin{0.0};     // world position of the whole grid's lowest corner
    glm::dvec3 voxel_size{1.0}; // world units, per axis, > 0
    glm::ivec3 extent{0};       // voxels to compute: the framebuffer's size
    glm::ivec3 offset{0};       // of those voxels in the whole grid; 0 unless cropped
    glm::ivec3 whole{0};        // extent of the whole grid, which sets the snapping; 0 = the same as `extent`

    // The part [begin, begin + size) of this grid. Its voxels, fragments and shader inputs are exactly those of the
    // whole grid there (fragment::voxel stays an index of the whole grid): slabs for several devices or out-of-core
    // runs.
    [[nodiscard]] grid crop(glm::ivec3 begin, glm::ivec3 size) const {
        grid part = *this;
        part.whole = whole_extent();
        part.offset = offset + begin;
        part.extent = size;
        return part;
    }

    [[nodiscard]] glm::ivec3 whole_extent() const { return whole == glm::ivec3(0) ? extent : whole; }

    // World position of the computed part's lowest corner.
    [[nodiscard]] glm::dvec3 part_origin() const { return origin + glm::dvec3(offset) * voxel_size; }

    friend bool operator==(const grid&, const grid&) = default;
};

// Checks everything about a grid that does not need a mesh; see status_code.
[[nodiscard]] inline status validate(const grid& g) {
    const auto fail = [](status_code code) {
        status s;
        s.code = code;
        return s;
    };
    const glm::ivec3 whole = g.whole_extent();
    for (int a = 0; a < 3; ++a) {
        if (g.extent[a] <= 0 || whole[a] <= 0 || g.offset[a] < 0) return fail(status_code::bad_extent);
        if (whole[a] > grid::max_extent) return fail(status_code::extent_too_large);
        if (g.offset[a] > whole[a] - g.extent[a]) return fail(status_code::bad_extent);
        if (!std::isfinite(g.origin[a])) return fail(status_code::bad_origin);
        if (!std::isfinite(g.voxel_size[a]) || !(g.voxel_size[a] > 0.0)) return fail(status_code::bad_voxel_size);
        // The scale is 2^F / voxel_size with F from 1 to 16: both ends must be ordinary numbers.
        if (!std::isnormal(65536.0 / g.voxel_size[a]) || !std::isnormal(1.0 / g.voxel_size[a]))
            return fail(status_code::bad_voxel_size);
    }
    return {};
}

namespace core {

// g is valid. The three numbers that decide a position's snapped place are rounded here, once.
[[nodiscard]] inline snap_transform make_snap_transform(const grid& g) {
    const glm::ivec3 whole = g.whole_extent();
    snap_transform t{};
    t.fraction = fraction_bits(std::max({whole.x, whole.y, whole.z}));
    for (int a = 0; a < 3; ++a) {
        t.origin[a] = g.origin[a];
        t.scale[a] = static_cast<double>(std::int64_t{1} << t.fraction) / g.voxel_size[a];
        t.offset[a] = std::int64_t{g.offset[a]} << t.fraction;
        t.shift[a] = exact::rounding_shift(t.offset[a]);
    }
    return t;
}

// Normals of grid space become world normals by these factors (the other two voxel sizes, relative to the largest).
// Exactly 1 where voxels are cubes.
[[nodiscard]] inline triple<double> normal_factors(const grid& g) {
    const double m = std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z});
    const double x = g.voxel_size.x / m, y = g.voxel_size.y / m, z = g.voxel_size.z / m;
    return {{y * z, x * z, x * y}};
}

} // namespace core

// A grid of cubic voxels, `extent` of them, around the finite ones of `positions`, centred. Along the tightest axis
// (1 + 2 * margin) times the bounding box fits exactly. A box without size gets unit voxels.
[[nodiscard]] inline grid fit(array_view<const glm::vec3> positions, glm::ivec3 extent, double margin = 1e-4) {
    glm::dvec3 lo(0.0), hi(0.0);
    bool any = false;
    for (const glm::vec3& p : positions) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
        for (int a = 0; a < 3; ++a) {
            lo[a] = any ? std::min(lo[a], double{p[a]}) : double{p[a]};
            hi[a] = any ? std::max(hi[a], double{p[a]}) : double{p[a]};
        }
        any = true;
    }
    double size = 0.0;
    for (int a = 0; a < 3; ++a) {
        if (extent[a] <= 0) continue;
        const double side = (hi[a] - lo[a]) * std::fma(2.0, margin, 1.0);
        size = std::max(size, side / extent[a]);
    }
    if (!(size > 0.0)) size = 1.0;
    grid g;
    g.extent = extent;
    g.voxel_size = glm::dvec3(size);
    for (int a = 0; a < 3; ++a) g.origin[a] = std::fma(-0.5 * extent[a], size, 0.5 * (lo[a] + hi[a]));
    return g;
}

} // namespace voxelpipe
