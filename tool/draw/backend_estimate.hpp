// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rough estimates of the time on the CPU and on a GPU, by which --backend auto decides. Only whole
// orders matter: starting CUDA takes about as long as the CPU takes for a million shaded fragments a thread.

#include "model/placement.hpp"
#include "voxelizer.hpp"

#include <cstdint>
#include <string>

namespace voxelize {

struct work_size {
    double triangles = 0;
    double fragments = 0;    // estimated: a voxel's side of the grid's box counts three times, each triangle twice
    double samples = 0;      // that --distance looks for the nearest triangle of
    bool shaded = false;     // colours, normals, numbers or depths, not only bits and counts
    double model_bytes = 0;  // vertices, indices and texels
    double result_bytes = 0; // of the volume, or of its bricks
};

// The work of a request for a model of that many triangles and bytes, drawn into a dense grid or into bricks.
[[nodiscard]] work_size work_of(const voxelize_request& request, double triangles, double model_bytes,
                                bool in_bricks = false);

// Time on the CPU with that many threads.
[[nodiscard]] double cpu_milliseconds(const work_size& work, int threads);

// Time on a GPU, if CUDA began to start so long ago.
[[nodiscard]] double cuda_milliseconds(const work_size& work, double started_milliseconds_ago);

// True if CUDA may turn out to be the quicker way for a file of that size, before it is read: then CUDA starts
// meanwhile.
[[nodiscard]] bool cuda_may_pay(const grid_request& grid, const voxelize_request& request, double file_bytes);

// Both in words, for a person.
[[nodiscard]] std::string in_words(double cpu_milliseconds, double cuda_milliseconds);

} // namespace voxelize
