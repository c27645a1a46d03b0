// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of links: whether a triangle crosses the segment between two moved centres of voxels, by signed volumes of
// tetrahedra, which are polynomials in the offset e; and where, as an exact fraction. Shares nothing with voxelpipe/.

#include "distance_oracle.hpp"

#include <array>

namespace oracle {

using link_int = wide_int<8>; // 512 bits

struct link_hit {
    bool is_crossed;
    link_int numerator, denominator; // the part of the unmoved link before the crossing; the denominator is above 0
};

// Positions in units of 2^-fraction_bits voxel. Centres are moved by (e, e^2, e^3), e -> 0+; the link goes from that of
// `voxel` to that of voxel + direction.
link_hit cross_link(const lattice_triangle& t, int fraction_bits, const std::array<int, 3>& voxel,
                    const std::array<int, 3>& direction);

} // namespace oracle
