// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Draw after draw through a raster without tiles: where it gets its vertices from.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/device/scene/triangle_source.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <cstdint>
#include <span>

namespace voxelpipe::device {

// Instances of a mesh that are drawn in one pass of at most `most` triangles, at least one.
template <class Mesh>
[[nodiscard]] std::uint64_t instances_of_pass(const Mesh& m, std::uint64_t most) {
    const std::uint64_t each = m.triangles.size(), all = std::max<std::uint64_t>(m.copies.count, 1);
    return each == 0 ? all : std::clamp<std::uint64_t>(most / each, 1, all);
}

// Calls raster(draw, source, is_first) for each draw that has triangles, or for some of its instances at a time, at
// most pass_triangles. ShadesInRaster: the raster shades vertices itself, otherwise `positions` has room for those of
// the largest pass; there are no varyings. state->deferred is zero.
template <bool ShadesInRaster, class Mesh, class VertexShader, class FragmentShader, class Raster>
void raster_each_draw(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const core::snap_transform& snap,
                      const vertex_positions& positions, pipeline_state* state, stage_clock* clock, cudaStream_t stream,
                      const Raster& raster, std::uint64_t pass_triangles = ~std::uint64_t{0}) {
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const auto& d = draws[i];
        const auto number = static_cast<std::uint32_t>(i);
        if (d.mesh.num_triangles() == 0) continue;
        auto part = d; // a pass's instances
        const std::uint64_t each = instances_of_pass(d.mesh, pass_triangles);
        for (std::uint64_t first = 0; first < d.mesh.copies.count; first += each) {
            part.mesh.copies.count = std::min(each, d.mesh.copies.count - first);
            const bool is_first = i == 0 && first == 0;
            if (!is_first) check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
            if constexpr (ShadesInRaster) {
                raster(part, shading_source<Mesh, VertexShader>{part.mesh, part.vertex_shader, snap, number}, is_first);
            } else {
                vertex_shade(part.mesh, part.vertex_shader, snap, number, positions, static_cast<no_varyings*>(nullptr),
                             stream, static_cast<std::uint32_t>(first), true);
                end_stage(clock, &stage_times::vertex_shade);
                raster(part, stored_source{geometry_from(part.mesh, positions, 0)}, false);
            }
        }
    }
}

} // namespace voxelpipe::device
