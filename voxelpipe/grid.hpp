// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The position of the voxels in space: extent, origin and voxel size are run-time values, and need be neither powers of
// two nor cubic. fit() makes a grid around positions; grid::crop() selects a part of a grid, whose result is the crop
// of the whole.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/status.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace voxelpipe {

// Voxel (i, j, k) is the closed box from origin + (i, j, k) * voxel_size to origin + (i + 1, j + 1, k + 1) *
// voxel_size.
struct grid {
    static constexpr int max_extent = 1 << core::max_log2_extent; // voxels per axis

    glm::dvec3 origin{0.0};     // world position of the whole grid's lowest corner
    glm::dvec3 voxel_size{1.0}; // world units, per axis, > 0
    glm::ivec3 extent{0};       // voxels to compute: the framebuffer's size
    glm::ivec3 offset{0};       // position of those voxels in the whole grid; 0 unless cropped
    glm::ivec3 whole{0};        // extent of the whole grid, which determines the snapping; 0: the same as `extent`
    bool corners = false;       // made by at_corners(): lies half a voxel below `origin`, snapped like that grid

    // The part [begin, begin + size) of this grid, for slabs on several devices or out-of-core runs. Its voxels,
    // fragments and shader inputs are exactly those of the whole grid; fragment::voxel remains an index of the whole
    // grid.
    [[nodiscard]] grid crop(glm::ivec3 begin, glm::ivec3 size) const {
        grid part = *this;
        part.whole = whole_extent();
        part.offset = offset + begin;
        part.extent = size;
        return part;
    }

    // The grid whose voxels have this one's corners as their centres: one voxel more an axis, half a voxel lower.
    // Positions snap as in this grid, so both see the same triangles. This one must not be such a grid itself.
    [[nodiscard]] grid at_corners() const {
        grid moved = *this;
        moved.whole = whole_extent() + 1;
        moved.extent = extent + 1;
        moved.corners = true;
        return moved;
    }

    // Voxels of the whole grid, which determine the snapping.
    [[nodiscard]] glm::ivec3 whole_extent() const { return whole == glm::ivec3(0) ? extent : whole; }

    // The grid that this one was cropped from, or this one. Its voxels are numbered like fragment::voxel.
    [[nodiscard]] grid uncropped() const {
        grid all = *this;
        all.extent = whole_extent();
        all.offset = glm::ivec3(0);
        return all;
    }

    // World position of the computed part's lowest corner.
    [[nodiscard]] glm::dvec3 part_origin() const { return origin + (glm::dvec3(offset) - half()) * voxel_size; }

    // Conversions between world and voxels. Voxels are numbered as in framebuffers and A-buffers, from the corner of
    // the computed part; for fragment::voxel in a crop, use those of uncropped().

    // World position of continuous voxel coordinates, in which voxel (i, j, k) is the box from (i, j, k) to (i + 1,
    // j + 1, k + 1).
    [[nodiscard]] VOXELPIPE_HD glm::dvec3 to_world(const glm::dvec3& p) const {
        const double h = half();
        return {exact::fma(offset.x + p.x - h, voxel_size.x, origin.x),
                exact::fma(offset.y + p.y - h, voxel_size.y, origin.y),
                exact::fma(offset.z + p.z - h, voxel_size.z, origin.z)};
    }
    // Continuous voxel coordinates of a world position: the inverse of to_world, up to rounding.
    [[nodiscard]] VOXELPIPE_HD glm::dvec3 to_voxels(const glm::dvec3& world) const {
        const double h = half();
        return {(world.x - origin.x) / voxel_size.x - offset.x + h, (world.y - origin.y) / voxel_size.y - offset.y + h,
                (world.z - origin.z) / voxel_size.z - offset.z + h};
    }
    // World position of a voxel's centre.
    [[nodiscard]] VOXELPIPE_HD glm::dvec3 voxel_center(const glm::ivec3& voxel) const {
        return to_world({voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5});
    }
    // The voxel that contains a world position; of two that share a face, the upper one. Outside the computed part the
    // result is an index that contains() refuses. Positions must be finite and within 2^31 voxels of the part's corner.
    [[nodiscard]] glm::ivec3 voxel_at(const glm::dvec3& world) const {
        const glm::dvec3 p = to_voxels(world);
        return {static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
                static_cast<int>(std::floor(p.z))};
    }
    // True if the computed part has this voxel.
    [[nodiscard]] VOXELPIPE_HD bool contains(const glm::ivec3& voxel) const {
        return voxel.x >= 0 && voxel.y >= 0 && voxel.z >= 0 && voxel.x < extent.x && voxel.y < extent.y &&
               voxel.z < extent.z;
    }

