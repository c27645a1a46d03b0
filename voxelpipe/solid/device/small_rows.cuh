// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The first pass over a solid's triangles. Most small ones lie between the centres of all rows and end at a first look.
// The others are queued, each warp for itself, until all of its lanes have one; then each lane finds the crossings of
// its triangle in 32-bit integers. What is too large for that is left to solid/device/large_rows.cuh.

#include <voxelpipe/solid/core/small_crossing.hpp>
#include <voxelpipe/solid/device/large_rows.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <cstdint>

namespace voxelpipe::device {

// Memory that is to be zero before crossings come: whole uint4s, or none.
struct zeroed_memory {
    uint4* to = nullptr;
    std::uint64_t count = 0;
};

// The codes of all vertices. Meanwhile it writes zeros, which takes no kernel then.
template <class Mesh, class VertexShader>
__global__ __launch_bounds__(threads_per_block) void find_row_codes_kernel(
    const __grid_constant__ shaded_triangles<Mesh, VertexShader> triangles, const __grid_constant__ row_grid grid,
    const __grid_constant__ zeroed_memory zeros, const pipeline_state* state) {
    await_stream();
    const std::uint64_t first = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x,
                        step = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t v = first; v < triangles.num_vertices; v += step) {
        std::int32_t q[3];
        const auto vertex = static_cast<std::uint32_t>(v);
        triangles.codes[v] = row_code::serves(grid) && triangles.source.int32_position(triangles.source.load(vertex), q)
                                 ? row_code::of(q, grid)
                                 : row_code::none;
    }
    if (zeros.count != 0 && state->index_error == 0) // of a check in front
        for (std::uint64_t k = first; k < zeros.count; k += step) zeros.to[k] = uint4{0, 0, 0, 0};
}

// Room for n items of each lane behind what *total counts: the number of the lane's first one. All lanes take part.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long reserve_for_warp(std::uint32_t n,
                                                                              unsigned long long* total) {
    const std::uint32_t lane = threadIdx.x % 32;
    std::uint32_t before = n; // with its own
    for (unsigned step = 1; step < 32; step *= 2) {
        const std::uint32_t other = __shfl_up_sync(0xffffffffu, before, step);
        if (lane >= step) before += other;
    }
    unsigned long long first = 0;
    if (lane == 31 && before != 0) first = atomicAdd(total, static_cast<unsigned long long>(before));
    return __shfl_sync(0xffffffffu, first, 31) + before - n;
}

// Counts of one thread.
struct row_totals {
    std::uint32_t drawn = 0, nonfinite = 0, too_far = 0, outside = 0, crossings = 0;

    __device__ VOXELPIPE_INLINE void see(core::triangle_class kind) {
        using core::triangle_class;
        drawn += static_cast<std::uint32_t>(kind == triangle_class::drawn);
        nonfinite += static_cast<std::uint32_t>(kind == triangle_class::nonfinite);
        too_far += static_cast<std::uint32_t>(kind == triangle_class::too_far);
        outside += static_cast<std::uint32_t>(kind == triangle_class::outside);
    }
    // All threads of the block take part.
    __device__ void add_up(bool with_crossings, pipeline_state* state) const {
        const auto add = [](std::uint32_t one, unsigned long long* total) {
            if (__syncthreads_or(static_cast<int>(one != 0)) == 0) return;
            const unsigned long long sum = block_sum(one);
            if (threadIdx.x == 0) atomicAdd(total, sum);
        };
        add(drawn, &state->drawn);
        add(nonfinite, &state->nonfinite);
        add(too_far, &state->too_far);
        add(outside, &state->outside);
        if (with_crossings) add(crossings, &state->solid.crossings);
    }
};

struct warp_rows {
    word lines[tuning::lines_at_once][32]; // of each lane's triangle
    std::uint32_t queue[32 * tuning::looks_at_once + 31];
};

