// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster of large triangles without tiles: each is split into work items, which warps share out, whatever triangles
// they belong to. Conservative coverage finds the bricks (core/brick_triangle.hpp) that a triangle meets, then the
// voxels of each; thin coverage takes rows of 16 columns. A triangle too large for 64 bits goes through 128.

#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/raster/split_setup.cuh>
#include <voxelpipe/device/scene/int128_coverage.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Makes rows of bits along x from spans of columns: neighbouring columns with one voxel at the same depth become one
// row.
template <class Sink>
struct span_writer {
    Sink& sink;
    int x = 0, y = 0, z = 0; // of the pending row
    word mask = 0;

    __device__ VOXELPIPE_INLINE void flush() {
        if (mask != 0) {
            sink.mark_row(x, x + 31 - __clz(static_cast<int>(mask)), y, z);
            sink.row(x, y, z, mask);
        }
        mask = 0;
    }
    __device__ VOXELPIPE_INLINE void span(int axis, int u, int v, int w0, int w1) {
        if (axis == 0) {
            for (int at = w0; at <= w1; at += 32) {
                const int n = w1 - at + 1;
                sink.mark_row(at, n >= 32 ? at + 31 : w1, u, v);
                sink.row(at, u, v, n >= 32 ? ~0u : (1u << n) - 1);
            }
            return;
        }
        for (int w = w0; w <= w1; ++w) {
            const auto p = core::to_xyz(axis, u, v, w);
            if (mask != 0 && p[1] == y && p[2] == z && p[0] - x < 32) {
                mask |= 1u << (p[0] - x);
            } else {
                flush();
                x = p[0];
                y = p[1];
                z = p[2];
                mask = 1;
            }
        }
    }
};

// Index of the last of n > 0 ascending numbers that is at most `number`; the first one must be. All lanes of a warp
// call it with the same arguments; each probes one element, so that few loads wait for one another.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned find_last(const unsigned long long* numbers, unsigned n,
                                                             unsigned long long number) {
    const unsigned lane = threadIdx.x % 32;
    unsigned first = 0;
    while (n > 1) {
        const unsigned step = (n + 31) / 32, probe = step * lane;
        const bool below = probe < n && numbers[first + probe] <= number;
        const unsigned skipped = (static_cast<unsigned>(__popc(__ballot_sync(0xffffffffu, below))) - 1) * step;
        first += skipped;
        n = n - skipped < step ? n - skipped : step;
    }
    return uniform(first);
}

// Shared memory of one warp for split triangles.
template <coverage Rule>
struct brick_memory {
    split_setup<Rule> setups[2]; // of a work item and of the next one
    std::uint32_t next;          // the setup's number of the next work item, or of the one after that
    // Bricks that wait, by their position in the grid.
    std::int16_t bricks[Rule == coverage::thin ? 1 : 3][tuning::max_bricks];
};

// Number of parts, a power of two, that a work item is divided into. A warp goes through the bricks of its columns four
// at a time: if there are few work items, more warps with less work finish sooner. A thin piece is one lane's, so it is
// not divided.
template <coverage Rule>
[[nodiscard]] VOXELPIPE_HD inline unsigned parts_of_work_item(unsigned long long items, unsigned warps) {
    unsigned parts = 1;
    if (Rule == coverage::conservative)
        while (parts < split_pieces<Rule>::per_work_item && items * parts * 2 <= warps) parts *= 2;
    return parts;
}

// A lane's piece of a split thin triangle: a row of columns, and the position of its voxels (see thin_columns).
template <class Position>
struct thin_piece {
    core::brick_row row;
    core::row_axes axes;
    int u, v;            // of the row's first column
    std::int32_t w;      // depths count from here
    std::int32_t lo, hi; // depths of the grid that the triangle can have
    Position origin, by_u, by_w;

