// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle: which voxels a triangle covers, decided a second way that shares nothing with voxelpipe/ (no header of it
// is included here or in oracle.cpp). Takes a grid and three float positions; gives exact voxel sets and exact rational
// barycentrics. Coverage is decided by projecting every box corner and every vertex on each of the separating axes, in
// integers that provably do not overflow. Candidates come from halving the grid, never from a bounding box.

#include "wide_int.hpp"

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

namespace oracle {

using wide = wide_int<4>; // 256 bits

// World-space origin and voxel size per axis; extent in voxels, 1 to 2^24 an axis.
struct grid {
    double origin[3];
    double voxel_size[3];
    int extent[3];
};

// Positions that leave 2^40 fixed-point units on some axis drop their triangle.
inline constexpr std::int64_t farthest_position = std::int64_t{1} << 40;

struct snapped_triangle {
    std::int64_t v[3][3]; // [vertex][axis], units of 2^-F voxel; zero where dropped
    bool dropped;         // a position is NaN, infinite or too far away
};

// Ordered as a framebuffer is laid out: x fastest.
struct voxel {
    int i, j, k;
    friend bool operator==(const voxel&, const voxel&) = default;
    friend std::strong_ordering operator<=>(const voxel& a, const voxel& b) {
        if (a.k != b.k) return a.k <=> b.k;
        if (a.j != b.j) return a.j <=> b.j;
        return a.i <=> b.i;
    }
};

// Part of a grid: voxels from lo to hi, hi not included.
struct region {
    int lo[3];
    int hi[3];
};

// Integers to decide with. `automatic` takes the narrowest that is proven wide enough; naming one that is not throws
// std::overflow_error. All give the same answer, which oracle_test checks.
enum class arithmetic { automatic, bits64, bits128, bits256 };

// F = min(16, 24 - ceil(log2(largest extent))).
int fraction_bits(const grid& g);

// q = rne((double(p) - origin) * scale), scale = 2^F / voxel_size, each operation rounded by itself.
snapped_triangle snap(const grid& g, const float v[3][3]);

// Does the closed box from lo to hi (voxel coordinates, lo <= hi) meet the closed triangle? A voxel is {i,j,k} to
// {i+1,j+1,k+1}. Requires a triangle that was not dropped.
bool box_meets_triangle(int fraction_bits, const snapped_triangle& t, const std::array<int, 3>& lo,
                        const std::array<int, 3>& hi, arithmetic with = arithmetic::automatic);

bool covers_conservative(const grid& g, const snapped_triangle& t, int i, int j, int k,
                         arithmetic with = arithmetic::automatic);

// Every voxel of the grid whose closed box meets the closed triangle, ascending. Empty for a dropped triangle.
std::vector<voxel> conservative(const grid& g, const snapped_triangle& t, arithmetic with = arithmetic::automatic);

// The same, for the voxels of a part of the grid; the grid still decides how positions snap.
std::vector<voxel> conservative(const grid& g, const snapped_triangle& t, const region& part,
                                arithmetic with = arithmetic::automatic);

// Axis of the largest |normal component| (ties: x over y over z), or -1 for a zero-area triangle.
int dominant_axis(const snapped_triangle& t);

// Twice the area vector of the snapped triangle: (v1 - v0) x (v2 - v0).
std::array<wide, 3> normal(const snapped_triangle& t);

// One voxel for every column along the dominant axis whose closed unit square meets the closed projected triangle, at
// the floor of the plane's depth at the column's centre, if that lies inside the grid. Ascending.
std::vector<voxel> thin(const grid& g, const snapped_triangle& t, arithmetic with = arithmetic::automatic);
std::vector<voxel> thin(const grid& g, const snapped_triangle& t, const region& part,
                        arithmetic with = arithmetic::automatic);

// Voxels of which the triangle meets an arm that is not parallel to it: a closed segment along an axis, through the
// centre, from face to face. Ascending.
std::vector<voxel> crosshair(const grid& g, const snapped_triangle& t, const region& part,
                             arithmetic with = arithmetic::automatic);

// The same with closed segments from corner to corner.
std::vector<voxel> diagonal(const grid& g, const snapped_triangle& t, const region& part,
                            arithmetic with = arithmetic::automatic);

// A rational number; the denominator is not zero but may be negative.
struct ratio {
    wide numerator;
    wide denominator;
};

// Barycentrics of the point of the triangle's plane over the centre of the voxel's column along the dominant axis. They
// sum to one and may leave [0,1]. Requires a triangle with area.
std::array<ratio, 3> barycentrics(const grid& g, const snapped_triangle& t, const voxel& at);

// The plane's depth at that point along the dominant axis, in voxels.
ratio depth(const grid& g, const snapped_triangle& t, const voxel& at);

// The float, or double, nearest to the exact value, ties to even. Throws std::overflow_error for magnitudes above the
// largest finite one (none of the ratios above reaches that) and for subnormal results other than zero.
float nearest_float(const ratio& value);
double nearest_double(const ratio& value);

} // namespace oracle
