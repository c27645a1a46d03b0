// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "distance_voxelizer.hpp"

#include "distance_drawer.hpp"
#include "draw/cuda_device.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

bool is_of_nearest(target id) {
    return id == target::distance || id == target::nearest || id == target::color || id == target::normal ||
           id == target::material || id == target::triangle || id == target::depth;
}

double distance_need(const scene& model, const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    const double samples = n.x * n.y * n.z;
    bool numbers = false, shaded = false;
    for (const target id : request.targets) {
        numbers = numbers || id == target::nearest || id == target::triangle || id == target::material;
        shaded = shaded || id != target::distance;
    }
    // A vertex as it is snapped, with what shaders hand on; a triangle's box, number and part of the tree.
    constexpr double vertex_bytes = 24, triangle_bytes = 160, crossing_bytes = 16, thread_bytes = 1 << 20;
    const double triangles = static_cast<double>(model.triangle_count());
    double bytes = volume_bytes(request) + (numbers ? 4 * samples : 0);
    bytes += static_cast<double>(model.vertex_count()) * (vertex_bytes + (shaded ? sizeof(surface_varyings) : 0.0));
    bytes += triangles * triangle_bytes + thread_count(request.threads) * thread_bytes;
    if (request.distance->is_signed) bytes += samples / 8 + triangles * crossing_bytes;
    if (request.write_bytes) {
        // The band of a surface as large as the grid's.
        const double band =
            request.distance->is_whole
                ? samples
                : std::min(samples, 2 * (n.x * n.y + n.y * n.z + n.z * n.x) * 2 * request.distance->band);
        constexpr double brick_voxels = 512, filled = 0.5;
        bytes = std::max(bytes, volume_bytes(request) +
                                    request.write_bytes(std::min(band / filled, samples) / brick_voxels, band, 0));
    }
    return bytes;
}

volume run_distance_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    const double need = distance_need(model, request);
    const glm::ivec3 extent = request.grid.extent;
    memory::expect(need);
    memory::require(need,
                    std::string(request.distance->is_whole ? "a whole distance field of " : "a distance field of ") +
                        std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " + std::to_string(extent.z) +
                        " samples",
                    memory::fewer_voxels_hint, need);
    if (const std::uint64_t lines = model.line_count(); lines != 0)
        stats.warnings.push_back(std::to_string(lines) +
                                 " line(s) and point(s) have no distances: --distance leaves them out");
    if (request.devices != 1) throw backend_error("--devices: one GPU draws distances");
    try {
        stats.triangles = model.triangle_count();
        if (request.backend != backend_choice::cpu)
            if (std::optional<volume> drawn = draw_on_cuda(model, request, false, stats,
                                                           [&](const cuda_facts& facts, const voxelize_request& how) {
                                                               return distances_on_cuda(facts, model, how, stats);
                                                           }))
                return std::move(*drawn);
        const int threads = thread_count(request.threads);
        vp::cpu_backend on{static_cast<unsigned>(threads)};
        if (request.progress)
            on.progress = [&request](std::uint64_t done, std::uint64_t total) {
                request.progress(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
            };
        stats.backend = "cpu";
        stats.threads = threads;
        return draw_distances(on, model, request, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint, need));
    }
}

} // namespace voxelize
