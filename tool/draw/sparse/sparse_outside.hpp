// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The colours that the sides of the grid see, in bricks: what columns_of does for dense volumes, and values of a part
// of the voxels.

#include "draw/outside.hpp"
#include "model/sparse_volume.hpp"

namespace voxelize {

// Adds voxels of V to those columns of a box that are there (one list of `to.along` may be empty). Those in layers
// outside of the box are passed over; no voxel lies outside of it along x or y. V has no tiles.
void add_columns(const sparse_volume& v, column_table& to);

// Gives voxels of V the values that they have in a part of them. TO is a channel of V, FROM one of the part with values
// of the same size.
void put_values(const sparse_volume& part, const channel& from, const sparse_volume& v, channel& to);

} // namespace voxelize
