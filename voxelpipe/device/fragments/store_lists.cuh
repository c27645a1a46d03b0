// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Copies finished fragment lists to where the caller wants them.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/fragment_lists.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// Lengths of the lists, for readers on the device: both 0 if the call failed.
struct list_counts {
    std::uint64_t voxels, fragments;
};

// Copies the lists, or what of them is not in place. All threads of the launch call it. The padding of a
// payload, which nobody has written and nobody reads, is copied with it: tools that look for uninitialised memory
// report that.
template <class Key, class Payload>
__device__ void copy_lists(const fragment_lists<Key, Payload>& lists, std::uint64_t num_voxels,
                           std::uint64_t num_fragments, std::uint64_t* voxels, std::uint64_t* offsets,
                           std::uint32_t* primitives, Payload* payloads) {
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    if (!lists.are_at_output) {
        for (std::uint64_t i = thread; i < num_voxels; i += threads) {
            voxels[i] = lists.voxel(i);
            offsets[i] = lists.first_of_voxel[i];
        }
        if (thread == 0 && num_voxels != 0) offsets[num_voxels] = num_fragments;
    }
    if (lists.are_payloads_at_output) return; // and so is all else
    for (std::uint64_t i = thread; i < num_fragments; i += threads) {
        if (!lists.are_at_output) primitives[i] = lists.primitive(i);
        if constexpr (!std::is_same_v<Payload, no_payload>) payloads[i] = lists.payload_of(i);
    }
}

template <class Key, class Payload>
__global__ void copy_lists_kernel(fragment_lists<Key, Payload> lists, std::uint64_t num_voxels,
                                  std::uint64_t num_fragments, std::uint64_t* voxels, std::uint64_t* offsets,
                                  std::uint32_t* primitives, Payload* payloads) {
    copy_lists(lists, num_voxels, num_fragments, voxels, offsets, primitives, payloads);
}

// The same to the output pointers, with the lengths in the state, if there is room for the voxels.
template <class Key, class Payload>
__global__ void store_lists_kernel(const __grid_constant__ fragment_lists<Key, Payload> lists,
                                   const pipeline_state* state, capacities limits) {
    await_stream();
    const csr_pointers to = *lists.pointers;
    if (has_failed(*state, limits) || state->list_voxels > to.voxel_capacity) return;
    copy_lists(lists, state->list_voxels, state->list_fragments, to.voxels, to.offsets, to.primitives,
               static_cast<Payload*>(to.payloads));
}
template <class Key, class Payload>
void store_lists(const fragment_lists<Key, Payload>& lists, const pipeline_state* state, const capacities& limits,
                 cudaStream_t stream, stage_clock* clock) {
    if (lists.are_stored()) return;
    launch_behind(store_lists_kernel<Key, Payload>, fill_device(limits.fragments), threads_per_block, stream,
                  stage::abuffer_emit, lists, state, limits);
    end_stage(clock, &stage_times::abuffer_emit);
}

// The same, with room for as many voxels as fragments. Publishes the lengths.
template <class Key, class Payload>
__global__ void publish_lists_kernel(fragment_lists<Key, Payload> lists, pipeline_state* state, capacities limits,
                                     list_counts* counts, std::uint64_t* voxels, std::uint64_t* offsets,
                                     std::uint32_t* primitives, Payload* payloads) {
    await_stream();
    const bool failed = has_failed(*state, limits);
    const std::uint64_t num_voxels = failed ? 0 : state->list_voxels;
    const std::uint64_t num_fragments = failed ? 0 : state->list_fragments;
    if (blockIdx.x == 0 && threadIdx.x == 0) {
        *counts = {num_voxels, num_fragments};
        state->voxels = num_voxels; // has_failed reads neither
        state->fragments = num_fragments;
    }
    copy_lists(lists, num_voxels, num_fragments, voxels, offsets, primitives, payloads);
}

} // namespace voxelpipe::device
