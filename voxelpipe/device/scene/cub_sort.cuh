// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What is left to cub: the sort of (cell, primitive) pairs by cell, the sum of counts, the selection of the first
// fragment of each voxel. cub's headers are seen by scene/cub_sort_kernels.cuh only. The tile sort orders (tile,
// primitive) pairs stably, over just the key bits in use; so each tile's triangles come by ascending primitive (paper
// section 4, tile sort). The number of pairs is known on the device alone: the whole capacity is sorted, its unused end
// filled with keys that come last. Key: std::uint32_t or std::uint64_t.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// Bits that tell num_cells cells and the filler apart.
[[nodiscard]] inline int key_bits(std::uint64_t num_cells) { return static_cast<int>(std::bit_width(num_cells)); }

// Bytes of storage that sort_by_cell wants.
template <class Key>
[[nodiscard]] std::size_t sort_bytes(std::uint64_t capacity, int bits);

// Sorts the pairs of keys[0] and values[0], with the other two as room. Returns which array holds them then: 0 or 1.
template <class Key>
[[nodiscard]] int sort_by_cell(Key* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity,
                               int bits, void* storage, std::size_t bytes, stage where, cudaStream_t stream);

// Makes the pairs beyond *num_pairs, or all where the call has failed, fillers that sort to the end.
template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream);

// Bytes of storage that sum_counts wants.
VOXELPIPE_DECLARES_KERNELS [[nodiscard]] std::size_t share_scan_bytes(std::uint32_t num_primitives);

// offsets[i]: the sum of the counts before i.
VOXELPIPE_DECLARES_KERNELS void sum_counts(const std::uint32_t* counts, unsigned long long* offsets,
                                           std::uint32_t num_primitives, void* storage, std::size_t bytes, stage where,
                                           cudaStream_t stream);

// Bytes of storage that select_voxels wants.
template <class Key>
[[nodiscard]] std::size_t select_bytes(std::uint64_t capacity);

// The number of each voxel's first fragment, ascending, among the fragments of state->list_fragments sorted keys; how
// many these are goes to state->list_voxels. None where the call has failed.
template <class Key>
void select_voxels(const Key* keys, std::uint64_t* first_of_voxel, pipeline_state* state, const capacities& limits,
                   void* storage, std::size_t bytes, cudaStream_t stream);

} // namespace voxelpipe::device
