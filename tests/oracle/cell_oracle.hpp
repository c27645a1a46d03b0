// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of cut cells: what a triangle adds to the fraction of a voxel, from polygons in the triangle's own
// parameters, whose corners are exact fractions. Each area and moment is an exact fraction, too, and is divided once.
// Shares nothing with voxelpipe/.

#include "distance_oracle.hpp"

#include <array>
#include <cstdint>

namespace oracle {

struct cell_part {
    long double fraction; // winding number, integrated over the voxel: of rows along x, positive where n_x < 0
    long double cover;    // of the pixel by the part at x below the voxel: likewise
    std::array<long double, 2> cover_moment; // the same part's moments in y and z, about the pixel's centre
    bool touches;                            // the closed triangle meets the closed voxel
    bool touches_face;                       // and its closed lower face along x
    std::array<long double, 3> moment;       // of the winding number, about the voxel's centre
    // Of the part in the voxel, in faces of a voxel, and its moment about the centre; parts in a plane between two
    // voxels belong to the lower one.
    long double area;
    std::array<long double, 3> area_moment;
};

// Positions in units of 2^-fraction_bits voxel, |coordinates| < 2^20.
cell_part cell_of(const lattice_triangle& t, int fraction_bits, const std::array<int, 3>& voxel);

} // namespace oracle
