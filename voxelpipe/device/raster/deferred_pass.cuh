// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The deferred pass: draws what the first pass left (raster/raster.cuh), in warps of 32 triangles of one class, and
// split triangles by work items.

#include <voxelpipe/device/raster/blend_sink.cuh>
#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/raster/list_walk.hpp>
#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/raster/split_triangles.cuh>
#include <voxelpipe/device/raster/warp_combine.cuh>

namespace voxelpipe::device {

// Blocks per multiprocessor: bounds the registers.
template <class Call>
inline constexpr int deferred_min_blocks = tuning::deferred_blocks(Call::rule, Call::sink::stages_in_shared);

// Draws all work items. Out of line, so that their registers are not reserved while other triangles are drawn. Does not
// wait for other warps of the block.
template <class Call>
__device__ __noinline__ typename Call::deferred_sink::totals
raster_all_work_items(const Call& call, unsigned* dropped, brick_memory<Call::rule>& bricks,
                      typename Call::deferred_sink::memory& memory, unsigned warp, unsigned warps) {
    typename Call::deferred_sink sink(call, dropped, memory);
    raster_work_items(call, sink, bricks, warp, warps);
    __syncwarp();
    return sink.end();
}

// Sets up the warp's share of the split triangles (raster/split_setup.cuh).
template <class Call>
__device__ __noinline__ void keep_setups(const Call& call, unsigned warp, unsigned warps) {
    const split_work_items all(call.lists);
    if (all.want_setups(call.lists, warps))
        split_setup<Call::rule>::keep(call, warp, warps, static_cast<std::uint32_t>(all.triangles));
}

// A warp's position in the deferred pass.
struct warp_position {
    unsigned warp, warps; // of the whole launch
    unsigned lane;
};

// Draws the triangles of one list from number `first` on, by group_lanes lanes each.
template <class Call, class Sink>
__device__ VOXELPIPE_INLINE void raster_by_lanes(const Call& call, int size, std::uint32_t first,
                                                 const warp_position& position, const lane_rows& kept, Sink& sink) {
    constexpr unsigned at_once = 32 / tuning::group_lanes;
    const std::uint32_t length = uniform(static_cast<std::uint32_t>(call.lists.lengths[size]));
    const unsigned chunks = (length - first + at_once - 1) / at_once;
    for (unsigned chunk = position.warp; chunk < chunks; chunk += position.warps) {
        const std::uint32_t i = first + chunk * at_once + position.lane / tuning::group_lanes;
        const bool wanted = i < length;
        __syncwarp();
        raster_by_group<Call::rule>(call.in, wanted, wanted ? call.lists.at(size, i) : 0, kept, sink);
        __syncwarp();
    }
}

// Draws the lists of tiny and small triangles, one thread each; neighbours in a list are alike, and lie in neighbouring
// lanes. What does not fill a warp, and lists too short to fill the device, are drawn by group_lanes lanes each. All
// lists advance together, part by part (list_walk): they are nearly in the order of the mesh, so voxels are in the
// cache while triangles of all classes touch them.
template <class Call, class Rows, class Sink>
__device__ VOXELPIPE_INLINE void raster_lists(const Call& call, const warp_position& position, const lane_rows& kept,
                                              Rows& rows, Sink& sink) {
    constexpr int num_classes = size_class::warp_group; // those before warp_group
    std::uint32_t chunks[num_classes];
    for (int k = 0; k < num_classes; ++k) {
        const std::uint32_t length = uniform(static_cast<std::uint32_t>(call.lists.lengths[k]));
        const bool few = k != size_class::tiny && length / 64 * tuning::group_lanes < position.warps;
        chunks[k] = few ? 0 : length / 32;
        const unsigned from_last = position.warps - 1 - position.warp; // warps at the end have fewer whole chunks
        raster_by_lanes(call, k, chunks[k] * 32, {few ? position.warp : from_last, position.warps, position.lane}, kept,
                        sink);
    }
    // While a chunk is drawn, the vertex numbers of the next one and the triangle numbers of the one after that are
    // being loaded.
    using walk_type = core::list_walk<num_classes>;
    using chunk = typename walk_type::chunk;
    walk_type walk(chunks, position.warp, position.warps);
    const auto number = [&](const chunk& c) VOXELPIPE_INLINE_LAMBDA {
        return c.list < 0 ? 0 : call.lists.at(c.list, 32 * c.number + position.lane);
    };
    const auto vertices = [&](const chunk& c, std::uint32_t triangle) VOXELPIPE_INLINE_LAMBDA {
        return c.list < 0 ? glm::uvec3(0) : call.in.source.triangle(triangle);
    };
    chunk here = walk.next(), next = walk.next();
    std::uint32_t triangle = number(here), triangle_of_next = number(next);
    glm::uvec3 index = vertices(here, triangle);
    while (here.list >= 0) {
        const int32_triangle r = load_int32(call.in, index);
        const chunk after = walk.next();
        const glm::uvec3 index_of_next = vertices(next, triangle_of_next);
        const std::uint32_t triangle_of_after = number(after);
        __syncwarp();
        if constexpr (Call::rule == coverage::conservative && Sink::takes_warp_rounds) {
            sink.begin(triangle);
            raster_rows_by_rounds(call.in, r, here.list == size_class::tiny, kept, sink);
        } else {
            bool is_done = false;
            if constexpr (Sink::takes_warp_rounds) {
                sink.begin(triangle);
                is_done = here.list != size_class::tiny && raster_thin_by_rounds(call.in, r, kept, sink);
            }
            if (!is_done)
                emit_with_retry(sink, [&]() VOXELPIPE_INLINE_LAMBDA {
                    sink.begin(triangle);
                    if (here.list == size_class::tiny)
                        raster_tiny<Call::rule>(call.in, r, sink);
                    else
                        raster_small<Call::rule, true>(call.in, r, kept, rows);
                });
        }
        __syncwarp();
        if constexpr (combines_words<Call>)
            if (here.list != size_class::tiny) rows.flush();
        here = next;
        next = after;
        triangle = triangle_of_next;
        triangle_of_next = triangle_of_after;
        index = index_of_next;
    }
}

template <class Call>
__global__ __launch_bounds__(tuning::raster_threads,
                             deferred_min_blocks<Call>) void deferred_pass_kernel(const __grid_constant__ Call call,
                                                                                  pipeline_state* state) {
    using sink_type = typename Call::deferred_sink;
    constexpr bool thin = Call::rule == coverage::thin;
    // A warp needs one of the two at a time. More shared memory would leave less to the vertex cache.
    __shared__ union {
        brick_memory<Call::rule> bricks;
        kept_rows rows;
    } memory_of_warps[raster_warps];
    __shared__ warp_words<Call> words[raster_warps];
    __shared__ typename sink_type::memory memories[raster_warps];
    __shared__ unsigned dropped[num_triangle_classes];
    await_stream();
    call.out.prepare(std::uint64_t{blockIdx.x} * tuning::raster_threads + threadIdx.x,
                     std::uint64_t{gridDim.x} * tuning::raster_threads);
    // With nothing to draw, the launch costs a call little.
    if (state->index_error != 0 || state->deferred.are_none()) return;
    if (blockIdx.x == 0 && threadIdx.x == 0) state->deferred.drawn = 1;
    if (threadIdx.x < num_triangle_classes) dropped[threadIdx.x] = 0;
    __syncthreads();
    const unsigned in_block = warp_in_block();
    const lane_rows kept(memory_of_warps[in_block].rows);
    const warp_position position{blockIdx.x * raster_warps + in_block, gridDim.x * raster_warps, threadIdx.x % 32};
    typename sink_type::memory& memory = memories[in_block];
    const bool has_items = uniform(*call.lists.next) != 0;
    // Work items of few split triangles go to different multiprocessors.
    const unsigned warp_of_items = thin ? position.warp : in_block * gridDim.x + blockIdx.x;
    const auto draw_items = [&]() VOXELPIPE_INLINE_LAMBDA {
        return raster_all_work_items(call, dropped, memory_of_warps[in_block].bricks, memory, warp_of_items,
                                     position.warps);
    };
    // Thin work items come last: their setups are ready when all else is drawn. Conservative ones take longest, so they
    // come first, while other warps draw the rest.
    typename sink_type::totals of_items{};
    if (has_items) {
        keep_setups(call, warp_of_items, position.warps);
        if constexpr (!thin) of_items = draw_items();
    }
    sink_type sink(call, dropped, memory);
    sink.take_over(of_items);
    raster_by_lanes(call, size_class::warp_group, 0, position, kept, sink);
    if constexpr (combines_words<Call>) {
        combining_sink<Call> rows(sink, words[in_block]);
        raster_lists(call, position, kept, rows, sink);
        sink.take_over(rows.end());
    } else {
        raster_lists(call, position, kept, sink, sink);
    }
    if constexpr (thin) {
        if (has_items) {
            (void)sink.end(); // flushes; the memory becomes another sink's
            sink.take_over(draw_items());
        }
    }
    sink.finish(state);
    __syncthreads();
    if (threadIdx.x == 0) { // the first pass has counted them as drawn
        const unsigned none = count_dropped(dropped, state);
        if (none != 0) atomicAdd(&state->drawn, 0ull - none);
    }
}

} // namespace voxelpipe::device
