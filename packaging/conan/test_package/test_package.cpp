// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include <cpu_ref/backend.hpp>

#include <vector>

namespace vp = voxelpipe;

int main() { // a square between two layers of 4 x 4 voxels fills both
    const std::vector<glm::vec3> positions{{0, 0, 2}, {4, 0, 2}, {4, 4, 2}, {0, 4, 2}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 2, 3}};
    vp::grid grid;
    grid.extent = {4, 4, 4};
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> surface{backend, grid.extent};
    const vp::status drawn = vp::voxelize(backend, vp::mesh_view<>{positions, triangles}, grid, vp::passthrough{},
                                          vp::constant(true), surface);
    return drawn.ok() && drawn.counts.voxels == 32 ? 0 : 1;
}
