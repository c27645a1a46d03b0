// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The deferred pass of conservative coverage into masks. A warp makes the setups of up to 32 triangles, finds the
// bricks that they meet, a lane each, and then draws 32 pairs of a triangle and a brick at a time: a lane looks its
// brick up once and writes each word once, and the rows of all pairs are shared out. So lanes have equal work, whatever
// the sizes of their triangles; a large triangle is drawn by many warps, work item by work item
// (raster/split_triangles.cuh). Bricks must lie on the raster: its first voxel is that of a brick.

#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/sparse/device/mask_drawer.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Makes the setups of up to 32 small triangles, and draws them. All lanes call it.
template <class Call>
__device__ VOXELPIPE_INLINE void draw_small_masks(const Call& call, mask_drawer<false, Call>& drawer,
                                                  mask_memory& memory, bool valid, std::uint32_t triangle) {
    constexpr unsigned all = 0xffffffffu;
    const unsigned lane = threadIdx.x % 32;
    int first[3] = {}, sides[3] = {};
    if (valid) {
        const int32_triangle r = load_int32(call.in, call.in.source.triangle(triangle));
        const core::small_box part = r.part(call.in.extent);
        valid = !part.empty();
        if (valid) {
            mask_column{memory.small, lane}.set(r, part, call.in.fraction);
            for (int k = 0; k < 3; ++k) {
                first[k] = (r.lo[k] + part.lo[k]) >> log2_mask_brick;
                sides[k] = ((r.lo[k] + part.hi[k]) >> log2_mask_brick) - first[k] + 1;
            }
        }
    }
    // Bricks of the boxes, numbered triangle by triangle.
    const unsigned mine = valid ? static_cast<unsigned>(sides[0] * sides[1] * sides[2]) : 0;
    unsigned total = 0;
    const unsigned before = exclusive_sum(mine, total);
    const unsigned packed = static_cast<unsigned>(sides[0]) | static_cast<unsigned>(sides[1]) << 8;
    __syncwarp();
    for (unsigned i = 0; i < total; i += 32) {
        const unsigned number = i + lane;
        unsigned slot = 0;
        for (unsigned step = 16; step != 0; step /= 2)
            if (__shfl_sync(all, before, slot + step) <= number) slot += step;
        const unsigned rest = number - __shfl_sync(all, before, slot), across = __shfl_sync(all, packed, slot);
        const int x = __shfl_sync(all, first[0], slot), y = __shfl_sync(all, first[1], slot),
                  z = __shfl_sync(all, first[2], slot);
        mask_pair p{};
        const bool wanted = number < total;
        if (wanted) {
            const unsigned nx = across & 255u, ny = across >> 8, row = rest / nx;
            p = {static_cast<std::uint16_t>(static_cast<unsigned>(x) + rest % nx),
                 static_cast<std::uint16_t>(static_cast<unsigned>(y) + row % ny),
                 static_cast<std::uint16_t>(static_cast<unsigned>(z) + row / ny), static_cast<std::uint16_t>(slot)};
        }
        drawer.push(wanted, p);
    }
    drawer.flush();
}

// Draws the lists of small triangles. Short lists are divided into chunks of fewer triangles, so that all warps have
// some.
template <class Call>
__device__ __noinline__ unsigned draw_mask_lists(const Call& call, mask_memory& memory, const warp_position& position) {
    mask_drawer<false, Call> drawer{call, memory};
#pragma unroll 1
    for (int size = size_class::count - 1; size >= 0; --size) {
        const std::uint32_t length = uniform(static_cast<std::uint32_t>(call.lists.lengths[size]));
        const std::uint32_t even = (length + position.warps - 1) / position.warps;
        const std::uint32_t at_once = even < 1 ? 1 : even > 32 ? 32 : even;
        const std::uint32_t chunks = (length + at_once - 1) / at_once;
#pragma unroll 1
        for (std::uint32_t chunk = position.warp; chunk < chunks; chunk += position.warps) {
            const std::uint32_t i = chunk * at_once + position.lane;
            const bool valid = position.lane < at_once && i < length;
            draw_small_masks(call, drawer, memory, valid, valid ? call.lists.at(size, i) : 0);
        }
    }
    return drawer.fragments;
}

// Makes the setup of a large triangle: number `number` of the split ones.
template <class Call>
__device__ __noinline__ void set_up_large_mask(const Call& call, large_mask_triangle& to, std::uint32_t number) {
    to.find(call, number);
}
// As raster_wide_piece, out of line.
template <class Call, class Sink>
__device__ __noinline__ typename Sink::totals
draw_wide_mask(const Call& call, unsigned* dropped, typename Sink::memory& memory, const large_mask_triangle& s,
               std::int64_t piece, unsigned part, bool valid) {
    Sink sink(call, dropped, memory);
    raster_wide_piece(call, sink, s.triangle, s.pieces, piece, part, valid);
    return sink.end();
}

