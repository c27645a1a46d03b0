// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distributes triangles of very different size. A triangle that may touch few cells (tiles or voxels) is one thread's
// work. A larger one is divided into chunks, sub-boxes of its box of cells, of which a warp takes 32 at a time.
// Coverage is exact within any box, so the chunks give exactly the whole. Every stage that turns triangles into cells
// has two passes, count and emit, with a prefix sum between: cells come out by ascending primitive, whatever the launch
// order.

#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>

namespace voxelpipe::device {

inline constexpr int chunk_columns = 16;     // a chunk of a large triangle is a row of this many columns
inline constexpr int chunks_per_record = 32; // one per lane

// 32 consecutive chunks of a large triangle.
struct chunk_record {
    std::uint32_t primitive;
    std::uint32_t first; // chunk number / 32
};

// True if a box of cells is one thread's work: at most max_columns columns, whichever the dominant axis.
[[nodiscard]] VOXELPIPE_HD inline bool is_small(const core::voxel_box& box, std::int64_t max_columns) {
    const std::int64_t x = box.hi[0] - box.lo[0] + 1, y = box.hi[1] - box.lo[1] + 1, z = box.hi[2] - box.lo[2] + 1;
    return core::max3(x * y, y * z, z * x) <= max_columns;
}

// Divides a box of cells into chunks: rows of up to 16 columns in the plane of u and v, over the whole depth along w.
struct chunk_grid {
    int axis;
    core::triple<std::int64_t> lo, hi; // uvw
    std::int64_t per_row;

    VOXELPIPE_HD chunk_grid(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])),
          per_row((hi[0] - lo[0] + chunk_columns) / chunk_columns) {}

    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * (hi[1] - lo[1] + 1); }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const {
        return (count() + chunks_per_record - 1) / chunks_per_record;
    }
    [[nodiscard]] VOXELPIPE_HD core::voxel_box chunk(std::int64_t i) const {
        const std::int64_t v = lo[1] + i / per_row, u = lo[0] + i % per_row * chunk_columns;
        const std::int64_t u_end = u + chunk_columns - 1 < hi[0] ? u + chunk_columns - 1 : hi[0];
        return {core::to_xyz(axis, u, v, lo[2]), core::to_xyz(axis, u_end, v, hi[2])};
    }
};

// Arrays of the two passes. counts and offsets have an element per primitive.
struct cell_buffers {
    std::uint32_t* counts;
    unsigned long long* offsets;
    chunk_record* records;
    unsigned long long record_capacity;
    unsigned long long* num_records; // in pipeline_state
    unsigned long long* num_cells;
};

// The counters num_records and num_cells are left null.
[[nodiscard]] inline cell_buffers take_cell_buffers(arena& memory, std::uint32_t num_primitives,
                                                    unsigned long long record_capacity) {
    cell_buffers b{};
    b.counts = memory.take<std::uint32_t>(num_primitives);
    b.offsets = memory.take<unsigned long long>(num_primitives);
    b.records = memory.take<chunk_record>(record_capacity);
    b.record_capacity = record_capacity;
    return b;
}

// Adds the block's discarded cells to the state. All threads call it.
__device__ inline void count_discarded(std::uint64_t discarded, pipeline_state* state) {
    if (__syncthreads_or(static_cast<int>(discarded != 0)) == 0) return;
    const unsigned long long sum = block_sum(discarded);
    if (threadIdx.x == 0) atomicAdd(&state->discarded, sum);
}

// Cells of a triangle within a box.
struct cell_counts {
    std::uint32_t kept = 0, discarded = 0; // stored cells, and discarded ones
};

// Op is the stage:
//   static constexpr coverage rule;   std::int64_t small_columns (most columns of one thread's triangle)
//     bool counts_triangles (true if this stage fills the triangle counters)
//   voxel_box cells(voxel_box reach)                          converts a box of voxels to cells
//   count(geometry, triangle, primitive, box, whole)          counts the triangle's cells within the box; whole: the
//   box
//                                                             is the triangle's own
//   emit(geometry, triangle, primitive, box, whole, offset)   stores the cells that count() counts, from offset on
// Inclusive prefix sum of `value` over the lanes of a warp.
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t lane_prefix(std::uint32_t value) {
    for (unsigned step = 1; step < 32; step *= 2) {
        const std::uint32_t other = __shfl_up_sync(0xffffffffu, value, step);
        if (threadIdx.x % 32 >= step) value += other;
    }
    return value;
}

