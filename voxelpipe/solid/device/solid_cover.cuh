// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The conservative cover of a solid's body, as entries of its rows: one where a run of covered voxels begins and one
// behind its end. The raster of the occupancy mask sets a bit for each covered voxel, and a pass over the bits lists
// the runs, body by body in one mask. So a row with cover and no crossing is swept as any other, and the memory does
// not grow with the number of draws.

#include <voxelpipe/device/fragments/list_sink.cuh>
#include <voxelpipe/device/raster/mask_sink.cuh>
#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/scene/int128_coverage.cuh>
#include <voxelpipe/solid/device/crossing_list.cuh>
#include <voxelpipe/solid/device/solid_source.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Appends where runs of bits begin and end in rows, but for ends behind a row. A thread a word.
template <class State>
__global__ __launch_bounds__(threads_per_block) void list_cover_kernel(const word* mask,
                                                                       const __grid_constant__ row_grid grid,
                                                                       const __grid_constant__ crossing_list list,
                                                                       std::uint32_t body, State* state) {
    await_stream();
    const auto words_x = static_cast<std::uint32_t>((grid.extent.x + 31) / 32);
    const std::uint64_t num = grid.num_rows() * words_x, step = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t start = std::uint64_t{blockIdx.x} * blockDim.x; start < num; start += step) {
        const std::uint64_t i = start + threadIdx.x;
        word begins = 0, ends = 0;
        std::uint32_t x0 = 0;
        if (i < num) {
            x0 = static_cast<std::uint32_t>(i % words_x) * 32;
            const word bits = mask[i], before = bits << 1 | (x0 != 0 ? mask[i - 1] >> 31 : 0u);
            const auto left = static_cast<std::uint32_t>(grid.extent.x) - x0;
            begins = bits & ~before;
            ends = ~bits & before & (left >= 32 ? ~0u : (1u << left) - 1);
        }
        const auto n = static_cast<unsigned>(__popc(begins) + __popc(ends));
        if (__syncthreads_or(static_cast<int>(n != 0)) == 0) continue;
        unsigned long long at = reserve_for_block(n, &state->list_fragments);
        const unsigned long long all = block_sum(n);
        if (threadIdx.x == 0) atomicAdd(&state->solid.cover_ends, all);
        const std::uint64_t row = i / words_x;
        for (; begins != 0; begins &= begins - 1)
            list.store(at++, row, body,
                       entry_value::of(x0 + static_cast<unsigned>(__ffs(static_cast<int>(begins))) - 1,
                                       entry_kind::cover_begin));
        for (; ends != 0; ends &= ends - 1)
            list.store(
                at++, row, body,
                entry_value::of(x0 + static_cast<unsigned>(__ffs(static_cast<int>(ends))) - 1, entry_kind::cover_end));
    }
}

// Grids and meshes that the 32-bit raster does not serve: sets the bits of voxels, as cells of count_and_emit.
// A template although there is one coverage: nvcc's suppression of calls from host code works in templates only.
template <coverage Rule>
struct cover_cells {
    static constexpr coverage rule = Rule;
    static constexpr std::int64_t small_columns = 256;
    static constexpr bool counts_triangles = true;
    word* mask;
    glm::ivec3 extent;

    [[nodiscard]] __device__ static core::voxel_box cells(const core::voxel_box& reach) { return reach; }
    // Out of line: two passes of cells_kernel call it.
    [[nodiscard]] __device__ __noinline__ cell_counts count(const geometry& geo, const loaded_triangle& t,
                                                            std::uint32_t, const core::voxel_box& box, bool) const {
        const int fraction = geo.snap.fraction;
        constexpr auto spans = core::to_rule(Rule);
        const auto set = [&](int axis, int u, int v, int w0, int w1) {
            for (int w = w0; w <= w1; ++w) {
                const auto p = core::to_xyz(axis, u, v, w);
                atomicOr(mask + mask_target::map::cell(extent, p[0], p[1], p[2]), 1u << (p[0] & 31));
            }
        };
        if (core::fits_narrow(t.a, t.b, t.c, fraction)) {
            const auto s = core::setup_triangle<spans, std::int64_t>(t.a, t.b, t.c, fraction);
            core::for_each_span<spans>(s, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                set(s.axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w0), static_cast<int>(w1));
            });
        } else {
            const int axis = core::dominant_axis(t.a, t.b, t.c, fraction);
            for_each_wide_span<spans>(t.a, t.b, t.c, fraction, box,
                                      [&](const wide_span& s) { set(axis, s.u, s.v, s.w_first, s.w_last); });
        }
        return {};
    }
};

