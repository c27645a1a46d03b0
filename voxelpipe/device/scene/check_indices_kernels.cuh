// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of scene/check_indices.cuh.

#include <voxelpipe/device/scene/check_indices.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Index>
__global__ void check_indices_kernel(const Index* indices, std::uint64_t count, Index num_vertices,
                                     pipeline_state* state) {
    await_stream();
    bool bad = false;
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    std::uint64_t done = 0;
    if (reinterpret_cast<std::uintptr_t>(indices) % 16 == 0) {
        for (std::uint64_t i = thread; i < count / 4; i += threads) {
            const uint4 v = __ldg(reinterpret_cast<const uint4*>(indices) + i);
            bad = bad || v.x >= num_vertices || v.y >= num_vertices || v.z >= num_vertices || v.w >= num_vertices;
        }
        done = count / 4 * 4;
    }
    for (std::uint64_t i = done + thread; i < count; i += threads) bad = bad || indices[i] >= num_vertices;
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, bad_index);
}

// *max must be 0 before.
template <class Index>
__global__ void max_index_kernel(const Index* indices, std::uint64_t count, Index* max_index) {
    await_stream();
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    Index mine = 0;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += threads)
        mine = indices[i] > mine ? indices[i] : mine;
    mine = __reduce_max_sync(0xffffffffu, mine);
    if (threadIdx.x % 32 == 0) atomicMax(max_index, mine);
}

VOXELPIPE_DEFINES_KERNELS void check_indices(const glm::uvec3* triangles, std::uint64_t num_triangles,
                                             std::uint64_t num_vertices, pipeline_state* state, cudaStream_t stream) {
    launch_behind(check_indices_kernel<std::uint32_t>, fill_device(num_triangles), threads_per_block, stream,
                  stage::coarse_raster, reinterpret_cast<const std::uint32_t*>(triangles), 3 * num_triangles,
                  static_cast<std::uint32_t>(num_vertices), state);
}

VOXELPIPE_DEFINES_KERNELS void find_max_index(const array_view<const glm::uvec3>& triangles, std::uint32_t* max_index,
                                              cudaStream_t stream) {
    if (triangles.size() == 0) return;
    launch_behind(max_index_kernel<std::uint32_t>, fill_device(triangles.size()), threads_per_block, stream,
                  stage::validate, reinterpret_cast<const std::uint32_t*>(triangles.data()),
                  std::uint64_t{3} * triangles.size(), max_index);
}

} // namespace voxelpipe::device
