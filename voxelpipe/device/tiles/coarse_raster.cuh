// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coarse raster: triangles -> (tile, primitive) pairs, by ascending primitive. Counts triangles, and the reasons why
// others are dropped (paper section 4, coarse raster). A tile is a voxel of a coarser grid, so the same exact coverage
// decides.

#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/int128_coverage.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

namespace voxelpipe::device {

template <coverage Rule>
struct tile_cells {
    static constexpr coverage rule = Rule;
    static constexpr std::int64_t small_columns = tuning::small_tile_columns;
    static constexpr bool knows_lines = Rule == coverage::conservative; // a thin triangle leaves tiles out
    core::tile_grid tiles;
    std::uint32_t* keys;       // tile numbers
    std::uint32_t* primitives; // as long as keys
    bool counts_triangles = true;

    [[nodiscard]] __device__ core::voxel_box cells(const core::voxel_box& reach) const {
        return core::coarsen(reach, tiles.log2_size);
    }
    // True if the triangle's bounding box is one tile wide along two axes, so that it meets all tiles of the box, and
    // if 32 bits tell. Then `box` is the part within the grid, not empty. Most triangles of a fine mesh are such.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool find_line(const geometry& geo, std::uint32_t primitive,
                                                             core::voxel_box& box) const {
        if (geo.arms != core::arm_set::none) return false; // they leave tiles out
        const draw_geometry& d = geo.draw(geo.find_draw(primitive));
        const glm::uvec3 index = d.triangles[primitive - d.first_primitive];
        if (index.x >= d.num_vertices || index.y >= d.num_vertices || index.z >= d.num_vertices) return false;
        const int32_triangle t = load_int32(raster_input<stored_source>{{d}, 0, geo.snap.fraction, geo.extent}, index);
        if (!t.fits_int32 || t.is_outside<Rule>(geo.extent)) return false;
        std::int64_t longest = 0, others = 0;
        for (int k = 0; k < 3; ++k) {
            const std::int32_t last = (k == 0 ? geo.extent.x : k == 1 ? geo.extent.y : geo.extent.z) - 1;
            const std::int32_t length = (t.hi[k] >> tiles.log2_size) - (t.lo[k] >> tiles.log2_size);
            others += length < longest ? length : longest;
            longest = length < longest ? longest : length;
            box.lo[k] = (t.lo[k] < 0 ? 0 : t.lo[k]) >> tiles.log2_size;
            box.hi[k] = (t.hi[k] < last ? t.hi[k] : last) >> tiles.log2_size;
        }
        return others == 0 && longest < small_columns;
    }
    __device__ VOXELPIPE_INLINE void emit_line(std::uint32_t primitive, const core::voxel_box& box,
                                               unsigned long long at) const {
        for (std::int64_t z = box.lo[2]; z <= box.hi[2]; ++z)
            for (std::int64_t y = box.lo[1]; y <= box.hi[1]; ++y)
                for (std::int64_t x = box.lo[0]; x <= box.hi[0]; ++x, ++at) {
                    keys[at] = static_cast<std::uint32_t>(tiles.index(x, y, z));
                    primitives[at] = primitive;
                }
    }
    [[nodiscard]] __device__ cell_counts count(const geometry& geo, const loaded_triangle& t, std::uint32_t primitive,
                                               const core::voxel_box& box, bool whole) const {
        return {walk(geo.snap.fraction + tiles.log2_size, t, primitive, box, whole, nothing), 0};
    }
    __device__ void emit(const geometry& geo, const loaded_triangle& t, std::uint32_t primitive,
                         const core::voxel_box& box, bool whole, unsigned long long at) const {
        (void)walk(geo.snap.fraction + tiles.log2_size, t, primitive, box, whole, at);
    }

private:
    static constexpr unsigned long long nothing = ~0ull;

    // Visits the triangle's tiles within the box and returns their number. Stores them from `at` on, unless `at` is
    // `nothing`. Out of line and shared by all kernels of the coarse raster: it is most of their code.
    __device__ __noinline__ std::uint32_t walk(int fraction, const loaded_triangle& t, std::uint32_t primitive,
                                               const core::voxel_box& box, bool whole, unsigned long long at) const {
        constexpr auto cells_rule = Rule == coverage::thin ? core::span_rule::columns : core::span_rule::conservative;
        std::uint32_t n = 0;
        const auto visit = [&](std::uint64_t tile) {
            if (at != nothing) {
                keys[at + n] = static_cast<std::uint32_t>(tile);
                primitives[at + n] = primitive;
            }
            ++n;
        };
        const auto column = [&](int axis, std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
            for (std::int64_t w = w0; w <= w1; ++w) {
                const auto p = core::to_xyz(axis, u, v, w);
                visit(tiles.index(p[0], p[1], p[2]));
            }
        };
        // A triangle within one tile needs no test; a chunk of a larger one does.
        if (whole && box.lo[0] == box.hi[0] && box.lo[1] == box.hi[1] && box.lo[2] == box.hi[2]) {
            visit(tiles.index(box.lo[0], box.lo[1], box.lo[2]));
        } else if (core::fits_narrow(t.a, t.b, t.c, fraction)) {
            const auto setup = core::setup_triangle<cells_rule, std::int64_t>(t.a, t.b, t.c, fraction);
            core::for_each_span<cells_rule>(setup, box,
                                            [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                                                column(setup.axis, u, v, w0, w1);
                                            });
        } else {
            const int axis = core::dominant_axis(t.a, t.b, t.c, fraction);
            for_each_wide_span<cells_rule>(t.a, t.b, t.c, fraction, box,
                                           [&](const wide_span& s) { column(axis, s.u, s.v, s.w_first, s.w_last); });
        }
        return n;
    }
};

} // namespace voxelpipe::device
