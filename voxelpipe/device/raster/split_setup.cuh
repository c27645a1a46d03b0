// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Splits large triangles into work items, and sets them up: once each if they have many work items, otherwise for every
// work item (raster/split_triangles.cuh draws them).

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/device/base/relaxed_access.cuh>
#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

inline constexpr int max_immediate_extent = 1 << 16; // bricks are numbered with 16 bits, voxels with 32
static_assert((std::int64_t{max_immediate_extent} / core::raster_brick_size + 1) * (max_immediate_extent + 1) <
              1u << 31);

// Splits a large triangle's box of voxels into pieces, one per lane, and groups these into work items, one per warp.
// Conservative: columns of bricks along the dominant axis, few per work item, because the bricks of a column keep eight
// lanes busy, and a floor or a wall would otherwise make one warp finish last. Thin: rows of 16 columns of voxels,
// along the one of the other two axes that makes fewer of them.
template <coverage Rule>
struct split_pieces {
    static constexpr int across = Rule == coverage::thin ? 1 : core::raster_brick_size; // voxels along v
    static constexpr int per_work_item = tuning::pieces_per_work_item<Rule>;
    core::row_axes axes;
    core::triple<std::int64_t> lo, hi;            // the box, as uvw of these axes
    std::int64_t first_u, first_v, per_row, rows; // 32 bits can number the pieces (max_immediate_extent)

    split_pieces() = default;
    VOXELPIPE_HD split_pieces(const core::voxel_box& box, int dominant)
        : split_pieces(box, core::row_axes{dominant, false}) {
        if constexpr (Rule == coverage::thin) {
            const split_pieces by_v(box, core::row_axes{dominant, true});
            // A row of columns along x is set by one word, so it counts 3/4.
            const std::int64_t mine = count() * (axes.are_along_x() ? 3 : 4),
                               other = by_v.count() * (by_v.axes.are_along_x() ? 3 : 4);
            if (other < mine) *this = by_v;
        }
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * rows; }
    [[nodiscard]] VOXELPIPE_HD std::int64_t work_items() const { return (count() + per_work_item - 1) / per_work_item; }
    // The lowest voxel of piece i along u and v, possibly outside the box.
    [[nodiscard]] VOXELPIPE_HD std::int64_t u(std::int64_t i) const {
        return (first_u + static_cast<std::uint32_t>(i) % static_cast<std::uint32_t>(per_row))
               << core::log2_raster_brick;
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t v(std::int64_t i) const {
        return (first_v + static_cast<std::uint32_t>(i) / static_cast<std::uint32_t>(per_row)) * across;
    }
    // Piece i divided among lanes_each lanes: has_rows is true if part `part` has rows within the box, piece returns
    // them as a box of voxels.
    static constexpr int lanes_each = 32 / per_work_item;
    [[nodiscard]] VOXELPIPE_HD bool has_rows(std::int64_t i, unsigned part) const {
        return first_row(i, part) <= hi[1] && first_row(i, part + 1) > lo[1];
    }
    [[nodiscard]] VOXELPIPE_HD core::voxel_box piece(std::int64_t i, unsigned part) const {
        const std::int64_t u0 = u(i), u1 = u0 + core::raster_brick_size - 1;
        const std::int64_t v0 = first_row(i, part), v1 = first_row(i, part + 1) - 1;
        const auto inside = [&](std::int64_t at, int k) { return at < lo[k] ? lo[k] : at > hi[k] ? hi[k] : at; };
        return {axes.from_rows(inside(u0, 0), inside(v0, 1), lo[2]),
                axes.from_rows(inside(u1, 0), inside(v1, 1), hi[2])};
    }
    // The most work items that a triangle can have in a grid of this extent.
    [[nodiscard]] static std::uint64_t max_work_items(glm::ivec3 extent) {
        const auto of = [](std::int64_t along, std::int64_t rest) {
            const std::int64_t pieces = (along / core::raster_brick_size + 1) * (rest / across + 1);
            return static_cast<std::uint64_t>((pieces + per_work_item - 1) / per_work_item);
        };
        return std::max(core::max3(of(extent.y, extent.z), of(extent.z, extent.x), of(extent.x, extent.y)),
                        core::max3(of(extent.z, extent.y), of(extent.x, extent.z), of(extent.y, extent.x)));
    }

private:
    VOXELPIPE_HD split_pieces(const core::voxel_box& box, const core::row_axes& axes_)
        : axes(axes_), lo(axes_.to_rows(box.lo[0], box.lo[1], box.lo[2])),
          hi(axes_.to_rows(box.hi[0], box.hi[1], box.hi[2])), first_u(lo[0] >> core::log2_raster_brick),
          first_v(lo[1] / across), per_row((hi[0] >> core::log2_raster_brick) - first_u + 1),
          rows(hi[1] / across - first_v + 1) {}
    [[nodiscard]] VOXELPIPE_HD std::int64_t first_row(std::int64_t i, unsigned part) const {
        return v(i) + part * (across / lanes_each);
    }
};
// For either rule.
[[nodiscard]] inline std::uint64_t max_work_items(glm::ivec3 extent) {
    return std::max(split_pieces<coverage::thin>::max_work_items(extent),
                    split_pieces<coverage::conservative>::max_work_items(extent));
}

// A triangle in full width, and the voxels that it may touch.
template <class Call>
struct located_triangle {
    core::snapped_position a, b, c;
    core::voxel_box reach{}; // within the grid, if it is drawn
    core::triangle_class kind;

