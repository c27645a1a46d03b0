// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's pipeline for cuda_backend: the colours that the sides of the grid see.
#include "cuda_pipeline.cuh"

namespace voxelize {
VOXELIZE_CUDA_OUTER()
} // namespace voxelize
