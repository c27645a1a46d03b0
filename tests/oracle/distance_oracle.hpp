// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of distances: the square of a point's distance from a closed triangle as an exact fraction, by all that
// could be nearest: vertices, edges whose foot lies on them, the face if the foot lies in it; the least counts. Lengths
// along an axis are integers times a power of two, as doubles are. Shares nothing with voxelpipe/.

#include "wide_int.hpp"

#include <array>
#include <cstdint>

namespace oracle {

using distance_int = wide_int<28>; // 1792 bits
using lattice_point = std::array<std::int64_t, 3>;
using lattice_triangle = std::array<lattice_point, 3>;

// numerator / denominator, in squares of the oracle's unit.
struct exact_square {
    distance_int numerator, denominator;
};
// True if a < b.
bool is_less(const exact_square& a, const exact_square& b);

class distance_oracle {
public:
    // voxel_size / 2^fraction_bits is the length of a step of the lattice. Sizes may differ by 2^10.
    distance_oracle(const std::array<double, 3>& voxel_size, int fraction_bits);

    [[nodiscard]] exact_square square(const lattice_triangle& t, const lattice_point& p) const;
    // True if no other float is nearer to the root, in world units. Both neighbours of a tie are nearest.
    [[nodiscard]] bool is_nearest_float(const exact_square& square, float root) const;
    // |a - b| <= b 2^-bits, for a double a that is a square in world units.
    [[nodiscard]] bool is_close(double a, const exact_square& b, int bits) const;

private:
    std::array<distance_int, 3> length_; // in units of 2^exponent_
    int exponent_ = 0;
    // Compares mantissa * 2^exponent with the square, all in world units: -1, 0 or 1.
    [[nodiscard]] int compare(const distance_int& mantissa, int exponent, const exact_square& square) const;
};

} // namespace oracle
