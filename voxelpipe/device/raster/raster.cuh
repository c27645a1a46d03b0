// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Raster without tiles: fragments go from their triangle straight to a sink. Coarse raster, sort and tile images cost a
// small triangle more than the few voxels that it touches. The first pass reads the mesh once, draws what costs next to
// nothing, and defers the rest by size class (raster/deferred_triangles.cuh), so that warps of the deferred pass have
// 32 triangles of a class.

#include <voxelpipe/device/raster/blend_sink.cuh>
#include <voxelpipe/device/raster/block_pass.cuh>
#include <voxelpipe/device/raster/deferred_pass.cuh>
#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/raster/oversized.cuh>
#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/raster/split_triangles.cuh>
#include <voxelpipe/device/raster/warp_combine.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

namespace voxelpipe::device {

// ---- the first pass: every triangle ---------------------------------------------------------------------------------

// Blocks per multiprocessor: bounds the registers.
template <class Call>
inline constexpr int first_min_blocks = tuning::first_blocks(Call::rule, Call::sink::stages_in_shared);

// Thin triangles of up to 2 x 2 x 2 voxels that are redone in integers: those that floats cannot decide, and those of
// warps with few. Each takes a column of words.
struct cube_queue {
    std::int32_t q[9][tuning::queue_slots];
    std::uint32_t triangle[tuning::queue_slots]; // by warp_triangles
};
struct no_queue {};
// For thin coverage: the cubes, and when none waits, the rows for draw_remaining.
union cubes_or_rows {
    cube_queue cubes;
    kept_rows rows;
};

// Shared memory of one warp of the first pass.
template <class Call>
struct first_memory {
    class_queues queues;
    std::conditional_t<Call::rule == coverage::thin, cubes_or_rows, no_queue> thin;
    typename Call::sink::memory sink;
};

// True if the first pass can set close cubes together (raster/warp_combine.cuh).
template <class Call>
inline constexpr bool has_close_cubes = Call::output::only_sets && (Call::rule == coverage::conservative);

// A warp of the first pass. Every warp has its own queues, so no thread waits for another warp. Close: batches are
// tried as close cubes.
template <class Call, bool Close>
struct first_warp {
    static constexpr bool thin = Call::rule == coverage::thin;
    using triangle_class = core::triangle_class;
    using sink_type = typename Call::sink;
    using corners_type = loaded_corners<typename Call::source_type>;
    // True if the vertices of a batch are loaded before the fragments of the previous one are blended. Not for
    // conservative coverage of bits, which first reads words: they would wait behind the vertices (5 % slower).
    static constexpr bool loads_ahead = thin || sink_type::stages_in_shared;

    const Call& call;
    first_memory<Call>& memory;
    sink_type& sink;
    class_writer& writer;
    std::uint32_t* oversized; // the block's oversized triangles
    unsigned& num_oversized;
    bool defers_rest;  // what waits at the end goes to the deferred pass, few as it may be
    int num_cubes = 0; // thin triangles that wait
    static constexpr std::uint32_t not_close =
        1u << 31; // flag of a code, which has 16 bits: the previous batch was not close

