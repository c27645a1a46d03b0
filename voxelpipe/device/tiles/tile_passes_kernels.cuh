// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The coarse pass (tiles/tile_passes.cuh) and its kernels, which depend on no shader and no target.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/device/tiles/coarse_raster.cuh>
#include <voxelpipe/device/tiles/tile_passes.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Buffers>
__global__ void tile_split_kernel(const std::uint32_t* keys, Buffers out, pipeline_state* state, capacities limits) {
    if (has_failed(*state, limits)) return;
    const auto num_pairs = static_cast<std::uint32_t>(state->tile_pairs);
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint32_t tile = i < num_pairs ? keys[i] : 0;
    const auto first = static_cast<std::uint32_t>(i);
    std::uint32_t count = 0; // of the run that begins here
    if (i < num_pairs && (i == 0 || keys[i - 1] != tile)) {
        // Finds the end of the run: doubling steps from its start, then bisection.
        std::uint64_t lo = first, step = 1;
        while (lo + step < num_pairs && keys[lo + step] == tile) {
            lo += step;
            step *= 2;
        }
        const std::uint64_t end = lo + step < num_pairs ? lo + step : num_pairs;
        const std::uint64_t last = core::bisect_last(lo, end, [=](std::uint64_t at) { return keys[at] == tile; });
        count = static_cast<std::uint32_t>(last + 1 - first);
    }
    const std::uint32_t parts = (count + out.pairs_per_item - 1) / out.pairs_per_item;
    // A block takes room once: an atomic for each run would be most of the time.
    const auto at = static_cast<std::uint32_t>(take_room(parts, &state->num_items, ~0u));
    if (parts == 0) return;
    if (parts == 1) {
        out.items[at] = {tile, first, count, no_image};
        return;
    }
    const std::uint32_t image = atomicAdd(&state->num_images, parts);
    out.splits[atomicAdd(&state->num_splits, 1u)] = {tile, image, parts};
    if (parts > max_narrow_split) state->has_wide_splits = 1;
    const std::uint32_t each = (count + parts - 1) / parts;
    for (std::uint32_t p = 0; p < parts; ++p) {
        const std::uint32_t begin = p * each < count ? p * each : count;
        const std::uint32_t end = begin + each < count ? begin + each : count;
        out.items[at + p] = {tile, first + begin, end - begin, image + p};
    }
}

VOXELPIPE_DEFINES_KERNELS void tile_split(const std::uint32_t* keys, const split_buffers& out, pipeline_state* state,
                                          const capacities& limits, cudaStream_t stream) {
    tile_split_kernel<<<num_blocks(limits.tile_pairs), threads_per_block, 0, stream>>>(keys, out, state, limits);
    check(cudaGetLastError(), stage::tile_split);
}

VOXELPIPE_DEFINES_KERNELS void restart_items(pipeline_state* state, cudaStream_t stream) {
    check(cudaMemsetAsync(&state->next_item, 0, sizeof(state->next_item), stream), stage::fine_raster);
}

template <coverage Rule>
tile_work coarse_pass(const geometry& geo, const tile_memory& m, pipeline_state* state, const capacities& limits,
                      cudaStream_t stream, stage_clock* clock) {
    cell_buffers cells = m.cells;
    cells.num_records = &state->tile_records;
    cells.num_cells = &state->tile_pairs;
    const tile_cells<Rule> op{m.tiles, m.keys[0], m.primitives[0]};
    const auto blocks =
        static_cast<unsigned>((std::uint64_t{geo.num_primitives} + left_triangles::max - 1) / left_triangles::max);
    append_kernel<Rule><<<blocks, threads_per_block, 0, stream>>>(geo, op, cells, state, limits, append_pass::small);
    check(cudaGetLastError(), stage::coarse_raster);
    append_kernel<Rule><<<fill_device(cells.record_capacity * 32), threads_per_block, 0, stream>>>(
        geo, op, cells, state, limits, append_pass::large);
    check(cudaGetLastError(), stage::coarse_raster);
    end_stage(clock, &stage_times::coarse_raster);
    fill_end(m.keys[0], m.primitives[0], cells.num_cells, limits.tile_pairs, state, limits, stream);
    const int at = sort_by_cell(m.keys, m.primitives, limits.tile_pairs, m.bits, m.storage, m.storage_bytes,
                                stage::tile_sort, stream);
    end_stage(clock, &stage_times::tile_sort);
    tile_split(m.keys[at], m.split, state, limits, stream);
    end_stage(clock, &stage_times::tile_split);
    return {m.keys[at], {m.primitives[at], m.split.items, m.images, m.tiles, false, false, false}, m.split.splits};
}

} // namespace voxelpipe::device
