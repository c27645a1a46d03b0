// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Code of docs/solvers.md: what codes with embedded boundaries read, from one call for each axis; links into walls.
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

// snippet: bounce
// Bouzidi, Firdaouss and Lallemand's linear rule: what arrives from a wall at rest. f is what streams towards it.
float bounced(float q, float f_here, float f_behind, float f_opposite) {
    if (q < 0.5F) return 2 * q * f_here + (1 - 2 * q) * f_behind;
    return f_here / (2 * q) + (1 - 1 / (2 * q)) * f_opposite;
}

// Calls apply(node, link, q) for every link of a node in the fluid into the wall.
template <class IsWall, class Apply>
void for_each_wall_link(const vp::mesh_view<>& mesh, const vp::grid& grid, const IsWall& is_wall, const Apply& apply) {
    vp::cpu_backend backend;
    vp::link_list<vp::cpu_backend> links(backend);
    vp::voxelize_links(backend, mesh, grid, vp::passthrough{}, links, {.neighbours = 18}).or_throw();
    const std::vector<glm::ivec3> nodes = links.voxels.to_host(backend);
    const std::vector<float> q = links.q.to_host(backend);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (int link = 0; link < 18; ++link) {
            const float part = q[18 * i + static_cast<std::size_t>(link)];
            if (part > 0 && !is_wall(nodes[i])) apply(nodes[i], link, part);
        }
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

// Links of the fluid end in the wall where the box's faces are, and the rule is exact for what is linear along a link:
// below a half it takes what starts 1 - q from the wall, else what passes the node between two that it knows.
TEST(Solvers, LinksBounceAtTheFaces) {
    const solids::mesh box = solids::box({3.25F, 2.625F, 2.875F}, {7.75F, 8.125F, 7.5625F});
    vp::grid grid;
    grid.extent = glm::ivec3(11);
    const auto inside = solids::library_solid(box, grid, {}).voxels;
    const auto is_wall = [&](const glm::ivec3& p) { return inside[solids::index(grid.extent, p.x, p.y, p.z)] != 0; };
    std::size_t straight = 0, short_parts = 0;
    for_each_wall_link(box.view(), grid, is_wall, [&](const glm::ivec3& node, int link, float q) {
        const auto linear = [](float from_wall) { return 0.25F + 0.5F * from_wall; };
        if (q < 0.5F) {
            EXPECT_FLOAT_EQ(bounced(q, linear(q), linear(q + 1), 1e9F), linear(1 - q));
        } else {
            EXPECT_FLOAT_EQ(bounced(q, linear(1 - q), 1e9F, linear(q + 1)), linear(q));
        }
        if (link >= 6) return; // along axes, below: the distance to the face
        const glm::vec3 centre = glm::vec3(node) + 0.5F, d(vp::link_direction(link));
        const float face =
            glm::dot(d, d.x + d.y + d.z > 0 ? glm::vec3(3.25F, 2.625F, 2.875F) : glm::vec3(7.75F, 8.125F, 7.5625F));
        EXPECT_EQ(q, face - glm::dot(d, centre));
        ++straight;
        short_parts += q < 0.5F ? 1 : 0;
    });
    EXPECT_EQ(straight, 6u * 5 * 5);
    EXPECT_GT(short_parts, 20u);
}

} // namespace