    // Has no columns if not `wanted`.
    template <class Sink>
    __device__ VOXELPIPE_INLINE thin_piece(const split_setup<coverage::thin>& t, std::int64_t piece, bool wanted,
                                           const Sink& sink)
        : axes(t.pieces.axes), u(static_cast<int>(t.pieces.u(piece))), v(static_cast<int>(t.pieces.v(piece))) {
        const auto& first = t.bricks.first;
        const auto& last = t.bricks.last;
        const auto low = [&](int k) { return static_cast<std::int32_t>(t.pieces.lo[k]); };
        const auto high = [&](int k) { return static_cast<std::int32_t>(t.pieces.hi[k]); };
        wanted = wanted && v >= first[1] && v <= last[1]; // the box within the grid is one voxel wider
        if (wanted && t.bricks.meets_row(u - first[0], v - first[1]))
            row = core::brick_row(t.bricks, u - first[0], v - first[1],
                                  core::max3(u, first[0], low(0)) - u, // columns of the bounding box, within the grid
                                  core::min3(u + core::raster_brick_size - 1, last[0], high(0)) - u);
        w = first[2] + row.base;
        lo = low(2) - w;
        hi = high(2) - w;
        const auto position = [&](int along_u, int along_v, int along_w) {
            const auto p = axes.from_rows(along_u, along_v, along_w);
            return sink.position(p[0], p[1], p[2]);
        };
        origin = position(u, v, w);
        by_u = position(1, 0, 0);
        by_w = position(0, 0, 1);
    }

    // Passes the fragments to a sink that distributes them over all lanes, 32 columns at a time from any lanes' rows.
    // Returns false, with nothing done, if some may lie outside the grid. All lanes call it, with rows of one triangle.
    template <class Sink>
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool emit_by_group(const split_setup<coverage::thin>& t,
                                                                 Sink& sink) const {
        constexpr int most = core::raster_brick_size + 1; // slopes are at most one
        if (!__all_sync(0xffffffffu, row.columns == 0 || (lo <= -most && hi >= most))) return false;
        const int first = row.columns != 0 ? row.first_column() : 0; // lanes without columns are not asked
        sink.distribute(__popc(row.columns), [&](unsigned lane, unsigned i) VOXELPIPE_INLINE_LAMBDA {
            constexpr unsigned all = 0xffffffffu;
            core::brick_row of_lane;
            of_lane.plane = __shfl_sync(all, row.plane, lane);
            of_lane.by_u = __shfl_sync(all, row.by_u, lane);
            of_lane.first = __shfl_sync(all, row.first, lane);
            const int column = __shfl_sync(all, first, lane) + static_cast<int>(i);
            const std::int32_t depth = of_lane.depth(t.bricks, column);
            return __shfl_sync(all, origin, lane) + by_u * column + by_w * depth;
        });
        return true;
    }
    // Emits runs of columns with equal depth. ByPosition: runs that do not lie along x are emitted by position;
    // otherwise all are rows, which are marked too.
    template <bool ByPosition, class Sink>
    __device__ VOXELPIPE_INLINE void emit(const split_setup<coverage::thin>& t, Sink& sink) const {
        if (row.columns == 0) return;
        const int last = row.last_column();
        for (int from = row.first_column(), to = 0; from <= last; from = to + 1) {
            const std::int32_t depth = row.depth(t.bricks, from);
            to = row.last_of_depth(t.bricks, depth, from, last);
            if (depth < lo || depth > hi) continue;
            if (axes.are_along_x()) {
                const auto p = axes.from_rows(u, v, w + depth);
                sink.mark_row(p[0] + from, p[0] + to, p[1], p[2]);
                sink.row(p[0], p[1], p[2], (2u << to) - (1u << from));
                continue;
            }
            if constexpr (ByPosition) {
                sink.emit_line(origin + by_u * from + by_w * depth, by_u, static_cast<unsigned>(to - from + 1));
            } else {
                for (int column = from; column <= to; ++column) {
                    const auto p = axes.from_rows(u + column, v, w + depth);
                    sink.mark_row(p[0], p[0], p[1], p[2]);
                    sink.row(p[0], p[1], p[2], 1u);
                }
            }
        }
    }
};

// The numbers of work items and of split triangles.
struct split_work_items {
    unsigned long long work_items, triangles;