    // Draws, queues or defers the lane's triangle i, if valid; load() returns it. code: by warp_triangles, possibly
    // with not_close. load_next() is called between coverage and blending, while few registers are in use.
    template <class Load, class LoadNext>
    __device__ VOXELPIPE_INLINE void batch(std::uint32_t i, std::uint32_t& code, bool valid, const Load& load,
                                           const LoadNext& load_next) {
        // Longest side of the bounding box of a triangle still to draw, oversized_side, or 0. An int instead of several
        // bools (see inside()).
        int side = 0, inside = 0;
        int32_triangle r;
        if (valid) {
            r = load();
            inside = r.inside(call.in.extent);
            side = side_to_draw<Call::rule>(call.in, r, inside);
            if (side == 0) sink.drop(triangle_class::outside);
        }
        if constexpr (!thin) {
            if (!draws_slim(i, r, inside, side, load_next)) {
                const word bits = find_cube(call.in, side != 0 && side <= 2, r, inside);
                load_next();
                bool is_done = false;
                if constexpr (Close) is_done = sets_close_cubes(code, r, bits);
                if (!is_done)
                    emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
                        if (bits == 0) return;
                        sink.begin(i);
                        emit_cube(r, bits, sink);
                    });
                side = bits != 0 ? 0 : side;
            }
        } else {
            const bool is_cube = side != 0 && side <= 2;
            const bool at_once = __popc(__ballot_sync(0xffffffffu, is_cube)) >= tuning::min_thin_cubes;
            bool sure = false;
            core::thin_cube cube{};
            if (at_once && is_cube) cube = core::thin_cube_by_signs(r.q, r.lo, r.last, call.in.fraction, sure);
            if (__any_sync(0xffffffffu, is_cube && !sure)) {
                const int at = take_slot(is_cube && !sure, num_cubes);
                if (is_cube && !sure) {
                    for (int k = 0; k < 9; ++k) memory.thin.cubes.q[k][at] = r.q[k / 3][k % 3];
                    memory.thin.cubes.triangle[at] = code;
                }
            }
            load_next();
            if (at_once)
                emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
                    if (!sure) return;
                    sink.begin(i);
                    emit_thin_cube(call.in, r, cube, sink);
                });
            side = is_cube ? 0 : side;
        }
        if (__any_sync(0xffffffffu, side != 0)) {
            writer.push(side != 0 && side != oversized_side ? size_class_of<Call::rule>(r, side) : -1, code);
            // A function call here would spill the caller's registers.
            if (side == oversized_side) {
                const unsigned at = atomicAdd(&num_oversized, 1u);
                if constexpr (!finds_oversized_again<typename Call::output>) oversized[at] = i;
            }
        }
        __syncwarp();
        if constexpr (thin)
            if (num_cubes >= 32) drain_cubes<true>();
    }

    // Tries to set what find_cube found, for the whole warp; returns true if it did. After a batch that is not close,
    // 15 are not tried.
    __device__ VOXELPIPE_INLINE bool sets_close_cubes(std::uint32_t& code, const int32_triangle& r, word bits) {
        const bool looks = (code & not_close) == 0 || code / 32 % tuning::batches_not_close == 0;
        if (looks && set_close_cubes(voxelpipe::get<0>(call.out.fb.targets), r.lo, bits)) {
            code &= ~not_close;
            sink.count(bits);
            return true;
        }
        code |= not_close;
        return false;
    }

    // Tries to draw triangles with slim boxes, for conservative coverage; returns false, with nothing done, if the warp
    // has too few that are three voxels long.
    template <class LoadNext>
    __device__ VOXELPIPE_INLINE bool draws_slim(std::uint32_t i, const int32_triangle& r, int inside, int& side,
                                                const LoadNext& load_next) {
        if (__popc(__ballot_sync(0xffffffffu, side == 3)) < tuning::min_slim) return false;
        core::slim_rows rows{};
        if (side != 0 && side <= 3 && inside >= 0 && core::is_slim(r.last))
            rows = core::slim_rows_by_signs(r.q, r.lo, r.last, call.in.fraction);
        load_next();
        emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
            if (rows.bits == 0) return;
            sink.begin(i);
            sink.slim(r.lo[0], r.lo[1], r.lo[2], rows);
        });
        side = rows.bits != 0 ? 0 : side;
        return true;
    }

    // Draws the last 32 waiting cubes; all of them, possibly fewer, if not AllLanes.
    template <bool AllLanes>
    __device__ VOXELPIPE_INLINE void drain_cubes() {
        const int lane = static_cast<int>(threadIdx.x) % 32;
        const bool wanted = AllLanes || lane < num_cubes;
        num_cubes = AllLanes ? num_cubes - 32 : 0;
        const int at = wanted ? num_cubes + lane : 0;
        int32_triangle r;
        for (int k = 0; k < 9; ++k) r.q[k / 3][k % 3] = memory.thin.cubes.q[k][at];
        r.fits_int32 = true;
        r.find_box(call.in.fraction);
        emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
            if (!wanted) return;
            sink.begin(warp_triangles::of(memory.thin.cubes.triangle[at]));
            raster_tiny<Call::rule>(call.in, r, sink);
        });
        __syncwarp();
    }

    // Draws all batches of this warp; `index`: the vertices of the lane's first triangle. Returns how many triangles it
    // read.
    __device__ VOXELPIPE_INLINE unsigned run(glm::uvec3 index) {
        const unsigned lane = threadIdx.x % 32;
        const std::uint32_t step = gridDim.x * tuning::raster_threads, num = call.in.num_triangles;
        const std::uint32_t begin = blockIdx.x * tuning::raster_threads + warp_in_block() * 32;
        // Indices are loaded one batch ahead, or two if vertices are loaded ahead too.
        if constexpr (loads_ahead) {
            bool valid = begin + lane < num && sink.check(index);
            corners_type corners;
            if (valid) corners = load_corners(call.in, index);
            index = load_index(call.in, begin + step + lane);
            for (std::uint32_t first = begin, code = lane; first < num; first += step, code += 32) {
                const std::uint32_t next = first + step + lane;
                const glm::uvec3 index_of_second = load_index(call.in, next + step);
                const auto load = [&]() VOXELPIPE_INLINE_LAMBDA { return make_int32_triangle(call.in, corners); };
                batch(first + lane, code, valid, load, [&]() VOXELPIPE_INLINE_LAMBDA {
                    valid = next < num && sink.check(index);
                    if (valid) corners = load_corners(call.in, index);
                });
                index = index_of_second;
            }
        } else {
            for (std::uint32_t first = begin, code = lane; first < num; first += step, code += 32) {
                const glm::uvec3 next = load_index(call.in, first + step + lane);
                const auto load = [&]() VOXELPIPE_INLINE_LAMBDA { return load_int32(call.in, index); };
                batch(first + lane, code, first + lane < num && sink.check(index), load,
                      []() VOXELPIPE_INLINE_LAMBDA {});
                index = next;
            }
        }
        if constexpr (thin) {
            if (defers_rest) { // the remaining cubes too
                const int at = static_cast<int>(lane);
                writer.push(at < num_cubes ? static_cast<int>(size_class::tiny) : -1, memory.thin.cubes.triangle[at]);
            } else if (num_cubes != 0) {
                drain_cubes<false>();
            }
        }
        if (begin >= num) return 0;
        const std::uint32_t batches = (num - begin - 1) / step + 1, of_last = num - (begin + (batches - 1) * step);
        return (batches - 1) * 32 + (of_last < 32 ? of_last : 32);
    }
};

