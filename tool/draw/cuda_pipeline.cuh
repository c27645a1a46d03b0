// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tool's pipeline for cuda_backend: how it reads targets, and which file compiles which of its parts. nvcc takes
// minutes for all kernels of the pipeline, so each part that draws is instantiated in a file of its own.

#include "pipeline_solid.hpp"
#include "pipeline_surface.hpp"
#include "sparse/sparse_parts.hpp"

#include <voxelpipe/device/surface_calls.cuh>

#include <algorithm>
#include <cstddef>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelize {

namespace gpu {

// Any error as an exception; a lack of memory as the pipeline knows it.
inline void check(cudaError_t error) {
    if (error == cudaSuccess) return;
    (void)cudaGetLastError();
    if (error == cudaErrorMemoryAllocation) throw std::bad_alloc{};
    throw std::runtime_error(std::string("CUDA says: ") + cudaGetErrorString(error));
}

template <class T, class Value>
__global__ void work_out(T* out, std::size_t first, std::size_t count, const Value value) {
    const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i < count) out[i] = value(first + i);
}

} // namespace gpu

// Values are worked out on the device, piece by piece, and each piece is copied to where it belongs.
template <>
struct memory_access<vp::cuda_backend> {
    static constexpr bool on_host = false;

    template <class T, class Value>
    static void read(vp::cuda_backend& backend, T* out, std::size_t count, const Value& value, int) {
        constexpr std::size_t piece = (std::size_t{32} << 20) / sizeof(T);
        vp::cuda_backend::buffer<T> buffer{backend, std::min(count, piece)};
        for (std::size_t first = 0; first < count; first += piece) {
            const std::size_t size = std::min(piece, count - first);
            constexpr unsigned threads = 256;
            gpu::work_out<<<static_cast<unsigned>((size + threads - 1) / threads), threads, 0, backend.stream>>>(
                buffer.data(), first, size, value);
            gpu::check(cudaGetLastError());
            gpu::check(
                cudaMemcpyAsync(out + first, buffer.data(), size * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
        }
        gpu::check(cudaStreamSynchronize(backend.stream));
    }
    template <class T>
    [[nodiscard]] static std::vector<T> list(vp::cuda_backend& backend, const T* from, std::size_t count) {
        std::vector<T> copied(count);
        gpu::check(cudaMemcpyAsync(copied.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
        gpu::check(cudaStreamSynchronize(backend.stream));
        return copied;
    }
};

// Each is instantiated in a file of its own, which CMake writes.
#define VOXELIZE_CUDA_BITS(HOW)                                                                                        \
    HOW template void pipeline<vp::cuda_backend>::draw_bits(volume&, const voxelpipe::grid&, int);
#define VOXELIZE_CUDA_SURFACE(HOW)                                                                                     \
    HOW template void pipeline<vp::cuda_backend>::draw_surface(volume&, const voxelpipe::grid&, int);
#define VOXELIZE_CUDA_OUTER(HOW)                                                                                       \
    HOW template void pipeline<vp::cuda_backend>::draw_outer(volume&, const voxelpipe::grid&, int);
#define VOXELIZE_CUDA_SOLID(HOW)                                                                                       \
    HOW template void pipeline<vp::cuda_backend>::draw_solid(volume&, const voxelpipe::grid&, int);                    \
    HOW template void pipeline<vp::cuda_backend>::examine_solid_bits(const voxelpipe::grid&);
#define VOXELIZE_CUDA_BRICK_BITS(HOW)                                                                                  \
    HOW template bool sparse_pipeline<vp::cuda_backend>::draw_walls(sparse_volume&, const voxelpipe::grid&,            \
                                                                    const vp::sparse_limits&);                         \
    HOW template bool sparse_pipeline<vp::cuda_backend>::draw_bits(sparse_volume&, const voxelpipe::grid&,             \
                                                                   const vp::sparse_limits&);                          \
    HOW template std::optional<brick_counts> sparse_pipeline<vp::cuda_backend>::count_touched(const voxelpipe::grid&,  \
                                                                                              voxelpipe::coverage);
#define VOXELIZE_CUDA_BRICK_SURFACE(HOW)                                                                               \
    HOW template bool sparse_pipeline<vp::cuda_backend>::draw_occupied(sparse_volume&, const voxelpipe::grid&,         \
                                                                       const vp::sparse_limits&);                      \
    HOW template bool sparse_pipeline<vp::cuda_backend>::draw_surface(sparse_volume&, const voxelpipe::grid&,          \
                                                                      const vp::sparse_limits&);
#define VOXELIZE_CUDA_BRICK_OUTER(HOW)                                                                                 \
    HOW template bool sparse_pipeline<vp::cuda_backend>::draw_outer_in(const voxelpipe::grid&,                         \
                                                                       const vp::sparse_limits&, sparse_volume&);
#define VOXELIZE_CUDA_BRICK_SOLID(HOW)                                                                                 \
    HOW template vp::status sparse_pipeline<vp::cuda_backend>::draw_solid_bits(const voxelpipe::grid&, sparse_volume&, \
                                                                               channel&);

} // namespace voxelize
