// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bake.cuh"

namespace voxelpipe::python {

sparse_result<float> list_voxels(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule) {
    const current_device current(on);
    const auto all = std::make_shared<kept_bricks<target<bit, blend::bit_or>>>(on, g.extent);
    sparse_result<float> made;
    made.result = voxelize(all->own.backend, mesh, g, passthrough{}, constant(true), all->fb, voxelize_options{rule});
    if (made.result.ok()) give_voxels(on, all, made);
    return made;
}

} // namespace voxelpipe::python
