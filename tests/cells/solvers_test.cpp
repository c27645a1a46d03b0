// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Code of docs/solvers.md: what codes with embedded boundaries read, from one call for each axis.
#include "../solids/solid_support.hpp"

#include <cpu_ref/backend.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

namespace vp = voxelpipe;

// snippet: cut_cells
// Of a voxel: its fraction, and its two faces along the rows' axis.
struct fraction_and_faces {
    VOXELPIPE_HD vp::output<float, float, double> operator()(const vp::cell_fragment& f) const {
        constexpr double unit = 0x1p-44;
        // Units are whole numbers, of which the difference is exact.
        return vp::outputs(f.fraction, static_cast<float>(static_cast<double>(f.aperture) * unit),
                           static_cast<double>(f.aperture - f.next_aperture) * unit);
    }
};

struct cut_cells {
    std::vector<float> fraction;                // of the volume inside
    std::array<std::vector<float>, 3> aperture; // of the lower face along x, y, z; the upper one is the neighbour's
    std::array<std::vector<double>, 3> wall;    // the surface's area vector in the voxel, in faces
};

cut_cells find_cut_cells(const vp::mesh_view<>& mesh, const vp::grid& grid) {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>, vp::target<float, vp::blend::replace>,
                    vp::target<double, vp::blend::replace>>
        voxels(backend, grid.extent);
    cut_cells found;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        vp::clear(backend, voxels).or_throw();
        vp::voxelize_cells(backend, mesh, grid, vp::passthrough{}, fraction_and_faces{}, voxels,
                           {.axis = static_cast<int>(axis)})
            .or_throw();
        if (axis == 0) found.fraction = vp::get<0>(voxels).to_host(backend);
        found.aperture[axis] = vp::get<1>(voxels).to_host(backend);
        found.wall[axis] = vp::get<2>(voxels).to_host(backend);
    }
    return found;
}
// end snippet

// A voxel's walls and faces close, and on a closed mesh the walls of all voxels do.
TEST(Solvers, CutCellsClose) {
    const solids::mesh ball = solids::sphere({8.1F, 7.9F, 8.3F}, 6.2F, 3);
    vp::grid grid;
    grid.extent = {16, 17, 18};
    const cut_cells found = find_cut_cells(ball.view(), grid);
    const std::array<std::size_t, 3> step{1, 16, 16 * 17};
    std::array<double, 3> sum{};
    std::size_t cut = 0;
    for (std::size_t at = 0; at < found.fraction.size(); ++at) {
        cut += found.fraction[at] > 0 && found.fraction[at] < 1 ? 1 : 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            sum[axis] += found.wall[axis][at];
            const std::size_t next = at + step[axis]; // outside of the ball, the last layer has no faces inside
            const float upper = next < found.fraction.size() ? found.aperture[axis][next] : 0;
            EXPECT_NEAR(found.wall[axis][at], static_cast<double>(found.aperture[axis][at]) - upper, 0x1p-23);
        }
    }
    EXPECT_LT(500, cut);
    EXPECT_EQ((std::array<double, 3>{}), sum);
}

} // namespace
