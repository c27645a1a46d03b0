// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Sorts of keys, prefix sums and selections, and the preparation of a sort.
#include <voxelpipe/device/fragments/fragment_lists_kernels.cuh>
#include <voxelpipe/device/scene/key_sort_kernels.cuh>
#include <voxelpipe/device/scene/prefix_sum_kernels.cuh>
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {

#define VOXELPIPE_KEY(KEY)                                                                                             \
    template std::size_t sort_bytes<KEY>(std::uint64_t, int);                                                          \
    template int sort_by_cell(KEY* const(&)[2], std::uint32_t* const(&)[2], std::uint64_t, int, void*, std::size_t,    \
                              stage, cudaStream_t);                                                                    \
    template void fill_end(KEY*, std::uint32_t*, const unsigned long long*, std::uint64_t, const pipeline_state*,      \
                           const capacities&, cudaStream_t);                                                           \
    template void prepare_sort(KEY*, std::uint32_t*, std::uint64_t, const sort_preparation&, const pipeline_state*,    \
                               const capacities&, cudaStream_t);
VOXELPIPE_KEY(std::uint32_t)
VOXELPIPE_KEY(std::uint64_t)

} // namespace voxelpipe::device
