// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster of large triangles without tiles: each is cut into pieces that warps share out, whatever triangles they belong
// to. Conservative coverage finds the bricks (core/brick_triangle.hpp) that a triangle meets, then the voxels of each;
// thin coverage takes rows of 16 columns. A triangle that the 64-bit path cannot hold goes through 128 bits.

#include <voxelpipe/device/small_raster.cuh>
#include <voxelpipe/device/triangle_lists.cuh>
#include <voxelpipe/device/wide_path.cuh>
#include <voxelpipe/device/work_share.cuh>

#include <algorithm>

namespace voxelpipe::device {

inline constexpr int most_direct_extent = 1 << 16; // bricks are numbered with 16 bits, voxels with 32

// How a large triangle's box of voxels is cut into pieces, a lane each, some to a record, which is a warp's.
// Conservative: columns of bricks along the dominant axis, few, for the bricks of a column keep eight lanes busy, and
// the last warp to end is one with a floor or a wall. Thin: rows of 16 columns of voxels.
template <coverage Rule>
struct large_pieces {
    static constexpr int across = Rule == coverage::thin ? 1 : core::brick_size; // voxels along v
    static constexpr int per_record = Rule == coverage::thin ? 32 : 8;
    int axis;
    core::triple<std::int64_t> lo, hi; // uvw, the box
    std::int64_t first_u, first_v, per_row, rows;

    VOXELPIPE_HD large_pieces(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])), first_u(lo[0] >> core::log2_brick),
          first_v(lo[1] / across), per_row((hi[0] >> core::log2_brick) - first_u + 1),
          rows(hi[1] / across - first_v + 1) {}
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * rows; }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const { return (count() + per_record - 1) / per_record; }
    // The lowest voxel of piece i along u and v, maybe outside the box.
    [[nodiscard]] VOXELPIPE_HD std::int64_t u(std::int64_t i) const {
        return (first_u + i % per_row) << core::log2_brick;
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t v(std::int64_t i) const { return (first_v + i / per_row) * across; }
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

// What one warp keeps in shared memory for a large triangle: nothing where coverage is thin.
struct brick_memory {
    core::brick_triangle triangle;
    std::int16_t bricks[3][most_bricks]; // that wait, in bricks of the grid
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

// The pieces of all triangles in call.lists.cut, a lane each; parts warp, warp + warps, ... of the
// records are this warp's. Conservative: the lanes find the bricks that the triangle meets in their columns, and
// medium_lanes of them then take a brick each.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_records(const Call& call, Sink& sink, brick_memory& memory, unsigned warp,
                                                unsigned warps) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr auto rule = core::to_rule(Call::rule);
    constexpr int per_record = large_pieces<Call::rule>::per_record;
    using sink_type = Sink;
    const unsigned lane = threadIdx.x % 32;
    const core::voxel_box whole{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
    const unsigned long long packed = uniform(*call.lists.next);
    const unsigned long long records = packed & ((1ull << triangle_lists::record_bits) - 1);
    const unsigned long long num = packed >> triangle_lists::record_bits;
    const unsigned parts = parts_of_record<Call::rule>(records, warps);
    for (unsigned long long i = uniform(warp); i < records * parts; i += warps) {
        const unsigned long long r = i / parts;
        __syncwarp(); // lanes that the last pieces kept apart come together
        const unsigned lo = find_last(call.lists.first_records, static_cast<unsigned>(num), r);
        const auto piece = static_cast<std::int64_t>((r - call.lists.first_records[lo]) * per_record + lane);
        sink.begin(call.lists.cut[lo]);
        const glm::uvec3 index = call.in.source.triangle(call.lists.cut[lo]);
        const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                     c = call.in.source.position(index.z);
        core::voxel_box reach{};
        (void)core::classify<Call::rule>(a, b, c, call.in.fraction, whole, reach);
        const int axis = core::dominant_axis(a, b, c, call.in.fraction);
        const large_pieces<Call::rule> pieces(reach, axis);
        // Lanes beyond the record's pieces have the number of no part.
        const bool valid = piece < pieces.count() && lane * parts / per_record == i % parts;
        if (!core::fits_narrow(a, b, c, call.in.fraction)) {
            // All lanes: those beyond the record's pieces take part of one.
            const std::int64_t shared = piece - lane + lane % per_record;
            const bool wanted = shared < pieces.count() && lane % per_record * parts / per_record == i % parts &&
                                pieces.has_rows(shared, lane / per_record);
            feed(sink, [&] {
                if (!wanted) return;
                span_writer<sink_type> writer{sink};
                for_each_wide_span<rule>(a, b, c, call.in.fraction, pieces.piece(shared, lane / per_record),
                                         [&](const wide_span& s) { writer.span(axis, s.u, s.v, s.w_first, s.w_last); });
                writer.flush();
            });
            continue;
        }
        const core::voxel_box box = core::bounds(a, b, c, call.in.fraction);
        if constexpr (thin) {
            feed(sink, [&] {
                if (!valid) return;
                const core::brick_thin t(a, b, c, box, axis, call.in.fraction);
                const auto origin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
                const auto last = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
                const std::int64_t u0 = pieces.u(piece), v = pieces.v(piece);
                if (v < origin[1] || v > last[1]) return; // reach is a voxel wider
                const auto u = static_cast<int>(u0 - origin[0]), at_v = static_cast<int>(v - origin[1]);
                if (!t.meets_row(u, at_v)) return;
                // Columns of the bounding box, within the grid.
                const std::int64_t from = u0 > origin[0] ? u0 : origin[0], to = u0 + core::brick_size - 1;
                const std::int64_t begin = from > pieces.lo[0] ? from : pieces.lo[0];
                const std::int64_t end = core::min3(to, last[0], pieces.hi[0]);
                span_writer<sink_type> writer{sink};
                t.from(u, at_v).template row<true>(
                    static_cast<int>(begin - u0), static_cast<int>(end - u0), 0, [&](int column, int depth) {
                        const std::int64_t w = origin[2] + depth;
                        if (w < pieces.lo[2] || w > pieces.hi[2]) return;
                        writer.span(axis, static_cast<int>(u0) + column, static_cast<int>(v), static_cast<int>(w),
                                    static_cast<int>(w));
                    });
                writer.flush();
            });
        } else {
            __syncwarp(); // the last triangle's bricks are done
            {
                const core::brick_triangle t(a, b, c, box, call.in.fraction);
                if (lane == 0) memory.triangle = t;
            }
            __syncwarp();
            const core::brick_triangle& t = memory.triangle;
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
