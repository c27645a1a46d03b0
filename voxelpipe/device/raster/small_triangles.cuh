// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster of one small triangle, by one thread or by eight lanes. Fragments go to a sink (raster/sink.cuh).

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/core/corner_signs.hpp>
#include <voxelpipe/core/small_conservative.hpp>
#include <voxelpipe/core/small_thin.hpp>
#include <voxelpipe/core/thin_cube.hpp>
#include <voxelpipe/device/raster/sink.cuh>
#include <voxelpipe/device/raster/size_class.cuh>

#include <type_traits>
#include <utility>

namespace voxelpipe::device {

// ---- small triangles ------------------------------------------------------------------------------------------------

// Longest side of a bounding box, in voxels, for which 32 bits suffice.
[[nodiscard]] __device__ VOXELPIPE_INLINE int max_group_side(int fraction) {
    return fraction < 16 ? 32 : 1 << (core::small_edge_bits - fraction);
}
static_assert(core::small_voxels(16) == 16 && core::small_voxels(15) == 32 && core::small_voxels(0) == 32 &&
              core::small_voxels(core::small_edge_bits) == 1);

// Storage for a warp: each lane has a column of words for its triangle (small_conservative::rows_of_16,
// small_thin::columns).
struct kept_rows {
    word words[max_long_side][32];
};
// One lane's column. The address is hidden from the compiler, which would otherwise recompute it each time, in ten
// instructions.
struct lane_rows {
    std::uint32_t first;

    __device__ VOXELPIPE_INLINE explicit lane_rows(kept_rows& of_warp) {
        const auto at = static_cast<std::uint32_t>(__cvta_generic_to_shared(of_warp.words[0] + threadIdx.x % 32));
        asm volatile("mov.u32 %0, %1;" : "=r"(first) : "r"(at));
    }
    __device__ VOXELPIPE_INLINE void set(int i, word w) const {
        asm volatile("st.shared.u32 [%0], %1;" ::"r"(first + 128 * static_cast<unsigned>(i)), "r"(w) : "memory");
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word get(int i) const {
        word w = 0;
        asm volatile("ld.shared.u32 %0, [%1];" : "=r"(w) : "r"(first + 128 * static_cast<unsigned>(i)) : "memory");
        return w;
    }
};
static_assert(sizeof(kept_rows::words[0]) == 128);
struct no_rows {};
// A part of at most 32 x 32 columns by group_lanes lanes, or of max_columns by one, has at most max_long_side rows
// along its shorter side.
static_assert(tuning::max_columns < max_long_side * max_long_side && 32 / tuning::group_lanes <= max_long_side);

// The columns of a small triangle for thin coverage: rows along the longer side of the box, and the position of their
// voxels, which is linear in u, v and w.
template <class Position>
struct thin_columns {
    core::small_thin s;
    core::triple<std::int32_t> begin, end; // along u, v, w
    int lowest, depth;                     // along w: voxels of the grid before the box; voxels of the grid
    Position origin, by_u, by_v, by_w;

