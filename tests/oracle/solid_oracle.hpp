// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of solids: the winding number of a voxel's centre by a ray in any direction, triangle by triangle, from
// signed volumes. The library sweeps rows and compares plane depths; nothing here does. Shares nothing with voxelpipe/.

#include "oracle.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace oracle {

// A mesh and a direction d. The centre of each voxel is moved by (e, e^2, e^3), e infinitely small: e along axis
// order[0], e^2 along order[1], e^3 along order[2]. Triangles that were dropped are left out.
class winding_oracle {
public:
    winding_oracle(int fraction_bits, const std::vector<snapped_triangle>& mesh, const std::array<int, 3>& direction,
                   const std::array<int, 3>& order = {0, 1, 2});

    // The triangles that the ray from the moved centre along d leaves through their fronts, minus those that it enters
    // by their fronts. For a closed mesh that is the winding number, whatever the direction.
    std::int64_t winding(const voxel& at) const;

private:
    // A linear function of the position, and what its sign is where it is 0.
    struct plane {
        wide c[3], constant;
        int tie;
        bool narrow; // all fits in 128 bits
        int128 c128[3], constant128;
        int sign(const std::int64_t (&p)[3]) const;
    };
    struct piece {
        plane edge[3], face;
        int front; // sign of n . d
    };
    plane make_plane(const std::array<wide, 3>& c, const wide& constant) const;

    int fraction_bits_;
    std::array<int, 3> order_;
    std::vector<piece> pieces_;
};

// The generalized winding number of a voxel's centre: the solid angles of the given triangles over 4 pi, in long double
// by libm. No cones, no rows: it holds for open meshes as for closed ones.
struct generalized_winding {
    long double number;
    long double doubt;  // what roundings may have done to it
    bool is_on_surface; // the centre lies on a triangle, and the number is not defined
};
// voxel_size: only ratios matter.
generalized_winding find_generalized_winding(int fraction_bits, const std::vector<snapped_triangle>& mesh,
                                             const std::array<double, 3>& voxel_size, const voxel& at);

} // namespace oracle
