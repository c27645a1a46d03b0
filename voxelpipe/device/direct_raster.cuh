// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Direct raster: fragments go straight from their triangle into the render targets, without tiles, where the shader is
// constant and every target takes a fragment by one atomic (direct_target.cuh). Coarse raster, sort and tile images
// cost a small triangle more than the few voxels that it touches. Small triangles are small_raster.cuh's; what that
// leaves goes to a list in global memory, which a second kernel shares out by bricks.

#include <voxelpipe/device/direct_target.cuh>
#include <voxelpipe/device/small_raster.cuh>
#include <voxelpipe/device/tile_image.cuh>
#include <voxelpipe/device/wide_path.cuh>
#include <voxelpipe/device/work_share.cuh>

namespace voxelpipe::device {

// Triangles that the small path cannot take, in order of arrival, each with the number of its first record of 32
// chunks: a warp finds the triangle of a record by bisection. `next` packs how many triangles and records there are, so
// that one atomic places both.
struct large_list {
    static constexpr int record_bits = 36;
    std::uint32_t* triangles;
    unsigned long long* first_records;
    unsigned long long* next;
    std::uint32_t* mediums; // small triangles that are much work for one thread
    unsigned long long* num_mediums;

    [[nodiscard]] static large_list take(arena& memory, std::size_t num_triangles) {
        large_list l{};
        l.triangles = memory.take<std::uint32_t>(num_triangles);
        l.first_records = memory.take<unsigned long long>(num_triangles);
        l.mediums = memory.take<std::uint32_t>(num_triangles);
        return l;
    }
    // With its counters, which are zeroed.
    [[nodiscard]] large_list with(pipeline_state* state) const {
        large_list l = *this;
        l.next = &state->next_large;
        l.num_mediums = &state->num_mediums;
        return l;
    }
    [[nodiscard]] static constexpr bool holds(std::uint64_t triangles, std::uint64_t records_each) {
        return triangles < (std::uint64_t{1} << (64 - record_bits)) &&
               triangles * records_each < (std::uint64_t{1} << record_bits);
    }
    __device__ void push(std::uint32_t triangle, unsigned long long records) const {
        const unsigned long long at = atomicAdd(next, (1ull << record_bits) + records);
        triangles[at >> record_bits] = triangle;
        first_records[at >> record_bits] = at & ((1ull << record_bits) - 1);
    }
};

// One draw. Output says where its fragments go, and has the sink that takes them there: framebuffer_output, or
// list_output (list_raster.cuh).
template <coverage Rule, class Source, class Output>
struct direct_call {
    static constexpr coverage rule = Rule;
    using source_type = Source;
    using sink = typename Output::template sink<direct_call>;
    raster_input<Source> in;
    Output out;
    large_list large;
};

inline constexpr int most_direct_extent = 1 << 16; // bricks are numbered with 16 bits, voxels with 32

// ---- large triangles ------------------------------------------------------------------------------------------------

// How a large triangle's box of voxels is cut into pieces, a lane each, 32 to a record. Conservative: columns of bricks
// along the dominant axis. Thin: rows of 16 columns of voxels.
template <coverage Rule>
struct large_pieces {
    static constexpr int across = Rule == coverage::thin ? 1 : core::brick_size; // voxels along v
    int axis;
    core::triple<std::int64_t> lo, hi; // uvw, the box
    std::int64_t first_u, first_v, per_row, rows;

    VOXELPIPE_HD large_pieces(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])), first_u(lo[0] >> core::log2_brick),
          first_v(lo[1] / across), per_row((hi[0] >> core::log2_brick) - first_u + 1),
          rows(hi[1] / across - first_v + 1) {}
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * rows; }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const {
        return (count() + chunks_per_record - 1) / chunks_per_record;
    }
    // The lowest voxel of piece i along u and v, maybe outside the box.
    [[nodiscard]] VOXELPIPE_HD std::int64_t u(std::int64_t i) const {
        return (first_u + i % per_row) << core::log2_brick;
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t v(std::int64_t i) const { return (first_v + i / per_row) * across; }
    // Piece i as a box of voxels.
    [[nodiscard]] VOXELPIPE_HD core::voxel_box piece(std::int64_t i) const {
        const std::int64_t u0 = u(i), v0 = v(i), u1 = u0 + core::brick_size - 1, v1 = v0 + across - 1;
        const auto inside = [&](std::int64_t at, int k) { return at < lo[k] ? lo[k] : at > hi[k] ? hi[k] : at; };
        return {core::to_xyz(axis, inside(u0, 0), inside(v0, 1), lo[2]),
                core::to_xyz(axis, inside(u1, 0), inside(v1, 1), hi[2])};
    }
    // The most records that a triangle can have in a grid.
    [[nodiscard]] static std::uint64_t most_records(glm::ivec3 extent) {
        const auto of = [](std::int64_t along, std::int64_t rest) {
            const std::int64_t pieces = (along / core::brick_size + 1) * (rest / across + 1);
            return static_cast<std::uint64_t>((pieces + chunks_per_record - 1) / chunks_per_record);
        };
        return core::max3(of(extent.y, extent.z), of(extent.z, extent.x), of(extent.x, extent.y));
    }
};

