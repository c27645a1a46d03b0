// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A second translation unit of one program: what headers define must be `inline`.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

namespace vp = voxelpipe;

std::size_t count_thin(const vp::mesh_view<>& mesh, const vp::grid& grid) {
    vp::cpu_backend backend;
    vp::abuffer<vp::cpu_backend> lists{backend};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(), lists, vp::coverage::thin).or_throw();
    return lists.num_voxels();
}
