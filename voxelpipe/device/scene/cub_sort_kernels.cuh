// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The calls of cub that scene/cub_sort.cuh declares.

#include <voxelpipe/device/scene/cub_sort.cuh>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <cuda/std/functional>
#include <thrust/iterator/counting_iterator.h>

namespace voxelpipe::device {

template <class Key>
std::size_t sort_bytes(std::uint64_t capacity, int bits) {
    std::size_t bytes = 0;
    cub::DoubleBuffer<Key> keys;
    cub::DoubleBuffer<std::uint32_t> values;
    check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, capacity, 0, bits), stage::tile_sort);
    return bytes;
}

template <class Key>
int sort_by_cell(Key* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity, int bits,
                 void* storage, std::size_t bytes, stage where, cudaStream_t stream) {
    cub::DoubleBuffer<Key> k(keys[0], keys[1]);
    cub::DoubleBuffer<std::uint32_t> v(values[0], values[1]);
    check(cub::DeviceRadixSort::SortPairs(storage, bytes, k, v, capacity, 0, bits, stream), where);
    VOXELPIPE_ASSERT(k.selector == v.selector);
    return k.selector;
}

template <class Key>
__global__ void fill_end_kernel(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs,
                                std::uint64_t capacity, const pipeline_state* state, capacities limits) {
    await_stream();
    const std::uint64_t first = has_failed(*state, limits) ? 0 : *num_pairs;
    for (std::uint64_t i = first + std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < capacity;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        keys[i] = static_cast<Key>(~Key{0});
        values[i] = 0;
    }
}

template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(fill_end_kernel<Key>, fill_device(capacity), threads_per_block, stream, stage::tile_sort, keys,
                  values, num_pairs, capacity, state, limits);
}

VOXELPIPE_DEFINES_KERNELS std::size_t cell_scan_bytes(std::uint32_t num_primitives) {
    std::size_t bytes = 0;
    check(cub::DeviceScan::ExclusiveScan(nullptr, bytes, static_cast<const std::uint32_t*>(nullptr),
                                         static_cast<unsigned long long*>(nullptr), ::cuda::std::plus<>{}, 0ull,
                                         num_primitives));
    return bytes;
}

VOXELPIPE_DEFINES_KERNELS void sum_counts(const std::uint32_t* counts, unsigned long long* offsets,
                                          std::uint32_t num_primitives, void* storage, std::size_t bytes, stage where,
                                          cudaStream_t stream) {
    check(cub::DeviceScan::ExclusiveScan(storage, bytes, counts, offsets, ::cuda::std::plus<>{}, 0ull, num_primitives,
                                         stream),
          where);
}

// True if fragment i of the sorted ones is the first of its voxel.
struct is_first_of_voxel {
    sorted_keys keys;
    const pipeline_state* state;
    capacities limits;
    [[nodiscard]] __device__ bool operator()(unsigned long long i) const {
        return !has_failed(*state, limits) && i < state->list_fragments && (i == 0 || keys.differ(i, i - 1));
    }
};

VOXELPIPE_DEFINES_KERNELS std::size_t select_bytes(std::uint64_t capacity) {
    std::size_t bytes = 0;
    check(cub::DeviceSelect::If(nullptr, bytes, thrust::counting_iterator<unsigned long long>(0),
                                static_cast<std::uint64_t*>(nullptr), static_cast<unsigned long long*>(nullptr),
                                capacity, is_first_of_voxel{}),
          stage::abuffer_emit);
    return bytes;
}

VOXELPIPE_DEFINES_KERNELS void select_voxels(const sorted_keys& keys, std::uint64_t* first_of_voxel,
                                             pipeline_state* state, const capacities& limits, void* storage,
                                             std::size_t bytes, cudaStream_t stream) {
    check(cub::DeviceSelect::If(storage, bytes, thrust::counting_iterator<unsigned long long>(0), first_of_voxel,
                                &state->list_voxels, limits.fragments, is_first_of_voxel{keys, state, limits}, stream),
          stage::abuffer_emit);
}

} // namespace voxelpipe::device