    // Returns false if the triangle has no area.
    template <class Source, class Sink>
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool find(const raster_input<Source>& call, const core::small_triangle& t,
                                                        const std::int32_t (&lo)[3], const core::small_box& box,
                                                        const Sink& sink) {
        const core::triple<std::int64_t> normal = core::small_normal(t);
        const int axis = core::small_axis(normal);
        if (axis < 0) return false;
        s = core::small_thin(t, normal, axis, call.fraction);
        begin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
        end = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
        const bool swapped = end[0] - begin[0] < end[1] - begin[1];
        if (swapped) {
            s.swap_uv();
            begin = {begin[1], begin[0], begin[2]};
            end = {end[1], end[0], end[2]};
        }
        depth = axis == 0 ? call.extent.x : axis == 1 ? call.extent.y : call.extent.z;
        lowest = axis == 0 ? lo[0] : axis == 1 ? lo[1] : lo[2];
        const auto step_along = [&](int k) VOXELPIPE_INLINE_LAMBDA { return sink.position(k == 0, k == 1, k == 2); };
        const int next = axis == 2 ? 0 : axis + 1, last = axis == 0 ? 2 : axis - 1; // axes of u and v
        origin = sink.position(lo[0], lo[1], lo[2]);
        by_u = step_along(swapped ? last : next);
        by_v = step_along(swapped ? next : last);
        by_w = step_along(axis);
        return true;
    }
    // True if every column's voxel lies in the grid: it may lie one beyond the box on either side.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_inside() const {
        return lowest >= 1 && lowest + end[2] + 1 < depth;
    }
};

template <class Sink>
using position_of_sink = decltype(std::declval<const Sink&>().position(0, 0, 0));

// Emits the thin fragments of the columns in rows first, first + step, ...; returns false if the triangle has no area.
template <class Source, class Kept, class Sink>
__device__ VOXELPIPE_INLINE bool raster_thin(const raster_input<Source>& call, const core::small_triangle& t,
                                             const std::int32_t (&lo)[3], const core::small_box& box, int first,
                                             int step, Kept&& kept, Sink& sink) {
    thin_columns<position_of_sink<Sink>> c;
    if (!c.find(call, t, lo, box, sink)) return false;
    auto row = c.origin;
    c.s.columns(
        c.begin[0], c.end[0], c.begin[1] + first, c.end[1], step, kept,
        [&](int v) VOXELPIPE_INLINE_LAMBDA { row = c.origin + c.by_v * v; },
        [&](int u, int w) VOXELPIPE_INLINE_LAMBDA {
            sink.emit(row + c.by_u * u + c.by_w * w,
                      static_cast<unsigned>(c.lowest + w) < static_cast<unsigned>(c.depth));
        });
    return true;
}

// Emits the thin fragments of a warp's triangles in rounds, to a sink that needs their number first. All lanes call it.
// Returns false, with nothing done, if the number cannot be known.
template <class Source, class Kept, class Sink>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool raster_thin_by_rounds(const raster_input<Source>& call,
                                                                     const int32_triangle& r, Kept&& kept, Sink& sink) {
    thin_columns<position_of_sink<Sink>> c;
    const bool has_area = c.find(call, r.relative(call.fraction), r.lo, r.part(call.extent), sink);
    if (!__all_sync(0xffffffffu, !has_area || c.is_inside())) return false;
    core::small_thin::walk walk{};
    std::uint32_t count = 0;
    if (has_area)
        walk = c.s.find_columns(c.begin[0], c.end[0], c.begin[1], c.end[1], 1, kept, count);
    else
        sink.drop(core::triangle_class::zero_area);
    auto row = c.origin;
    sink.rounds(
        count, [&]() VOXELPIPE_INLINE_LAMBDA { return walk.is_done(); },
        [&]() VOXELPIPE_INLINE_LAMBDA {
            auto position = row;
            c.s.next_column(
                walk, kept, [&](int v) VOXELPIPE_INLINE_LAMBDA { row = c.origin + c.by_v * v; },
                [&](int u, int w) VOXELPIPE_INLINE_LAMBDA { position = row + c.by_u * u + c.by_w * w; });
            return position;
        });
    return true;
}

// Emits the thin fragments of a bounding box of at most two voxels a side, all columns at once: the common case of a
// fine mesh.
template <class Source, class Sink>
__device__ VOXELPIPE_INLINE void emit_thin_cube(const raster_input<Source>& call, const int32_triangle& r,
                                                const core::thin_cube& cube, Sink& sink) {
    const int axis = cube.axis;
    // The voxel may lie one beyond the box on either side.
    const bool inside = (r.lo[0] - 1 | r.lo[1] - 1 | r.lo[2] - 1 | (call.extent.x - 3 - r.lo[0]) |
                         (call.extent.y - 3 - r.lo[1]) | (call.extent.z - 3 - r.lo[2])) >= 0;
    word columns = cube.columns;
    if (!inside)
        for (int i = 0; i < 4; ++i) {
            const auto at = cube.voxel(i);
            const glm::ivec3 p(r.lo[0] + at[0], r.lo[1] + at[1], r.lo[2] + at[2]);
            if (p.x < 0 || p.y < 0 || p.z < 0 || p.x >= call.extent.x || p.y >= call.extent.y || p.z >= call.extent.z)
                columns &= ~(1u << i);
        }
    const auto by_u = sink.position(axis != 0, axis == 0, 0), by_v = sink.position(0, axis == 2, axis != 2),
               by_w = sink.position(axis == 0, axis == 1, axis == 2), below = sink.position(r.lo[0], r.lo[1], r.lo[2]);
    sink.voxels(columns, [&](int column) VOXELPIPE_INLINE_LAMBDA {
        return below + by_u * (column & 1) + by_v * (column >> 1) + by_w * cube.depth(column);
    });
}
// Returns false if the triangle has no area.
template <class Source, class Sink>
__device__ VOXELPIPE_INLINE bool raster_thin_cube(const raster_input<Source>& call, const int32_triangle& r,
                                                  Sink& sink) {
    const core::thin_cube cube = core::thin_cube_by_integers(r.relative(call.fraction), r.last, call.fraction);
    if (cube.axis < 0) return false;
    emit_thin_cube(call, r, cube, sink);
    return true;
}

// Emits the conservative fragments within a box of at most 32 voxels a side; group_lanes neighbouring lanes call it
// together. Takes 8 x 8 rows along x at a time, by rows of equal y or of equal z, whichever has fewer non-empty ones: a
// floor has rows of one y, a wall may have rows of one z.
template <class Sink>
__device__ VOXELPIPE_INLINE void raster_lanes(const core::small_conservative& s, const std::int32_t (&lo)[3],
                                              const core::small_box& box, Sink& sink) {
    const int lane = static_cast<int>(threadIdx.x) % tuning::group_lanes;
    const unsigned first_of_group = threadIdx.x % 32 / tuning::group_lanes * tuning::group_lanes;
    const unsigned group = ((1u << tuning::group_lanes) - 1) << first_of_group;
    const int x0 = box.lo[0], x1 = box.hi[0];
    for (int first_y = box.lo[1]; first_y <= box.hi[1]; first_y += tuning::group_lanes) {
        const word at_y = first_y + lane <= box.hi[1] ? s.limit_at_y(x0, x1, first_y + lane) : 0;
        const unsigned ys = __ballot_sync(group, at_y != 0) >> first_of_group;
        if (ys == 0) continue;
        for (int first_z = box.lo[2]; first_z <= box.hi[2]; first_z += tuning::group_lanes) {
            const word at_z = first_z + lane <= box.hi[2] ? s.limit_at_z(x0, x1, first_z + lane) : 0;
            const unsigned zs = __ballot_sync(group, at_z != 0) >> first_of_group;
            const bool by_y = __popc(ys) <= __popc(zs);
            for (unsigned left = by_y ? ys : zs; left != 0; left &= left - 1) {
                const int one = __ffs(static_cast<int>(left)) - 1;
                const word limit =
                    __shfl_sync(group, by_y ? at_y : at_z, one, tuning::group_lanes) & (by_y ? at_z : at_y);
                const int y = first_y + (by_y ? one : lane), z = first_z + (by_y ? lane : one);
                const word bits = limit == 0 || !s.meets_row(y, z) ? 0 : s.plane_bits(x0, y, z, limit);
                if constexpr (Sink::splits_long_rows) {
                    if (by_y && __popc(ys) <= tuning::group_lanes / 4) { // few long rows: all lanes draw each
                        word rows = __ballot_sync(group, bits != 0) >> first_of_group;
                        const unsigned longest = __reduce_max_sync(group, static_cast<unsigned>(__popc(bits)));
                        if (static_cast<unsigned>(__popc(rows)) * 5 <= longest * 3) {
                            for (; rows != 0; rows &= rows - 1) {
                                const int of = __ffs(static_cast<int>(rows)) - 1;
                                const word mask = __shfl_sync(group, bits, of, tuning::group_lanes);
                                sink.row_by_all(group, lo[0] + x0, lo[1] + y, lo[2] + first_z + of, mask);
                            }
                            continue;
                        }
                    }
                }
                sink.row(lo[0] + x0, lo[1] + y, lo[2] + z, bits);
            }
        }
    }
}

// The voxels of 2 x 2 x 2, bit x + 2 y + 4 z, that lie in a box.
[[nodiscard]] __device__ VOXELPIPE_INLINE word cube_part(const core::small_box& box) {
    return (box.lo[0] == 0 ? 0xffu : 0xaau) & (box.hi[0] == 1 ? 0xffu : 0x55u) & (box.lo[1] == 0 ? 0xffu : 0xccu) &
           (box.hi[1] == 1 ? 0xffu : 0x33u) & (box.lo[2] == 0 ? 0xffu : 0xf0u) & (box.hi[2] == 1 ? 0xffu : 0x0fu);
}
// Conservative coverage of a bounding box of at most two voxels a side, the common case of a fine mesh, for each lane
// that wants it; the result is for emit_cube. 0 if floats cannot decide, or if nothing lies in the grid: then
// raster_tiny. `inside`: of int32_triangle. All lanes call it.
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE word find_cube(const raster_input<Source>& call, bool wanted,
                                                         const int32_triangle& r, int inside) {
    word bits = 0;
    const int wide =
        wanted ? r.last[0] + r.last[1] + r.last[2] : 0; // number of axes along which the box has two voxels
    const bool all_ways = __any_sync(0xffffffffu, wide == 3);
    if (wanted) {
        if (wide < 2) { // a line is covered whole
            bits = core::cube_of(r.last);
        } else {
            const core::sure_bits cube = all_ways ? core::cube_bits_by_signs(r.q, r.lo, r.last, call.fraction)
                                                  : core::quad_bits_by_signs(r.q, r.lo, r.last, call.fraction);
            bits = cube.sure ? cube.bits : 0;
        }
        if (inside < 0) bits &= cube_part(r.part(call.extent));
    }
    return bits;
}
template <class Sink>
__device__ VOXELPIPE_INLINE void emit_cube(const int32_triangle& r, word bits, Sink& sink) {
    if constexpr (Sink::merges_equal_voxels) {
        if ((r.last[0] | r.last[1] | r.last[2]) == 0) {
            if (bits != 0) sink.one(r.lo[0], r.lo[1], r.lo[2]);
            return;
        }
    }
    sink.cube(r.lo[0], r.lo[1], r.lo[2], bits);
}

// Draws one triangle by group_lanes neighbouring lanes, if wanted. All lanes of the warp call it.
template <coverage Rule, class Source, class Sink>
__device__ VOXELPIPE_INLINE void raster_by_group(const raster_input<Source>& call, bool wanted, std::uint32_t triangle,
                                                 const lane_rows& kept, Sink& sink) {
    int32_triangle r;
    if (wanted) r = load_int32(call, call.source.triangle(triangle));
    emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
        if (!wanted) return;
        sink.begin(triangle);
        if constexpr (Rule == coverage::thin) {
            const int lane = static_cast<int>(threadIdx.x) % tuning::group_lanes;
            const bool has_area = raster_thin(call, r.relative(call.fraction), r.lo, r.part(call.extent), lane,
                                              tuning::group_lanes, kept, sink);
            if (!has_area && lane == 0) sink.drop(core::triangle_class::zero_area);
        } else {
            raster_lanes(core::small_conservative(r.relative(call.fraction), call.fraction), r.lo, r.part(call.extent),
                         sink);
        }
    });
}

