// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster of large triangles without tiles: each is cut into pieces that warps share out, whatever triangles they belong
// to. Conservative coverage finds the bricks (core/brick_triangle.hpp) that a triangle meets, then the voxels of each;
// thin coverage takes rows of 16 columns. What all pieces of a triangle need of it is found once where there are many
// (large_setup). A triangle that the 64-bit path cannot hold goes through 128 bits.

#include <voxelpipe/device/small_raster.cuh>
#include <voxelpipe/device/triangle_lists.cuh>
#include <voxelpipe/device/wide_path.cuh>
#include <voxelpipe/device/work_share.cuh>

#include <cuda/atomic>

#include <algorithm>

namespace voxelpipe::device {

inline constexpr int most_direct_extent = 1 << 16; // bricks are numbered with 16 bits, voxels with 32
static_assert((std::int64_t{most_direct_extent} / core::brick_size + 1) * (most_direct_extent + 1) < 1u << 31);

// How a large triangle's box of voxels is cut into pieces, a lane each, some to a record, which is a warp's.
// Conservative: columns of bricks along the dominant axis, few, for the bricks of a column keep eight lanes busy, and
// the last warp to end is one with a floor or a wall. Thin: rows of 16 columns of voxels.
template <coverage Rule>
struct large_pieces {
    static constexpr int across = Rule == coverage::thin ? 1 : core::brick_size; // voxels along v
    static constexpr int per_record = Rule == coverage::thin ? 32 : 8;
    int axis;
    core::triple<std::int64_t> lo, hi;            // uvw, the box
    std::int64_t first_u, first_v, per_row, rows; // 32 bits number pieces (most_direct_extent)

