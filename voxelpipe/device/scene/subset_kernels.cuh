// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of scene/subset.cuh.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/device/scene/subset.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

template <class Number>
__global__ void check_numbers_kernel(const Number* numbers, std::uint64_t count, std::uint64_t whole,
                                     unsigned int* error) {
    await_stream();
    bool bad = false;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        bad = bad || numbers[i] >= whole || (i + 1 < count && numbers[i] >= numbers[i + 1]);
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(error, bad_numbers);
}

template <class Number>
__global__ void renumber_lists_kernel(const listed_draw* draws, std::uint32_t num_draws, Number* primitives,
                                      const std::uint64_t* count, std::uint64_t most) {
    await_stream();
    const std::uint64_t n = count != nullptr ? *count : most;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < n;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        const listed_draw& d =
            draws[core::bisect_last(0u, num_draws, [&](std::uint32_t at) { return draws[at].first <= primitives[i]; })];
        const std::uint32_t drawn = primitives[i] - d.first;
        primitives[i] = d.numbers.of(drawn % d.each, drawn / d.each).primitive;
    }
}

VOXELPIPE_DEFINES_KERNELS void check_numbers(const std::uint32_t* numbers, std::uint64_t count, std::uint64_t whole,
                                             unsigned int* error, cudaStream_t stream) {
    launch_behind(check_numbers_kernel<std::uint32_t>, fill_device(count), threads_per_block, stream, stage::validate,
                  numbers, count, whole, error);
}

VOXELPIPE_DEFINES_KERNELS void renumber_lists(const listed_draw* draws, std::size_t num_draws,
                                              std::uint32_t* primitives, const std::uint64_t* count, std::uint64_t most,
                                              cudaStream_t stream) {
    launch_behind(renumber_lists_kernel<std::uint32_t>, fill_device(most), threads_per_block, stream,
                  stage::abuffer_emit, draws, static_cast<std::uint32_t>(num_draws), primitives, count, most);
}

} // namespace voxelpipe::device
