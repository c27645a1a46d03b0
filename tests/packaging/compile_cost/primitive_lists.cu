// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// The primitives of each voxel, in an A-buffer.
#include <voxelpipe/voxelpipe.hpp>

namespace vp = voxelpipe;

vp::status draw_primitive_lists(vp::cuda_backend& backend, const vp::mesh_view<>& mesh, const vp::grid& grid,
                                vp::abuffer<vp::cuda_backend, void>& out) {
    return vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(true), out);
}
