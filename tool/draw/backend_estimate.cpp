// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "backend_estimate.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <cmath>

namespace voxelize {

namespace {

// Nanoseconds of one core of a server of 2023, measured with DamagedHelmet.glb and a mesh of 7.2 million triangles. A
// result's bytes are bound by the memory, which a few cores keep busy.
constexpr double per_triangle = 60, per_fragment = 40, per_shaded_fragment = 600, per_sample = 300;
constexpr double cpu_bytes_per_ns = 2, most_cpu_bytes_per_ns = 7;
// An NVIDIA H200 with 16 cores: what is left of its work beside the start of CUDA, its end and the transfers is a few
// milliseconds.
constexpr double cuda_start_ms = 250, cuda_end_ms = 120, cuda_calls_ms = 10, cuda_bytes_per_ns = 12,
                 cuda_per_shaded_fragment = 0.1;

} // namespace

work_size work_of(const voxelize_request& request, double triangles, double model_bytes, bool in_bricks) {
    work_size work;
    work.triangles = triangles;
    const glm::dvec3 n(request.grid.extent);
    work.fragments = 2 * triangles + 3 * 2 * (n.x * n.y + n.y * n.z + n.z * n.x);
    work.shaded = std::any_of(request.targets.begin(), request.targets.end(), [](target id) {
        return id != target::occupancy && id != target::count && id != target::distance;
    });
    work.model_bytes = model_bytes;
    work.result_bytes = volume_bytes(request);
    if (request.distance) { // each sample of the band looks at some triangles
        const double all = n.x * n.y * n.z;
        work.samples = request.distance->is_whole ? all : std::min(all, work.fragments * request.distance->band);
    }
    if (in_bricks) work.result_bytes *= std::min(1.0, work.fragments / (n.x * n.y * n.z));
    return work;
}

double cpu_milliseconds(const work_size& work, int threads) {
    const double ns = per_triangle * work.triangles +
                      (work.shaded ? per_shaded_fragment : per_fragment) * work.fragments + per_sample * work.samples;
    const double n = std::max(threads, 1);
    return (ns / n + work.result_bytes / std::min(n * cpu_bytes_per_ns, most_cpu_bytes_per_ns)) / 1e6;
}

double cuda_milliseconds(const work_size& work, double started_milliseconds_ago) {
    const double ns = (work.model_bytes + work.result_bytes) / cuda_bytes_per_ns +
                      (work.shaded ? cuda_per_shaded_fragment * work.fragments : 0);
    return std::max(0.0, cuda_start_ms - started_milliseconds_ago) + cuda_calls_ms + ns / 1e6 + cuda_end_ms;
}

bool cuda_may_pay(const grid_request& grid, const voxelize_request& request, double file_bytes) {
    constexpr double least_triangle_bytes = 9; // 16-bit indices, and half a vertex of 16-bit integers
    constexpr int unknown = 1024;              // voxels along each axis, where that depends on the model
    voxelize_request most = request;
    most.grid.extent = grid.extent.value_or(glm::ivec3(grid.voxel_size ? unknown : grid.resolution.value_or(128)));
    const work_size work = work_of(most, file_bytes / least_triangle_bytes, file_bytes);
    return cpu_milliseconds(work, thread_count(request.threads)) > cuda_milliseconds(work, 0);
}

std::string in_words(double cpu_milliseconds, double cuda_milliseconds) {
    const auto rounded = [](double ms) { return std::to_string(std::llround(std::max(ms, 1.0))) + " ms"; };
    return "about " + rounded(cpu_milliseconds) + " on the CPU, about " + rounded(cuda_milliseconds) +
           " with CUDA, its start included";
}

} // namespace voxelize
