// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A functor for each of many numbers: the passes of programs (programs/passes/passes.hpp), points and lines. Compiled
// by programs that use these, and by no other.

#include <voxelpipe/device/base/launch.cuh>

#include <algorithm>
#include <cstdint>

namespace voxelpipe::device {

template <class F>
__global__ __launch_bounds__(threads_per_block) void for_each_kernel(const __grid_constant__ F f, std::uint64_t count) {
    await_stream();
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        f(i);
}

// Calls f(i) for i below `count`.
template <class F>
void for_each(std::uint64_t count, const F& f, stage where, cudaStream_t stream) {
    static_assert(sizeof(F) <= 3900,
                  "voxelpipe: a program or shader has too much data by value; let it hold a pointer");
    if (count == 0) return;
    const auto blocks = static_cast<unsigned>(std::min<std::uint64_t>((count - 1) / threads_per_block + 1, 1u << 20));
    launch_behind(for_each_kernel<F>, blocks, threads_per_block, stream, where, f, count);
}

} // namespace voxelpipe::device
