// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: the device and the backend of one call on a GPU.

#include <bindings/device_stream.hpp>
#include <voxelpipe/device/backend.cuh>

#include <cuda_runtime.h>

#include <stdexcept>
#include <string>

namespace voxelpipe::bindings {

// Throws std::runtime_error, with CUDA's text.
inline void check(cudaError_t error) {
    if (error != cudaSuccess) throw std::runtime_error(std::string("CUDA: ") + cudaGetErrorString(error));
}

// Makes the call's device the current one, and gives the old one back.
class current_device {
public:
    explicit current_device(const device_stream& on) {
        check(cudaGetDevice(&before_));
        check(cudaSetDevice(on.device));
    }
    ~current_device() { (void)cudaSetDevice(before_); }
    current_device(const current_device&) = delete;
    current_device& operator=(const current_device&) = delete;

private:
    int before_ = 0;
};

// The backend of one call, which keeps neither graphs nor locked memory for later ones.
struct call_backend {
    cuda_backend backend;
    explicit call_backend(const device_stream& on) : backend(reinterpret_cast<cudaStream_t>(on.stream)) {
        backend.use_graphs = false;
        backend.use_pinned_memory = false;
    }
};

} // namespace voxelpipe::bindings
