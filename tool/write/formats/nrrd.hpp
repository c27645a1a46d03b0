// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// NRRD (teem's "nearly raw raster data"), version 4 for its orientation fields: one channel a file, raw or gzip
// encoding, x fastest, components as a first axis. Bits as uint8, half floats as float (NRRD has none). The space
// origin is the centre of voxel (0,0,0), the space directions are the steps from voxel to voxel.

#include "formats.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_nrrd(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

} // namespace voxelize