    large_pieces() = default;
    VOXELPIPE_HD large_pieces(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])), first_u(lo[0] >> core::log2_brick),
          first_v(lo[1] / across), per_row((hi[0] >> core::log2_brick) - first_u + 1),
          rows(hi[1] / across - first_v + 1) {}
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * rows; }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const { return (count() + per_record - 1) / per_record; }
    // The lowest voxel of piece i along u and v, maybe outside the box.
    [[nodiscard]] VOXELPIPE_HD std::int64_t u(std::int64_t i) const {
        return (first_u + static_cast<std::uint32_t>(i) % static_cast<std::uint32_t>(per_row)) << core::log2_brick;
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t v(std::int64_t i) const {
        return (first_v + static_cast<std::uint32_t>(i) / static_cast<std::uint32_t>(per_row)) * across;
    }
    // A piece by several lanes: whether part `part` of lanes_each has rows within the box, and these as a box of
    // voxels.
    static constexpr int lanes_each = 32 / per_record;
    [[nodiscard]] VOXELPIPE_HD bool has_rows(std::int64_t i, unsigned part) const {
        return first_row(i, part) <= hi[1] && first_row(i, part + 1) > lo[1];
    }
    [[nodiscard]] VOXELPIPE_HD core::voxel_box piece(std::int64_t i, unsigned part) const {
        const std::int64_t u0 = u(i), u1 = u0 + core::brick_size - 1;
        const std::int64_t v0 = first_row(i, part), v1 = first_row(i, part + 1) - 1;
        const auto inside = [&](std::int64_t at, int k) { return at < lo[k] ? lo[k] : at > hi[k] ? hi[k] : at; };
        return {core::to_xyz(axis, inside(u0, 0), inside(v0, 1), lo[2]),
                core::to_xyz(axis, inside(u1, 0), inside(v1, 1), hi[2])};
    }
    // The most records that a triangle can have in a grid.
    [[nodiscard]] static std::uint64_t most_records(glm::ivec3 extent) {
        const auto of = [](std::int64_t along, std::int64_t rest) {
            const std::int64_t pieces = (along / core::brick_size + 1) * (rest / across + 1);
            return static_cast<std::uint64_t>((pieces + per_record - 1) / per_record);
        };
        return core::max3(of(extent.y, extent.z), of(extent.z, extent.x), of(extent.x, extent.y));
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::int64_t first_row(std::int64_t i, unsigned part) const {
        return v(i) + part * (across / lanes_each);
    }
};
// Whichever rule.
[[nodiscard]] inline std::uint64_t most_large_records(glm::ivec3 extent) {
    return std::max(large_pieces<coverage::thin>::most_records(extent),
                    large_pieces<coverage::conservative>::most_records(extent));
}

// Decides about a triangle in full width; records: how many it has, where it is drawn.
template <class Call>
__device__ inline core::triangle_class find_records(const Call& call, std::uint32_t triangle,
                                                    unsigned long long& records) {
    const glm::uvec3 index = call.in.source.triangle(triangle);
    const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                 c = call.in.source.position(index.z);
    const core::voxel_box whole{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
    core::voxel_box reach{};
    core::triangle_class kind = core::classify<Call::rule>(a, b, c, call.in.fraction, whole, reach);
    if (kind != core::triangle_class::drawn) return kind;
    if (Call::rule == coverage::thin && core::has_zero_area(a, b, c)) return core::triangle_class::zero_area;
    const large_pieces<Call::rule> pieces(reach, core::dominant_axis(a, b, c, call.in.fraction));
    records = static_cast<unsigned long long>(pieces.records());
    return kind;
}

// The big triangles that a block left until its end, by all its threads.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void cut_big(const Call& call, Sink& sink, const std::uint32_t* big, unsigned num_big) {
    for (unsigned first = 0; first < num_big; first += blockDim.x) {
        const unsigned at = first + threadIdx.x;
        unsigned long long records = 0;
        const std::uint32_t triangle = at < num_big ? big[at] : 0;
        if (at < num_big) {
            const core::triangle_class kind = find_records(call, triangle, records);
            if (kind != core::triangle_class::drawn) sink.drop(kind);
        }
        __syncwarp();
        call.lists.push_cut(triangle, records);
    }
}

// What all records of a large triangle need of it.
template <coverage Rule>
struct alignas(16) large_setup {
    std::conditional_t<Rule == coverage::thin, core::brick_thin, core::brick_triangle> bricks; // where is_narrow
    core::voxel_box box, reach; // of the triangle; what of it lies in the grid
    large_pieces<Rule> pieces;
    std::uint32_t is_narrow; // or the 64-bit path cannot hold it
    static_assert(sizeof(bricks) + 2 * sizeof(box) + sizeof(pieces) + 16 <= triangle_lists::setup_bytes);

    // Of a triangle that has records, by all lanes of a warp, into its shared memory.
    template <class Call>
    __device__ VOXELPIPE_INLINE void find(const Call& call, std::uint32_t triangle) {
        const int fraction = call.in.fraction;
        const glm::uvec3 index = call.in.source.triangle(triangle);
        const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                     c = call.in.source.position(index.z);
        const core::voxel_box whole{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
        core::voxel_box within{};
        (void)core::classify<Rule>(a, b, c, fraction, whole, within);
        const int axis = core::dominant_axis(a, b, c, fraction);
        const core::voxel_box whole_box = core::bounds(a, b, c, fraction);
        const bool narrow = core::fits_narrow(a, b, c, fraction);
        if (threadIdx.x % 32 == 0) {
            reach = within;
            box = whole_box;
            pieces = large_pieces<Rule>(within, axis);
            is_narrow = narrow;
        }
        if (!narrow) return;
        if constexpr (Rule == coverage::thin) {
            const core::brick_thin t(a, b, c, whole_box, axis, fraction);
            if (threadIdx.x % 32 == 0) bricks = t;
        } else {
            const core::brick_triangle t(a, b, c, whole_box, fraction);
            if (threadIdx.x % 32 == 0) bricks = t;
        }
    }
    // From where another warp has kept it, or to there, for others. All lanes take part; false: it is not there, or not
    // yet, for nobody waits long.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool load(const triangle_lists& lists, unsigned number) {
        const unsigned lane = threadIdx.x % 32;
        unsigned there = 0;
        for (int look = 0; look < 64 && there == 0; ++look) {
            if (lane == 0) there = ready(lists.has_setup[number]).load(::cuda::memory_order_acquire);
            there = __shfl_sync(0xffffffffu, there, 0);
        }
        if (there == 0) return false;
        const auto* const from =
            reinterpret_cast<const uint4*>(lists.setups) + number * (sizeof(*this) / sizeof(uint4));
        for (unsigned i = lane; i < sizeof(*this) / sizeof(uint4); i += 32) reinterpret_cast<uint4*>(this)[i] = from[i];
        return true;
    }
    __device__ VOXELPIPE_INLINE void keep(const triangle_lists& lists, unsigned number) const {
        const unsigned lane = threadIdx.x % 32;
        auto* const to = reinterpret_cast<uint4*>(lists.setups) + number * (sizeof(*this) / sizeof(uint4));
        for (unsigned i = lane; i < sizeof(*this) / sizeof(uint4); i += 32)
            to[i] = reinterpret_cast<const uint4*>(this)[i];
        __threadfence();
        __syncwarp();
        if (lane == 0) ready(lists.has_setup[number]).store(1, ::cuda::memory_order_release);
    }

private:
    using ready = ::cuda::atomic_ref<std::uint32_t, ::cuda::thread_scope_device>;
};

// Rows of bits along x from spans of columns: columns next to each other with one voxel at the same depth become one.
template <class Sink>
struct span_writer {
    Sink& sink;
    int x = 0, y = 0, z = 0; // of the row that waits
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

// The last of n ascending numbers, n > 0, that is at most `number`; the first is. All lanes of a warp take part, with
// the same arguments: each probes a place, so that few loads wait for one another.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned find_last(const unsigned long long* numbers, unsigned n,
                                                             unsigned long long number) {
    const unsigned lane = threadIdx.x % 32;
    unsigned first = 0;
    while (n > 1) {
        const unsigned step = (n + 31) / 32, place = step * lane;
        const bool below = place < n && numbers[first + place] <= number;
        const unsigned skipped = (static_cast<unsigned>(__popc(__ballot_sync(0xffffffffu, below))) - 1) * step;
        first += skipped;
        n = n - skipped < step ? n - skipped : step;
    }
    return uniform(first);
}

inline constexpr int most_bricks = 64;

// What one warp keeps in shared memory for a large triangle.
template <coverage Rule>
struct brick_memory {
    large_setup<Rule> setup;
    std::int16_t bricks[Rule == coverage::thin ? 1 : 3][most_bricks]; // that wait, in bricks of the grid
};

// Into how many parts, a power of two, a record is cut. A warp goes through the bricks of its columns four at a time:
// where there are few records, more warps with less each end sooner. Thin pieces are a lane's own.
template <coverage Rule>
[[nodiscard]] VOXELPIPE_HD inline unsigned parts_of_record(unsigned long long records, unsigned warps) {
    unsigned parts = 1;
    if (Rule == coverage::conservative)
        while (parts < large_pieces<Rule>::per_record && records * parts * 2 <= warps) parts *= 2;
    return parts;
}

// A lane's piece of a large thin triangle: a row of columns, and where its voxels lie (see thin_columns).
template <class Place>
struct thin_piece {
    core::brick_row row;
    int axis, u, v;      // of the row's first column; its depths count from
    std::int32_t w;      // this one
    std::int32_t lo, hi; // depths of the grid that the triangle can have, from the same
    Place origin, by_u, by_w;

    // No columns where it is not `wanted`.
    template <class Sink>
    __device__ VOXELPIPE_INLINE thin_piece(const large_setup<coverage::thin>& t, std::int64_t piece, bool wanted,
                                           const Sink& sink)
        : axis(t.pieces.axis), u(static_cast<int>(t.pieces.u(piece))), v(static_cast<int>(t.pieces.v(piece))) {
        const core::voxel_box& box = t.box;
        const large_pieces<coverage::thin>& pieces = t.pieces;
        const auto first = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
        const auto last = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
        wanted = wanted && v >= first[1] && v <= last[1]; // the box within the grid is a voxel wider
        const auto from_u = static_cast<int>(u - first[0]), from_v = static_cast<int>(v - first[1]);
        if (wanted && t.bricks.meets_row(from_u, from_v)) {
            // Columns of the bounding box, within the grid.
            const std::int64_t begin = u > first[0] ? u : first[0], end = u + core::brick_size - 1;
            row = core::brick_row(t.bricks, from_u, from_v,
                                  static_cast<int>((begin > pieces.lo[0] ? begin : pieces.lo[0]) - u),
                                  static_cast<int>(core::min3(end, last[0], pieces.hi[0]) - u));
        }
        w = static_cast<std::int32_t>(first[2]) + row.base;
        lo = static_cast<std::int32_t>(pieces.lo[2]) - w;
        hi = static_cast<std::int32_t>(pieces.hi[2]) - w;
        const auto place = [&](int along_u, int along_v, int along_w) {
            const auto p = core::to_xyz(axis, along_u, along_v, along_w);
            return sink.place(p[0], p[1], p[2]);
        };
        origin = place(u, v, w);
        by_u = place(1, 0, 0);
        by_w = place(0, 0, 1);
    }

    // For a sink that wants to know how many columns all lanes have; false where that cannot be known, for some may lie
    // outside of the grid. All lanes take part.
    template <class Sink>
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool give_by_rounds(Sink& sink) const {
        constexpr int most = core::brick_size + 1; // slopes are at most one
        if (!__all_sync(0xffffffffu, row.count == 0 || (lo <= -most && hi >= most))) return false;
        core::brick_row left = row;
        sink.rounds(
            left.count, [&]() VOXELPIPE_INLINE_LAMBDA { return left.is_done(); },
            [&]() VOXELPIPE_INLINE_LAMBDA {
                Place at = origin;
                left.next([&](int column, int depth)
                              VOXELPIPE_INLINE_LAMBDA { at = origin + by_u * column + by_w * depth; });
                return at;
            });
        return true;
    }
    // ByPlace: columns that do not lie along x go to where they lie; otherwise all are rows, of which the sink is told.
    template <bool ByPlace, class Sink>
    __device__ VOXELPIPE_INLINE void give(Sink& sink) {
        word mask = 0; // of columns next to each other along x that have one depth
        std::int32_t of_mask = 0;
        const auto give_mask = [&]() VOXELPIPE_INLINE_LAMBDA {
            if (mask == 0) return;
            const auto p = core::to_xyz(axis, u, v, w + of_mask);
            const int low = __ffs(static_cast<int>(mask)) - 1;
            sink.mark_row(p[0] + low, p[0] + 31 - __clz(static_cast<int>(mask)), p[1], p[2]);
            sink.row(p[0], p[1], p[2], mask);
            mask = 0;
        };
        while (!row.is_done()) {
            row.next([&](int column, int depth) VOXELPIPE_INLINE_LAMBDA {
                const bool inside = depth >= lo && depth <= hi;
                if (axis == 2) { // then u is x
                    if (depth != of_mask) give_mask();
                    of_mask = depth;
                    mask |= inside ? 1u << column : 0;
                } else if constexpr (ByPlace) {
                    sink.put(origin + by_u * column + by_w * depth, inside);
                } else if (inside) {
                    const auto p = core::to_xyz(axis, u + column, v, w + depth);
                    sink.mark_row(p[0], p[0], p[1], p[2]);
                    sink.row(p[0], p[1], p[2], 1u);
                }
            });
        }
        give_mask();
    }
};

// The pieces of all triangles in call.lists.cut, a lane each; parts warp, warp + warps, ... of the
// records are this warp's. Conservative: the lanes find the bricks that the triangle meets in their columns, and
// medium_lanes of them then take a brick each.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_records(const Call& call, Sink& sink, brick_memory<Call::rule>& memory,
                                                unsigned warp, unsigned warps) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr auto rule = core::to_rule(Call::rule);
    constexpr int per_record = large_pieces<Call::rule>::per_record;
    using sink_type = Sink;
    const unsigned lane = threadIdx.x % 32;
    const unsigned long long packed = uniform(*call.lists.next);
    const unsigned long long records = packed & ((1ull << triangle_lists::record_bits) - 1);
    const unsigned long long num = packed >> triangle_lists::record_bits;
    const unsigned parts = parts_of_record<Call::rule>(records, warps);
    // Where each warp has several records, all triangles are set up first, for whoever has one of their records.
    const unsigned long long num_first = num <= call.lists.num_setups && records >= 2 * warps ? num : 0;
    for (unsigned long long i = uniform(warp); i < num_first + records * parts; i += warps) {
        const bool is_first = i < num_first;
        const unsigned long long part = i - num_first, r = part / parts;
        __syncwarp(); // lanes that the last pieces kept apart come together; nobody reads the last setup any more
        const unsigned lo =
            is_first ? static_cast<unsigned>(i) : find_last(call.lists.first_records, static_cast<unsigned>(num), r);
        if (is_first || num_first == 0 || !memory.setup.load(call.lists, lo))
            memory.setup.find(call, call.lists.cut[lo]);
        __syncwarp();
        if (is_first) {
            memory.setup.keep(call.lists, lo);
            continue;
        }
        const auto piece = static_cast<std::int64_t>((r - call.lists.first_records[lo]) * per_record + lane);
        sink.begin(call.lists.cut[lo]);
        const large_setup<Call::rule>& setup = memory.setup;
        const large_pieces<Call::rule>& pieces = setup.pieces;
        // Lanes beyond the record's pieces have the number of no part.
        const bool valid = piece < pieces.count() && lane * parts / per_record == part % parts;
        if (setup.is_narrow == 0) {
            const glm::uvec3 index = call.in.source.triangle(call.lists.cut[lo]);
            const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                         c = call.in.source.position(index.z);
            // All lanes: those beyond the record's pieces take part of one.
            const std::int64_t shared = piece - lane + lane % per_record;
            const bool wanted = shared < pieces.count() && lane % per_record * parts / per_record == part % parts &&
                                pieces.has_rows(shared, lane / per_record);
            feed(sink, [&] {
                if (!wanted) return;
                span_writer<sink_type> writer{sink};
                for_each_wide_span<rule>(
                    a, b, c, call.in.fraction, pieces.piece(shared, lane / per_record),
                    [&](const wide_span& s) { writer.span(pieces.axis, s.u, s.v, s.w_first, s.w_last); });
                writer.flush();
            });
            continue;
        }
        if constexpr (thin) {
            const thin_piece<place_of_sink<Sink>> found(setup, piece, valid, sink);
            if constexpr (Sink::has_rounds)
                if (found.give_by_rounds(sink)) continue;
            feed(sink, [&] {
                thin_piece<place_of_sink<Sink>> one = found; // it may come once more
                one.template give<Call::output::only_sets || Sink::buffers>(sink);
            });
        } else {
            const core::brick_triangle& t = setup.bricks;
            const core::voxel_box &box = setup.box, &reach = setup.reach;
            const int axis = pieces.axis;
            const auto raster_bricks = [&](int n) {
                __syncwarp();
                for (int first = 0; first < n; first += 32 / medium_lanes) {
                    const int at = first + static_cast<int>(lane) / medium_lanes;
                    feed(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
                        if (at >= n) return;
                        std::int32_t corner[3]; // in the grid
                        int from[3];            // the same from the bounding box
                        core::small_box part;
                        for (int k = 0; k < 3; ++k) {
                            corner[k] = memory.bricks[k][at] * core::brick_size;
                            from[k] = corner[k] - static_cast<int>(box.lo[k]);
                            part.lo[k] = reach.lo[k] > corner[k] ? static_cast<int>(reach.lo[k]) - corner[k] : 0;
                            part.hi[k] = reach.hi[k] - corner[k] < core::brick_size - 1
                                             ? static_cast<int>(reach.hi[k]) - corner[k]
                                             : core::brick_size - 1;
                        }
                        sink.mark_brick(corner, lane % medium_lanes);
                        raster_lanes(t.at(from[0], from[1], from[2]), corner, part, sink);
                    });
                }
                __syncwarp();
            };
            int w = 0, w_end = -1; // bricks
            const std::int64_t u0 = pieces.u(piece), v0 = pieces.v(piece);
            if (valid) {
                const auto origin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
                double first = 0, last = 0;
                t.depths(axis, static_cast<int>(u0 - origin[0]), static_cast<int>(v0 - origin[1]), first, last);
                const auto low = static_cast<double>(pieces.lo[2]), high = static_cast<double>(pieces.hi[2]);
                first += static_cast<double>(origin[2]);
                last += static_cast<double>(origin[2]);
                if (first <= high && last >= low) {
                    w = static_cast<int>(first > low ? first : low) >> core::log2_brick;
                    w_end = static_cast<int>(last < high ? last : high) >> core::log2_brick;
                }
            }
            int waiting = 0;
            while (__any_sync(0xffffffffu, w <= w_end)) {
                bool hit = false;
                core::triple<int> brick{};
                if (w <= w_end) {
                    brick = core::to_xyz(axis, static_cast<int>(u0 >> core::log2_brick),
                                         static_cast<int>(v0 >> core::log2_brick), w);
                    hit = t.meets(brick[0] * core::brick_size - static_cast<int>(box.lo[0]),
                                  brick[1] * core::brick_size - static_cast<int>(box.lo[1]),
                                  brick[2] * core::brick_size - static_cast<int>(box.lo[2]));
                }
                ++w;
                const int place = take_place(hit, waiting);
                if (hit)
                    for (int k = 0; k < 3; ++k) memory.bricks[k][place] = static_cast<std::int16_t>(brick[k]);
                if (waiting > most_bricks - 32) {
                    raster_bricks(waiting);
                    waiting = 0;
                }
            }
            raster_bricks(waiting);
        }
    }
}

} // namespace voxelpipe::device
