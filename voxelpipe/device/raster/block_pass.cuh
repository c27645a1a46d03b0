// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// First pass for targets that hold values. Bits are tested before they are written and mostly are set already, but a
// value takes an atomic for every fragment: neighbouring triangles must be drawn at about the same time, while their
// voxels are in the cache. So one kernel draws all small triangles, and a warp queues those of a class until it has 32.
// Only triangles that are more than one thread's work are deferred (raster/deferred_triangles.cuh).

#include <voxelpipe/device/raster/deferred_triangles.cuh>
#include <voxelpipe/device/raster/small_triangles.cuh>
#include <voxelpipe/device/raster/split_triangles.cuh>

namespace voxelpipe::device {

// Triangles by their vertices, each in a column of words.
struct triangle_queue {
    std::int32_t q[9][tuning::queue_slots];
};

// Shared memory of one warp.
struct warp_queues {
    triangle_queue tiny_queue, small_queue;         // boxes for raster_tiny; other small ones
    std::uint32_t large_queue[tuning::queue_slots]; // numbers of triangles, which are loaded again
};

// The work of one warp, from the mesh to a sink. Every warp has its own queues, so no thread waits for another warp.
// The queue lengths are registers with the same value in all lanes.
template <class Call>
struct block_warp {
    static constexpr bool thin = Call::rule == coverage::thin;
    using triangle_class = core::triangle_class;
    using sink_type = typename Call::sink;

    const Call& call;
    warp_queues& queues;
    kept_rows& kept; // of the warp
    next_corners<typename Call::source_type>& corners;
    sink_type& sink;
    std::uint32_t* oversized; // the block's oversized triangles
    unsigned& num_oversized;
    int lane = static_cast<int>(threadIdx.x) % 32;
    int num_tiny = 0, num_small = 0, num_large = 0;