// A triangle a lane, maybe none.
template <class Source, class Sink>
struct small_rows {
    const Source& source;
    const row_grid& grid;
    const Sink& sink;
    const row_triangles& kept;
    pipeline_state* state;
    word (&lines)[tuning::lines_at_once][32];
    row_totals totals;

    __device__ VOXELPIPE_INLINE void emit(bool valid, std::uint32_t i) {
        solid_triangle t;
        if (valid) {
            t = load_solid_triangle(source, grid, i);
            if (!t.index_ok)
                atomicOr(&state->index_error, bad_index);
            else if (source.is_counted(i))
                totals.see(t.kind);
        }
        const bool has_rows = !t.rows.empty();
        core::small_triangle at{};
        std::int32_t origin[3]{};
        bool is_small = has_rows && t.fits_int32;
        if (is_small) {
            const int most = core::small_voxels(grid.fraction);
            for (int k = 0; k < 3; ++k) {
                origin[k] = core::min3(t.q[0][k], t.q[1][k], t.q[2][k]) >> grid.fraction;
                is_small =
                    is_small && (core::max3(t.q[0][k], t.q[1][k], t.q[2][k]) >> grid.fraction) - origin[k] < most;
                for (int v = 0; v < 3; ++v) at.p[v][k] = t.q[v][k] - (origin[k] << grid.fraction);
            }
        }
        if (!is_small) at = core::small_triangle{};
        const core::small_crossings crossings(at, grid.fraction);
        // Twice the area that rows see tells how many there are.
        const bool has_many = is_small && crossings.plane[0] >> (2 * grid.fraction + 1) > tuning::small_crossing_count;
        const bool is_large = has_rows && (!is_small || has_many);
        if (__ballot_sync(0xffffffffu, static_cast<int>(is_large)) != 0) leave(is_large, i, t.rows);
        is_small = is_small && !has_many && crossings.winding != 0; // others have no crossing
        if (__ballot_sync(0xffffffffu, static_cast<int>(is_small)) == 0) return;
        // Relative to the origin; none if there is no triangle.
        const int y0 = static_cast<int>(t.rows.u.lo) - origin[1], last = static_cast<int>(t.rows.u.hi - t.rows.u.lo);
        int z = static_cast<int>(t.rows.v.lo) - origin[2];
        const int z1 = is_small ? static_cast<int>(t.rows.v.hi) - origin[2] : z - 1;
        core::small_row_ends ends(crossings.edge, false, y0, z, 1);
        const std::uint32_t lane = threadIdx.x % 32;
        const std::uint64_t first_row = grid.row(t.rows.u.lo, origin[2]); // that of (y0, 0)
        while (__ballot_sync(0xffffffffu, static_cast<int>(z <= z1)) != 0) {
            std::uint32_t with_rows = 0, n = 0;
            const int z0 = z;
            for (int k = 0; k < tuning::lines_at_once && z <= z1; ++k, ++z) {
                const word rows = ends.next(last);
                lines[k][lane] = rows;
                with_rows |= static_cast<std::uint32_t>(rows != 0) << k;
                n += static_cast<std::uint32_t>(__popc(rows));
            }
            unsigned long long number = 0;
            if constexpr (Sink::is_listing)
                number = reserve_for_warp(n, &state->list_fragments);
            else
                totals.crossings += n;
            std::uint64_t row = 0;
            std::int64_t line = 0;
            for (word rows = 0; (with_rows | rows) != 0;) {
                if (rows == 0) {
                    const int k = exact::highest_one(with_rows);
                    with_rows ^= 1u << k;
                    rows = lines[k][lane];
                    line = crossings.of_line(z0 + k);
                    row = first_row + static_cast<std::uint64_t>(z0 + k) * static_cast<std::uint64_t>(grid.extent.y);
                }
                const int y = exact::highest_one(rows);
                rows ^= 1u << y;
                sink.emit(grid, number++, t.draw, row + static_cast<unsigned>(y),
                          origin[0] + crossings.first_beyond(line, y0 + y), crossings.winding);
            }
            __syncwarp();
        }
    }

private:
    // Leaves triangles to the next pass. All lanes take part.
    __device__ VOXELPIPE_INLINE void leave(bool mine, std::uint32_t i, const core::row_box& rows) const {
        const std::uint32_t lane = threadIdx.x % 32;
        unsigned long long before = mine ? 1ull << row_triangles::item_bits | item_grid(rows).count() : 0;
        const unsigned long long own = before;
        for (unsigned step = 1; step < 32; step *= 2) {
            const unsigned long long other = __shfl_up_sync(0xffffffffu, before, step);
            if (lane >= step) before += other;
        }
        unsigned long long at = lane == 31 ? atomicAdd(kept.next_large, before) : 0;
        at = __shfl_sync(0xffffffffu, at, 31) + before - own;
        if (!mine) return;
        kept.triangles[at >> row_triangles::item_bits] = i;
        kept.first_items[at >> row_triangles::item_bits] = at & row_triangles::item_mask;
    }
};

