// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The prefix sum of counts, which is CUB's, and the selection of each voxel's first fragment among a number of them
// that stays on the device, which CUB does not have: one pass, in which a tile learns from earlier tiles how much is
// before it (base/lookback.cuh).

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

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
