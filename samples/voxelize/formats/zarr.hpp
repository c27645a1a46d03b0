// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Zarr, version 3: a folder that is a group, with an array for each channel, named after it, in the order (z, y, x[,
// c]). An array's chunks of 64^3 voxels lie together in files of up to 256^3 (shards, whose index has a CRC-32C).
// Chunks without a drawn voxel take no bytes, and files without such a chunk do not exist.

#include "formats.hpp"

namespace voxelize {

// The folder appears whole or not at all; one that is there is replaced if it is a Zarr group.
std::vector<std::filesystem::path> write_zarr(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

} // namespace voxelize
