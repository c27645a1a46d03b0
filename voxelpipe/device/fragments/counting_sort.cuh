// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counting sort of fragments by voxel, where a counter for each voxel of the grid is not much beside them: they are
// numbered within their voxels by atomics in the cache, the sums of the counters list the voxels, and each fragment's
// primitive goes where it belongs. A radix sort (fragments/radix_sort.cuh) reads and writes all of them three times for
// the 21 bits of a voxel of 128^3.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/fragments/order_voxels.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Fragments as they were listed.
struct counted_pairs {
    std::uint32_t *voxels, *primitives;
};

// Puts listed fragments in order into b.places(), and lists the voxels; b.from: room for the primitives. The last stage
// is not ended.
VOXELPIPE_DECLARES_KERNELS void order_by_counting(order_buffers b, const counted_pairs& pairs, const counting_memory& m,
                                                  std::uint64_t num_primitives, pipeline_state* state,
                                                  const capacities& limits, cudaStream_t stream, stage_clock* clock);

} // namespace voxelpipe::device