// Draws the n triangles, at most 32 and none of them large, that wait in the block's queues, by one warp, a thread
// each.
template <class Call>
__device__ __noinline__ typename Call::sink::totals
draw_remaining(const Call& call, unsigned* dropped, first_memory<Call> (&memories)[raster_warps],
               const unsigned (&waiting)[size_class::count][raster_warps], unsigned n) {
    first_memory<Call>& memory = memories[warp_in_block()];
    typename Call::sink sink(call, dropped, memory.sink);
    unsigned at = threadIdx.x % 32;
    const bool wanted = at < n;
    int size = 0;
    std::uint32_t triangle = 0;
    int32_triangle r{};
    if (wanted) {
        unsigned warp = 0;
        while (at >= waiting[size][warp]) {
            at -= waiting[size][warp];
            warp = (warp + 1) % raster_warps;
            size += warp == 0 ? 1 : 0;
        }
        triangle = warp_triangles::of(memories[warp].queues.triangles[size][at], warp);
        r = load_int32(call.in, call.in.source.triangle(triangle));
    }
    emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
        if (!wanted) return;
        sink.begin(triangle);
        if (size == size_class::tiny)
            raster_tiny<Call::rule>(call.in, r, sink);
        else if constexpr (Call::rule == coverage::thin)
            raster_small<Call::rule, true>(call.in, r, lane_rows(memory.thin.rows), sink);
        else
            raster_small<Call::rule, true>(call.in, r, no_rows{}, sink);
    });
    return sink.end();
}

// The first pass. `again`: a copy of the call for out-of-line functions. If its own address were taken, the compiler
// would reload the call after each reduction.
template <class Call, bool Close>
__global__ __launch_bounds__(tuning::raster_threads,
                             first_min_blocks<Call>) void first_pass_kernel(const __grid_constant__ Call call,
                                                                            const __grid_constant__ Call again,
                                                                            deferral deferred, pipeline_state* state) {
    using sink_type = typename Call::sink;
    __shared__ first_memory<Call> memories[raster_warps];
    __shared__ unsigned slots[size_class::count][raster_warps];
    __shared__ unsigned dropped[num_triangle_classes], num_oversized;
    const glm::uvec3 index = load_index(call.in, blockIdx.x * tuning::raster_threads + threadIdx.x);
    await_stream();
    const bool draws_few = Call::output::may_draw_few && deferred != deferral::by_pass;
    if (Call::output::may_draw_few && deferred == deferral::by_blocks)
        call.out.prepare(std::uint64_t{blockIdx.x} * tuning::raster_threads + threadIdx.x,
                         std::uint64_t{gridDim.x} * tuning::raster_threads);
    if (call.out.is_checked() && state->index_error != 0) return;
    if (threadIdx.x < num_triangle_classes) dropped[threadIdx.x] = 0;
    if (threadIdx.x == 0) num_oversized = 0;
    __syncthreads();
    first_memory<Call>& memory = memories[warp_in_block()];
    sink_type sink(call, dropped, memory.sink);
    class_writer writer{call.lists, memory.queues};
    std::uint32_t* oversized = nullptr;
    if constexpr (!finds_oversized_again<typename Call::output>) {
        const std::uint32_t step = gridDim.x * tuning::raster_threads, batches = (call.in.num_triangles - 1) / step + 1;
        oversized = call.lists.oversized + std::size_t{blockIdx.x} * batches * tuning::raster_threads;
    }
    first_warp<Call, Close> warp{call, memory, sink, writer, oversized, num_oversized, !draws_few};
    const unsigned looked_at = warp.run(index);
    __syncthreads();
    if constexpr (!finds_oversized_again<typename Call::output>)
        split_oversized(call, sink, warp.oversized, num_oversized);
    else if (num_oversized != 0)
        split_oversized_again(again, dropped, memory.sink);
    writer.note(slots);
    int left = class_writer::many;
    if (draws_few)
        left = writer.count();
    else
        __syncthreads();
    if (left >= class_writer::many) {
        writer.finish(slots);
    } else if (left != 0 && threadIdx.x < 32) {
        (void)sink.end(); // flushes; the memory becomes another sink's
        sink.take_over(draw_remaining(again, dropped, memories, slots, static_cast<unsigned>(left)));
    }
    sink.finish(state);
    count_looked_at(looked_at, dropped, state);
}