template <class Source, class Sink>
__global__ __launch_bounds__(threads_per_block, tuning::small_row_blocks) void small_rows_kernel(
    const __grid_constant__ Source source, const __grid_constant__ row_grid grid, const __grid_constant__ Sink sink,
    const __grid_constant__ row_triangles kept, pipeline_state* state) {
    constexpr unsigned warps = threads_per_block / 32;
    constexpr std::uint64_t step = 32 * tuning::looks_at_once;
    __shared__ warp_rows memory[warps];
    await_stream();
    if constexpr (!Sink::is_listing)
        if (state->index_error != 0) return; // of a check in front: nothing here changes it
    warp_rows& mine = memory[warp_in_block()];
    const std::uint32_t lane = threadIdx.x % 32;
    small_rows<Source, Sink> rows{source, grid, sink, kept, state, mine.lines, {}};
    std::uint32_t queued = 0;
    const auto emit = [&](std::uint32_t n) VOXELPIPE_INLINE_LAMBDA { // the last n of the queue
        queued -= n;
        const std::uint32_t i = lane < n ? mine.queue[queued + lane] : 0;
        __syncwarp();
        rows.emit(lane < n, i);
    };
    for (std::uint64_t first = (std::uint64_t{blockIdx.x} * warps + warp_in_block()) * step;
         first < source.num_triangles; first += std::uint64_t{gridDim.x} * warps * step) {
        typename Source::located at[tuning::looks_at_once];
        typename Source::corners corners[tuning::looks_at_once];
        bool is_there[tuning::looks_at_once];
#pragma unroll
        for (std::uint32_t k = 0; k < tuning::looks_at_once; ++k) {
            const std::uint64_t i = first + 32 * k + lane;
            is_there[k] = i < source.num_triangles;
            at[k] = source.locate(is_there[k] ? static_cast<std::uint32_t>(i) : 0);
        }
#pragma unroll
        for (std::uint32_t k = 0; k < tuning::looks_at_once; ++k) corners[k] = source.fetch(at[k]);
#pragma unroll
        for (std::uint32_t k = 0; k < tuning::looks_at_once; ++k) {
            const auto i = static_cast<std::uint32_t>(first + 32 * k + lane);
            const first_look look = source.look(corners[k], grid);
            const bool waits = is_there[k] && look == first_look::unknown;
            if (is_there[k] && !waits && source.is_counted(i)) {
                rows.totals.drawn += static_cast<std::uint32_t>(look == first_look::no_rows);
                rows.totals.outside += static_cast<std::uint32_t>(look == first_look::outside);
            }
            const unsigned waiting = __ballot_sync(0xffffffffu, static_cast<int>(waits));
            if (waits) mine.queue[queued + static_cast<unsigned>(__popc(waiting & ((1u << lane) - 1)))] = i;
            queued += static_cast<unsigned>(__popc(waiting));
        }
        __syncwarp();
        while (queued >= 32) emit(32);
    }
    if (queued != 0) emit(queued);
    rows.totals.add_up(!Sink::is_listing, state);
}

} // namespace voxelpipe::device
