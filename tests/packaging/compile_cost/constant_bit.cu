// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// A constant into bits.
#include <voxelpipe/voxelpipe.hpp>

namespace vp = voxelpipe;

vp::status draw_constant_bit(vp::cuda_backend& backend, const vp::mesh_view<>& mesh, const vp::grid& grid,
                             const vp::framebuffer_view<vp::target<vp::bit, vp::blend::bit_or>>& out) {
    return vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(true), out);
}
