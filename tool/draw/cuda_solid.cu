// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's pipeline for cuda_backend: solids, and what their repairs did.
#include "cuda_pipeline.cuh"

namespace voxelize {
VOXELIZE_CUDA_SOLID()
} // namespace voxelize