    __device__ VOXELPIPE_INLINE located_triangle(const Call& call, std::uint32_t triangle) {
        const glm::uvec3 index = call.in.source.triangle(triangle);
        a = call.in.source.position(index.x);
        b = call.in.source.position(index.y);
        c = call.in.source.position(index.z);
        const core::voxel_box grid{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
        kind = core::classify<Call::rule>(a, b, c, call.in.fraction, grid, reach);
    }
    // How it is split, if it is drawn.
    [[nodiscard]] __device__ VOXELPIPE_INLINE split_pieces<Call::rule> pieces(int fraction) const {
        return {reach, core::dominant_axis(a, b, c, fraction)};
    }
};

// Classifies a triangle; if it is drawn, `items` becomes its number of work items.
template <class Call>
__device__ inline core::triangle_class count_work_items(const Call& call, std::uint32_t triangle,
                                                        unsigned long long& items) {
    const located_triangle<Call> t(call, triangle);
    if (t.kind != core::triangle_class::drawn) return t.kind;
    if (Call::rule == coverage::thin && core::has_zero_area(t.a, t.b, t.c)) return core::triangle_class::zero_area;
    items = static_cast<unsigned long long>(t.pieces(call.in.fraction).work_items());
    return t.kind;
}

// Splits the oversized triangles that a block left until its end. All of its threads call it.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void split_oversized(const Call& call, Sink& sink, const std::uint32_t* oversized,
                                                 unsigned num_oversized) {
    for (unsigned first = 0; first < num_oversized; first += blockDim.x) {
        const unsigned at = first + threadIdx.x;
        unsigned long long items = 0;
        const std::uint32_t triangle = at < num_oversized ? oversized[at] : 0;
        if (at < num_oversized) {
            const core::triangle_class kind = count_work_items(call, triangle, items);
            if (kind != core::triangle_class::drawn) sink.drop(kind);
        }
        __syncwarp();
        call.lists.push_split(triangle, items);
    }
}

// Values of a split triangle that all of its work items need.
template <coverage Rule>
struct alignas(16) split_setup {
    std::conditional_t<Rule == coverage::thin, core::brick_thin, core::brick_triangle> bricks; // set if is_narrow
    core::voxel_box box, reach; // of the triangle; its part within the grid
    split_pieces<Rule> pieces;
    unsigned long long first_work_item; // number of the triangle's first work item
    std::uint32_t triangle;
    std::uint32_t is_narrow; // 0 if the 64-bit path cannot hold it

