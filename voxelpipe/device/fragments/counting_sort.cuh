// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counting sort of fragments by voxel, for grids with few voxels per fragment. Atomics in the cache number the
// fragments within their voxels, prefix sums of the counters list the voxels, and each primitive is written to its
// position. A radix sort (fragments/radix_sort.cuh) reads and writes everything three times for the 21 bits of a voxel
// of 128^3.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/order_voxels.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Fragments in the order in which they were listed.
struct counted_pairs {
    std::uint32_t *voxels, *primitives;
};

// Writes listed fragments in order to b.pointers(), and lists the voxels. b.from: scratch for the primitives. Does not
// end the last stage.
VOXELPIPE_DECLARES_KERNELS void order_by_counting(order_buffers b, const counted_pairs& pairs, const counting_memory& m,
                                                  std::uint64_t num_primitives, pipeline_state* state,
                                                  const capacities& limits, cudaStream_t stream, stage_clock* clock);

} // namespace voxelpipe::device
