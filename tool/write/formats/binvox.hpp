// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Patrick Min's .binvox, version 1: the occupancy as runs of equal voxels, y fastest, then z, then x. The format wants
// a cube with one voxel size: a grid that is no cube gets empty voxels at its high sides, a grid whose voxel sizes
// differ from axis to axis is refused. translate is the grid's origin, scale the side of the cube, both in world units.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_binvox(const voxel_shape& v, const std::filesystem::path& path,
                                                const write_options& options);

} // namespace voxelize
