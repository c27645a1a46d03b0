// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A program on a GPU: a stream and memory of its own, a target in device memory that the program has made, a
// framebuffer that tracks its changes. Exits with 0 when the bytes are those of the CPU, and with 77 where there is no
// GPU.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cuda_runtime.h>

#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <vector>

namespace vp = voxelpipe;

namespace {

void check(cudaError_t error) {
    if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

using sums = vp::target<float, vp::blend::add>;

template <class Backend>
vp::status draw(Backend& backend, const vp::grid& grid, const vp::framebuffer_view<sums>& view) {
    const std::vector<glm::vec3> positions{{0, 0, 0}, {60, 5, 20}, {10, 50, 40}, {30, 20, 63}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 2, 3}, {0, 2, 3}};
    const vp::mesh mesh{backend, positions, triangles};
    return vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(0.25f), view);
}

// snippet: memory
struct pool { // any object with these two functions, or a resource of cuda::mr
    std::size_t in_use = 0;
    void* allocate_async(std::size_t bytes, std::size_t /*alignment*/, cudaStream_t stream) {
        void* p = nullptr;
        if (cudaMallocAsync(&p, bytes, stream) != cudaSuccess) throw std::bad_alloc();
        in_use += bytes;
        return p;
    }
    void deallocate_async(void* p, std::size_t bytes, std::size_t /*alignment*/, cudaStream_t stream) {
        in_use -= bytes;
        cudaFreeAsync(p, stream);
    }
};
// end snippet

bool run(cudaStream_t stream) {
    const vp::grid grid{{0, 0, 0}, {1, 1, 1}, {64, 64, 64}};
    vp::cpu_backend host;
    vp::framebuffer<vp::cpu_backend, sums> expected{host, grid.extent};
    draw(host, grid, expected).or_throw();

    pool memory;
    bool good = true;
    {
        // snippet: stream
        vp::cuda_backend backend{stream, memory}; // all work, copies and memory go through this stream
        float* voxels = nullptr;                  // or a tensor, a field of a solver, ...
        check(cudaMallocAsync(&voxels, sums::map::elements(grid.extent) * sizeof(float), stream));
        draw(backend, grid, vp::framebuffer_view<sums>::on(grid.extent, voxels)).or_throw(); // returns when all is done
        // end snippet
        std::vector<float> got(sums::map::elements(grid.extent));
        check(cudaMemcpyAsync(got.data(), voxels, got.size() * sizeof(float), cudaMemcpyDeviceToHost, stream));
        check(cudaStreamSynchronize(stream));
        check(cudaFreeAsync(voxels, stream));
        good = got == vp::get<0>(expected).to_host(host);

        // snippet: tracked
        vp::framebuffer<vp::cuda_backend, sums> frames{backend, grid.extent};
        frames.track_changes(backend); // each clear writes only where something was drawn since the last one
        for (int frame = 0; frame < 3; ++frame) draw(backend, grid, frames).or_throw();
        // end snippet
        good = good && vp::get<0>(frames).to_host(backend) == vp::get<0>(expected).to_host(host);
    }
    check(cudaStreamSynchronize(stream));
    std::printf("%s; %zu bytes still in use\n", good ? "the same bytes as on the CPU" : "other bytes", memory.in_use);
    return good && memory.in_use == 0;
}

} // namespace

int main() {
    int devices = 0;
    if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) {
        std::puts("no GPU here");
        return 77;
    }
    cudaStream_t stream = nullptr;
    bool good = false;
    try {
        check(cudaStreamCreate(&stream));
        good = run(stream);
        check(cudaStreamDestroy(stream));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "on_a_gpu: %s\n", e.what());
    }
    return good ? 0 : 1;
}