// Draws a warp's share of the work items of large triangles: runs of neighbouring ones, whose triangles are set up
// together, a lane each. A lane has a column of bricks along the dominant axis.
template <class Call>
__device__ __noinline__ typename Call::deferred_sink::totals
draw_large_masks(const Call& call, unsigned* dropped, typename Call::deferred_sink::memory& sink_memory,
                 mask_memory& memory, const warp_position& position) {
    using sink_type = typename Call::deferred_sink;
    sink_type sink(call, dropped, sink_memory);
    mask_drawer<true, Call> drawer{call, memory};
    const split_work_items all(call.lists);
    constexpr unsigned long long most_at_once = mask_memory::max_large; // each has a triangle of its own, at most
    const unsigned long long even = all.work_items / (4ull * position.warps);
    const unsigned long long at_once = even < 1 ? 1 : even > most_at_once ? most_at_once : even;
    constexpr int per_work_item = split_pieces<coverage::conservative>::per_work_item;
    const unsigned of_item = position.lane % per_work_item, of_piece = position.lane / per_work_item;
    static_assert(32 / per_work_item == 4 && core::raster_brick_size == 2 * core::mask_brick_size);
#pragma unroll 1
    for (unsigned long long from = position.warp * at_once; from < all.work_items; from += position.warps * at_once) {
        const unsigned long long to = from + at_once < all.work_items ? from + at_once : all.work_items;
        const unsigned first = find_last(call.lists.first_work_items, static_cast<unsigned>(all.triangles), from);
        const unsigned mine = first + position.lane;
        const bool has =
            position.lane < mask_memory::max_large && mine < all.triangles && call.lists.first_work_items[mine] < to;
        if (has) set_up_large_mask(call, memory.large[position.lane], mine);
        const unsigned num = static_cast<unsigned>(__popc(__ballot_sync(0xffffffffu, has)));
        __syncwarp();
        unsigned slot = 0;
#pragma unroll 1
        for (unsigned long long item = from; item < to; ++item) {
            while (slot + 1 < num && memory.large[slot + 1].first_work_item <= item) ++slot;
            const large_mask_triangle& s = memory.large[slot];
            const auto piece = static_cast<std::int64_t>((item - s.first_work_item) * per_work_item + of_item);
            const bool valid = piece < s.pieces.count();
            if (!s.fits) {
                sink.take_over(draw_wide_mask<Call, sink_type>(call, dropped, sink_memory, s, piece, of_piece, valid));
                continue;
            }
            const int axis = s.pieces.axes.dominant;
            const auto u = static_cast<int>(s.pieces.u(piece)) + static_cast<int>(of_piece % 2) * core::mask_brick_size,
                       v = static_cast<int>(s.pieces.v(piece)) + static_cast<int>(of_piece / 2) * core::mask_brick_size;
            const auto low = core::to_uvw(axis, s.low[0], s.low[1], s.low[2]),
                       begin = core::to_uvw(axis, s.begin[0], s.begin[1], s.begin[2]),
                       end = core::to_uvw(axis, s.end[0], s.end[1], s.end[2]);
            int w = 0, w_end = -1; // bricks along the column
            if (valid && u <= end[0] && v <= end[1] && u + core::mask_brick_size > begin[0] &&
                v + core::mask_brick_size > begin[1]) {
                double depth = 0, last = 0;
                s.t.depths(axis, u - low[0], v - low[1], depth, last);
                depth += low[2];
                last += low[2];
                if (depth <= end[2] && last >= begin[2]) {
                    w = (depth > begin[2] ? static_cast<int>(depth) : begin[2]) >> log2_mask_brick;
                    w_end = (last < end[2] ? static_cast<int>(last) : end[2]) >> log2_mask_brick;
                }
            }
#pragma unroll 1
            while (__any_sync(0xffffffffu, w <= w_end)) {
                const auto at = core::to_xyz(axis, u >> log2_mask_brick, v >> log2_mask_brick, w);
                const mask_pair p{static_cast<std::uint16_t>(at[0]), static_cast<std::uint16_t>(at[1]),
                                  static_cast<std::uint16_t>(at[2]), static_cast<std::uint16_t>(slot)};
                drawer.push(w <= w_end, p);
                ++w;
            }
        }
        drawer.flush(); // with the setups that its pairs have
        __syncwarp();
    }
    sink.mine.fragments += drawer.fragments;
    return sink.end();
}

inline constexpr int mask_pass_blocks = 4; // per multiprocessor: bounds the registers

template <class Call>
__global__ __launch_bounds__(tuning::raster_threads,
                             mask_pass_blocks) void mask_pass_kernel(const __grid_constant__ Call call,
                                                                     pipeline_state* state) {
    using sink_type = typename Call::deferred_sink;
    __shared__ mask_memory memory_of_warps[raster_warps];
    __shared__ typename sink_type::memory memories[raster_warps];
    __shared__ unsigned dropped[num_triangle_classes];
    await_stream();
    if (state->index_error != 0) return;
    if (threadIdx.x < num_triangle_classes) dropped[threadIdx.x] = 0;
    __syncthreads();
    const unsigned in_block = warp_in_block();
    mask_memory& memory = memory_of_warps[in_block];
    // Work items of few large triangles go to different multiprocessors.
    const warp_position position{in_block * gridDim.x + blockIdx.x, gridDim.x * raster_warps, threadIdx.x % 32};
    sink_type sink(call, dropped, memories[in_block]);
    if (uniform(*call.lists.next) != 0)
        sink.take_over(draw_large_masks(call, dropped, memories[in_block], memory, position));
    __syncwarp();
    sink.mine.fragments += draw_mask_lists(call, memory, position);
    sink.finish(state);
}

template <class Call>
void launch_mask_pass(const Call& call, pipeline_state* state, stage where, cudaStream_t stream) {
    launch_behind(mask_pass_kernel<Call>, static_cast<unsigned>(num_multiprocessors()) * mask_pass_blocks,
                  tuning::raster_threads, stream, where, call, state);
}

} // namespace voxelpipe::device