    // Computes the setup of split triangle `number`. One thread calls it.
    template <class Call>
    __device__ VOXELPIPE_INLINE void find(const Call& call, std::uint32_t number) {
        const int fraction = call.in.fraction;
        first_work_item = call.lists.first_work_items[number];
        triangle = call.lists.split[number];
        const located_triangle<Call> t(call, triangle);
        const core::voxel_box whole = core::bounds(t.a, t.b, t.c, fraction);
        const split_pieces<Rule> split = t.pieces(fraction);
        const bool narrow = core::fits_narrow(t.a, t.b, t.c, fraction);
        reach = t.reach;
        box = whole;
        pieces = split;
        is_narrow = narrow;
        if (!narrow) return;
        if constexpr (Rule == coverage::thin)
            bricks = core::brick_thin(t.a, t.b, t.c, whole, split.axes, fraction);
        else
            bricks = core::brick_triangle(t.a, t.b, t.c, whole, fraction);
    }
    // Computes this warp's share of the setups, one per lane, strided so that all warps have one before any has two.
    // Stores for each of their work items which setup it needs.
    template <class Call>
    __device__ VOXELPIPE_INLINE static void keep(const Call& call, unsigned warp, unsigned warps, std::uint32_t num) {
        const unsigned lane = threadIdx.x % 32;
        unsigned kept = 0;
        for (std::uint32_t first = warp; first < num; first += 32 * warps) {
            const std::uint32_t mine = first + lane * warps;
            unsigned item = 0, items = 0;
            if (mine < num) {
                split_setup& setup = kept_of(call.lists)[mine];
                setup.find(call, mine);
                item = static_cast<unsigned>(setup.first_work_item);
                items = static_cast<unsigned>(setup.pieces.work_items());
            }
            const unsigned lanes = __ballot_sync(0xffffffffu, mine < num);
            kept += static_cast<unsigned>(__popc(lanes));
            for (unsigned left = lanes; left != 0; left &= left - 1) {
                const int of = __ffs(static_cast<int>(left)) - 1;
                const unsigned begin = __shfl_sync(0xffffffffu, item, of), count = __shfl_sync(0xffffffffu, items, of);
                for (unsigned i = lane; i < count; i += 32)
                    call.lists.oversized[begin + i] = first + static_cast<unsigned>(of) * warps;
            }
        }
        __threadfence();
        __syncwarp();
        if (lane == 0 && kept != 0) atomicAdd(call.lists.setups_ready, static_cast<unsigned long long>(kept));
    }
    // True if all `num` setups are ready. Polls for a short time only: there may be blocks that have not begun. All
    // lanes call it.
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool are_kept(const deferred_triangles& lists, std::uint32_t num) {
        bool all = false;
        for (int look = 0; look < tuning::setup_polls && !all; ++look) {
            if (threadIdx.x % 32 == 0) all = load_relaxed(*lists.setups_ready) == num;
            all = __shfl_sync(0xffffffffu, static_cast<int>(all), 0) != 0;
        }
        __syncwarp();
        __threadfence();
        return all;
    }
    // Starts to copy a setup to this place in shared memory; the caller waits for it. All lanes call it.
    __device__ VOXELPIPE_INLINE void fetch(const deferred_triangles& lists, std::uint32_t number) {
        constexpr unsigned parts = sizeof(split_setup) / sizeof(uint4);
        static_assert(parts <= 32 && sizeof(split_setup) <= deferred_triangles::setup_bytes);
        const unsigned lane = threadIdx.x % 32;
        if (lane < parts)
            copy_four_words(static_cast<std::uint32_t>(__cvta_generic_to_shared(this)) + 16 * lane,
                            reinterpret_cast<const uint4*>(kept_of(lists) + number) + lane);
    }

private:
    [[nodiscard]] __device__ VOXELPIPE_INLINE static split_setup* kept_of(const deferred_triangles& lists) {
        return reinterpret_cast<split_setup*>(lists.setups);
    }
};

} // namespace voxelpipe::device
