// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The kernels of base/launch.cuh, and their launches.

#include <voxelpipe/device/base/launch.cuh>

#include <cstdint>

namespace voxelpipe::device {

// A template, like all kernels in headers, so that several translation units may hold it.
template <class Word>
__global__ void zero_kernel(Word* memory, std::uint64_t words) {
    await_stream();
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < words;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        memory[i] = {};
}

VOXELPIPE_DEFINES_KERNELS void zero_memory(void* memory, std::size_t bytes, cudaStream_t stream) {
    launch_behind(zero_kernel<uint4>, fill_device(bytes / sizeof(uint4)), threads_per_block, stream, stage::validate,
                  static_cast<uint4*>(memory), std::uint64_t{bytes / sizeof(uint4)});
}

} // namespace voxelpipe::device