    __device__ VOXELPIPE_INLINE static void push(triangle_queue& queue, int at, const int32_triangle& r) {
        for (int k = 0; k < 9; ++k) queue.q[k][at] = r.q[k / 3][k % 3];
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int32_triangle take(const triangle_queue& queue, int at) const {
        int32_triangle r;
        for (int k = 0; k < 9; ++k) r.q[k / 3][k % 3] = queue.q[k][at];
        r.fits_int32 = true;
        r.find_box(call.in.fraction);
        return r;
    }
    // Draws or queues the lane's triangle i, if valid; its corners have been fetched. Then fetches those of the next
    // one, which has these vertices.
    __device__ VOXELPIPE_INLINE void batch(std::uint32_t i, bool valid, bool has_next, const glm::uvec3& next) {
        bool waits = false, is_oversized = false;
        int inside = 0, most = 0;
        bool is_done = false;
        int32_triangle r;
        r = corners.take(call.in);
        if (has_next) corners.fetch(call.in.source, next);
        if (valid) {
            most = r.longest_side();
            is_oversized = !r.fits_int32 || most > max_group_side(call.in.fraction);
            inside = r.inside(call.in.extent);
            if (!is_oversized && inside < 0 && r.template is_outside<Call::rule>(call.in.extent))
                sink.drop(triangle_class::outside);
            else
                waits = !is_oversized;
        }
        sink.mark_boxes(waits, r);
        if constexpr (thin) {
            const bool is_cube = waits && most <= 2;
            if (__popc(__ballot_sync(0xffffffffu, is_cube)) >= tuning::min_thin_cubes && is_cube) {
                const core::thin_cube cube = core::thin_cube_by_signs(r.q, r.lo, r.last, call.in.fraction, is_done);
                if (is_done) emit_thin_cube(call.in, r, cube, sink);
            }
        } else {
            const word bits = find_cube(call.in, waits && most <= 2, r, inside);
            is_done = bits != 0;
            if (is_done) emit_cube(r, bits, sink);
        }
        waits = waits && !is_done;
        if (__any_sync(0xffffffffu, waits || is_oversized)) {
            const int size = waits ? size_class_of<Call::rule>(r, most) : -1;
            const int tiny_at = take_slot(size == size_class::tiny, num_tiny);
            if (size == size_class::tiny) push(queues.tiny_queue, tiny_at, r);
            const int small_at = take_slot(size == size_class::thread, num_small);
            if (size == size_class::thread) push(queues.small_queue, small_at, r);
            // If each block has at most one round of the mesh, some multiprocessors may have no block: these triangles
            // go to the whole device.
            const bool is_spread =
                size == size_class::thread_heavy && call.in.num_triangles <= gridDim.x * tuning::raster_threads;
            const bool is_large = size == size_class::thread_heavy && !is_spread;
            const int large_at = take_slot(is_large, num_large);
            if (is_large) queues.large_queue[large_at] = i;
            call.lists.push(size_class::warp_group, is_spread || size == size_class::warp_group, i);
            if (is_oversized)
                oversized[atomicAdd(&num_oversized, 1u)] = i; // a function call here would spill the caller's registers
        }
        __syncwarp();
    }

    // Draws all batches of this warp (`index`: the vertices of the lane's first triangle), then what is left in the
    // queues of all warps of the block. All threads of the block call it. Returns how many triangles the warp read.
    template <int Warps>
    __device__ VOXELPIPE_INLINE unsigned run(glm::uvec3 index, const warp_queues (&all)[Warps], int (&left)[3][Warps]) {
        const std::uint32_t step = gridDim.x * Warps * 32;
        const std::uint32_t begin = blockIdx.x * Warps * 32 + threadIdx.x / 32 * 32;
        // One loop for triangles queued during the mesh and those left at the end: separate loops would double the
        // code, the sink's included, and warps would wait for instructions.
        const int own = static_cast<int>(warp_in_block());
        int ended = 0; // classes whose rest is done
        const auto triangle = [&](std::uint32_t first)
                                  VOXELPIPE_INLINE_LAMBDA { return first + static_cast<unsigned>(lane); };
        const std::uint32_t num_triangles = call.in.num_triangles;
        if (triangle(begin) < num_triangles) corners.fetch(call.in.source, index);
        index = load_index(call.in, triangle(begin + step));
        for (std::uint32_t first = begin;;) {
            int w = own, at = 0;
            bool is_tiny = false, is_large = false;
            if (num_tiny >= 32) {
                at = (num_tiny -= 32) + lane;
                is_tiny = true;
            } else if (num_small >= 32) {
                at = (num_small -= 32) + lane;
            } else if (num_large >= 32) {
                at = (num_large -= 32) + lane;
                is_large = true;
            } else if (first < num_triangles) {
                // While a batch is drawn, the corners of the next one are being fetched, and the indices of the one
                // after that.
                const glm::uvec3 second = load_index(call.in, triangle(first + 2 * step));
                batch(triangle(first), triangle(first) < num_triangles, triangle(first + step) < num_triangles, index);
                index = second;
                first += step;
                continue;
            } else {
                if (ended == 0) {
                    if (lane == 0) {
                        left[0][own] = num_tiny;
                        left[1][own] = num_small;
                        left[2][own] = num_large;
                    }
                    __syncthreads();
                }
                if (ended == 2) break;
                is_tiny = ended == 0;
                at = static_cast<int>(threadIdx.x); // fewer than 32 per warp are left
                for (w = 0; w < Warps && at >= left[ended][w];) at -= left[ended][w++];
                ++ended;
            }
            __syncwarp();
            if (w < Warps) {
                if (is_tiny) {
                    raster_tiny<Call::rule>(call.in, take(all[w].tiny_queue, at), sink);
                } else {
                    const int32_triangle r = is_large
                                                 ? load_int32(call.in, call.in.source.triangle(all[w].large_queue[at]))
                                                 : take(all[w].small_queue, at);
                    raster_small<Call::rule, false>(call.in, r, lane_rows(kept), sink);
                }
            }
            __syncwarp();
        }
        // One lane each, the larger triangles would keep a few lanes busy long after all others.
        int num = 0;
        for (const int n : left[2]) num += n;
        for (int start = 0; start < num; start += Warps * 32 / tuning::group_lanes) {
            int at = start + static_cast<int>(threadIdx.x) / tuning::group_lanes, w = 0;
            while (w < Warps && at >= left[2][w]) at -= left[2][w++];
            raster_by_group<Call::rule>(call.in, w < Warps, w < Warps ? all[w].large_queue[at] : 0, lane_rows(kept),
                                        sink);
        }

        split_oversized(call, sink, oversized, num_oversized);
        if (begin >= call.in.num_triangles) return 0;
        const std::uint32_t batches = (call.in.num_triangles - begin - 1) / step + 1;
        const std::uint32_t of_last = call.in.num_triangles - (begin + (batches - 1) * step);
        return (batches - 1) * 32 + (of_last < 32 ? of_last : 32);
    }
};

template <class Call>
__global__ __launch_bounds__(tuning::raster_threads,
                             tuning::value_blocks) void block_raster_kernel(const __grid_constant__ Call call,
                                                                            pipeline_state* state) {
    using sink_type = typename Call::sink;
    __shared__ warp_queues queues[raster_warps];
    __shared__ kept_rows rows_of_warps[raster_warps];
    __shared__ next_corners<typename Call::source_type> corners[raster_warps];
    __shared__ typename sink_type::memory memories[raster_warps];
    __shared__ int left[3][raster_warps];
    __shared__ unsigned dropped[num_triangle_classes], num_oversized;
    const glm::uvec3 index = load_index(call.in, blockIdx.x * tuning::raster_threads + threadIdx.x);
    await_stream();
    if (state->index_error != 0) return;
    if (threadIdx.x == 0) num_oversized = 0;
    if (threadIdx.x < num_triangle_classes) dropped[threadIdx.x] = 0;
    __syncthreads();
    sink_type sink(call, dropped, memories[threadIdx.x / 32]);
    const std::uint32_t step = gridDim.x * tuning::raster_threads, batches = (call.in.num_triangles - 1) / step + 1;
    block_warp<Call> warp{call,
                          queues[threadIdx.x / 32],
                          rows_of_warps[threadIdx.x / 32],
                          corners[threadIdx.x / 32],
                          sink,
                          call.lists.oversized + std::size_t{blockIdx.x} * batches * tuning::raster_threads,
                          num_oversized};
    const unsigned looked_at = warp.run(index, queues, left);
    sink.finish(state);
    count_looked_at(looked_at, dropped, state);
}

} // namespace voxelpipe::device
