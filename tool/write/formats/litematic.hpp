// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Litematica's .litematic, version 5 of it, which that mod and its readers load: one region of the voxels, each a block
// as in .schem (schem.hpp), with the same axes. The numbers of the blocks lie bit by bit in an array of 64-bit
// integers, across their borders. It has neither time nor author, so that the same voxels give the same bytes. The
// format ends at 2^31 - 1 blocks.

#include "formats.hpp"
#include "voxel_shape.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

std::vector<std::filesystem::path> write_litematic(const voxel_shape& v, const std::filesystem::path& path,
                                                   const write_options& options);

} // namespace voxelize
