// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include <cpu_ref/backend.hpp>

#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

int main() {
    // snippet: shortest
    const std::vector<glm::vec3> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; // a tetrahedron
    const std::vector<glm::uvec3> triangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

    vp::cpu_backend backend; // vp::cuda_backend on a GPU
    const vp::grid grid = vp::fit(positions, {64, 64, 64});
    const vp::mesh mesh{backend, positions, triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> surface{backend, grid.extent};
    const vp::status drawn = vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(true), surface);

    const auto touched = vp::get<0>(surface).to_host_target(backend);
    // end snippet
    std::printf("%s: %llu voxels, the centre is %d\n", drawn.message().c_str(),
                static_cast<unsigned long long>(drawn.counts.voxels), touched(32, 32, 32));
    return drawn.ok() && drawn.counts.voxels != 0 && !touched(32, 32, 32) ? 0 : 1;
}
