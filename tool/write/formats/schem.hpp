// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Minecraft's .schem: the Sponge schematic, version 2, which WorldEdit and most editors load (a compressed NBT tree). A
// voxel is a block. Minecraft is y up, like glTF: with write_options::up == y voxel (i,j,k) stands at (i,j,k), with up
// == z at (i, k, ny-1-j). The format knows neither origin nor voxel size; a grid whose voxel sizes differ from axis to
// axis is refused, and so is one of more than 32767 voxels along an axis or 2^31 - 1 in all.
//
// Voxels become blocks as write_options::blocks says, or default_blocks() (blocks.hpp): by their material, or by their
// colour, which is that of find_colors() (alpha unused); without colours, all voxels are the block nearest to clay.

#include "formats.hpp"
#include "voxel_shape.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

std::vector<std::filesystem::path> write_schem(const voxel_shape& v, const std::filesystem::path& path,
                                               const write_options& options);

} // namespace voxelize
