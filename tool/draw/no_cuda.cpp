// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// In place of cuda_device.cu where the program is built without CUDA.
#include "cuda_device.hpp"

namespace voxelize {

bool built_with_cuda() { return false; }

cuda_facts look_for_cuda() { return {}; }

volume run_on_cuda(const cuda_facts& facts, scene&, const voxelize_request&, voxelize_stats&) {
    throw backend_error(why_not(facts));
}

volume distances_on_cuda(const cuda_facts& facts, scene&, const voxelize_request&, voxelize_stats&) {
    throw backend_error(why_not(facts));
}

surface_mesh remeshed_on_cuda(const cuda_facts& facts, scene&, const voxelize_request&, voxelize_stats&) {
    throw backend_error(why_not(facts));
}

std::unique_ptr<brick_drawer> bricks_on_cuda(const cuda_facts& facts, scene&, const voxelize_request&, voxelize_stats&,
                                             voxelpipe::stage_times&) {
    throw backend_error(why_not(facts));
}

} // namespace voxelize
