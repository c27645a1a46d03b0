// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coarse raster: triangles -> (tile, primitive) pairs, in any order. Counts triangles, and the reasons why others are
// dropped (paper section 4, coarse raster). A tile is a voxel of a coarser grid, so the same exact coverage
// decides.

#include <voxelpipe/core/corner_signs.hpp>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/int128_coverage.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

namespace voxelpipe::device {

template <coverage Rule>
struct tile_cells {
    static constexpr coverage rule = Rule;
    static constexpr std::int64_t small_columns = tuning::small_tile_columns;
    core::tile_grid tiles;
    std::uint32_t* keys;       // tile numbers
    std::uint32_t* primitives; // as long as keys
    [[nodiscard]] __device__ core::voxel_box cells(const core::voxel_box& reach) const {
        return core::coarsen(reach, tiles.log2_size);
    }
    // The number of tiles if the triangle's bounding box is one tile wide along two axes, so that it meets all tiles of
    // the box, and if 32 bits tell; otherwise 0. `lo`, `hi`: the part of the box within the grid, not empty. Most
    // triangles of a fine mesh are such. Not for thin coverage and arms, which leave tiles out.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t find_line(const geometry& geo, const draw_geometry& d,
                                                                      const glm::uvec3& index, glm::ivec3& lo,
                                                                      glm::ivec3& hi) const {
        if (index.x >= d.num_vertices || index.y >= d.num_vertices || index.z >= d.num_vertices) return 0;
        const int32_triangle t = load_int32(raster_input<stored_source>{{d}, 0, geo.snap.fraction, geo.extent}, index);
        if (!t.fits_int32 || t.is_outside<Rule>(geo.extent)) return 0;
        std::int32_t longest = 0, others = 0;
        std::uint32_t n = 1;
        for (int k = 0; k < 3; ++k) {
            // By name: nvcc --Ofast-compile=mid reads a vector in a kernel's parameters from a wrong address if the
            // index is not a constant.
            const std::int32_t last = (k == 0   ? geo.extent.x
                                       : k == 1 ? geo.extent.y
                                                : geo.extent.z) -
                                      1,
                               length = (t.hi[k] >> tiles.log2_size) - (t.lo[k] >> tiles.log2_size);
            others += length < longest ? length : longest;
            longest = length < longest ? longest : length;
            lo[k] = (t.lo[k] < 0 ? 0 : t.lo[k]) >> tiles.log2_size;
            hi[k] = (t.hi[k] < last ? t.hi[k] : last) >> tiles.log2_size;
            n *= static_cast<std::uint32_t>(hi[k] - lo[k] + 1);
        }
        return others == 0 && longest < small_columns ? n : 0;
    }
    // The tiles of a triangle whose bounding box is at most three tiles a side and lies inside the grid, by the signs
    // of floats (core/corner_signs.hpp): bits x + 3 y + 9 z from the box's lowest tile on, which is `lo`; 0 if this or
    // the signs are not so. Not for thin coverage and arms. Most triangles that are no lines are such.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word find_cube(const geometry& geo, const int32_triangle& t,
                                                             std::int32_t (&lo)[3]) const {
        const int fraction = geo.snap.fraction + tiles.log2_size;
        if (!t.fits_int32 || t.inside(geo.extent) < 0 || fraction > max_sign_fraction) return 0;
        core::small_box box;
        for (int k = 0; k < 3; ++k) {
            lo[k] = t.lo[k] >> tiles.log2_size;
            box.lo[k] = 0;
            box.hi[k] = (t.hi[k] >> tiles.log2_size) - lo[k];
            if (box.hi[k] > 2) return 0;
        }
        const core::ruled_out out = core::rule_out_by_signs(t.q, lo, box.hi, fraction);
        if (!out.sure) return 0;
        word cube = 0;
        core::rows_of_three(out, box, [&](int y, int z, word row) { cube |= row << (3 * y + 9 * z); });
        return cube;
    }
    __device__ VOXELPIPE_INLINE void emit_cube(std::uint32_t primitive, const std::int32_t (&lo)[3], word cube,
                                               unsigned long long at) const {
        for (; cube != 0; cube &= cube - 1, ++at) {
            const int i = exact::lowest_one(cube);
            keys[at] = static_cast<std::uint32_t>(tiles.index(lo[0] + i % 3, lo[1] + i / 3 % 3, lo[2] + i / 9));
            primitives[at] = primitive;
        }
    }
    __device__ VOXELPIPE_INLINE void emit_line(std::uint32_t primitive, const glm::ivec3& lo, const glm::ivec3& hi,
                                               unsigned long long at) const {
        for (int z = lo.z; z <= hi.z; ++z)
            for (int y = lo.y; y <= hi.y; ++y)
                for (int x = lo.x; x <= hi.x; ++x, ++at) {
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
    static constexpr int max_sign_fraction = 20; // of rule_out_by_signs, in units of tiles

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

// Takes room for the `value` pairs of each thread from *num; returns where the thread's begin, or no_room for the whole
// block. All threads of the block call it, once.
inline constexpr unsigned long long no_room = ~0ull;
template <class Number>
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long take_room(std::uint32_t value, Number* num,
                                                                       unsigned long long capacity) {
    __shared__ std::uint32_t warp_sums[threads_per_block / 32];
    __shared__ unsigned long long first;
    const unsigned warp = threadIdx.x / 32;
    std::uint32_t before = lane_prefix(value);
    if (threadIdx.x % 32 == 31) warp_sums[warp] = before;
    __syncthreads();
    std::uint32_t all = 0;
    for (unsigned w = 0; w < threads_per_block / 32; ++w) {
        before += w < warp ? warp_sums[w] : 0;
        all += warp_sums[w];
    }
    if (threadIdx.x == 0) {
        const unsigned long long at = all == 0 ? 0 : atomicAdd(num, static_cast<Number>(all));
        first = at + all > capacity ? no_room : at;
    }
    __syncthreads();
    return first == no_room ? no_room : first + before - value;
}

// The triangles of a block that are no lines of tiles. They cost far more, so the threads share them out.
struct left_triangles {
    static constexpr unsigned each = tuning::coarse_triangles, max = each * threads_per_block;
    std::uint32_t ids[max];
    std::uint32_t tiles[max]; // their number; or, with the highest bit, tile_cells::find_cube
    static constexpr std::uint32_t is_cube = 1u << 31;
    unsigned num;
    unsigned kinds[5]; // by triangle_class
};

// See tile_cells::find_cube.
template <coverage Rule>
[[nodiscard]] __device__ VOXELPIPE_INLINE word find_cube(const geometry& geo, const tile_cells<Rule>& op,
                                                         std::uint32_t id, std::int32_t (&lo)[3]) {
    if (Rule != coverage::conservative || geo.arms != core::arm_set::none) return 0;
    const draw_geometry& d = geo.draw(geo.find_draw(id));
    const glm::uvec3 index = d.triangles[id - d.first_primitive];
    if (index.x >= d.num_vertices || index.y >= d.num_vertices || index.z >= d.num_vertices) return 0;
    return op.find_cube(geo, load_int32(raster_input<stored_source>{{d}, 0, geo.snap.fraction, geo.extent}, index), lo);
}

// Appends the pairs of small triangles, several of a thread's at a time, and records the large ones. All threads of the
// block call it.
template <coverage Rule>
__device__ VOXELPIPE_INLINE void append_small(const geometry& geo, const tile_cells<Rule>& op, const cell_buffers& b,
                                              pipeline_state* state, const capacities& limits) {
    using core::triangle_class;
    constexpr unsigned each = left_triangles::each;
    __shared__ left_triangles left;
    if (threadIdx.x < 5) left.kinds[threadIdx.x] = 0;
    if (threadIdx.x == 0) left.num = 0;
    __syncthreads();
    const std::uint64_t first = std::uint64_t{blockIdx.x} * left_triangles::max;
    std::uint32_t pairs = 0, tiles_of[each];
    glm::ivec3 lo[each], hi[each];
#pragma unroll
    for (unsigned k = 0; k < each; ++k) {
        const std::uint64_t i = first + k * threads_per_block + threadIdx.x;
        tiles_of[k] = 0;
        if (i >= geo.num_primitives) continue;
        const auto id = static_cast<std::uint32_t>(i);
        if (Rule == coverage::conservative && geo.arms == core::arm_set::none) {
            const draw_geometry& d = geo.draw(geo.find_draw(id));
            tiles_of[k] = op.find_line(geo, d, d.triangles[id - d.first_primitive], lo[k], hi[k]);
        }
        if (tiles_of[k] == 0) left.ids[atomicAdd(&left.num, 1u)] = id;
        pairs += tiles_of[k];
    }
    __syncthreads();
    for (unsigned at = threadIdx.x; at < left.num; at += threads_per_block) {
        const std::uint32_t id = left.ids[at];
        std::int32_t lowest[3];
        if (const word cube = find_cube(geo, op, id, lowest); cube != 0) {
            atomicAdd(&left.kinds[static_cast<int>(triangle_class::drawn)], 1u);
            left.tiles[at] = cube | left_triangles::is_cube;
            pairs += static_cast<std::uint32_t>(__popc(cube));
            continue;
        }
        const loaded_triangle t = geo.load(id);
        std::uint32_t n = 0;
        if (!t.index_ok) {
            atomicOr(&state->index_error, bad_index);
        } else {
            core::voxel_box reach{};
            triangle_class kind = core::classify<Rule>(t.a, t.b, t.c, geo.snap.fraction, geo.whole_box(), reach);
            if ((Rule == coverage::thin || geo.arms != core::arm_set::none) && kind == triangle_class::drawn &&
                core::has_zero_area(t.a, t.b, t.c))
                kind = triangle_class::zero_area;
            atomicAdd(&left.kinds[static_cast<int>(kind)], 1u);
            if (kind == triangle_class::drawn) {
                const core::voxel_box box = op.cells(reach);
                if (is_small(box, op.small_columns))
                    n = op.count(geo, t, id, box, true).kept;
                else
                    record_chunks(geo, t, id, box, b);
            }
        }
        left.tiles[at] = n;
        pairs += n;
    }
    unsigned long long at = take_room(pairs, b.num_cells, limits.tile_pairs); // its barriers complete left.kinds
    if (threadIdx.x < 5) {
        unsigned num = left.kinds[threadIdx.x];
        if (threadIdx.x == static_cast<unsigned>(triangle_class::drawn)) {
            const std::uint64_t rest = geo.num_primitives - first;
            num += static_cast<unsigned>(rest < left_triangles::max ? rest : left_triangles::max) - left.num;
        }
        if (num != 0)
            atomicAdd(state->counter_of(static_cast<triangle_class>(threadIdx.x)),
                      static_cast<unsigned long long>(num));
    }
    if (at == no_room) return;
#pragma unroll
    for (unsigned k = 0; k < each; ++k) {
        if (tiles_of[k] == 0) continue;
        op.emit_line(static_cast<std::uint32_t>(first + k * threads_per_block + threadIdx.x), lo[k], hi[k], at);
        at += tiles_of[k];
    }
    for (unsigned i = threadIdx.x; i < left.num; i += threads_per_block) {
        if (left.tiles[i] == 0) continue;
        if ((left.tiles[i] & left_triangles::is_cube) != 0) {
            const word cube = left.tiles[i] & ~left_triangles::is_cube;
            std::int32_t lowest[3];
            (void)find_cube(geo, op, left.ids[i], lowest);
            op.emit_cube(left.ids[i], lowest, cube, at);
            at += static_cast<unsigned>(__popc(cube));
            continue;
        }
        const loaded_triangle t = geo.load(left.ids[i]);
        core::voxel_box reach{};
        (void)core::classify<Rule>(t.a, t.b, t.c, geo.snap.fraction, geo.whole_box(), reach);
        op.emit(geo, t, left.ids[i], op.cells(reach), true, at);
        at += left.tiles[i];
    }
}

// Appends the pairs of the large triangles: a warp takes room for those of a record.
template <coverage Rule>
__device__ VOXELPIPE_INLINE void append_large(const geometry& geo, const tile_cells<Rule>& op, const cell_buffers& b,
                                              const pipeline_state* state, const capacities& limits) {
    if (state->index_error != 0) return;
    for_each_record(geo, op, b,
                    [&](std::uint32_t id, const loaded_triangle& t, bool valid, const core::voxel_box& box) {
                        const std::uint32_t n = valid ? op.count(geo, t, id, box, false).kept : 0;
                        const std::uint32_t before = lane_prefix(n);
                        unsigned long long first = 0;
                        if (threadIdx.x % 32 == 31 && before != 0)
                            first = atomicAdd(b.num_cells, static_cast<unsigned long long>(before));
                        first = __shfl_sync(0xffffffffu, first, 31);
                        if (n != 0 && first + before <= limits.tile_pairs)
                            op.emit(geo, t, id, box, false, first + before - n);
                    });
}

// As in count_and_emit, a kernel is both passes, which share most of their code.
enum class append_pass { small, large };
template <coverage Rule>
__global__ __launch_bounds__(threads_per_block, tuning::count_emit_min_blocks) void append_kernel(
    const __grid_constant__ geometry geo, const __grid_constant__ tile_cells<Rule> op,
    const __grid_constant__ cell_buffers b, pipeline_state* state, const __grid_constant__ capacities limits,
    append_pass pass) {
    if (pass == append_pass::small)
        append_small(geo, op, b, state, limits);
    else
        append_large(geo, op, b, state, limits);
}

} // namespace voxelpipe::device
