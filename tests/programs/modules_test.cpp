// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distances and cut cells of what programs make, on cpu_backend.

#include "module_cases.hpp"

#include <cpu_ref/backend.hpp>
#include <cpu_ref/cells/voxelize_cells.hpp>
#include <cpu_ref/distance/voxelize_distance.hpp>

namespace vp = voxelpipe;

namespace {

TEST(ProgramModules, DistancesAreThoseOfTheMadeMesh) {
    vp::cpu_backend backend(2);
    programs::expect_distances_of_programs(backend);
}
TEST(ProgramModules, DistancesOfTrianglesThatAreLeftOutDoNotCount) {
    vp::cpu_backend backend(2);
    programs::expect_distances_without_what_is_left_out(backend);
}
TEST(ProgramModules, CellsAreThoseOfTheMadeMesh) {
    vp::cpu_backend backend(2);
    programs::expect_cells_of_programs(backend);
}

// A level beyond the program's own, and more triangles than an element may make, are named.
struct too_many {
    VOXELPIPE_HD auto operator()(const vp::triangle<programs::weight>&) const {
        vp::triangles<1, programs::weight> out;
        out.count = 2;
        return out;
    }
};
TEST(ProgramModules, BadProgramsAreRefused) {
    vp::cpu_backend backend(1);
    programs::octahedra m;
    m.add({4, 4, 4}, 3);
    vp::grid g;
    g.extent = glm::ivec3(8);
    const vp::mesh<vp::cpu_backend> mesh(backend, m.positions, m.triangles);
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> fb{backend, g.extent};
    EXPECT_EQ(
        vp::voxelize_distance(backend, mesh, g, programs::weighted{}, vp::geometry{too_many{}}, vp::distance{}, fb)
            .code,
        vp::status_code::bad_count);
    EXPECT_EQ(
        vp::voxelize_cells(backend, mesh, g, programs::weighted{}, vp::geometry{too_many{}}, vp::fraction{}, fb).code,
        vp::status_code::bad_count);
}

} // namespace
