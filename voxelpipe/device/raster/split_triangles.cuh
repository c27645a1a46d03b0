// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster of large triangles without tiles: each is split into work items, which warps share out, whatever triangles
// they belong to. Conservative coverage finds the bricks (core/brick_triangle.hpp) that a triangle meets, then the
// voxels of each; thin coverage takes rows of 16 columns. If triangles have many work items, each is set up once
// (split_setup). A triangle too large for 64 bits goes through 128.

#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/int128_coverage.cuh>

#include <cuda/atomic>

#include <algorithm>

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
        ::cuda::atomic_ref<unsigned long long, ::cuda::thread_scope_device> kept(*lists.setups_ready);
        bool all = false;
        for (int look = 0; look < tuning::setup_polls && !all; ++look) {
            if (threadIdx.x % 32 == 0) all = kept.load(::cuda::memory_order_relaxed) == num;
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
        sink.share(__popc(row.columns), [&](unsigned lane, unsigned i) VOXELPIPE_INLINE_LAMBDA {
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
        work_items = packed & ((1ull << deferred_triangles::work_item_bits) - 1);
        triangles = packed >> deferred_triangles::work_item_bits;
    }
    // True if all triangles are set up before their work items are drawn: if each warp has several.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool want_setups(const deferred_triangles& lists, unsigned warps) const {
        return triangles <= lists.num_setups && work_items >= tuning::min_items_for_setups * warps &&
               work_items <= lists.oversized_capacity;
    }
};

// Draws the pieces of all split triangles; parts warp, warp + warps, ... of the work items are this warp's, a piece per
// lane. Conservative: the lanes find the bricks that the triangle meets in their columns, and group_lanes of them then
// draw a brick each.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_work_items(const Call& call, Sink& sink, brick_memory<Call::rule>& memory,
                                                   unsigned warp, unsigned warps) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr auto rule = core::to_rule(Call::rule);
    constexpr int per_work_item = split_pieces<Call::rule>::per_work_item;
    using sink_type = Sink;
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
            const glm::uvec3 index = call.in.source.triangle(setup.triangle);
            const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                         c = call.in.source.position(index.z);
            const bool wanted = valid && pieces.has_rows(piece, of_piece);
            emit_with_retry(sink, [&] {
                if (!wanted) return;
                span_writer<sink_type> writer{sink};
                for_each_wide_span<rule>(
                    a, b, c, call.in.fraction, pieces.piece(piece, of_piece),
                    [&](const wide_span& s) { writer.span(pieces.axes.dominant, s.u, s.v, s.w_first, s.w_last); });
                writer.flush();
            });
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