// Draws a bounding box of at most two voxels a side, or three for conservative coverage, by one thread.
template <coverage Rule, class Source, class Sink>
__device__ VOXELPIPE_INLINE void raster_tiny(const raster_input<Source>& call, const int32_triangle& r, Sink& sink) {
    if constexpr (Rule == coverage::thin) {
        if (!raster_thin_cube(call, r, sink)) sink.drop(core::triangle_class::zero_area);
    } else {
        const core::small_box box = r.part(call.extent);
        if (box.empty()) return;
        const auto emit = [&](int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
            sink.row(r.lo[0] + box.lo[0], r.lo[1] + y, r.lo[2] + z, bits);
        };
        const core::ruled_out out = core::rule_out_by_signs(r.q, r.lo, r.last, call.fraction);
        if (out.sure)
            core::rows_of_three(out, box, emit);
        else
            core::small_conservative(r.relative(call.fraction), call.fraction).long_rows(box, emit);
    }
}

// Conservative coverage for a warp that passes rows in rounds: one triangle a lane, all of one list. tiny: boxes of at
// most three voxels a side; otherwise at most max_long_side. All lanes call it.
template <class Source, class Kept, class Sink>
__device__ VOXELPIPE_INLINE void raster_rows_by_rounds(const raster_input<Source>& call, const int32_triangle& r,
                                                       bool tiny, Kept&& kept, Sink& sink) {
    core::small_box box = r.part(call.extent);
    const auto emit_to = [&](const auto& emit) VOXELPIPE_INLINE_LAMBDA {
        return [&](int y, int z, word bits)
                   VOXELPIPE_INLINE_LAMBDA { emit(r.lo[0] + box.lo[0], r.lo[1] + y, r.lo[2] + z, bits); };
    };
    if (tiny) {
        const core::ruled_out out = core::rule_out_by_signs(r.q, r.lo, r.last, call.fraction);
        core::row_walk_3 rows;
        if (out.sure && !box.empty()) rows = core::row_walk_3(out, box);
        sink.row_rounds([&]() VOXELPIPE_INLINE_LAMBDA { return rows.is_done(); },
                        [&](const auto& emit) VOXELPIPE_INLINE_LAMBDA { rows.next(emit_to(emit)); });
        if (__all_sync(0xffffffffu, out.sure)) return;
        if (out.sure) box = {{1, 1, 1}, {0, 0, 0}};
    }
    const core::small_conservative s(r.relative(call.fraction), call.fraction);
    const bool is_long = r.longest_side() > max_short_side;
    {
        const core::small_box part = is_long ? core::small_box{{1, 1, 1}, {0, 0, 0}} : box;
        auto rows = core::small_conservative::row_walk_8::of(s, part, true);
        sink.row_rounds([&]() VOXELPIPE_INLINE_LAMBDA { return rows.is_done(); },
                        [&](const auto& emit) VOXELPIPE_INLINE_LAMBDA { rows.template next<true>(s, emit_to(emit)); });
    }
    if (!__any_sync(0xffffffffu, is_long)) return;
    core::small_conservative::row_walk_16 rows(s, is_long ? box : core::small_box{{1, 1, 1}, {0, 0, 0}}, true, kept);
    sink.row_rounds([&]() VOXELPIPE_INLINE_LAMBDA { return rows.is_done(); },
                    [&](const auto& emit)
                        VOXELPIPE_INLINE_LAMBDA { rows.template next<true>(s, kept, emit_to(emit)); });
}

// Draws any small triangle, by one thread. Apart: the kernel holds nothing else in registers meanwhile. kept:
// lane_rows, or no_rows for conservative boxes of at most max_short_side voxels a side.
template <coverage Rule, bool Apart, class Source, class Kept, class Sink>
__device__ VOXELPIPE_INLINE void raster_small(const raster_input<Source>& call, const int32_triangle& r,
                                              const Kept& kept, Sink& sink) {
    const core::small_box box = r.part(call.extent);
    if constexpr (Rule == coverage::thin) {
        if (!raster_thin(call, r.relative(call.fraction), r.lo, box, 0, 1, kept, sink))
            sink.drop(core::triangle_class::zero_area);
    } else {
        const core::small_conservative s(r.relative(call.fraction), call.fraction);
        const auto emit = [&](int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
            sink.row(r.lo[0] + box.lo[0], r.lo[1] + y, r.lo[2] + z, bits);
        };
        const int most = core::max3(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]) + 1;
        if (std::is_same_v<Kept, no_rows> || most <= max_short_side)
            s.template rows<Apart>(box, emit);
        else if constexpr (!std::is_same_v<Kept, no_rows>)
            s.template rows_of_16<Apart>(box, kept, emit);
    }
}

} // namespace voxelpipe::device
