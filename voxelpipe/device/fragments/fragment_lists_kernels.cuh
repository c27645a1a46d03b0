// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Kernels and launches of fragments/fragment_lists.cuh and shade_lists.cuh that depend on no shader.

#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/fragments/shade_lists.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Key>
__global__ void prepare_sort_kernel(Key* keys, std::uint32_t* values, std::uint64_t capacity,
                                    const __grid_constant__ sort_preparation preparation, const pipeline_state* state,
                                    capacities limits) {
    await_stream();
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x,
                        threads = std::uint64_t{gridDim.x} * blockDim.x;
    preparation.run(thread, threads);
    if (are_sorted_here<Key>(capacity)) return;
    const std::uint64_t first = has_failed(*state, limits) ? 0 : state->list_fragments;
    for (std::uint64_t i = first + thread; i < capacity; i += threads) { // as fill_end
        keys[i] = static_cast<Key>(~Key{0});
        values[i] = 0;
    }
}

template <class Key>
void prepare_sort(Key* keys, std::uint32_t* values, std::uint64_t capacity, const sort_preparation& preparation,
                  const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(prepare_sort_kernel<Key>, fill_device(capacity), threads_per_block, stream, stage::tile_sort, keys,
                  values, capacity, preparation, state, limits);
}

// One thread runs it.
template <class State>
__global__ void end_filter_kernel(State* state, capacities limits) {
    await_stream();
    if (!has_failed(*state, limits)) state->list_fragments = state->kept;
}

VOXELPIPE_DEFINES_KERNELS void end_filter(pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(end_filter_kernel<pipeline_state>, 1, 1, stream, stage::abuffer_emit, state, limits);
}

} // namespace voxelpipe::device
