// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Draw after draw through a raster without tiles: where it gets its vertices from.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::device {

// Calls raster(draw, source, is_first) for each draw that has triangles. ShadesInRaster: the raster shades vertices
// itself, otherwise `positions` has room for those of the largest draw; there are no varyings. state->deferred is zero.
template <bool ShadesInRaster, class Mesh, class VertexShader, class FragmentShader, class Raster>
void raster_each_draw(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const core::snap_transform& snap,
                      const vertex_positions& positions, pipeline_state* state, stage_clock* clock, cudaStream_t stream,
                      const Raster& raster) {
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const auto& d = draws[i];
        const auto number = static_cast<std::uint32_t>(i);
        if (d.mesh.num_triangles() == 0) continue;
        if (i != 0) check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
        if constexpr (ShadesInRaster) {
            raster(d, shading_source<Mesh, VertexShader>{d.mesh, d.vertex_shader, snap, number}, i == 0);
        } else {
            vertex_shade(d.mesh, d.vertex_shader, snap, number, positions, static_cast<no_varyings*>(nullptr), stream);
            end_stage(clock, &stage_times::vertex_shade);
            raster(d, stored_source{geometry_from(d.mesh, positions, 0)}, false);
        }
    }
}

} // namespace voxelpipe::device