    // Voxels by which the whole grid lies below `origin`.
    [[nodiscard]] VOXELPIPE_HD double half() const { return corners ? 0.5 : 0.0; }
    // Fraction bits of snapped positions.
    [[nodiscard]] int fraction() const {
        const glm::ivec3 e = whole_extent();
        return core::fraction_bits(std::max({e.x, e.y, e.z}) - (corners ? 1 : 0));
    }

    friend bool operator==(const grid&, const grid&) = default;
};

// Checks everything about a grid that needs no mesh; see status_code.
[[nodiscard]] inline status validate(const grid& g) {
    const auto fail = [](status_code code) {
        status s;
        s.code = code;
        return s;
    };
    const glm::ivec3 whole = g.whole_extent();
    for (int a = 0; a < 3; ++a) {
        if (g.extent[a] <= 0 || whole[a] <= 0) return fail(status_code::bad_extent);
        if (whole[a] > grid::max_extent + (g.corners ? 1 : 0)) return fail(status_code::extent_too_large);
        if (g.offset[a] < 0 || g.offset[a] > whole[a] - g.extent[a]) return fail(status_code::bad_crop);
        if (!std::isfinite(g.origin[a])) return fail(status_code::bad_origin);
        if (!std::isfinite(g.voxel_size[a]) || !(g.voxel_size[a] > 0.0)) return fail(status_code::bad_voxel_size);
        // The scale is 2^F / voxel_size with F from 1 to 16: both extremes must be normal numbers.
        if (!std::isnormal(65536.0 / g.voxel_size[a]) || !std::isnormal(1.0 / g.voxel_size[a]))
            return fail(status_code::bad_voxel_size);
    }
    return {};
}

namespace core {

// g must be valid. The three numbers that determine a snapped position are rounded here, once.
[[nodiscard]] inline snap_transform make_snap_transform(const grid& g) {
    snap_transform t{};
    t.fraction = g.fraction();
    for (int a = 0; a < 3; ++a) {
        t.origin[a] = g.origin[a];
        t.scale[a] = static_cast<double>(std::int64_t{1} << t.fraction) / g.voxel_size[a];
        // Even, as rounding_shift wants it: F is 4 at least.
        t.offset[a] = (std::int64_t{g.offset[a]} << t.fraction) - (std::int64_t{g.corners} << (t.fraction - 1));
        t.shift[a] = exact::rounding_shift(t.offset[a]);
    }
    return t;
}

// Factors that turn normals of grid space into world normals: products of the other two voxel sizes, relative to the
// largest. Exactly 1 if voxels are cubes.
[[nodiscard]] inline triple<double> normal_factors(const grid& g) {
    const double m = std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z});
    const double x = g.voxel_size.x / m, y = g.voxel_size.y / m, z = g.voxel_size.z / m;
    return {{y * z, x * z, x * y}};
}

} // namespace core

// A box in world coordinates. Empty if a `low` is above its `high`, as by default.
struct bounding_box {
    glm::dvec3 low{std::numeric_limits<double>::infinity()};   // least coordinates, world units
    glm::dvec3 high{-std::numeric_limits<double>::infinity()}; // greatest coordinates, world units

    [[nodiscard]] bool empty() const { return !(low.x <= high.x && low.y <= high.y && low.z <= high.z); }
    friend bool operator==(const bounding_box&, const bounding_box&) = default;
};

// The bounding box of positions in host memory; those that are not finite are ignored.
[[nodiscard]] inline bounding_box bounds(array_view<const glm::vec3> positions) {
    bounding_box box;
    for (const glm::vec3& p : positions) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
        for (int a = 0; a < 3; ++a) {
            box.low[a] = std::min(box.low[a], double{p[a]});
            box.high[a] = std::max(box.high[a], double{p[a]});
        }
    }
    return box;
}

