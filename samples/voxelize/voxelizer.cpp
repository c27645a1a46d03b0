// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "voxelizer.hpp"

#include "cuda_device.hpp"
#include "padding.hpp"
#include "pipeline.hpp"

#include <cpu_ref/backend.hpp>

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

namespace voxelize {

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

volume run_on_cpu(scene& model, const voxelize_request& request, voxelize_stats& stats) {
    const int threads = thread_count(request.threads);
    vp::cpu_backend backend{static_cast<unsigned>(threads)};
    vp::stage_times times;
    backend.times = &times;
    stats.backend = "cpu";
    stats.threads = threads;
    volume result = pipeline<vp::cpu_backend>{backend, model, request, stats}.run();

    constexpr std::string_view absent[] = {"tile_split", "tile_resolve", "abuffer_emit"};
    show_stages(stats, times, absent, "");
    return result;
}

// The GPU, where it can be used: stats.no_cuda says why where it cannot.
std::optional<volume> try_cuda(scene& model, voxelize_request request, voxelize_stats& stats) {
    const auto start = std::chrono::steady_clock::now();
    const cuda_facts facts = look_for_cuda();
    stats.no_cuda = why_not(facts);
    if (!stats.no_cuda.empty()) {
        if (request.backend == backend_choice::cuda)
            throw backend_error("--backend cuda: " + stats.no_cuda + "; use --backend cpu");
        return std::nullopt;
    }
    const voxelize_stats before = stats;
    try {
        if (const std::string why = why_too_large(facts, model, request); !why.empty()) throw device_memory_error(why);
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("cuda_start", time.count());
        if (request.work_memory == 0) request.work_memory = default_work_memory(facts);
        return run_on_cuda(facts, model, request, stats);
    } catch (const device_memory_error& error) {
        if (request.backend == backend_choice::cuda)
            throw memory_error(std::string("--backend cuda: ") + error.what() + "; use --backend cpu");
        stats = before;
        stats.no_cuda = error.what();
        stats.warnings.push_back(stats.no_cuda + "; the CPU does the work");
        return std::nullopt;
    }
}

volume with_ring(volume inside, const voxelize_request& request) {
    volume result = padded(std::move(inside), request.padding);
    for (std::size_t axis = 0; axis < 3; ++axis) // without the rounding of a way there and back
        result.origin[axis] = request.grid.part_origin()[static_cast<glm::length_t>(axis)];
    return result;
}

} // namespace

volume run_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    check_memory(request);
    try {
        voxelize_request inside = request;
        inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
        if (request.backend != backend_choice::cpu)
            if (std::optional<volume> result = try_cuda(model, inside, stats))
                return with_ring(std::move(*result), request);
        if (inside.work_memory == 0) inside.work_memory = std::uint64_t{128} << 20;
        return with_ring(run_on_cpu(model, inside, stats), request);
    } catch (const std::bad_alloc&) {
        throw memory_error("not enough memory: take fewer targets or voxels");
    }
}

} // namespace voxelize
