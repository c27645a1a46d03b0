// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes for the scaling curves, made on the device, because the largest would take minutes to make and copy. All lie
// in a grid with voxels of size 1 and its origin at 0 (unit_grid). They throw out_of_device_memory before they
// allocate what does not fit.

#include "session.hpp"

#include <cstdint>

namespace bench::gpu {

[[nodiscard]] voxelpipe::grid unit_grid(int n);

// A sphere that fills a grid of n^3: each side of a cube split into m x m quads, 12 m^2 triangles, so that they come
// row by row, as those of a scanned surface do.
[[nodiscard]] resident_mesh sphere_of_quads(std::uint64_t m, int n);
// The m that comes closest to so many triangles.
[[nodiscard]] std::uint64_t quads_for(std::uint64_t triangles);

// Equilateral triangles with edges of `edge` voxels, at random positions and turned at random, all of them inside a
// grid of n^3. edge <= 0.8 n.
[[nodiscard]] resident_mesh scattered_triangles(std::uint64_t count, double edge, int n, std::uint64_t seed);

enum class placement : std::uint8_t {
    together, // the voxels fill a cube in the middle of the grid: few tiles
    spread,   // the voxels lie evenly all over the grid
};
// `voxels` voxels with `depth` triangles in each, one after the other, none of which leaves its voxel: depth fragments
// a voxel under the conservative rule.
[[nodiscard]] resident_mesh stacked_triangles(std::uint64_t voxels, std::uint64_t depth, placement where, int n,
                                              std::uint64_t seed);

} // namespace bench::gpu