    __device__ VOXELPIPE_INLINE explicit split_work_items(const deferred_triangles& lists) {
        const unsigned long long packed = uniform(*lists.next);
        work_items = packed & ((1ull << lists.work_item_bits) - 1);
        triangles = packed >> lists.work_item_bits;
    }
    // True if all triangles are set up before their work items are drawn: if each warp has several.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool want_setups(const deferred_triangles& lists, unsigned warps) const {
        return triangles <= lists.num_setups && work_items >= tuning::min_items_for_setups * warps &&
               work_items <= lists.oversized_capacity;
    }
};

// Draws a part of a piece of a triangle that takes 128 bits. All lanes call it, with the same triangle.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_wide_piece(const Call& call, Sink& sink, std::uint32_t triangle,
                                                   const split_pieces<Call::rule>& pieces, std::int64_t piece,
                                                   unsigned part, bool valid) {
    const glm::uvec3 index = call.in.source.triangle(triangle);
    const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                 c = call.in.source.position(index.z);
    const bool wanted = valid && pieces.has_rows(piece, part);
    emit_with_retry(sink, [&] {
        if (!wanted) return;
        span_writer<Sink> writer{sink};
        for_each_wide_span<core::to_rule(Call::rule)>(
            a, b, c, call.in.fraction, pieces.piece(piece, part),
            [&](const wide_span& s) { writer.span(pieces.axes.dominant, s.u, s.v, s.w_first, s.w_last); });
        writer.flush();
    });
}

