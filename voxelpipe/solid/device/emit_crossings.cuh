// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Every crossing of the draws' triangles with rows, into a list or straight into bits: a pass over all triangles and
// one over the work items of the large ones.

#include <voxelpipe/solid/device/small_rows.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Before emit_crossings, for triangles that are shaded on the spot.
template <class Mesh, class VertexShader>
void find_row_codes(const shaded_triangles<Mesh, VertexShader>& triangles, const row_grid& grid,
                    const zeroed_memory& zeros, pipeline_state* state, cudaStream_t stream) {
    const std::uint64_t work = triangles.num_vertices > zeros.count / 4 ? triangles.num_vertices : zeros.count / 4;
    launch_behind(find_row_codes_kernel<Mesh, VertexShader>, fill_device(work), threads_per_block, stream,
                  stage::vertex_shade, triangles, grid, zeros, static_cast<const pipeline_state*>(state));
}

// Every crossing of the source's triangles. kept: with(state).
template <class Source, class Sink>
void emit_crossings(const Source& source, const row_grid& grid, const Sink& sink, const row_triangles& kept,
                    pipeline_state* state, cudaStream_t stream) {
    launch_behind(small_rows_kernel<Source, Sink>, fill_device(source.num_triangles, tuning::small_row_blocks),
                  threads_per_block, stream, stage::coarse_raster, source, grid, sink, kept, state);
    launch_behind(large_rows_kernel<Source, Sink>,
                  static_cast<unsigned>(num_multiprocessors() * tuning::large_row_blocks), threads_per_block, stream,
                  stage::coarse_raster, source, grid, sink, kept, state);
}

} // namespace voxelpipe::device