// A centred grid of `extent` cubic voxels around a box. Along the tightest axis the grid is (1 + 2 * margin) times the
// box. A box without size, or an empty one, gets unit voxels.
[[nodiscard]] inline grid fit(const bounding_box& box, glm::ivec3 extent, double margin = 1e-4) {
    const glm::dvec3 lo = box.empty() ? glm::dvec3(0.0) : box.low, hi = box.empty() ? glm::dvec3(0.0) : box.high;
    double size = 0.0;
    for (int a = 0; a < 3; ++a) {
        if (extent[a] <= 0) continue;
        const double side = (hi[a] - lo[a]) * exact::fma(2.0, margin, 1.0);
        size = std::max(size, side / extent[a]);
    }
    if (!(size > 0.0)) size = 1.0;
    grid g;
    g.extent = extent;
    g.voxel_size = glm::dvec3(size);
    for (int a = 0; a < 3; ++a) g.origin[a] = exact::fma(-0.5 * extent[a], size, 0.5 * (lo[a] + hi[a]));
    return g;
}

// A centred grid of n cubic voxels along the longest side of a box, and as few as hold the box along the others; with
// the margin of fit(). n < 1 gives a grid that calls refuse as bad_extent.
[[nodiscard]] inline grid fit_longest(const bounding_box& box, int n, double margin = 1e-4) {
    const glm::dvec3 side = box.empty() ? glm::dvec3(0.0) : (box.high - box.low) * exact::fma(2.0, margin, 1.0);
    const double longest = std::max({side.x, side.y, side.z});
    glm::ivec3 extent(n);
    for (int a = 0; a < 3 && longest > 0.0; ++a)
        if (side[a] < longest)
            extent[a] = std::clamp(static_cast<int>(std::ceil(side[a] / longest * n)), 1, std::max(n, 1));
    return fit(box, extent, margin);
}

// A grid of voxels of this size, in world units per axis, on the lattice of the size's multiples: the voxels that the
// box spans, at least one per axis. A side that snaps to a face of the lattice counts as lying in it, and a box that
// ends there gets only the voxel inside: a side from 0 to 0.6f is 6 voxels of 0.1. Conservative coverage of a surface
// in that face touches the next layer too; `padding` adds voxels at either end. A size that is not positive, or that
// needs more than grid::max_extent voxels, gives a grid that calls refuse.
[[nodiscard]] inline grid fit_voxel_size(const bounding_box& box, glm::dvec3 voxel_size, int padding = 0) {
    const auto fit_with = [&](double tolerance) {
        grid g;
        g.voxel_size = voxel_size;
        for (int a = 0; a < 3; ++a) {
            const double lo = box.empty() ? 0.0 : box.low[a], hi = box.empty() ? 0.0 : box.high[a];
            const double first = std::floor(lo / voxel_size[a] + tolerance);
            const double last = std::max(std::ceil(hi / voxel_size[a] - tolerance), first + 1.0);
            const double count = last - first + 2.0 * padding;
            g.origin[a] = (first - padding) * voxel_size[a];
            if (count >= 1.0) g.extent[a] = static_cast<int>(std::min(count, 2.0 * grid::max_extent));
        }
        return g;
    };
    const grid g = fit_with(0.0); // at most two voxels per axis too large, so its units are at most twice as large
    if (!validate(g).ok()) return g;
    const int bits = core::fraction_bits(std::max({g.extent.x, g.extent.y, g.extent.z}));
    return fit_with(0.25 / static_cast<double>(std::int64_t{1} << bits));
}
[[nodiscard]] inline grid fit_voxel_size(const bounding_box& box, double voxel_size, int padding = 0) {
    return fit_voxel_size(box, glm::dvec3(voxel_size), padding);
}

// The same around positions in host memory; those that are not finite are ignored.
[[nodiscard]] inline grid fit(array_view<const glm::vec3> positions, glm::ivec3 extent, double margin = 1e-4) {
    return fit(bounds(positions), extent, margin);
}

// Around positions in the memory of a backend, such as mesh::view().positions. Copies them to the host; use the box for
// several grids.
template <class Backend>
[[nodiscard]] bounding_box bounds(Backend& backend, backend_view<const glm::vec3> positions) {
    return bounds(backend.read(positions));
}

// Refuses positions in a backend's memory, which the host may not be able to read.
template <class T>
void bounds(backend_view<T>) {
    static_assert(core::never<T>, "voxelpipe: these positions may be in device memory: use bounds(backend, positions)");
}
template <class T>
grid fit(backend_view<T>, glm::ivec3, double = 0) {
    static_assert(core::never<T>,
                  "voxelpipe: these positions may be in device memory: use fit(bounds(backend, positions), extent)");
    return {};
}

} // namespace voxelpipe