// Draws the pieces of all split triangles; parts warp, warp + warps, ... of the work items are this warp's, a piece per
// lane. Conservative: the lanes find the bricks that the triangle meets in their columns, and group_lanes of them then
// draw a brick each.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_work_items(const Call& call, Sink& sink, brick_memory<Call::rule>& memory,
                                                   unsigned warp, unsigned warps) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr int per_work_item = split_pieces<Call::rule>::per_work_item;
    const unsigned lane = threadIdx.x % 32;
    const split_work_items all(call.lists);
    const unsigned long long items = all.work_items;
    const unsigned parts = parts_of_work_item<Call::rule>(items, warps);
    using setup_type = split_setup<Call::rule>;
    // A kept setup is fetched while the previous work item is drawn, and its number while the one before that is; into
    // registers, they would have to be waited for.
    const bool are_kept = all.want_setups(call.lists, warps) &&
                          setup_type::are_kept(call.lists, static_cast<std::uint32_t>(all.triangles));
    const auto fetch_number = [&](unsigned long long item) VOXELPIPE_INLINE_LAMBDA {
        if (lane == 0 && item < items)
            copy_word(static_cast<std::uint32_t>(__cvta_generic_to_shared(&memory.next)), call.lists.oversized + item);
    };
    if (are_kept) {
        memory.setups[0].fetch(call.lists, call.lists.oversized[warp]);
        fetch_number(std::uint64_t{warp} + warps);
    }
    unsigned which = 0;
    for (unsigned long long i = uniform(warp); i < items * parts; i += warps, which ^= are_kept ? 1u : 0u) {
        const unsigned long long r = i / parts;
        __syncwarp(); // lanes that diverged in the last pieces meet; nobody reads the last setup any longer
        // Work items with kept setups have one part.
        if (are_kept) {
            await_copies();
            __syncwarp();
            const std::uint32_t next = memory.next;
            __syncwarp();
            if (r + warps < items) memory.setups[which ^ 1].fetch(call.lists, next);
            fetch_number(r + 2ull * warps);
        } else {
            const unsigned number = find_last(call.lists.first_work_items, static_cast<unsigned>(all.triangles), r);
            if (lane == 0) memory.setups[0].find(call, number);
            __syncwarp();
        }
        const setup_type& setup = memory.setups[which];
        const split_pieces<Call::rule>& pieces = setup.pieces;
        const unsigned of_item = lane % per_work_item, of_piece = lane / per_work_item;
        const auto piece = static_cast<std::int64_t>((r - setup.first_work_item) * per_work_item + of_item);
        sink.begin(setup.triangle);
        const bool valid =
            piece < pieces.count() && of_item * parts / per_work_item == static_cast<unsigned>(i % parts);
        if (setup.is_narrow == 0) {
            raster_wide_piece(call, sink, setup.triangle, pieces, piece, of_piece, valid);
            continue;
        }
        if constexpr (thin) {
            const thin_piece<position_of_sink<Sink>> found(setup, piece, valid, sink);
            if constexpr (Sink::takes_warp_rounds)
                if (found.emit_by_group(setup, sink)) continue;
            emit_with_retry(
                sink, [&] { found.template emit<Call::output::only_sets || Sink::stages_in_shared>(setup, sink); });
        } else {
            const core::brick_triangle& t = setup.bricks;
            const core::voxel_box &box = setup.box, &reach = setup.reach;
            const int axis = pieces.axes.dominant;
            const auto raster_bricks = [&](int n) {
                __syncwarp();
                for (int first = 0; first < n; first += 32 / tuning::group_lanes) {
                    const int at = first + static_cast<int>(lane) / tuning::group_lanes;
                    emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
                        if (at >= n) return;
                        std::int32_t corner[3]; // in the grid
                        int from[3];            // the same, from the bounding box
                        core::small_box part;
                        for (int k = 0; k < 3; ++k) {
                            corner[k] = memory.bricks[k][at] * core::raster_brick_size;
                            from[k] = corner[k] - static_cast<int>(box.lo[k]);
                            part.lo[k] = reach.lo[k] > corner[k] ? static_cast<int>(reach.lo[k]) - corner[k] : 0;
                            part.hi[k] = reach.hi[k] - corner[k] < core::raster_brick_size - 1
                                             ? static_cast<int>(reach.hi[k]) - corner[k]
                                             : core::raster_brick_size - 1;
                        }
                        sink.mark_brick(corner, lane % tuning::group_lanes);
                        raster_lanes(t.at(from[0], from[1], from[2]), corner, part, sink);
                    });
                }
                __syncwarp();
            };
            int w = 0, w_end = -1; // bricks along w; each of a piece's lanes has every lanes_each-th
            const std::int64_t u0 = pieces.u(piece), v0 = pieces.v(piece);
            if (valid) {
                const auto origin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
                double first = 0, last = 0;
                t.depths(axis, static_cast<int>(u0 - origin[0]), static_cast<int>(v0 - origin[1]), first, last);
                const auto low = static_cast<double>(pieces.lo[2]), high = static_cast<double>(pieces.hi[2]);
                first += static_cast<double>(origin[2]);
                last += static_cast<double>(origin[2]);
                if (first <= high && last >= low) {
                    w = (static_cast<int>(first > low ? first : low) >> core::log2_raster_brick) +
                        static_cast<int>(of_piece);
                    w_end = static_cast<int>(last < high ? last : high) >> core::log2_raster_brick;
                }
            }
            int waiting = 0;
            while (__any_sync(0xffffffffu, w <= w_end)) {
                bool hit = false;
                core::triple<int> brick{};
                if (w <= w_end) {
                    brick = core::to_xyz(axis, static_cast<int>(u0 >> core::log2_raster_brick),
                                         static_cast<int>(v0 >> core::log2_raster_brick), w);
                    hit = t.meets(brick[0] * core::raster_brick_size - static_cast<int>(box.lo[0]),
                                  brick[1] * core::raster_brick_size - static_cast<int>(box.lo[1]),
                                  brick[2] * core::raster_brick_size - static_cast<int>(box.lo[2]));
                }
                w += pieces.lanes_each;
                const int slot = take_slot(hit, waiting);
                if (hit)
                    for (int k = 0; k < 3; ++k) memory.bricks[k][slot] = static_cast<std::int16_t>(brick[k]);
                if (waiting > tuning::max_bricks - 32) {
                    raster_bricks(waiting);
                    waiting = 0;
                }
            }
            raster_bricks(waiting);
        }
    }
}

} // namespace voxelpipe::device
