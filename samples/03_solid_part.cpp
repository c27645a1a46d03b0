// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A part as a solid: volume and centre of mass of a flange, a tube on a plate, from the voxels whose centres are
// inside. Prints them beside the exact values and checks them. Tube and plate overlap and are two closed shells of one
// mesh: fill_rule::nonzero, the default, counts nothing twice.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

struct part {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    // A prism over a ring of n corners, from height z0 to z1; `bore` 0 leaves it full.
    void add_ring(unsigned n, float outside, float bore, float z0, float z1) {
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned i = 0; i < n; ++i)
            for (const auto& [r, z] : {std::pair{outside, z0}, {outside, z1}, {bore, z1}, {bore, z0}}) {
                const float angle = 6.28318531F * static_cast<float>(i) / static_cast<float>(n);
                positions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
            }
        for (unsigned i = 0; i < n; ++i)
            for (unsigned k = 0; k < 4; ++k) { // around the profile: outside, top, bore, bottom
                const auto at = [&](unsigned j, unsigned m) { return first + j % n * 4 + m % 4; };
                triangles.emplace_back(at(i, k), at(i + 1, k), at(i + 1, k + 1));
                triangles.emplace_back(at(i, k), at(i + 1, k + 1), at(i, k + 1));
            }
    }
};

int main() {
    part flange;
    flange.add_ring(64, 2.0F, 0.8F, 0.0F, 1.6F);   // the tube
    flange.add_ring(64, 3.0F, 0.8F, -0.5F, 0.25F); // the plate, which reaches into it
    // Sizes of a ring of 64 corners, and of the two parts: the tube above the plate, and the plate.
    const auto area = [](double outside, double bore) {
        return 32 * std::sin(6.28318531 / 64) * (outside * outside - bore * bore);
    };
    const double tube = area(2.0, 0.8) * 1.35, plate = area(3.0, 0.8) * 0.75;
    const double exact_volume = tube + plate, exact_height = (tube * 0.925 + plate * -0.125) / exact_volume;

    vp::cpu_backend backend;
    const vp::grid grid = vp::fit_voxel_size(vp::bounds(flange.positions), 0.025); // heights are multiples of it
    const vp::mesh mesh{backend, flange.positions, flange.triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> inside{backend, grid.extent};
    const vp::status s =
        vp::voxelize_solid(backend, mesh, grid, vp::passthrough{}, vp::constant(true), inside).or_throw();

    glm::dvec3 sum(0.0);
    vp::for_each_occupied(vp::get<0>(inside).to_host_target(backend),
                          [&](const glm::ivec3& voxel, bool) { sum += grid.voxel_center(voxel); });
    const double one = grid.voxel_size.x * grid.voxel_size.y * grid.voxel_size.z;
    const double volume = static_cast<double>(s.counts.voxels) * one;
    const glm::dvec3 centre = sum / static_cast<double>(s.counts.voxels);
    std::printf("volume %.4f, exact %.4f; centre of mass %.4f %.4f %.4f, exact 0 0 %.4f; %llu open rows\n", volume,
                exact_volume, centre.x, centre.y, centre.z, exact_height,
                static_cast<unsigned long long>(s.solid.open_rows));
    return s.solid.open_rows == 0 && std::abs(volume / exact_volume - 1) < 2e-3 &&
                   std::abs(centre.x) + std::abs(centre.y) + std::abs(centre.z - exact_height) < 5e-3
               ? 0
               : 1;
}
