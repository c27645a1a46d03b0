// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The look at the machine before anything runs on its GPU.
#include "cuda_device.hpp"

#include <cuda_runtime.h>

namespace voxelize {

namespace {

__global__ void empty_kernel() {}

// "8.0, 9.0", from nvcc's list 800,900.
std::string architecture_list() {
    std::string text;
    for (const int number : {__CUDA_ARCH_LIST__}) {
        if (!text.empty()) text += ", ";
        text += std::to_string(number / 100) + '.' + std::to_string(number % 100 / 10);
    }
    return text;
}

// Fills in the device until a call fails, and returns that call's error.
cudaError_t look_at_device(cuda_facts& facts) {
    if (const cudaError_t error = cudaGetDeviceCount(&facts.devices); error != cudaSuccess) return error;
    if (facts.devices == 0) return cudaErrorNoDevice;
    cudaDeviceProp properties{};
    if (const cudaError_t error = cudaGetDeviceProperties(&properties, 0); error != cudaSuccess) return error;
    facts.name = properties.name;
    facts.capability = properties.major * 10 + properties.minor;
    if (const cudaError_t error = cudaSetDevice(0); error != cudaSuccess) return error;
    std::size_t free = 0, total = 0;
    if (const cudaError_t error = cudaMemGetInfo(&free, &total); error != cudaSuccess) return error;
    facts.free_memory = free;
    facts.total_memory = total;
    empty_kernel<<<1, 1>>>();
    if (const cudaError_t error = cudaGetLastError(); error != cudaSuccess) return error;
    facts.has_kernel = true;
    return cudaStreamSynchronize(nullptr);
}

} // namespace

bool built_with_cuda() { return true; }

cuda_facts look_for_cuda() {
    cuda_facts facts;
    facts.built_in = true;
    facts.architectures = architecture_list();
    (void)cudaRuntimeGetVersion(&facts.runtime);
    (void)cudaDriverGetVersion(&facts.driver);
    const cudaError_t error = look_at_device(facts);
    switch (error) {
    case cudaSuccess:
        break;
    case cudaErrorInsufficientDriver: // also without any driver
        facts.driver_too_old = facts.driver != 0;
        break;
    case cudaErrorNoDevice:
        facts.devices = 0;
        break;
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
    case cudaErrorUnsupportedPtxVersion: // PTX for newer devices, but from a newer toolkit than the driver's
        facts.has_kernel = false;
        break;
    default:
        facts.error = cudaGetErrorString(error);
    }
    (void)cudaGetLastError();
    return facts;
}

} // namespace voxelize
