// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile sort: orders (tile, primitive) pairs by tile, stably, over just the key bits in use; so each tile's triangles
// come by ascending primitive (paper section 4, tile sort). The number of pairs is known on the device alone: the whole
// capacity is sorted, its unused end filled with keys that come last.

#include <voxelpipe/device/scene/scene.cuh>

#include <cub/device/device_radix_sort.cuh>

#include <bit>

namespace voxelpipe::device {

// Bits that tell num_cells cells and the filler apart.
[[nodiscard]] inline int key_bits(std::uint64_t num_cells) { return static_cast<int>(std::bit_width(num_cells)); }

template <class Key>
[[nodiscard]] std::size_t sort_bytes(std::uint64_t capacity, int bits) {
    std::size_t bytes = 0;
    cub::DoubleBuffer<Key> keys;
    cub::DoubleBuffer<std::uint32_t> values;
    check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, capacity, 0, bits), stage::tile_sort);
    return bytes;
}

// Makes the pairs beyond num_pairs, or all where the call has failed, fillers that sort to the end. By all threads of a
// grid.
template <class Key>
__device__ VOXELPIPE_INLINE void fill_end_by_all(Key* keys, std::uint32_t* values, std::uint64_t num_pairs,
                                                 std::uint64_t capacity, const pipeline_state& state,
                                                 const capacities& limits) {
    const std::uint64_t first = has_failed(state, limits) ? 0 : num_pairs;
    for (std::uint64_t i = first + std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < capacity;
         i += std::uint64_t{gridDim.x} * blockDim.x) {
        keys[i] = static_cast<Key>(~Key{0});
        values[i] = 0;
    }
}

template <class Key>
__global__ void fill_end_kernel(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs,
                                std::uint64_t capacity, const pipeline_state* state, capacities limits) {
    await_stream();
    fill_end_by_all(keys, values, *num_pairs, capacity, *state, limits);
}

template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(fill_end_kernel<Key>, fill_device(capacity), threads_per_block, stream, stage::tile_sort, keys,
                  values, num_pairs, capacity, state, limits);
}

template <class Key>
void sort_by_cell(cub::DoubleBuffer<Key>& keys, cub::DoubleBuffer<std::uint32_t>& values, std::uint64_t capacity,
                  int bits, void* storage, std::size_t bytes, stage where, cudaStream_t stream) {
    check(cub::DeviceRadixSort::SortPairs(storage, bytes, keys, values, capacity, 0, bits, stream), where);
}

} // namespace voxelpipe::device
