// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "remesher.hpp"

#include "draw/solid_options.hpp"
#include "draw/uploaded_scene.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace voxelize {
namespace {

vp::remesh_options remesh_options_of(const remesh_request& request) {
    const vp::solid_options solid = solid_options_of(request.sign);
    vp::remesh_options options;
    options.place = request.place;
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    options.level = request.level;
    options.quads = request.quads;
    return options;
}

surface_mesh remesh_scene(vp::cpu_backend& on, scene& model, const voxelize_request& request, voxelize_stats& stats) {
    const uploaded_scene<vp::cpu_backend> uploaded(on, model, request, wanted_targets{}, false);
    using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, vp::none>;
    std::vector<draw> draws;
    for (const auto& d : uploaded.bits_draws()) draws.push_back({d.mesh, d.vertex_shader, {}});
    vp::surface<vp::cpu_backend> made(on);
    const vp::status status = vp::remesh(on, draws, uploaded.relative_grid(), made, remesh_options_of(*request.remesh));
    if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
    status.or_throw();
    surface_mesh result;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<glm::length_t>(a);
        result.extent[a] = request.grid.extent[axis];
        result.origin[a] = request.grid.part_origin()[axis];
        result.voxel_size[a] = request.grid.voxel_size[axis];
    }
    result.vertices = made.vertices.to_host(on);
    result.triangles = made.triangles.to_host(on);
    result.quads = made.quads.to_host(on);
    result.sources = made.sources.to_host(on);
    result.counts = status.surface;
    stats.triangles_dropped = status.counts.triangles_dropped();
    stats.triangles_drawn = status.counts.triangles_drawn;
    solid_counts& counts = stats.solid.emplace();
    counts.rows = static_cast<std::uint64_t>(request.grid.extent.y) * static_cast<std::uint64_t>(request.grid.extent.z);
    counts.open_rows = status.solid.open_rows;
    counts.crossings = status.solid.crossings;
    counts.max_winding = status.solid.max_winding;
    counts.hole_edges = status.solid.hole_edges;
    counts.holes = status.solid.holes;
    counts.closed_holes = status.solid.cones;
    if (std::string warning = open_warning(request.remesh->sign, counts); !warning.empty())
        stats.warnings.push_back("the sign of --remesh: " + warning);
    if (result.vertices.empty())
        stats.warnings.push_back("nothing lies inside of the model on this grid: the mesh is empty. Sheets and open "
                                 "meshes enclose nothing; --close-holes, --solid exterior and --iso D above 0 help");
    return result;
}

} // namespace

double remesh_need(const scene& model, const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z;
    const double triangles = static_cast<double>(model.triangle_count()),
                 vertices = static_cast<double>(model.vertex_count());
    // The bits, or the field, and a word for each row of 32 cells.
    double bytes = samples * (request.remesh->level != 0 ? 4.0 + 2.0 / 8 : 2.0 / 8);
    bytes += vertices * 48 + triangles * 64;
    // Cells, crossings, vertices and faces of a surface as large as three times the grid's.
    constexpr double cell_bytes = 200;
    bytes += 6 * (n.x * n.y + n.y * n.z + n.z * n.x) * cell_bytes;
    return bytes;
}

surface_mesh run_remesher(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    require_cpu(request, "--remesh runs on the CPU alone", stats);
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
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        stats.backend = "cpu";
        stats.threads = threads;
        stats.slabs = 1;
        stats.triangles = model.triangle_count();
        const auto start = std::chrono::steady_clock::now();
        surface_mesh result = remesh_scene(on, model, request, stats);
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("remesh", time.count());
        return result;
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
