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
#include <filesystem>
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

// Crossings with rows are listed and sorted. Cells, vertices and faces have their values.
struct remesh_bytes {
    static constexpr double vertex = 84, triangle = 64, crossing = 24, cell = 150;
};

// Samples of the band that a level draws on each side of the surface.
double band_of_level(const voxelize_request& request) {
    const double largest = std::max({request.grid.voxel_size.x, request.grid.voxel_size.y, request.grid.voxel_size.z});
    return std::abs(request.remesh->level) / largest + 2;
}

// Cells that the surface passes, about: walls that repairs make, and the two sides of sheets at a level, are as large
// as the model.
double surface_cells_of(const voxelize_request& request, double samples, double crossings) {
    const remesh_request& wanted = *request.remesh;
    return std::min(samples, crossings * (wanted.sign.is_repaired() || wanted.level != 0 ? 2 : 1));
}

// As remesh_need, in slabs of that many layers, each by itself, while the arrays of the mesh are in files.
double need_of_remeshed_slabs(const scene& model, const voxelize_request& request, double crossings, int layers) {
    const glm::dvec3 n(request.grid.extent);
    const double drawn = std::min(n.z, layers + 2.0 * voxelpipe::surface_slab::beyond), samples = n.x * n.y * drawn;
    // Rows along z have the crossings of all layers below.
    double bytes = static_cast<double>(model.vertex_count()) * remesh_bytes::vertex +
                   static_cast<double>(model.triangle_count()) * remesh_bytes::triangle +
                   crossings * remesh_bytes::crossing;
    const double cells = surface_cells_of(request, n.x * n.y * n.z, crossings);
    bytes += std::min(samples, cells * drawn / n.z) * remesh_bytes::cell;
    // Bits of samples and what finds cells and rows; a level's field.
    bytes += samples * (request.remesh->level != 0 ? 4.75 : 0.5) + 8 * (n.x * n.y + (n.x + n.y) * drawn);
    return std::max(bytes, cells * 4); // then components are counted
}

// Layers of slabs that fit; none: the mesh is made at once. Throws memory_error where neither fits.
std::optional<int> layers_of_remesh(const scene& model, const voxelize_request& request, double need) {
    const glm::ivec3 extent = request.grid.extent;
    const remesh_request& wanted = *request.remesh;
    const auto room = static_cast<double>(memory::room());
    constexpr double used = 0.75; // of the room, by estimate: a surface is not the same in all layers
    const std::string what = "remeshing on a grid of " + std::to_string(extent.x) + " x " + std::to_string(extent.y) +
                             " x " + std::to_string(extent.z);
    const bool sees_all = wanted.embedded || wanted.sign.vote || wanted.sign.rule == solid_rule::exterior;
    if (need <= room || sees_all || request.backend == backend_choice::cuda) {
        memory::expect(need);
        memory::require(need, what, memory::fewer_voxels_hint, need);
        return std::nullopt;
    }
    const double crossings = crossings_of(model, request.grid);
    const auto need_of = [&](int layers) { return need_of_remeshed_slabs(model, request, crossings, layers); };
    int layers = 1; // the need grows with them
    for (int more = extent.z - 1; more > 0; more /= 2)
        while (layers + more <= extent.z && need_of(layers + more) <= used * room) layers += more;
    const double least = need_of(layers);
    memory::expect(least);
    memory::require(least, what + ", in slabs of " + std::to_string(layers) + " layers", memory::fewer_voxels_hint,
                    least);
    return layers;
}

} // namespace

remesh_memory remesh_need(const scene& model, const voxelize_request& request) {
    const remesh_request& wanted = *request.remesh;
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z, crossings = crossings_of(model, request.grid);
    remesh_memory need;
    need.bytes = static_cast<double>(model.vertex_count()) * remesh_bytes::vertex +
                 static_cast<double>(model.triangle_count()) * remesh_bytes::triangle +
                 crossings * remesh_bytes::crossing +
                 surface_cells_of(request, samples, crossings) * remesh_bytes::cell;
    // Grids of bits: of the rows of three axes, and of the cover and what a flood reaches.
    if (wanted.sign.vote) need.bytes += samples * 3 / 8;
    if (wanted.sign.rule == solid_rule::exterior) need.bytes += samples * 5 / 8;
    if (wanted.level != 0) {
        // The field of the grid with its bits, or the samples of the band in lists, then in bricks.
        constexpr double grid_bytes = 4.25, brick_bytes = 60;
        const double band = std::min(samples, crossings * 2 * band_of_level(request));
        need.in_bricks = band * brick_bytes < samples * grid_bytes;
        need.bytes += need.in_bricks ? band * brick_bytes : samples * grid_bytes;
    }
    return need;
}

surface_mesh run_remesher(scene&& model, const voxelize_request& request, const std::filesystem::path& folder,
                          voxelize_stats& stats) {
    if (request.devices != 1) throw backend_error("--devices: one GPU remeshes");
    const remesh_memory how_much = remesh_need(model, request);
    const double need = how_much.bytes;
    const std::optional<int> layers = layers_of_remesh(model, request, need);
    if (const std::uint64_t lines = model.line_count(); lines != 0)
        stats.warnings.push_back(std::to_string(lines) + " line(s) and point(s) enclose nothing: --remesh leaves them "
                                                         "out");
    try {
        stats.slabs = 1;
        stats.triangles = model.triangle_count();
        if (request.backend != backend_choice::cpu && !layers)
            if (std::optional<surface_mesh> made = draw_on_cuda(
                    model, request, true, stats, [&](const cuda_facts& facts, const voxelize_request& how) {
                        return remeshed_on_cuda(facts, model, how, how_much.in_bricks, stats);
                    }))
                return std::move(*made);
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        stats.backend = "cpu";
        stats.threads = threads;
        scene_remesher<vp::cpu_backend> remesher(on, model, request);
        return layers ? remesher.in_slabs(*layers, folder, stats) : remesher.whole(how_much.in_bricks, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
