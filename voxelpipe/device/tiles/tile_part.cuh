// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle's part of a tile: how the fine raster covers it, and what its fragments have in common.

#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/tiles/tile_setup.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <cstdint>

namespace voxelpipe::device {

// --------------------------------------------------------------------------------------

// How a block covers it: a thread or group_lanes lanes put its fragments in a queue, or it is divided into units.
enum class part_cover : std::uint8_t { by_thread, by_lanes, by_units };

// A triangle's bounding box, and its part within a tile of 2^Log2Size voxels a side. 32 bits decide relative to the box
// if that is small, otherwise relative to the tile.
template <coverage Rule, int Log2Size>
struct tile_part {
    raster_input<stored_source> in;
    glm::uvec3 index;
    int32_triangle t;
    core::small_box box; // the part, relative to `origin`
    std::int32_t origin[3];
    bool is_small;
    part_cover cover;

    __device__ VOXELPIPE_INLINE tile_part(const geometry& geo, const core::voxel_box& tile, std::uint32_t id)
        : in{{geo.draw(geo.find_draw(id))}, 0, geo.snap.fraction, geo.extent} {
        const draw_geometry& d = in.source.geometry;
        index = d.triangles[id - d.first_primitive];
        t = load_int32(in, index);
        is_small = t.fits_int32 && t.longest_side() <= core::small_voxels(in.fraction);
        bool in_bricks = false;
        if constexpr (Rule == coverage::conservative && Log2Size <= core::log2_raster_brick)
            in_bricks = t.fits_int32 && core::fits_narrow(corner(t, 0), corner(t, 1), corner(t, 2), in.fraction);
        if (geo.arms != core::arm_set::none || !(is_small || in_bricks)) {
            cover = part_cover::by_units;
            return;
        }
        int cells = 1;
        for (int k = 0; k < 3; ++k) {
            origin[k] = is_small ? t.lo[k] : static_cast<std::int32_t>(tile.lo[k]);
            box.lo[k] = core::max3(t.lo[k], static_cast<std::int32_t>(tile.lo[k]), 0) - origin[k];
            const auto last = static_cast<std::int32_t>(tile.hi[k]);
            box.hi[k] = (t.hi[k] < last ? t.hi[k] : last) - origin[k];
            cells *= box.hi[k] - box.lo[k] + 1;
        }
        // A thread's wide rows end where floats say, which takes relative coordinates.
        const bool is_quick = cells <= tuning::max_queue_cells && (is_small || box.hi[0] - box.lo[0] < 8);
        cover = is_quick                         ? part_cover::by_thread
                : Rule == coverage::conservative ? part_cover::by_lanes
                                                 : part_cover::by_units;
    }

    // Words of rows or columns, of one thread.
    template <int Size>
    struct kept_in_thread {
        word words[Size];
        __device__ VOXELPIPE_INLINE void set(int i, word w) { words[i] = w; }
        [[nodiscard]] __device__ VOXELPIPE_INLINE word get(int i) const { return words[i]; }
    };

    // Conservative coverage, relative to `origin`.
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::small_conservative coverage_of_box() const {
        return is_small ? core::small_conservative(t.relative(in.fraction), in.fraction)
                        : coverage_of_brick(t, {origin[0], origin[1], origin[2]}, in.fraction);
    }

    // For shading its fragments.
    __device__ VOXELPIPE_INLINE void set_up(const core::voxel_box& tile, tile_setup& setup) const {
        if (is_small) {
            const core::small_frame frame(t.relative(in.fraction), in.fraction);
            const auto first =
                core::to_uvw(frame.axis, tile.lo[0] - t.lo[0], tile.lo[1] - t.lo[1], tile.lo[2] - t.lo[2]);
            setup.set(frame, index, first[0], first[1]);
        } else {
            set_up_large(t, index, tile, in.fraction, setup);
        }
    }

    // Calls row(x, y, z, bits) for the rows of fragments in the tile.
    template <class Row>
    __device__ VOXELPIPE_INLINE void rows(const core::voxel_box& tile, Row&& row) const {
        if constexpr (Rule == coverage::thin) {
            struct sink {
                const core::voxel_box& tile;
                Row& to;
                // The columns are the tile's, but a thin fragment's depth may lie outside.
                __device__ VOXELPIPE_INLINE void row(int x, int y, int z, word bits) {
                    if (x >= tile.lo[0] && x <= tile.hi[0] && y >= tile.lo[1] && y <= tile.hi[1] && z >= tile.lo[2] &&
                        z <= tile.hi[2])
                        to(x, y, z, bits);
                }
                [[nodiscard]] __device__ VOXELPIPE_INLINE static glm::ivec3 position(int x, int y, int z) {
                    return {x, y, z};
                }
                __device__ VOXELPIPE_INLINE void emit(const glm::ivec3& at, bool wanted) {
                    if (wanted) row(at.x, at.y, at.z, 1u);
                }
            } within{tile, row};
            kept_in_thread<core::small_max_voxels> kept;
            (void)raster_thin(in, t.relative(in.fraction), t.lo, box, 0, 1, kept,
                              within); // triangles of zero area are in no tile
        } else {
            if (box.empty()) return;
            const core::small_conservative s = coverage_of_box();
            const auto emit = [&](int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
                if (bits != 0) row(origin[0] + box.lo[0], origin[1] + y, origin[2] + z, bits);
            };
            kept_in_thread<16> kept;
            if (box.hi[0] - box.lo[0] < 8)
                s.template rows<false>(box, emit);
            else if (Log2Size <= 4 && is_small)
                s.template rows_of_16<true>(box, kept, emit);
            else
                s.long_rows(box, emit);
        }
    }

private:
    [[nodiscard]] __device__ VOXELPIPE_INLINE static core::snapped_position corner(const int32_triangle& t, int v) {
        return {t.q[v][0], t.q[v][1], t.q[v][2]};
    }
    __device__ __noinline__ static void set_up_large(int32_triangle t, glm::uvec3 index, const core::voxel_box& tile,
                                                     int fraction, tile_setup& setup) {
        const auto frame = core::make_frame<std::int64_t>(corner(t, 0), corner(t, 1), corner(t, 2), fraction);
        const auto first = core::to_uvw(frame.axis, tile.lo[0], tile.lo[1], tile.lo[2]);
        setup.set(frame, index, first[0] - frame.origin[0], first[1] - frame.origin[1]);
    }
    [[nodiscard]] __device__ __noinline__ static core::small_conservative
    coverage_of_brick(int32_triangle t, glm::ivec3 at, int fraction) {
        const core::voxel_box bounds{{{t.lo[0], t.lo[1], t.lo[2]}}, {{t.hi[0], t.hi[1], t.hi[2]}}};
        return core::brick_triangle(corner(t, 0), corner(t, 1), corner(t, 2), bounds, fraction)
            .at(at.x - t.lo[0], at.y - t.lo[1], at.z - t.lo[2]);
    }
};

} // namespace voxelpipe::device
