// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "remesher.hpp"

#include "draw/cuda_device.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "remesh_scene.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

// How often the model's triangles cross the rows of samples along the three axes, about: their areas as seen along
// these.
double crossings_of(const scene& model, const vp::grid& grid) {
    double crossings = 0;
    std::vector<glm::dvec3> placed;
    for (const instance& shown : model.instances) {
        const primitive& part = model.primitives[shown.primitive];
        if (part.triangles.empty()) continue;
        placed.clear();
        for (const glm::vec3& p : part.positions) {
            glm::dvec3 voxel = shown.to_world(glm::dvec3(p));
            for (int a = 0; a < 3; ++a) voxel[a] /= grid.voxel_size[a];
            placed.push_back(voxel);
        }
        for (const glm::uvec3& t : part.triangles) {
            const glm::dvec3 u = placed[t.y] - placed[t.x], v = placed[t.z] - placed[t.x];
            const double seen =
                std::abs(u.y * v.z - u.z * v.y) + std::abs(u.z * v.x - u.x * v.z) + std::abs(u.x * v.y - u.y * v.x);
            if (std::isfinite(seen)) crossings += seen / 2;
        }
    }
    return crossings;
}

} // namespace

remesh_memory remesh_need(const scene& model, const voxelize_request& request) {
    const remesh_request& wanted = *request.remesh;
    const double triangles = static_cast<double>(model.triangle_count()),
                 vertices = static_cast<double>(model.vertex_count());
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z, crossings = crossings_of(model, request.grid);
    // Crossings with rows are listed and sorted. Cells, vertices and faces have their values; walls that repairs make,
    // and the two sides of sheets at a level, are as large as the model, about.
    constexpr double crossing_bytes = 24, cell_bytes = 150;
    const double cells = std::min(samples, crossings * (wanted.sign.is_repaired() || wanted.level != 0 ? 2 : 1));
    remesh_memory need;
    need.bytes = vertices * 84 + triangles * 64 + crossings * crossing_bytes + cells * cell_bytes;
    if (wanted.sign.vote || wanted.sign.rule == solid_rule::exterior) need.bytes += samples * 3 / 8;
    if (wanted.level != 0) {
        // The field of the grid with its bits, or the samples of the band in lists, then in bricks.
        constexpr double grid_bytes = 4.25, brick_bytes = 60;
        const double largest =
            std::max({request.grid.voxel_size.x, request.grid.voxel_size.y, request.grid.voxel_size.z});
        const double band = std::min(samples, crossings * 2 * (std::abs(wanted.level) / largest + 2));
        need.in_bricks = band * brick_bytes < samples * grid_bytes;
        need.bytes += need.in_bricks ? band * brick_bytes : samples * grid_bytes;
    }
    return need;
}

surface_mesh run_remesher(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    if (request.devices != 1) throw backend_error("--devices: one GPU remeshes");
    const remesh_memory how_much = remesh_need(model, request);
    const double need = how_much.bytes;
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
                        return remeshed_on_cuda(facts, model, how, how_much.in_bricks, stats);
                    }))
                return std::move(*made);
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        stats.backend = "cpu";
        stats.threads = threads;
        return remesh_scene(on, model, request, how_much.in_bricks, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
