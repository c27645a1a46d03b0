// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "voxelizer.hpp"

#include "pipeline.hpp"

#include <cpu_ref/backend.hpp>

#include <unistd.h>

#include <cmath>
#include <new>
#include <utility>

namespace voxelize {

template <>
inline constexpr bool memory_is_host<vp::cpu_backend> = true;

double volume_bytes(const voxelize_request& request) {
    double voxel = 0;
    for (const target id : request.targets) {
        const target_info& info = info_of(id);
        voxel += info.type == scalar::bit ? 0.125 : static_cast<double>(size_of(info.type)) * info.components;
    }
    return voxel * request.grid.extent.x * request.grid.extent.y * request.grid.extent.z;
}

namespace {

// Refuses what the machine cannot hold before the system does, less kindly, while it runs.
void check_memory(const voxelize_request& request) {
    const double needed = volume_bytes(request);
    const double physical = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    if (needed > 0.9 * physical)
        throw memory_error("the result needs " + std::to_string(std::llround(needed / (1 << 20))) +
                           " MiB, this machine has " + std::to_string(std::llround(physical / (1 << 20))) +
                           " MiB: take fewer targets or voxels");
}

volume run_on_cpu(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    const int threads = thread_count(request.threads);
    vp::cpu_backend backend{static_cast<unsigned>(threads)};
    vp::cpu::stage_times times;
    backend.times = &times;
    stats.backend = "cpu";
    stats.threads = threads;
    volume result = pipeline<vp::cpu_backend>{backend, std::move(model), request, stats}.run();

    // The pipeline's own stages in place of their sum.
    std::vector<std::pair<std::string, double>> stages;
    for (auto& [name, time] : stats.milliseconds) {
        if (name != "voxelize") {
            stages.emplace_back(name, time);
            continue;
        }
        stages.emplace_back("vertex_shade", times.vertex_shade);
        stages.emplace_back("coarse_raster", times.coarse_raster);
        stages.emplace_back("tile_sort", times.tile_sort);
        stages.emplace_back("clear", times.clear);
        stages.emplace_back("fine_raster", times.fine_raster);
    }
    stats.milliseconds = std::move(stages);
    return result;
}

} // namespace

volume run_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    check_memory(request);
    if (request.backend == backend_choice::cuda)
        throw backend_error("this program was built without the CUDA backend; use --backend cpu");
    try {
        return run_on_cpu(std::move(model), request, stats);
    } catch (const std::bad_alloc&) {
        throw memory_error("not enough memory: take fewer targets or voxels");
    }
}

} // namespace voxelize
