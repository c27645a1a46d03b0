// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Closed triangle meshes of several shells, in voxel units around the origin, for the separation tests. Every edge of a
// shell is shared by exactly two of its triangles, so the shell stays closed however its vertices are rounded.
// inside_of() says exactly on which side of each snapped shell a voxel's centre lies, by counting crossings in
// integers.

#include "library.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace properties {

struct point {
    double x, y, z;
};

struct closed_mesh {
    std::string name;
    std::vector<point> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::size_t> shells; // first triangle of each shell

    void add_shell(const closed_mesh& other); // the other's triangles become one more shell
};

closed_mesh box(point half_size);
closed_mesh tetrahedron(double radius);
closed_mesh sphere(double radius, int subdivisions); // 20 * 4^subdivisions triangles
closed_mesh torus(double radius, double tube, int around, int across);
// A sphere whose vertices are moved along their rays to random places between the two radii: star-shaped, spiky.
closed_mesh star(oracle::splitmix64& random, double inner, double outer, int subdivisions);
// A sphere within a sphere, `thickness` voxels apart.
closed_mesh hull(double radius, double thickness, int subdivisions);

void turn(closed_mesh& m, oracle::splitmix64& random); // a random rotation
void move(closed_mesh& m, point by);

// True if every edge of every shell is in exactly two triangles, once in each direction.
bool is_closed(const closed_mesh& m);

// As floats in the grid's world space, centred in the grid.
std::vector<oracle::world_triangle> place(const closed_mesh& m, const oracle::grid& g);

// For each voxel, x fastest, a bit per shell: whether the voxel's centre is inside the snapped shell. Voxels whose
// centre lies on a shell hold either value.
std::vector<std::uint32_t> inside_of(const closed_mesh& m, const oracle::grid& g,
                                     const std::vector<oracle::world_triangle>& placed);

} // namespace properties
