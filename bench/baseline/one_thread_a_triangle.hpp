// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The GPU baseline, after Schwarz and Seidel (2010): one thread a triangle, atomics on the grid in global memory, no
// tiles, no sort, no balance. Coverage is the library's own (core::rasterize), so that it gives the same sets.

#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/mesh.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace bench::gpu {

enum class baseline_output : std::uint8_t {
    bits, // as a linear target of bits: 32 voxels along x to a word
    sums, // floats; adds 1 a fragment
};

// Clears `words` and draws into them, on the stream, without a wait.
void voxelize_baseline(cudaStream_t stream, const voxelpipe::mesh_view<>& mesh, const voxelpipe::grid& grid,
                       voxelpipe::coverage rule, baseline_output output, std::uint32_t* d_words, std::size_t count);

// Number of words that differ; waits.
[[nodiscard]] std::uint64_t count_differences(cudaStream_t stream, const std::uint32_t* d_a, const std::uint32_t* d_b,
                                              std::size_t count);

} // namespace bench::gpu
