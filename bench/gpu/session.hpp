// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The start of every GPU benchmark: a stream, a memory pool that keeps what is freed (as that of a program that
// calls often would), meshes on the device, and the timing of calls. Plain C++: only the files that instantiate kernels
// need nvcc. Everything throws std::runtime_error where CUDA reports an error, out_of_device_memory where it is that.

#include "mesh_data.hpp"
#include "statistics.hpp"

#include <voxelpipe/grid.hpp>

#include <cuda_runtime_api.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

namespace bench::gpu {

struct out_of_device_memory : std::runtime_error {
    using std::runtime_error::runtime_error;
};

void check(cudaError_t error, const char* what);

class session {
public:
    session();
    ~session();
    session(const session&) = delete;
    session& operator=(const session&) = delete;

    [[nodiscard]] cudaStream_t stream() const { return stream_; }
    void wait() const;
    // Gives the pool's free memory back to the device.
    void trim() const;
    [[nodiscard]] std::size_t free_bytes() const; // of the device, after trim()

private:
    cudaStream_t stream_ = nullptr;
};

// Device memory that does not come from the pool.
template <class T>
class device_array {
public:
    device_array() = default;
    explicit device_array(std::size_t count) : count_(count) {
        if (count == 0) return;
        void* p = nullptr;
        check(cudaMalloc(&p, count * sizeof(T)), "device memory");
        pointer_.reset(static_cast<T*>(p));
    }
    [[nodiscard]] T* data() const { return pointer_.get(); }
    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] std::size_t bytes() const { return count_ * sizeof(T); }

private:
    struct release {
        void operator()(T* p) const { cudaFree(p); }
    };
    std::unique_ptr<T, release> pointer_;
    std::size_t count_ = 0;
};

// A mesh on the device.
struct resident_mesh {
    std::string name;
    std::string note;
    device_array<glm::vec3> positions;
    device_array<glm::uvec3> triangles;
};

[[nodiscard]] resident_mesh upload(const mesh_data& mesh);

// How often a call is repeated: warm-ups, then `runs` runs, fewer (at least `least_runs`) once they have taken
// `seconds` together.
struct repetition {
    int warmups = 3;
    int runs = 20;
    int least_runs = 3;
    double seconds = 10;
};

// The work of a call that never waits, captured once from the session's stream as a CUDA graph and launched as often as
// wanted.
class captured_call {
public:
    captured_call(const session& s, const std::function<void()>& call);
    ~captured_call();
    captured_call(const captured_call&) = delete;
    captured_call& operator=(const captured_call&) = delete;

    void launch() const;

private:
    cudaStream_t stream_;
    cudaGraphExec_t graph_ = nullptr;
};

// Times each run by two events on the session's stream around `call`, which may wait on the host or not.
[[nodiscard]] sample time_calls(const session& s, const repetition& how, const std::function<void()>& call);

} // namespace bench::gpu
