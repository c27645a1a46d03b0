// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Test triangles and grids: every class of triangle that has ever broken a voxelizer, at scales from 10^-3 voxel to
// 10^3 grids. A seed gives the same triangles on every run (splitmix64; no std distribution, whose results differ
// between standard libraries). Nothing of voxelpipe/ is included.

#include "oracle.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

namespace oracle {

class splitmix64 {
public:
    explicit splitmix64(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        state_ += 0x9e3779b97f4a7c15u;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    // In [0, count); the bias of the remainder is far below what a test could see.
    std::uint64_t below(std::uint64_t count) { return next() % count; }

    std::int64_t between(std::int64_t lo, std::int64_t hi) { // both included
        return lo + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(hi - lo) + 1));
    }

    bool one_in(std::uint64_t count) { return below(count) == 0; }

    double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; } // [0, 1)
    double uniform(double lo, double hi) { return lo + (hi - lo) * unit(); }

private:
    std::uint64_t state_;
};

enum class triangle_class {
    small,           // 10^-3 to 4 voxels, anywhere in the grid
    medium,          // 1 voxel to the grid
    large,           // 1 to 10^3 grids, most of them through the grid
    sliver,          // long, a few fixed-point units to a tenth of a voxel high
    needle,          // two vertices within a few fixed-point units, the third far off
    point,           // three equal vertices
    segment,         // two equal vertices
    collinear,       // three vertices exactly on one line
    corner_vertices, // vertices on voxel corners
    edge_vertices,   // vertices on voxel edges
    face_vertices,   // vertices on voxel faces
    edge_in_face,    // one edge lies in a plane of voxel faces
    face_plane,      // the whole triangle lies in a plane of voxel faces
    half_lattice,    // vertices at half voxels: depths at column centres are often exactly an integer
    diagonal_plane,  // two or three normal components of equal magnitude
    grazing,         // an edge touches a voxel edge, or passes exactly through a voxel corner
    lattice,         // small integer coordinates in fixed-point units round a voxel corner
    partly_outside,  // across the border of the grid
    wholly_outside,  // no vertex in the grid, most of them not touching it
    powers_of_two,   // bounding box of 2^k units, give or take two: where widths of integers run out
    far_away,        // vertices up to 2^40 fixed-point units away
    dropped,         // a vertex is NaN, infinite or further than 2^40 units
};

inline constexpr std::array all_triangle_classes = {
    triangle_class::small,          triangle_class::medium,        triangle_class::large,
    triangle_class::sliver,         triangle_class::needle,        triangle_class::point,
    triangle_class::segment,        triangle_class::collinear,     triangle_class::corner_vertices,
    triangle_class::edge_vertices,  triangle_class::face_vertices, triangle_class::edge_in_face,
    triangle_class::face_plane,     triangle_class::half_lattice,  triangle_class::diagonal_plane,
    triangle_class::grazing,        triangle_class::lattice,       triangle_class::partly_outside,
    triangle_class::wholly_outside, triangle_class::powers_of_two, triangle_class::far_away,
    triangle_class::dropped,
};

// True if its triangles usually cross the whole grid. A few are much work, and too much on large grids.
constexpr bool covers_much(triangle_class kind) {
    return kind == triangle_class::large || kind == triangle_class::powers_of_two || kind == triangle_class::far_away;
}

std::string_view name(triangle_class kind);

struct world_triangle {
    float v[3][3]; // [vertex][axis]
};

struct test_grid {
    grid g;
    std::string_view name;
    bool exact; // dyadic origin and voxel size: every lattice position inside the grid is a float and snaps to itself
    bool dense; // small enough for triangles that cover a large part of it
    region focus = {{0, 0, 0}, {0, 0, 0}}; // where triangles are placed; the whole grid if empty
};

// The same grid with the triangles placed in a part of it, which may be small enough to count as dense.
test_grid focused(const test_grid& where, const region& part);

// Cubic, non-cubic, odd, flat, one voxel, anisotropic, far from the world origin, and up to 4096 voxels an axis.
const std::vector<test_grid>& test_grids();

// One triangle of the class for this grid, in world space. On grids that are not `dense`, sizes are limited to about
// 64 voxels except where the class is about going further.
world_triangle make_triangle(splitmix64& random, const test_grid& where, triangle_class kind);

// World position of a point given in fixed-point units; exact inside a grid that says so.
std::array<float, 3> to_world(const grid& g, const std::array<double, 3>& units);

// VOXELPIPE_TEST_SCALE, which slow builds set below 1; 1 otherwise.
inline double test_scale() {
    const char* const scale = std::getenv("VOXELPIPE_TEST_SCALE");
    return scale == nullptr ? 1.0 : std::strtod(scale, nullptr);
}

// Repetitions in the oracle's own tests: `usual` times the test scale, at least a tenth.
inline int repeats(int usual) { return static_cast<int>(usual * std::clamp(test_scale(), 0.1, 1.0)); }

} // namespace oracle