// Appends the records of a large triangle whose box of cells is `box`.
__device__ inline void record_chunks(const geometry& geo, const loaded_triangle& t, std::uint32_t id,
                                     const core::voxel_box& box, const cell_buffers& b) {
    const chunk_grid chunks(box, core::dominant_axis(t.a, t.b, t.c, geo.snap.fraction));
    const auto records = static_cast<unsigned long long>(chunks.records());
    const unsigned long long first = atomicAdd(b.num_records, records);
    for (unsigned long long r = 0; r < records && first + r < b.record_capacity; ++r)
        b.records[first + r] = {id, static_cast<std::uint32_t>(r)};
}

template <class Op>
__device__ VOXELPIPE_INLINE void count_small(const geometry& geo, const Op& op, const cell_buffers& b,
                                             pipeline_state* state) {
    using core::triangle_class;
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    triangle_class kind = triangle_class::drawn;
    std::uint32_t n = 0; // cells
    bool bad = false;
    std::uint32_t discarded = 0;
    const bool valid = i < geo.num_primitives;
    const auto id = static_cast<std::uint32_t>(i);
    if (valid) {
        const loaded_triangle t = geo.load(id);
        bad = !t.index_ok;
        if (!bad) {
            core::voxel_box reach{};
            kind = core::classify<Op::rule>(t.a, t.b, t.c, geo.snap.fraction, geo.whole_box(), reach);
            if ((Op::rule == coverage::thin || geo.arms != core::arm_set::none) && kind == triangle_class::drawn &&
                core::has_zero_area(t.a, t.b, t.c))
                kind = triangle_class::zero_area;
            if (kind == triangle_class::drawn) {
                const core::voxel_box box = op.cells(reach);
                if (is_small(box, Op::small_columns)) {
                    const cell_counts cells = op.count(geo, t, id, box, true);
                    n = cells.kept;
                    discarded = cells.discarded;
                } else {
                    record_chunks(geo, t, id, box, b);
                }
            }
        }
        b.counts[id] = n;
    }
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, bad_index);
    if (op.counts_triangles) {
        const bool dropped = valid && !bad && kind != triangle_class::drawn;
        const int drawn = __syncthreads_count(static_cast<int>(valid && !bad && !dropped));
        if (threadIdx.x == 0 && drawn != 0) atomicAdd(&state->drawn, static_cast<unsigned long long>(drawn));
        if (__syncthreads_or(static_cast<int>(dropped)) != 0) {
            const auto add = [&](triangle_class which, unsigned long long* total) {
                const int count = __syncthreads_count(static_cast<int>(dropped && kind == which));
                if (threadIdx.x == 0 && count != 0) atomicAdd(total, static_cast<unsigned long long>(count));
            };
            add(triangle_class::nonfinite, &state->nonfinite);
            add(triangle_class::too_far, &state->too_far);
            add(triangle_class::zero_area, &state->zero_area);
            add(triangle_class::outside, &state->outside);
        }
    }
    const unsigned long long sum = block_sum(n);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(b.num_cells, sum);
    count_discarded(discarded, state);
}

// Calls visit for each record, in a warp; each lane has one of its chunks.
template <class Op, class Visit>
__device__ void for_each_record(const geometry& geo, const Op& op, const cell_buffers& b, Visit&& visit) {
    const unsigned long long num = *b.num_records < b.record_capacity ? *b.num_records : b.record_capacity;
    const unsigned long long warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    const unsigned lane = threadIdx.x % 32;
    for (unsigned long long r = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / 32; r < num; r += warps) {
        const chunk_record record = b.records[r];
        const loaded_triangle t = geo.load(record.primitive);
        core::voxel_box reach{};
        (void)core::classify<Op::rule>(t.a, t.b, t.c, geo.snap.fraction, geo.whole_box(), reach);
        const chunk_grid chunks(op.cells(reach), core::dominant_axis(t.a, t.b, t.c, geo.snap.fraction));
        const std::int64_t chunk = std::int64_t{record.first} * chunks_per_record + lane;
        visit(record.primitive, t, chunk < chunks.count(), chunks.chunk(chunk));
    }
}

template <class Op>
__device__ VOXELPIPE_INLINE void count_large(const geometry& geo, const Op& op, const cell_buffers& b,
                                             pipeline_state* state) {
    unsigned long long all = 0, discarded = 0;
    if (state->index_error == 0) {
        for_each_record(geo, op, b,
                        [&](std::uint32_t id, const loaded_triangle& t, bool valid, const core::voxel_box& box) {
                            std::uint32_t n = 0;
                            if (valid) {
                                const cell_counts cells = op.count(geo, t, id, box, false);
                                n = cells.kept;
                                discarded += cells.discarded;
                            }
                            const std::uint32_t sum = __reduce_add_sync(0xffffffffu, n);
                            if (threadIdx.x % 32 == 0 && sum != 0) atomicAdd(&b.counts[id], sum);
                            all += n;
                        });
    }
    const unsigned long long sum = block_sum(all);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(b.num_cells, sum);
    count_discarded(discarded, state);
}

