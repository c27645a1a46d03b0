// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's pipeline for cuda_backend: the surface with all its targets, and lines.
#include "cuda_pipeline.cuh"

namespace voxelize {
VOXELIZE_CUDA_SURFACE()
} // namespace voxelize
