// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Operations that cub does: the sort of (cell, primitive) pairs by cell, the prefix sum of counts, the selection of
// each voxel's first fragment. Only scene/cub_sort_kernels.cuh includes cub's headers. The sort is stable and looks at
// just the key bits in use (paper section 4, tile sort). Only the device knows the number of pairs: the whole capacity
// is sorted, with keys in the unused end that come last. Key: std::uint32_t or std::uint64_t.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// Key bits that distinguish num_cells cells and the filler.
[[nodiscard]] inline int key_bits(std::uint64_t num_cells) { return static_cast<int>(std::bit_width(num_cells)); }

// Bytes of storage for sort_by_cell.
template <class Key>
[[nodiscard]] std::size_t sort_bytes(std::uint64_t capacity, int bits);

// Sorts the pairs of keys[0] and values[0]; keys[1] and values[1] are scratch. Returns which of the two holds the
// result.
template <class Key>
[[nodiscard]] int sort_by_cell(Key* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity,
                               int bits, void* storage, std::size_t bytes, stage where, cudaStream_t stream);

// Overwrites the pairs beyond *num_pairs, or all if the call has failed, with fillers that sort to the end.
template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream);

// Bytes of storage for sum_counts.
VOXELPIPE_DECLARES_KERNELS [[nodiscard]] std::size_t cell_scan_bytes(std::uint32_t num_primitives);

// Sets offsets[i] to the sum of the counts before i.
VOXELPIPE_DECLARES_KERNELS void sum_counts(const std::uint32_t* counts, unsigned long long* offsets,
                                           std::uint32_t num_primitives, void* storage, std::size_t bytes, stage where,
                                           cudaStream_t stream);

// Bytes of storage for select_voxels.
VOXELPIPE_DECLARES_KERNELS [[nodiscard]] std::size_t select_bytes(std::uint64_t capacity);

// Sorted keys of either width: a kernel that only compares them serves both.
struct sorted_keys {
    const void* keys; // std::uint64_t if are_wide, otherwise std::uint32_t
    bool are_wide;

    [[nodiscard]] __device__ bool differ(std::uint64_t i, std::uint64_t k) const {
        if (are_wide) return static_cast<const std::uint64_t*>(keys)[i] != static_cast<const std::uint64_t*>(keys)[k];
        return static_cast<const std::uint32_t*>(keys)[i] != static_cast<const std::uint32_t*>(keys)[k];
    }
};

// Writes the index of each voxel's first fragment, ascending, among state->list_fragments sorted keys, and their number
// to state->list_voxels: 0 if the call has failed.
VOXELPIPE_DECLARES_KERNELS void select_voxels(const sorted_keys& keys, std::uint64_t* first_of_voxel,
                                              pipeline_state* state, const capacities& limits, void* storage,
                                              std::size_t bytes, cudaStream_t stream);

} // namespace voxelpipe::device
