// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes that are computed, for machines without the scene files and for what no scene has. Only + - * / sqrt and fma,
// each written so that no compiler flag changes a rounding: the same floats on every machine, so that golden values can
// be kept for them.

#include "mesh_data.hpp"

#include <cstdint>

namespace bench {

// splitmix64: the same numbers with every standard library.
class random_numbers {
public:
    explicit random_numbers(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        state_ += 0x9e3779b97f4a7c15u;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint64_t below(std::uint64_t count) { return next() % count; }
    // In [-1, 1), a multiple of 2^-52.
    double signed_unit() { return static_cast<double>(next() >> 11) * 0x1p-52 - 1.0; }

private:
    std::uint64_t state_;
};

// Unit sphere: each face of an icosahedron split into frequency^2, 20 * frequency^2 triangles. Closed, outward.
mesh_data icosphere(int frequency);

// Tube round a (2,3) torus knot: 2 * segments * sides triangles. Closed.
mesh_data torus_knot(int segments, int sides);

// `count` independent triangles whose vertices lie in a cube of side `size` somewhere in the unit cube; size > 1 gives
// triangles that cross it.
mesh_data triangle_soup(std::uint32_t count, double size, std::uint64_t seed);

// Thin hexagonal tubes that wander through a ball: 12 * strands * segments long, thin triangles; `seed` chooses them.
mesh_data hairball(int strands, int segments, std::uint64_t seed);

// A room of mixed sizes: walls of two triangles each, slanted beams through the whole room, and `clutter` small
// triangles of which most lie in one corner. 20 + clutter triangles.
mesh_data room(std::uint32_t clutter, std::uint64_t seed);

// One slanted triangle across the unit cube.
mesh_data one_triangle();

} // namespace bench
