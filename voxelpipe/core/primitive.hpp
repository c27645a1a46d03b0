// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Work on one triangle that all backends share, outside the raster itself: whether it is drawn and if not why, the
// tiles in which it has work, and the voxels of a tile.

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/tile_grid.hpp>

#include <cstdint>

namespace voxelpipe::core {

enum class triangle_class : std::uint8_t { drawn, nonfinite, too_far, zero_area, outside };

// nonfinite or too_far if a position is; drawn otherwise.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triangle_class classify_positions(const snapped_position& a,
                                                                              const snapped_position& b,
                                                                              const snapped_position& c) {
    if (is_drawable(a) && is_drawable(b) && is_drawable(c)) return triangle_class::drawn;
    const bool nonfinite = a.x == nonfinite_mark || b.x == nonfinite_mark || c.x == nonfinite_mark;
    return nonfinite ? triangle_class::nonfinite : triangle_class::too_far;
}

// Classifies a triangle: drawn, or why not. `reach` receives the voxels that it may touch, clipped to the grid.
template <coverage Rule>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE triangle_class classify(const snapped_position& a,
                                                                    const snapped_position& b,
                                                                    const snapped_position& c, int fraction,
                                                                    const voxel_box& whole, voxel_box& reach) {
    const triangle_class kind = classify_positions(a, b, c);
    if (kind != triangle_class::drawn) return kind;
    voxel_box box = bounds(a, b, c, fraction);
    if constexpr (Rule == coverage::thin) {
        // The depth at a touched column's centre is at most one voxel beyond the triangle's own depths.
        for (int i = 0; i < 3; ++i) {
            --box.lo[i];
            ++box.hi[i];
        }
    }
    reach = intersect(box, whole);
    return reach.empty() ? triangle_class::outside : triangle_class::drawn;
}

// Zero area after snapping; the vertices must be drawable.
[[nodiscard]] VOXELPIPE_HD inline bool has_zero_area(const snapped_position& a, const snapped_position& b,
                                                     const snapped_position& c) {
    const std::int64_t e1[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    const std::int64_t e2[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
    const auto equal = [&](int i, int j) {
        return static_cast<int128>(e1[i]) * e2[j] == static_cast<int128>(e1[j]) * e2[i];
    };
    return equal(1, 2) && equal(2, 0) && equal(0, 1);
}

// Converts a box of voxels to units of 2^log2_size voxels.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr voxel_box coarsen(const voxel_box& box, int log2_size) {
    voxel_box r{};
    for (int i = 0; i < 3; ++i) {
        r.lo[i] = box.lo[i] >> log2_size;
        r.hi[i] = box.hi[i] >> log2_size;
    }
    return r;
}

// Calls emit(tile) for each tile within `box` (tiles) in which the triangle has work: exactly the tiles whose closed
// box it meets (conservative), or the tiles that its plane passes within its columns (thin).
VOXELPIPE_ANY_CALLABLE
template <coverage Rule, class Emit>
VOXELPIPE_HD void for_each_tile_in(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                   int fraction, const voxel_box& box, const tile_grid& tiles, Emit&& emit) {
    // A tile is a voxel of a coarser grid, so the same exact coverage applies, 2^log2_size times larger.
    constexpr auto rule = Rule == coverage::thin ? span_rule::columns : span_rule::conservative;
    VOXELPIPE_CALLS_ANY
    rasterize<rule>(a, b, c, fraction + tiles.log2_size, box,
                    [&](const auto& t, std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                        for (std::int64_t w = w0; w <= w1; ++w) {
                            const auto p = to_xyz(t.axis, u, v, w);
                            emit(tiles.index(p[0], p[1], p[2]));
                        }
                    });
    VOXELPIPE_CALLS_ANY_END
}

// Calls emit(tile) for each tile of the triangle's `reach` (voxels) in which it has work. A triangle within one tile
// needs no test, nor does one whose bounding box is a line of tiles (is_line_of_voxels). Inlined, because most
// triangles lie in one tile.
VOXELPIPE_ANY_CALLABLE
template <coverage Rule, class Emit>
VOXELPIPE_HD VOXELPIPE_INLINE void for_each_tile(const snapped_position& a, const snapped_position& b,
                                                 const snapped_position& c, int fraction, const voxel_box& reach,
                                                 const tile_grid& tiles, Emit&& emit) {
    const voxel_box box = coarsen(reach, tiles.log2_size);
    if (box.lo[0] == box.hi[0] && box.lo[1] == box.hi[1] && box.lo[2] == box.hi[2]) {
        emit(tiles.index(box.lo[0], box.lo[1], box.lo[2]));
        return;
    }
    if constexpr (Rule == coverage::conservative) {
        if (is_line_of_voxels(bounds(a, b, c, fraction + tiles.log2_size))) {
            for (std::int64_t z = box.lo[2]; z <= box.hi[2]; ++z)
                for (std::int64_t y = box.lo[1]; y <= box.hi[1]; ++y)
                    for (std::int64_t x = box.lo[0]; x <= box.hi[0]; ++x) emit(tiles.index(x, y, z));
            return;
        }
    }
    for_each_tile_in<Rule>(a, b, c, fraction, box, tiles, emit);
}

// The voxels of a tile, clipped to the extent.
[[nodiscard]] VOXELPIPE_HD inline voxel_box tile_box(const tile_grid& tiles, std::uint64_t tile, glm::ivec3 extent) {
    const glm::ivec3 p = tiles.position(tile);
    voxel_box box{};
    for (int i = 0; i < 3; ++i) {
        const int lo = p[i] << tiles.log2_size;
        const int hi = lo + (1 << tiles.log2_size);
        box.lo[i] = lo;
        box.hi[i] = (hi < extent[i] ? hi : extent[i]) - 1;
    }
    return box;
}

// The dominant axis that setup_triangle would find, without the rest of the setup.
[[nodiscard]] VOXELPIPE_HD inline int dominant_axis(const snapped_position& a, const snapped_position& b,
                                                    const snapped_position& c, int fraction) {
    const auto pick = [&](auto zero) {
        using Int = decltype(zero);
        const Int e1x = b.x - a.x, e1y = b.y - a.y, e1z = b.z - a.z;
        const Int e2x = c.x - a.x, e2y = c.y - a.y, e2z = c.z - a.z;
        const Int mx = magnitude<Int>(e1y * e2z - e1z * e2y), my = magnitude<Int>(e1z * e2x - e1x * e2z),
                  mz = magnitude<Int>(e1x * e2y - e1y * e2x);
        if (mx == 0 && my == 0 && mz == 0) {
            const std::int64_t lx = max3(a.x, b.x, c.x) - min3(a.x, b.x, c.x);
            const std::int64_t ly = max3(a.y, b.y, c.y) - min3(a.y, b.y, c.y);
            const std::int64_t lz = max3(a.z, b.z, c.z) - min3(a.z, b.z, c.z);
            return lx >= ly && lx >= lz ? 0 : ly >= lz ? 1 : 2;
        }
        return mx >= my && mx >= mz ? 0 : my >= mz ? 1 : 2;
    };
    return fits_narrow(a, b, c, fraction) ? pick(std::int64_t{0}) : pick(int128{0});
}

} // namespace voxelpipe::core