// ---- host -----------------------------------------------------------------------------------------------------------

// Blocks of the first pass: as many as fit the device at once, but no fewer than warp_triangles needs to number their
// rounds.
[[nodiscard]] inline unsigned raster_blocks(std::uint32_t num_triangles, int per_multiprocessor) {
    const std::uint32_t batches = core::blocks_for_each(num_triangles, tuning::raster_threads);
    const auto at_once = static_cast<std::uint32_t>(num_multiprocessors() * per_multiprocessor);
    return std::min(batches, std::max(at_once, core::blocks_for_each(batches, warp_triangles::max_rounds)));
}

// True if blocks of the first pass can draw what they would defer, if calls of one draw like this one deferred `left`
// triangles.
[[nodiscard]] inline bool defers_few(std::size_t num_triangles, std::uint64_t left) {
    const std::uint64_t batches = core::blocks_for_each(num_triangles, tuning::raster_threads);
    const auto at_once = static_cast<std::uint64_t>(num_multiprocessors()) * tuning::max_left_blocks;
    return left <= std::min(batches, at_once) * tuning::max_left_of_block;
}

// The first pass alone. is_first: these are a call's first kernels. They read indices before they wait for the stream,
// so they must not start early: a kernel of the caller may still be writing them.
template <class Call>
void launch_first_pass(const Call& call, pipeline_state* state, stage where, cudaStream_t stream, bool is_first,
                       deferral deferred = deferral::by_pass) {
    static_assert(fragment_sink<typename Call::sink> && fragment_sink<typename Call::deferred_sink>);
    const unsigned triangles = call.in.num_triangles;
    if constexpr (Call::output::defers) {
        bool are_close = false;
        if constexpr (has_close_cubes<Call>) are_close = may_be_close(triangles, call.in.extent);
        const unsigned blocks = raster_blocks(triangles, first_min_blocks<Call>);
        const auto launch = [&]<bool Close>() {
            launch_kernel(!is_first, first_pass_kernel<Call, Close>, blocks, tuning::raster_threads, 0, stream, where,
                          call, call, deferred, state);
        };
        if (are_close)
            launch.template operator()<has_close_cubes<Call>>();
        else
            launch.template operator()<false>();
    } else {
        launch_kernel(!is_first, block_raster_kernel<Call>, raster_blocks(triangles, tuning::value_blocks),
                      tuning::raster_threads, 0, stream, where, call, state);
    }
}
template <class Call>
void launch_deferred_pass(const Call& call, pipeline_state* state, stage where, cudaStream_t stream) {
    const auto multiprocessors = static_cast<unsigned>(num_multiprocessors());
    launch_behind(deferred_pass_kernel<Call>, multiprocessors * deferred_min_blocks<Call>, tuning::raster_threads,
                  stream, where, call, state);
}
// The raster of a draw; arguments as above.
template <class Call>
void launch_raster(const Call& call, pipeline_state* state, stage where, cudaStream_t stream, bool is_first = false,
                   deferral deferred = deferral::by_pass) {
    launch_first_pass(call, state, where, stream, is_first, deferred);
    if (deferred != deferral::by_blocks) launch_deferred_pass(call, state, where, stream);
}

} // namespace voxelpipe::device
