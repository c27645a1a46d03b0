// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of solids: meshes in voxel coordinates (a grid of unit voxels at the origin snaps multiples of
// 2^-F to themselves), the library's solids, and the oracle's.

#include "solid_oracle.hpp"
#include "triangles.hpp"

#include <cpu_ref/backend.hpp>
#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace solids {

namespace vp = voxelpipe;
using oracle::splitmix64;

struct mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    [[nodiscard]] vp::mesh_view<> view() const { return {positions, triangles}; }
    mesh& add(const mesh& other);
    [[nodiscard]] mesh inside_out() const;
    [[nodiscard]] mesh moved(glm::vec3 by) const;
};

mesh box(glm::vec3 low, glm::vec3 high); // fronts outward
mesh octahedron(glm::vec3 center, float radius);
// A square tube along z: the box from low to high without the box `wall` further in, open at both ends.
mesh tube(glm::vec3 low, glm::vec3 high, float wall);
mesh sphere(glm::vec3 center, float radius, int subdivisions);
// Two fans over a closed polygon of random points: closed, whatever the points, and full of self-intersections.
// Coordinates are multiples of 1 / `per_voxel` from low to high.
mesh random_cycle(splitmix64& random, int points, int low, int high, int per_voxel);
// A set of boxes, octahedra and cycles within `extent` voxels, about half of them inside out, coordinates on multiples
// of a half.
mesh random_bodies(splitmix64& random, int extent, int count);
// Each triangle into three at a point of its own plane: the sum of its vertices if that is thrice a lattice point, or
// into two at the middle of an edge.
mesh split_at_lattice_points(const mesh& m);
// The mesh without the triangles of these numbers, and without `count` that are drawn by lot; one is left.
mesh without_triangles(mesh m, std::vector<std::size_t> which);
mesh with_holes(splitmix64& random, mesh m, std::size_t count);

vp::grid unit_grid(glm::ivec3 extent);
inline std::size_t index(glm::ivec3 extent, int x, int y, int z) {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(extent.y) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(extent.x) +
           static_cast<std::size_t>(x);
}

// A byte a voxel, x fastest: 1 where there is a fragment.
using voxel_set = std::vector<std::uint8_t>;
std::size_t count(const voxel_set& s);
voxel_set united(voxel_set a, const voxel_set& b);
voxel_set without(voxel_set a, const voxel_set& b);
voxel_set exclusive(voxel_set a, const voxel_set& b);

struct solid {
    voxel_set voxels;
    vp::status status;
};
// Each mesh is a draw. Fails the test if the call does.
solid library_solid(const std::vector<mesh>& draws, const vp::grid& g, const vp::solid_options& options = {},
                    unsigned threads = 2);
inline solid library_solid(const mesh& m, const vp::grid& g, const vp::solid_options& options = {},
                           unsigned threads = 2) {
    return library_solid(std::vector<mesh>{m}, g, options, threads);
}
// What a call says that draws a solid into bits, along the mesh's longest axis n voxels.
vp::status status_of_bits(const mesh& m, int n, const vp::solid_options& options);
// The conservative cover.
voxel_set library_cover(const mesh& m, const vp::grid& g);

// Winding numbers of all voxels by the oracle; the mesh is snapped by the oracle too.
std::vector<oracle::snapped_triangle> snap(const mesh& m, const vp::grid& g);
std::vector<std::int64_t> oracle_windings(const mesh& m, const vp::grid& g, const std::array<int, 3>& direction,
                                          const std::array<int, 3>& order = {0, 1, 2});
voxel_set accepted(const std::vector<std::int64_t>& windings, vp::fill_rule rule);

// Directions of the oracle's rays: parallel to no axis and to no plane of lattice points that meshes are likely to
// have; and from the low end of rows along x, which is what the library says of open meshes.
inline constexpr std::array<int, 3> skew{-7, 3, 11};
inline constexpr std::array<int, 3> along_rows{-1, 0, 0};

} // namespace solids
