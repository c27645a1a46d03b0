// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tile sort: orders (tile, primitive) pairs by tile, stably, over just the key bits in use; so each tile's triangles
// come by ascending primitive (paper section 4, tile sort). The number of pairs is known on the device alone: the whole
// capacity is sorted, its unused end filled with keys that come last.

#include <voxelpipe/device/scene.cuh>

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

// Makes every key the filler; before the keys are written.
template <class Key>
void fill_keys(Key* keys, std::uint64_t capacity, cudaStream_t stream) {
    check(cudaMemsetAsync(keys, 0xff, capacity * sizeof(Key), stream), stage::tile_sort);
}

template <class Key>
void sort_by_cell(cub::DoubleBuffer<Key>& keys, cub::DoubleBuffer<std::uint32_t>& values, std::uint64_t capacity,
                  int bits, void* storage, std::size_t bytes, stage where, cudaStream_t stream) {
    check(cub::DeviceRadixSort::SortPairs(storage, bytes, keys, values, capacity, 0, bits, stream), where);
}

} // namespace voxelpipe::device
