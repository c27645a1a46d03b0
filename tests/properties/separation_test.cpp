// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Separation, by flood fill on closed meshes: no path of empty voxels leads from one side of a closed surface to the
// other, stepping through faces for thin coverage (6-separating), through faces, edges and corners for conservative
// coverage (26-separating).

#include "closed_meshes.hpp"
#include "properties.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace properties {
namespace {

std::vector<bool> occupancy(const std::vector<oracle::world_triangle>& triangles, const grid& g, vp::coverage rule) {
    const image drawn = library_image(oracle::as_library(g), triangles, rule);
    std::vector<bool> full;
    for (int z = 0; z < g.extent[2]; ++z)
        for (int y = 0; y < g.extent[1]; ++y)
            for (int x = 0; x < g.extent[0]; ++x) full.push_back(drawn.occupied(x, y, z));
    return full;
}

struct flood_result {
    std::size_t leaks = 0;      // steps between empty voxels on different sides of a shell
    std::size_t components = 0; // of empty voxels
    std::size_t inside = 0;     // empty voxels inside some shell
    std::size_t outside = 0;    // empty voxels that the flood from the border reaches
};

// Floods the empty voxels, component by component, from each voxel that no component has reached yet.
flood_result flood(const grid& g, const std::vector<bool>& full, const std::vector<std::uint32_t>& side, bool corners) {
    const int nx = g.extent[0], ny = g.extent[1], nz = g.extent[2];
    const auto id = [&](int x, int y, int z) {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(nx) +
               static_cast<std::size_t>(x);
    };
    flood_result result;
    std::vector<bool> reached(full.size(), false);
    std::vector<oracle::voxel> queue;
    for (int z = 0; z < nz; ++z)
        for (int y = 0; y < ny; ++y)
            for (int x = 0; x < nx; ++x) {
                if (full[id(x, y, z)] || reached[id(x, y, z)]) continue;
                const std::uint32_t expected = side[id(x, y, z)];
                ++result.components;
                std::size_t size = 0;
                bool border = false;
                reached[id(x, y, z)] = true;
                queue.push_back({x, y, z});
                while (!queue.empty()) {
                    const oracle::voxel at = queue.back();
                    queue.pop_back();
                    ++size;
                    border = border || at.i == 0 || at.j == 0 || at.k == 0 || at.i == nx - 1 || at.j == ny - 1 ||
                             at.k == nz - 1;
                    result.inside += side[id(at.i, at.j, at.k)] != 0;
                    for (int step = 0; step < 27; ++step) {
                        const int dx = step % 3 - 1, dy = step / 3 % 3 - 1, dz = step / 9 - 1;
                        if (!corners && std::abs(dx) + std::abs(dy) + std::abs(dz) != 1) continue;
                        const int i = at.i + dx, j = at.j + dy, k = at.k + dz;
                        if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
                        const std::size_t next = id(i, j, k);
                        if (full[next]) continue;
                        result.leaks += side[next] != expected;
                        if (reached[next]) continue;
                        reached[next] = true;
                        queue.push_back({i, j, k});
                    }
                }
                if (border) result.outside += size;
            }
    return result;
}

const std::vector<grid>& grids() {
    static const std::vector<grid> list = {
        {{0, 0, 0}, {1, 1, 1}, {32, 32, 32}},
        {{-1, 2, -3}, {0.125, 0.125, 0.125}, {41, 37, 33}},
        {{100.3, -7.7, 0.1}, {0.013, 0.021, 0.017}, {30, 44, 36}}, // anisotropic: the mesh is stretched in the world
    };
    return list;
}

std::vector<closed_mesh> meshes() {
    splitmix64 random(41);
    std::vector<closed_mesh> list;
    const auto add = [&](closed_mesh m) {
        if (list.size() % 3 != 0) turn(m, random);
        if (list.size() % 4 != 0) move(m, {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
        list.push_back(std::move(m));
    };
    for (int n = 0; n < (oracle::test_scale() < 1 ? 1 : 4); ++n) {
        add(box({7, 5, 9}));       // faces on voxel faces if neither turned nor moved
        add(box({6.5, 7.5, 5.5})); // faces through voxel centres
        add(box({10, 10, 0.05}));  // a plate, thinner than a voxel
        add(box({12, 0.3, 0.2}));  // a rod
        add(tetrahedron(8));       // planes with two equal normal components
        add(sphere(9, 0));
        add(sphere(11, 2));
        add(sphere(8.25, 3)); // triangles of about a voxel
        add(sphere(6, 4));    // far below a voxel
        add(torus(9, 3, 24, 12));
        add(torus(8, 0.4, 60, 9)); // a wire
        add(star(random, 2, 14, 1));
        add(star(random, 4, 13, 2));
        add(star(random, 6, 12, 3));
        add(star(random, 0.1, 14, 2)); // spikes
        add(hull(10, 2.5, 2));
        add(hull(9, 0.7, 2)); // two surfaces within a voxel
        add(hull(9.5, 0.01, 3));
        closed_mesh two = box({5, 5, 5}); // two bodies that share a face plane and overlap
        two.name = "two_boxes";
        closed_mesh other = box({5, 3, 3});
        move(other, {4, 2, 1});
        two.add_shell(other);
        add(two);
    }
    return list;
}

// Coverages that stop paths across edges and corners of voxels too.
bool is_26_separating(vp::coverage rule) {
    return rule == vp::coverage::conservative || rule == vp::coverage::diagonal;
}

class Separation : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(Separation, NoPathOfEmptyVoxelsCrossesAClosedSurface) {
    const bool corners = is_26_separating(GetParam());
    std::size_t bodies = 0;
    for (const closed_mesh& m : meshes()) {
        ASSERT_TRUE(is_closed(m)) << m.name;
        for (const grid& g : grids()) {
            const auto placed = place(m, g);
            const auto side = inside_of(m, g, placed);
            const flood_result r = flood(g, occupancy(placed, g, GetParam()), side, corners);
            ASSERT_EQ(r.leaks, 0u) << m.name;
            EXPECT_GT(r.outside, 0u) << m.name;
            if (r.inside > 0) {
                ++bodies;
                EXPECT_GE(r.components, 2u) << m.name;
            }
        }
    }
    EXPECT_GT(bodies,
              oracle::test_scale() < 1 ? 25u : 100u); // bodies with empty voxels inside, so that a leak could show
}

// A surface that leaves the grid separates the voxels inside the grid.
TEST_P(Separation, HoldsWhereTheGridCutsTheSurface) {
    splitmix64 random(42);
    std::size_t bodies = 0;
    for (int n = 0; n < 40; ++n) {
        closed_mesh m = n % 2 == 0 ? sphere(14, 2) : star(random, 8, 24, 2);
        turn(m, random);
        move(m, {random.uniform(-15, 15), random.uniform(-15, 15), random.uniform(-15, 15)});
        const grid& g = grids()[static_cast<std::size_t>(n) % grids().size()];
        const auto placed = place(m, g);
        // inside_of counts crossings in whole columns, also below the grid.
        const flood_result r =
            flood(g, occupancy(placed, g, GetParam()), inside_of(m, g, placed), is_26_separating(GetParam()));
        ASSERT_EQ(r.leaks, 0u);
        bodies += r.inside > 0 && r.outside > r.inside;
    }
    EXPECT_GT(bodies, 20u);
}

INSTANTIATE_TEST_SUITE_P(AllRules, Separation,
                         ::testing::Values(vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair,
                                           vp::coverage::diagonal),
                         rule_of);

// Controls: the flood fill finds leaks through a hole in the mesh, and through the corners of thin surfaces.
TEST(SeparationControl, AHoleLeaks) {
    const grid& g = grids()[0];
    const closed_mesh m = sphere(10, 1);
    auto placed = place(m, g);
    const auto side = inside_of(m, g, placed);
    placed.erase(placed.begin() + 17);
    for (const vp::coverage rule :
         {vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair, vp::coverage::diagonal})
        EXPECT_GT(flood(g, occupancy(placed, g, rule), side, is_26_separating(rule)).leaks, 0u);
}

TEST(SeparationControl, ThinAndCrosshairAreNot26Separating) {
    const grid& g = grids()[0];
    const closed_mesh m = sphere(10, 2);
    const auto placed = place(m, g);
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::crosshair})
        EXPECT_GT(flood(g, occupancy(placed, g, rule), inside_of(m, g, placed), true).leaks, 0u);
}

TEST(SeparationControl, InsideOfABallIsWithinItsRadius) {
    const grid g = {{0, 0, 0}, {1, 1, 1}, {40, 40, 40}};
    const closed_mesh m = sphere(12, 4);
    const auto side = inside_of(m, g, place(m, g));
    for (int z = 0; z < 40; ++z)
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 40; ++x) {
                const double dx = x - 19.5, dy = y - 19.5, dz = z - 19.5, r = std::sqrt(dx * dx + dy * dy + dz * dz);
                if (r > 11.8 && r < 12.05) continue;
                ASSERT_EQ(side[static_cast<std::size_t>((z * 40 + y) * 40 + x)], r < 12 ? 1u : 0u) << x << y << z;
            }
}

} // namespace
} // namespace properties