// Decides about a triangle in full width; one that is drawn goes to the list.
template <class Call>
__device__ __noinline__ core::triangle_class push_large(const Call& call, std::uint32_t triangle, glm::uvec3 index) {
    const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                 c = call.in.source.position(index.z);
    const core::voxel_box whole{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
    core::voxel_box reach{};
    core::triangle_class kind = core::classify<Call::rule>(a, b, c, call.in.fraction, whole, reach);
    if (kind != core::triangle_class::drawn) return kind;
    if (Call::rule == coverage::thin && core::has_zero_area(a, b, c)) return core::triangle_class::zero_area;
    const large_pieces<Call::rule> pieces(reach, core::dominant_axis(a, b, c, call.in.fraction));
    call.large.push(triangle, static_cast<unsigned long long>(pieces.records()));
    return kind;
}

// Rows of bits along x from spans of columns: columns next to each other with one voxel at the same depth become one.
template <class Sink>
struct span_writer {
    Sink& sink;
    int x = 0, y = 0, z = 0; // of the row that waits
    word mask = 0;

    __device__ VOXELPIPE_INLINE void flush() {
        if (mask != 0) sink.row(x, y, z, mask);
        mask = 0;
    }
    __device__ VOXELPIPE_INLINE void span(int axis, int u, int v, int w0, int w1) {
        if (axis == 0) {
            for (int at = w0; at <= w1; at += 32) {
                const int n = w1 - at + 1;
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

// ---- kernels --------------------------------------------------------------------------------------------------------

// Before anything is written: whether every index is one of a vertex.
template <class Index>
__global__ void check_indices_kernel(const Index* indices, std::uint64_t count, Index num_vertices,
                                     pipeline_state* state) {
    bool bad = false;
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    std::uint64_t done = 0;
    if (reinterpret_cast<std::uintptr_t>(indices) % 16 == 0) {
        for (std::uint64_t i = thread; i < count / 4; i += threads) {
            const uint4 v = __ldg(reinterpret_cast<const uint4*>(indices) + i);
            bad = bad || v.x >= num_vertices || v.y >= num_vertices || v.z >= num_vertices || v.w >= num_vertices;
        }
        done = count / 4 * 4;
    }
    for (std::uint64_t i = done + thread; i < count; i += threads) bad = bad || indices[i] >= num_vertices;
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, 1u);
}

// What every sink of a direct call does with triangles that have no fragments here.
template <class Call>
struct direct_sink {
    const Call& call;
    unsigned* dropped; // by triangle_class, of the block; null where all triangles are drawn

    [[nodiscard]] __device__ VOXELPIPE_INLINE core::triangle_class big(std::uint32_t triangle,
                                                                       const glm::uvec3& index) {
        return push_large(call, triangle, index);
    }
    __device__ VOXELPIPE_INLINE void mediums(bool wanted, std::uint32_t triangle) {
        const unsigned who = __ballot_sync(0xffffffffu, wanted);
        if (who == 0) return;
        const unsigned lane = threadIdx.x % 32;
        unsigned long long first = 0;
        if (lane == 0) first = atomicAdd(call.large.num_mediums, static_cast<unsigned long long>(__popc(who)));
        first = __shfl_sync(0xffffffffu, first, 0);
        if (wanted) call.large.mediums[first + static_cast<unsigned>(__popc(who & ((1u << lane) - 1)))] = triangle;
    }
    __device__ VOXELPIPE_INLINE void drop(core::triangle_class kind) {
        atomicAdd(&dropped[static_cast<int>(kind)], 1u);
    }
};

// Fragments go into the targets.
template <class Call>
struct blending_sink : direct_sink<Call> {
    static constexpr bool names_triangles = false;
    static constexpr bool buffers = false;
    static constexpr bool checks_indices = false; // check_indices has run
    static constexpr int min_blocks = raster_min_blocks;
    struct memory {};

    // Fragments and first touches of one thread, which cannot write 2^32 before the largest list ends.
    unsigned fragments = 0, touched = 0;

    __device__ VOXELPIPE_INLINE blending_sink(const Call& call, unsigned* dropped, memory&)
        : direct_sink<Call>{call, dropped} {}
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool check(const glm::uvec3&) { return true; }
    __device__ VOXELPIPE_INLINE static void begin(std::uint32_t) {}
    // In the voxels x0 + i of a row, for the bits i of the mask.
    __device__ VOXELPIPE_INLINE void row(int x0, int y, int z, word mask) {
        if (mask == 0) return;
        fragments += static_cast<unsigned>(__popc(mask));
        each_target([&]<std::size_t K>(const auto& t, bool count_first) VOXELPIPE_INLINE_LAMBDA {
            touched += blend_row(t, x0, y, z, mask, voxelpipe::get<K>(this->call.out.values), count_first);
        });
    }
    // Rows as in blend_rows.
    __device__ VOXELPIPE_INLINE void two(int x, int y, int z, const word (&mask)[2], bool along_y) {
        fragments += static_cast<unsigned>(__popc(mask[0] | mask[1] << 2));
        rows(x, y, z, mask, along_y);
    }
    __device__ VOXELPIPE_INLINE void four(int x, int y, int z, const word (&mask)[4]) {
        fragments += static_cast<unsigned>(__popc(mask[0] | mask[1] << 2 | mask[2] << 4 | mask[3] << 6));
        rows(x, y, z, mask, false);
    }
    // The voxels position(i) for the bits i of a mask.
    template <class Position>
    __device__ VOXELPIPE_INLINE void voxels(word bits, const Position& position) {
        for (; bits != 0; bits &= bits - 1) {
            const glm::ivec3 p = position(__ffs(static_cast<int>(bits)) - 1);
            row(p.x, p.y, p.z, 1u);
        }
    }
    // Adds up; all threads of the block take part.
    __device__ void finish(pipeline_state* state) const {
        const auto add = [](unsigned mine, unsigned long long* total) {
            const unsigned long long sum = block_sum(mine);
            if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
        };
        add(fragments, &state->fragments);
        if (this->call.out.counting_target >= 0) add(touched, &state->voxels);
    }

private:
    template <int N>
    __device__ VOXELPIPE_INLINE void rows(int x, int y, int z, const word (&mask)[N], bool along_y) {
        each_target([&]<std::size_t K>(const auto& t, bool count_first) VOXELPIPE_INLINE_LAMBDA {
            touched += blend_rows(t, x, y, z, mask, along_y, voxelpipe::get<K>(this->call.out.values), count_first);
        });
    }
    template <class F>
    __device__ VOXELPIPE_INLINE void each_target(F&& f) const {
        core::for_each_index<targets_of<decltype(this->call.out.fb)>::count>([&]<std::size_t K>() {
            const auto& t = voxelpipe::get<K>(this->call.out.fb.targets);
            if (t.load != load_operation::off)
                f.template operator()<K>(t, this->call.out.counting_target == static_cast<int>(K));
        });
    }
};

template <class Framebuffer, class Values>
struct framebuffer_output {
    template <class Call>
    using sink = blending_sink<Call>;
    Framebuffer fb;
    Values values;
    int counting_target; // which target tells first touches, for the voxel counter; -1: none is wanted
};

// Whether a triangle's fragments are found and written, or why it has none, is decided here for each of them.
template <class Call>
__global__ __launch_bounds__(raster_threads,
                             Call::sink::min_blocks) void direct_raster_kernel(const __grid_constant__ Call call,
                                                                               pipeline_state* state) {
    using core::triangle_class;
    using sink_type = typename Call::sink;
    constexpr int warps = raster_threads / 32;
    __shared__ warp_queues queues[warps];
    __shared__ typename sink_type::memory memories[warps];
    __shared__ int left[3][warps];
    __shared__ unsigned dropped[5]; // by triangle_class
    if constexpr (!sink_type::checks_indices) {
        if (state->index_error != 0) return;
    }
    if (threadIdx.x < 5) dropped[threadIdx.x] = 0;
    __syncthreads();
    sink_type sink(call, dropped, memories[threadIdx.x / 32]);
    raster_warp<Call::rule, typename Call::source_type, sink_type> warp{call.in, queues[threadIdx.x / 32], sink};
    const unsigned looked_at = warp.run(queues, left);
    sink.finish(state);
    const unsigned long long all = block_sum(threadIdx.x % 32 == 0 ? looked_at : 0);
    if (threadIdx.x == 0) {
        const auto number = [&](triangle_class kind, unsigned long long* total) {
            const unsigned n = dropped[static_cast<int>(kind)];
            if (n != 0) atomicAdd(total, static_cast<unsigned long long>(n));
            return n;
        };
        const unsigned none =
            number(triangle_class::nonfinite, &state->nonfinite) + number(triangle_class::too_far, &state->too_far) +
            number(triangle_class::zero_area, &state->zero_area) + number(triangle_class::outside, &state->outside);
        if (all != none) atomicAdd(&state->drawn, all - none);
    }
}

inline constexpr int large_warps = 4; // of a block
inline constexpr int most_bricks = 64;

// What one warp keeps in shared memory for a large triangle.
struct large_memory {
    core::brick_triangle triangle;
    std::int16_t bricks[3][most_bricks]; // that wait, in bricks of the grid
};

// What direct_raster_kernel left. medium_lanes take a triangle of the small path; a warp takes a record: 32 pieces of a
// large triangle, a lane each. Conservative: the lanes find the bricks that the
// triangle meets in their columns, and medium_lanes of them then take a brick each.
template <class Call>
__global__ __launch_bounds__(32 * large_warps, 4) void direct_large_kernel(const __grid_constant__ Call call,
                                                                           pipeline_state* state) {
    constexpr bool thin = Call::rule == coverage::thin;
    constexpr auto rule = core::to_rule(Call::rule);
    using sink_type = typename Call::sink;
    __shared__ large_memory memories[thin ? 1 : large_warps];
    __shared__ typename sink_type::memory sink_memories[large_warps];
    if (state->index_error != 0) return;
    const unsigned long long packed = *call.large.next;
    const unsigned long long records = packed & ((1ull << large_list::record_bits) - 1);
    const unsigned long long num = packed >> large_list::record_bits;
    const unsigned long long warps = std::uint64_t{gridDim.x} * large_warps;
    const unsigned lane = threadIdx.x % 32;
    const core::voxel_box whole{{{0, 0, 0}}, {{call.in.extent.x - 1, call.in.extent.y - 1, call.in.extent.z - 1}}};
    sink_type sink(call, nullptr, sink_memories[threadIdx.x / 32]);
    const unsigned long long num_mediums = *call.large.num_mediums;
    const unsigned long long thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    constexpr unsigned at_once = 32 / medium_lanes; // triangles of a warp
    for (unsigned long long first = thread / 32 * at_once; first < num_mediums; first += warps * at_once) {
        const unsigned long long m = first + lane / medium_lanes;
        raster_medium<Call::rule>(call.in, m < num_mediums, m < num_mediums ? call.large.mediums[m] : 0, sink);
    }
    __syncwarp();
    for (unsigned long long r = thread / 32; r < records; r += warps) {
        unsigned long long lo = 0, hi = num; // the last triangle whose records begin at or before r
        while (hi - lo > 1) {
            const unsigned long long middle = lo + (hi - lo) / 2;
            if (call.large.first_records[middle] <= r)
                lo = middle;
            else
                hi = middle;
        }
        const auto piece = static_cast<std::int64_t>((r - call.large.first_records[lo]) * chunks_per_record + lane);
        sink.begin(call.large.triangles[lo]);
        const glm::uvec3 index = call.in.source.triangle(call.large.triangles[lo]);
        const core::snapped_position a = call.in.source.position(index.x), b = call.in.source.position(index.y),
                                     c = call.in.source.position(index.z);
        core::voxel_box reach{};
        (void)core::classify<Call::rule>(a, b, c, call.in.fraction, whole, reach);
        const int axis = core::dominant_axis(a, b, c, call.in.fraction);
        const large_pieces<Call::rule> pieces(reach, axis);
        const bool valid = piece < pieces.count();
        if (!core::fits_narrow(a, b, c, call.in.fraction)) {
            feed(sink, [&] {
                if (!valid) return;
                span_writer<sink_type> writer{sink};
                for_each_wide_span<rule>(a, b, c, call.in.fraction, pieces.piece(piece),
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
            large_memory& memory = memories[threadIdx.x / 32];
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
    sink.finish(state);
}

inline void check_indices(const glm::uvec3* triangles, std::uint64_t num_triangles, std::uint64_t num_vertices,
                          pipeline_state* state, cudaStream_t stream) {
    check_indices_kernel<std::uint32_t><<<fill_device(num_triangles), threads_per_block, 0, stream>>>(
        reinterpret_cast<const std::uint32_t*>(triangles), 3 * num_triangles, static_cast<std::uint32_t>(num_vertices),
        state);
    check(cudaGetLastError(), stage::coarse_raster);
}

template <class Call>
void direct_raster(const Call& call, pipeline_state* state, stage where, cudaStream_t stream) {
    const unsigned blocks = raster_blocks(call.in.num_triangles, Call::sink::min_blocks);
    direct_raster_kernel<Call><<<blocks, raster_threads, 0, stream>>>(call, state);
    check(cudaGetLastError(), where);
    direct_large_kernel<Call>
        <<<static_cast<unsigned>(num_multiprocessors()) * 4, 32 * large_warps, 0, stream>>>(call, state);
    check(cudaGetLastError(), where);
}

} // namespace voxelpipe::device
