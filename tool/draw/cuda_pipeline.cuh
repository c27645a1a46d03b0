// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tool's pipeline for cuda_backend: how it reads targets, and which file compiles which of its parts. nvcc takes
// minutes for all kernels of the pipeline, so each part that draws is instantiated in a file of its own.

#include "distance/distance_drawer.hpp"
#include "model/parallel.hpp"
#include "pipeline_solid.hpp"
#include "pipeline_surface.hpp"
#include "remesh/remesh_scene.hpp"
#include "sparse/sparse_parts.hpp"

#include <voxelpipe/device/surface_calls.cuh>
#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/distance_at.cuh>
#include <voxelpipe/surfaces/device/sparse_surfaces.cuh>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
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

// Host memory that the device writes directly, for two pieces on their way from it.
class staging {
public:
    static constexpr std::size_t most = std::size_t{32} << 20; // bytes of a piece

    // Bytes of the pieces of that many: an eighth of them or fewer, since making this memory takes longer than a copy
    // of it.
    [[nodiscard]] static std::size_t piece_of(std::size_t bytes) {
        constexpr std::size_t least = std::size_t{1} << 20, parts = 8;
        return std::clamp(bytes / parts / least * least, least, most);
    }

    // Made when it is first used, and freed when the thread ends.
    static staging& of_this_thread() {
        static thread_local staging made;
        return made;
    }
    staging(const staging&) = delete;
    staging& operator=(const staging&) = delete;

    // Begins to copy piece 0 or 1 from the device.
    void copy(std::size_t piece, const void* from, std::size_t bytes, cudaStream_t stream) {
        if (size_[piece] < bytes) {
            memory_[piece].reset();
            size_[piece] = 0;
            void* memory = nullptr;
            check(cudaMallocHost(&memory, bytes));
            memory_[piece].reset(static_cast<std::byte*>(memory));
            size_[piece] = bytes;
        }
        if (is_there_[piece] == nullptr) check(cudaEventCreateWithFlags(&is_there_[piece], cudaEventDisableTiming));
        check(cudaMemcpyAsync(memory_[piece].get(), from, bytes, cudaMemcpyDeviceToHost, stream));
        check(cudaEventRecord(is_there_[piece], stream));
    }
    // Waits for a piece, and puts it where it belongs.
    void take(std::size_t piece, void* to, std::size_t bytes, int threads) {
        check(cudaEventSynchronize(is_there_[piece]));
        constexpr std::size_t block = std::size_t{1} << 20;
        parallel_for((bytes + block - 1) / block, threads, [&](std::size_t b) {
            std::memcpy(static_cast<std::byte*>(to) + b * block, memory_[piece].get() + b * block,
                        std::min(block, bytes - b * block));
        });
    }

private:
    struct unpin {
        void operator()(std::byte* memory) const { (void)cudaFreeHost(memory); }
    };
    staging() = default;
    ~staging() {
        for (const cudaEvent_t event : is_there_)
            if (event != nullptr) (void)cudaEventDestroy(event);
    }

    std::unique_ptr<std::byte, unpin> memory_[2];
    std::size_t size_[2] = {};
    cudaEvent_t is_there_[2] = {};
};

} // namespace gpu

// Values are worked out on the device, piece by piece. Each piece is copied into memory that the device can write
// directly, and from there, by all threads, to where it belongs, while the device works on the next one.
template <>
struct memory_access<vp::cuda_backend> {
    static constexpr bool on_host = false;

    template <class T, class Value>
    static void read(vp::cuda_backend& backend, T* out, std::size_t count, const Value& value, int threads) {
        constexpr std::size_t little = std::size_t{4} << 20; // bytes that come sooner than memory for them is made
        const bool is_little = count * sizeof(T) <= little;
        const std::size_t piece = is_little ? count : gpu::staging::piece_of(count * sizeof(T)) / sizeof(T);
        const std::size_t pieces = piece == 0 ? 0 : (count + piece - 1) / piece;
        std::vector<vp::cuda_backend::buffer<T>> values;
        for (std::size_t i = 0; i < std::min<std::size_t>(pieces, 2); ++i)
            values.push_back({backend, std::min(count, piece)});
        gpu::staging& waiting = gpu::staging::of_this_thread();
        const auto size_of_piece = [&](std::size_t i) { return std::min(piece, count - i * piece); };
        const auto start = [&](std::size_t i) {
            constexpr unsigned block = 256;
            const std::size_t size = size_of_piece(i);
            T* const made = values[i % 2].data();
            gpu::work_out<<<static_cast<unsigned>((size + block - 1) / block), block, 0, backend.stream>>>(
                made, i * piece, size, value);
            gpu::check(cudaGetLastError());
            if (is_little)
                gpu::check(cudaMemcpyAsync(out, made, size * sizeof(T), cudaMemcpyDeviceToHost, backend.stream));
            else
                waiting.copy(i % 2, made, size * sizeof(T), backend.stream);
        };
        if (pieces != 0) start(0);
        if (is_little) return gpu::check(cudaStreamSynchronize(backend.stream));
        for (std::size_t i = 0; i < pieces; ++i) {
            if (i + 1 < pieces) start(i + 1);
            waiting.take(i % 2, out + i * piece, size_of_piece(i) * sizeof(T), threads);
        }
    }
    template <class T>
    [[nodiscard]] static std::vector<T> list(vp::cuda_backend& backend, const T* from, std::size_t count) {
        std::vector<T> copied(count);
        if (count != 0) read(backend, copied.data(), count, as_it_is<T>{from}, thread_count(0));
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
#define VOXELIZE_CUDA_DISTANCE(HOW)                                                                                    \
    HOW template volume draw_distances(vp::cuda_backend&, scene&, const voxelize_request&, voxelize_stats&);
#define VOXELIZE_CUDA_REMESH(HOW)                                                                                      \
    HOW template surface_mesh remesh_scene(vp::cuda_backend&, scene&, const voxelize_request&, bool, voxelize_stats&);

} // namespace voxelize
