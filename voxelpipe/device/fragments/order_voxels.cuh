// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment order: fragments that were found in any order and sorted by voxel are ordered by primitive within each
// voxel, and the voxels are listed with the offsets of their fragments. A warp takes a window of fragments and sorts
// all of its voxels, some hundred fragments, at once. A warp or a block each sorts longer voxels, and still longer ones
// are divided into runs, which are sorted and merged (fragments/order_long_voxels.cuh). Only the device knows the
// number of fragments.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/fragments/order_memory.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The capacities::longest_ordered for calls like one that had this pipeline_state::longest_ordered(): the largest for
// which the same kernels are launched.
[[nodiscard]] inline std::uint64_t expected_longest(std::uint64_t longest) {
    constexpr std::uint64_t block = tuning::max_of_block, ways = tuning::merge_ways;
    for (const std::uint64_t most : {std::uint64_t{0}, block, only_dense, block * ways, block * ways * ways})
        if (longest <= most) return most;
    return ~std::uint64_t{0};
}

// Orders b.from, lists the voxels and counts them in the state. Does not order voxels of more than
// limits.longest_ordered fragments; then the state has_failed.
VOXELPIPE_DECLARES_KERNELS void order_fragments(order_buffers b, std::uint64_t num_primitives, pipeline_state* state,
                                                capacities limits, cudaStream_t stream);

} // namespace voxelpipe::device
