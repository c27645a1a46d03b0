// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment order: fragments that were found in any order and then sorted by voxel are put in order of their primitives
// within each voxel, and the voxels are listed with where their fragments begin. A warp takes a window of fragments, in
// which it sorts all voxels of some hundred fragments at once; longer ones are a warp's or a block's each, and what is
// more than that is cut into runs that are sorted and merged (fragments/order_long_voxels.cuh). How many fragments
// there are is known on the device alone.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/fragments/order_memory.cuh>

#include <cstdint>

namespace voxelpipe::device {

// What capacities::longest_ordered is to be for calls like one with this pipeline_state::longest_ordered(): the most
// that the same kernels do.
[[nodiscard]] inline std::uint64_t longest_like(std::uint64_t longest) {
    constexpr std::uint64_t block = max_of_block, ways = merge_ways;
    for (const std::uint64_t most : {std::uint64_t{0}, block, only_dense, block * ways, block * ways * ways})
        if (longest <= most) return most;
    return ~std::uint64_t{0};
}

// Puts b.from in order and lists the voxels; counts them in the state. No voxel of more than limits.longest_ordered
// fragments, but then the state has_failed.
VOXELPIPE_DECLARES_KERNELS void order_fragments(order_buffers b, std::uint64_t num_primitives, pipeline_state* state,
                                                capacities limits, cudaStream_t stream);

} // namespace voxelpipe::device
