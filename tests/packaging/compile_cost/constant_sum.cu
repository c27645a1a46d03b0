// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// A constant that is added up in floats.
#include <voxelpipe/voxelpipe.hpp>

namespace vp = voxelpipe;

vp::status draw_constant_sum(vp::cuda_backend& backend, const vp::mesh_view<>& mesh, const vp::grid& grid,
                             const vp::framebuffer_view<vp::target<float, vp::blend::add>>& out) {
    return vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(1.0f), out);
}
