// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Segments and points decided a second way, by comparing rationals, layer by layer and voxel by voxel, without a
// division and without a header of voxelpipe/.

#include "oracle.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace oracle {

// Snapped ends, in units of 2^-F voxel from the grid's corner; equal for a point.
struct segment {
    std::int64_t a[3], b[3];
};

// The axis of the largest |difference|, ties x over y over z; 0 for a point.
int dominant_axis(const segment& s);

// Thin: one voxel in every layer of the grid along the dominant axis that the closed segment meets, at the floor of the
// line at the layer's centre, if it lies in the grid; the floor of a point. Ascending.
std::vector<voxel> thin(const grid& g, const segment& s);

// Conservative, in rationals: voxels for which one parameter of the closed segment satisfies all six inequalities.
std::vector<voxel> conservative(const grid& g, const segment& s);

// The parameter of the line at the centre of the voxel's layer: 0 at a, 1 at b. Not of a point.
ratio parameter(const grid& g, const segment& s, const voxel& at);

} // namespace oracle
