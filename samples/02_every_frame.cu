// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A mesh that moves, voxelized in every frame on a GPU that nobody waits for: voxelize_async works in memory that is
// made once, so that a CUDA graph captures the call, and launching it is all that a frame costs the host. Prints what a
// frame takes, beside vp::voxelize, which waits for its counters; exits with 0 when both have set the same voxels in
// the last frame, with 1 when not, and with 77 where there is no GPU.
#include <voxelpipe/voxelpipe.hpp>

#include <cuda_runtime.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

namespace vp = voxelpipe;

namespace {

constexpr int frames = 200;

void check(cudaError_t error) {
    if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

// The program's own kernel: what moves the vertices.
__global__ void turn(const glm::vec3* rest, glm::vec3* positions, unsigned count, float angle) {
    const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const float c = cosf(angle), s = sinf(angle);
    const glm::vec3 p = rest[i];
    positions[i] = {c * p.x - s * p.z, p.y, s * p.x + c * p.z};
}

// A torus around the z axis, of `around` by `across` quads.
void make_torus(unsigned around, unsigned across, std::vector<glm::vec3>& positions,
                std::vector<glm::uvec3>& triangles) {
    constexpr float circle = 6.2831853f;
    for (unsigned a = 0; a < around; ++a)
        for (unsigned b = 0; b < across; ++b) {
            const float u = circle * static_cast<float>(a) / static_cast<float>(around),
                        v = circle * static_cast<float>(b) / static_cast<float>(across);
            const float r = 0.7f + 0.25f * std::cos(v);
            positions.emplace_back(r * std::cos(u), r * std::sin(u), 0.25f * std::sin(v));
            const unsigned next_a = (a + 1) % around * across, next_b = (b + 1) % across, own = a * across;
            triangles.emplace_back(own + b, next_a + b, next_a + next_b);
            triangles.emplace_back(own + b, next_a + next_b, own + next_b);
        }
}

// Milliseconds of a frame, on average.
template <class Frame>
float time_frames(cudaStream_t stream, const Frame& frame) {
    cudaEvent_t start = nullptr, stop = nullptr;
    check(cudaEventCreate(&start));
    check(cudaEventCreate(&stop));
    check(cudaEventRecord(start, stream));
    for (int i = 0; i < frames; ++i) frame(0.01f * static_cast<float>(i));
    check(cudaEventRecord(stop, stream));
    check(cudaEventSynchronize(stop));
    float all = 0;
    check(cudaEventElapsedTime(&all, start, stop));
    check(cudaEventDestroy(start));
    check(cudaEventDestroy(stop));
    return all / frames;
}

bool run(cudaStream_t stream) {
    vp::cuda_backend backend{stream};
    std::vector<glm::vec3> torus;
    std::vector<glm::uvec3> triangles;
    make_torus(1024, 256, torus, triangles);
    const auto count = static_cast<unsigned>(torus.size());
    const vp::cuda_backend::buffer<glm::vec3> rest(backend, vp::array_view<const glm::vec3>(torus));
    vp::cuda_backend::buffer<glm::vec3> positions(backend, vp::array_view<const glm::vec3>(torus));
    const vp::cuda_backend::buffer<glm::uvec3> indices(backend, vp::array_view<const glm::uvec3>(triangles));
    const auto move = [&](float angle) {
        turn<<<(count + 255) / 256, 256, 0, stream>>>(rest.data(), positions.data(), count, angle);
        check(cudaGetLastError());
    };

    // Vertices move, triangles stay: their indices are looked at once, and not by every call.
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    draw_type draw{{positions.view(), indices.view(), {}}, {}, vp::constant(true)};
    draw.mesh.checked = vp::check_indices(backend, draw.mesh.triangles);
    const std::span<const draw_type> draws(&draw, 1);
    const vp::grid grid = vp::fit(std::vector<glm::vec3>{{-1, -1, -1}, {1, 1, 1}}, {256, 256, 256}); // however it turns
    using target = vp::target<vp::bit, vp::blend::bit_or>;
    vp::framebuffer<vp::cuda_backend, target> waited{backend, grid.extent}, captured{backend, grid.extent};
    const vp::voxelize_options options{.count_voxels = false}; // nobody asks how many voxels there are

    // Memory that suffices for every frame: bits of a constant need what follows from the mesh alone. Where a call
    // lists fragments or tiles, run the worst frame once, ask read_status, and make more where it says so.
    const vp::workspace_limits limits = vp::workspace_limits::for_triangles(triangles.size());
    const std::size_t bytes = vp::workspace_bytes(draws, grid, captured.view(), options, limits);
    vp::cuda_backend::buffer<std::byte> memory(backend, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};

    cudaGraph_t graph = nullptr;
    cudaGraphExec_t frame = nullptr;
    check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    const vp::status launched = vp::voxelize_async(backend, draws, grid, captured.view(), options, workspace);
    check(cudaStreamEndCapture(stream, &graph));
    (void)launched.or_throw();
    check(cudaGraphInstantiate(&frame, graph, 0));
    check(cudaGraphDestroy(graph));

    const auto by_graph = [&](float angle) {
        move(angle);
        check(cudaGraphLaunch(frame, stream));
    };
    const auto by_call = [&](float angle) {
        move(angle);
        (void)vp::voxelize(backend, draws, grid, waited, options).or_throw();
    };
    by_graph(0); // warm-ups
    by_call(0);
    const float ms = time_frames(stream, by_graph);
    const vp::status last = vp::read_status(backend, workspace).or_throw(); // of the last frame; the one wait
    const float ms_with_waits = time_frames(stream, by_call);
    check(cudaGraphExecDestroy(frame));
    std::printf("%llu triangles, %llu fragments: %.4f ms a frame, %.4f with a wait in each\n",
                static_cast<unsigned long long>(triangles.size()),
                static_cast<unsigned long long>(last.counts.fragments), ms, ms_with_waits);
    return last.counts.fragments != 0 && vp::get<0>(captured).to_host(backend) == vp::get<0>(waited).to_host(backend);
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
        std::fprintf(stderr, "02_every_frame: %s\n", e.what());
    }
    return good ? 0 : 1;
}