template <class Op>
__device__ VOXELPIPE_INLINE void emit_small(const geometry& geo, const Op& op, const cell_buffers& b,
                                            const pipeline_state* state, const capacities& limits) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (has_failed(*state, limits)) return;
    if (i >= geo.num_primitives || b.counts[i] == 0) return;
    const auto id = static_cast<std::uint32_t>(i);
    const loaded_triangle t = geo.load(id);
    core::voxel_box reach{};
    (void)core::classify<Op::rule>(t.a, t.b, t.c, geo.snap.fraction, geo.whole_box(), reach);
    const core::voxel_box box = op.cells(reach);
    if (!is_small(box, Op::small_columns)) return;
    op.emit(geo, t, id, box, true, b.offsets[id]);
}

// counts[i] is decremented to what remains of primitive i. A primitive's records take their offsets in any order: the
// later stable sort by cell hides it, because a primitive meets a cell once.
template <class Op>
__device__ VOXELPIPE_INLINE void emit_large(const geometry& geo, const Op& op, const cell_buffers& b,
                                            const pipeline_state* state, const capacities& limits) {
    if (has_failed(*state, limits)) return;
    for_each_record(geo, op, b,
                    [&](std::uint32_t id, const loaded_triangle& t, bool valid, const core::voxel_box& box) {
                        std::uint32_t n = 0;
                        if (valid) n = op.count(geo, t, id, box, false).kept;
                        const unsigned lane = threadIdx.x % 32;
                        const std::uint32_t before = lane_prefix(n);
                        const std::uint32_t sum = __shfl_sync(0xffffffffu, before, 31);
                        if (sum == 0) return;
                        std::uint32_t left = 0;
                        if (lane == 0) left = atomicSub(&b.counts[id], sum);
                        left = __shfl_sync(0xffffffffu, left, 0);
                        const unsigned long long at = b.offsets[id] + (left - sum) + (before - n);
                        if (n != 0) op.emit(geo, t, id, box, false, at);
                    });
}

// True for a stage that has a second pass.
template <class Op>
concept stores_cells = requires {
    &Op::emit;
};

// One kernel for all passes: what finds a triangle's cells, most of the code, is compiled once.
enum class cell_pass { count_small, count_large, emit_small, emit_large };
template <class Op>
__global__ __launch_bounds__(threads_per_block, tuning::count_emit_min_blocks) void cells_kernel(
    const __grid_constant__ geometry geo, const __grid_constant__ Op op, const __grid_constant__ cell_buffers b,
    pipeline_state* state, const __grid_constant__ capacities limits, cell_pass pass) {
    if (pass == cell_pass::count_small) {
        count_small(geo, op, b, state);
    } else if (pass == cell_pass::count_large) {
        count_large(geo, op, b, state);
    } else if constexpr (stores_cells<Op>) {
        if (pass == cell_pass::emit_small)
            emit_small(geo, op, b, state, limits);
        else
            emit_large(geo, op, b, state, limits);
    }
}
template <class Op>
void launch_cells(const geometry& geo, const Op& op, const cell_buffers& b, pipeline_state* state,
                  const capacities& limits, cell_pass pass, stage where, cudaStream_t stream) {
    const bool are_small = pass == cell_pass::count_small || pass == cell_pass::emit_small;
    const auto blocks = are_small ? num_blocks(geo.num_primitives) : fill_device(b.record_capacity * 32);
    cells_kernel<<<blocks, threads_per_block, 0, stream>>>(geo, op, b, state, limits, pass);
    check(cudaGetLastError(), where);
}

// Counts the cells of every primitive and computes their offsets.
template <class Op>
void count_cells(const geometry& geo, const Op& op, const cell_buffers& b, pipeline_state* state, void* scan_storage,
                 std::size_t scan_bytes, stage where, cudaStream_t stream) {
    launch_cells(geo, op, b, state, capacities{}, cell_pass::count_small, where, stream);
    launch_cells(geo, op, b, state, capacities{}, cell_pass::count_large, where, stream);
    sum_counts(b.counts, b.offsets, geo.num_primitives, scan_storage, scan_bytes, where, stream);
}

template <class Op>
void emit_cells(const geometry& geo, const Op& op, const cell_buffers& b, pipeline_state* state,
                const capacities& limits, stage where, cudaStream_t stream) {
    launch_cells(geo, op, b, state, limits, cell_pass::emit_small, where, stream);
    launch_cells(geo, op, b, state, limits, cell_pass::emit_large, where, stream);
}

} // namespace voxelpipe::device
