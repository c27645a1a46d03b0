// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "session.hpp"

#include <cstdint>
#include <limits>
#include <vector>

namespace bench::gpu {

namespace {

struct event {
    cudaEvent_t handle = nullptr;
    event() { check(cudaEventCreate(&handle), "event"); }
    ~event() { cudaEventDestroy(handle); }
    event(const event&) = delete;
    event& operator=(const event&) = delete;
};

cudaMemPool_t default_pool() {
    int device = 0;
    cudaMemPool_t pool = nullptr;
    check(cudaGetDevice(&device), "device");
    check(cudaDeviceGetDefaultMemPool(&pool, device), "memory pool");
    return pool;
}

} // namespace

void check(cudaError_t error, const char* what) {
    if (error == cudaSuccess) return;
    (void)cudaGetLastError(); // a failed allocation leaves a mark that the next launch would report
    const std::string text = std::string(what) + ": " + cudaGetErrorString(error);
    if (error == cudaErrorMemoryAllocation) throw out_of_device_memory(text);
    throw std::runtime_error(text);
}

session::session() {
    std::uint64_t keep = std::numeric_limits<std::uint64_t>::max();
    check(cudaMemPoolSetAttribute(default_pool(), cudaMemPoolAttrReleaseThreshold, &keep), "memory pool");
    check(cudaStreamCreate(&stream_), "stream");
}
session::~session() { cudaStreamDestroy(stream_); }

void session::wait() const { check(cudaStreamSynchronize(stream_), "stream"); }

void session::trim() const {
    wait();
    check(cudaMemPoolTrimTo(default_pool(), 0), "memory pool");
}

std::size_t session::free_bytes() const {
    trim();
    std::size_t free = 0, all = 0;
    check(cudaMemGetInfo(&free, &all), "memory");
    return free;
}

resident_mesh upload(const mesh_data& mesh) {
    resident_mesh m{mesh.name, mesh.note, device_array<glm::vec3>(mesh.positions.size()),
                    device_array<glm::uvec3>(mesh.triangles.size())};
    check(cudaMemcpy(m.positions.data(), mesh.positions.data(), m.positions.bytes(), cudaMemcpyHostToDevice), "upload");
    check(cudaMemcpy(m.triangles.data(), mesh.triangles.data(), m.triangles.bytes(), cudaMemcpyHostToDevice), "upload");
    return m;
}

captured_call::captured_call(const session& s, const std::function<void()>& call) : stream_(s.stream()) {
    cudaGraph_t graph = nullptr;
    check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal), "capture");
    try {
        call();
    } catch (...) {
        cudaStreamEndCapture(stream_, &graph);
        cudaGraphDestroy(graph);
        (void)cudaGetLastError();
        throw;
    }
    check(cudaStreamEndCapture(stream_, &graph), "capture");
    const cudaError_t made = cudaGraphInstantiate(&graph_, graph, 0);
    cudaGraphDestroy(graph);
    check(made, "graph");
}
captured_call::~captured_call() { cudaGraphExecDestroy(graph_); }

void captured_call::launch() const { check(cudaGraphLaunch(graph_, stream_), "graph"); }

sample time_calls(const session& s, const repetition& how, const std::function<void()>& call) {
    const event start, stop;
    std::vector<double> times;
    double total = 0;
    for (int i = 0; i < how.warmups + how.runs; ++i) {
        check(cudaEventRecord(start.handle, s.stream()), "event");
        call();
        check(cudaEventRecord(stop.handle, s.stream()), "event");
        check(cudaEventSynchronize(stop.handle), "timed call");
        float milliseconds = 0;
        check(cudaEventElapsedTime(&milliseconds, start.handle, stop.handle), "event");
        total += milliseconds;
        const bool enough = total > how.seconds * 1e3;
        if (i >= how.warmups || enough) times.push_back(milliseconds);
        if (enough && static_cast<int>(times.size()) >= how.least_runs) break;
    }
    return summarize(std::move(times));
}

} // namespace bench::gpu
