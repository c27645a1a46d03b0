// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A user's first program: one square of two triangles into a grid of 4 x 4 x 4. The square lies on the border
// between the second and the third layer, so conservative coverage has to fill exactly those two.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

std::size_t count_thin(const vp::mesh_view<>& mesh, const vp::grid& grid); // in second_unit.cpp

int main() {
    const std::vector<glm::vec3> positions{{0, 0, 2}, {4, 0, 2}, {4, 4, 2}, {0, 4, 2}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 2, 3}};
    vp::grid grid;
    grid.extent = {4, 4, 4};

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::max>> framebuffer{backend, grid.extent};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, vp::constant(7u), framebuffer).or_throw();

    const std::vector<std::uint32_t> voxels = vp::get<0>(framebuffer).to_host(backend);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        const std::size_t layer = i / 16;
        const std::uint32_t expected = layer == 1 || layer == 2 ? 7u : 0u;
        if (voxels[i] != expected) {
            std::printf("voxel %zu is %u, not %u\n", i, voxels[i], expected);
            return 1;
        }
    }
    const std::size_t thin = count_thin(mesh.view(), grid);
    if (thin != 16) {
        std::printf("%zu voxels are thinly covered, not 16\n", thin);
        return 1;
    }
    std::printf("voxelpipe %d.%d.%d: 32 voxels covered conservatively, %zu thinly\n", VOXELPIPE_VERSION_MAJOR,
                VOXELPIPE_VERSION_MINOR, VOXELPIPE_VERSION_PATCH, thin);
    return 0;
}
