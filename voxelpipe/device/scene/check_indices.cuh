// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Checks of vertex indices: in a call, before it writes anything, or once for all calls (check_indices of the backend).

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Sets state->index_error if an index is not below num_vertices.
VOXELPIPE_DECLARES_KERNELS void check_indices(const glm::uvec3* triangles, std::uint64_t num_triangles,
                                              std::uint64_t num_vertices, pipeline_state* state, cudaStream_t stream);

// The largest index of some triangles, possibly none. *max must be 0 before.
VOXELPIPE_DECLARES_KERNELS void find_max_index(const array_view<const glm::uvec3>& triangles, std::uint32_t* max_index,
                                               cudaStream_t stream);

} // namespace voxelpipe::device
