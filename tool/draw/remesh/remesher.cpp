// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "remesher.hpp"

#include "draw/cuda_device.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "remesh_scene.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <utility>

namespace voxelize {

double remesh_need(const scene& model, const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z;
    const double triangles = static_cast<double>(model.triangle_count()),
                 vertices = static_cast<double>(model.vertex_count());
    // The bits, or the field, and a word for each row of 32 cells.
    double bytes = samples * (request.remesh->level != 0 ? 4.0 + 2.0 / 8 : 2.0 / 8);
    bytes += vertices * 84 + triangles * 64;
    // Cells, crossings, vertices and faces with their values, of a surface as large as three times the grid's.
    constexpr double cell_bytes = 300;
    bytes += 6 * (n.x * n.y + n.y * n.z + n.z * n.x) * cell_bytes;
    return bytes;
}

surface_mesh run_remesher(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    if (request.devices != 1) throw backend_error("--devices: one GPU remeshes");
    const double need = remesh_need(model, request);
    const glm::ivec3 extent = request.grid.extent;
    memory::expect(need);
    memory::require(need,
                    "remeshing on a grid of " + std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " +
                        std::to_string(extent.z),
                    memory::fewer_voxels_hint, need);
    if (const std::uint64_t lines = model.line_count(); lines != 0)
        stats.warnings.push_back(std::to_string(lines) + " line(s) and point(s) enclose nothing: --remesh leaves them "
                                                         "out");
    try {
        stats.slabs = 1;
        stats.triangles = model.triangle_count();
        if (request.backend != backend_choice::cpu)
            if (std::optional<surface_mesh> made = draw_on_cuda(
                    model, request, true, stats, [&](const cuda_facts& facts, const voxelize_request& how) {
                        return remeshed_on_cuda(facts, model, how, stats);
                    }))
                return std::move(*made);
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        stats.backend = "cpu";
        stats.threads = threads;
        return remesh_scene(on, model, request, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