// Takes the counts of triangles from conservative coverage, for a call without crossings. One thread.
template <class State>
__global__ void take_counts_kernel(const State* from, State* to) {
    to->nonfinite = from->nonfinite;
    to->too_far = from->too_far;
    to->outside = from->outside;
    to->drawn = from->drawn;
    to->index_error |= from->index_error;
}

// Memory for the cover of one body after the other.
struct cover_memory {
    word* mask = nullptr;            // null: no cover is wanted
    pipeline_state* state = nullptr; // of the raster, which counts triangles in its own way
    deferred_triangles deferred{};
    cell_buffers cells{}; // where the 32-bit raster does not serve
    bool uses_raster = true;

    [[nodiscard]] static bool is_listed(std::uint64_t num_triangles, const grid& g) {
        return is_listable(num_triangles, core::make_snap_transform(g).fraction, g.extent);
    }
    [[nodiscard]] static cover_memory take(arena& memory, std::size_t max_triangles, const grid& g,
                                           const capacities& limits) {
        cover_memory m;
        m.mask = memory.take<word>(mask_target::map::elements(g.extent));
        m.state = memory.take<pipeline_state>(1);
        m.uses_raster = is_listed(max_triangles, g);
        if (m.uses_raster)
            m.deferred = deferred_triangles::take(memory, max_triangles);
        else
            m.cells = take_cell_buffers(memory, static_cast<std::uint32_t>(max_triangles), limits.fragment_records);
        return m;
    }
    // Called once a call.
    void start(cudaStream_t stream) const {
        check(cudaMemsetAsync(state, 0, sizeof(*state), stream), stage::fine_raster);
    }
    void clear(const grid& g, cudaStream_t stream) const {
        check(cudaMemsetAsync(mask, 0, mask_target::map::elements(g.extent) * sizeof(word), stream),
              stage::fine_raster);
    }
};

// One thread. The call runs again with room for as many records as the largest draw has wanted.
template <class State>
__global__ void note_records_kernel(const State* of_draw, State* of_call) {
    if (of_draw->fragment_records > of_call->fragment_records) of_call->fragment_records = of_draw->fragment_records;
}

// Sets the bits of a draw's cover. of_draw: its geometry by itself. state: the call's.
template <int = 0>
void raster_cover(const cover_memory& m, const draw_geometry& of_draw, std::uint32_t num_triangles, const geometry& all,
                  const grid& g, pipeline_state* state, cudaStream_t stream) {
    if (num_triangles == 0) return;
    check(cudaMemsetAsync(&m.state->deferred, 0, sizeof(m.state->deferred), stream), stage::fine_raster);
    if (m.uses_raster) {
        const raster_call<coverage::conservative, stored_source, mask_output> call{
            {{of_draw}, num_triangles, all.snap.fraction, g.extent},
            {m.mask, g.extent, of_draw.num_vertices, m.state, false},
            m.deferred.with(m.state)};
        launch_raster(call, m.state, stage::fine_raster, stream);
        return;
    }
    geometry one = all;
    one.one = of_draw;
    one.one.first_primitive = 0;
    one.many = nullptr;
    one.num_draws = 1;
    one.num_primitives = num_triangles;
    cell_buffers b = m.cells;
    b.num_records = &m.state->fragment_records;
    b.num_cells = &m.state->list_fragments;
    check(cudaMemsetAsync(b.num_records, 0, sizeof(*b.num_records), stream), stage::fine_raster);
    const cover_cells<coverage::conservative> op{m.mask, g.extent};
    for (const cell_pass pass : {cell_pass::count_small, cell_pass::count_large})
        launch_cells(one, op, b, m.state, capacities{}, pass, stage::fine_raster, stream);
    note_records_kernel<pipeline_state><<<1, 1, 0, stream>>>(m.state, state);
    check(cudaGetLastError(), stage::fine_raster);
}

// Appends what is set, as the cover of a body.
template <int = 0>
void list_cover(const cover_memory& m, const row_grid& grid, const crossing_list& to, std::uint32_t body,
                pipeline_state* state, cudaStream_t stream) {
    const std::uint64_t words = mask_target::map::elements(grid.extent);
    launch_behind(list_cover_kernel<pipeline_state>, fill_device(words), threads_per_block, stream, stage::fine_raster,
                  static_cast<const word*>(m.mask), grid, to, body, state);
}

// For a call without crossings.
template <int = 0>
void take_counts(const cover_memory& m, pipeline_state* state, cudaStream_t stream) {
    take_counts_kernel<pipeline_state><<<1, 1, 0, stream>>>(m.state, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
