// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Minecraft's .schem: the Sponge schematic, version 2, which WorldEdit and most editors load (a compressed NBT tree). A
// voxel is a block. Minecraft is y up, like glTF: with write_options::up == y voxel (i,j,k) stands at (i,j,k), with up
// == z at (i, k, ny-1-j). The format knows neither origin nor voxel size; a grid whose voxel sizes differ from axis to
// axis is refused, and so is one of more than 32767 voxels along an axis or 2^31 - 1 in all.
//
// Colours come from find_colors() (alpha unused): each becomes the concrete, wool or terracotta whose texture has the
// nearest mean, by squared distance in sRGB; without colours, all voxels are the block nearest to clay.

#include "formats.hpp"
#include "voxel_shape.hpp"
#include "write/preview.hpp"

#include <span>
#include <string_view>

namespace voxelize {

struct block_color {
    std::string_view name; // without "minecraft:"
    rgb8 color;            // mean of its texture
};

// The blocks that voxels become; in a file, block n has the number n + 1, and air is 0.
[[nodiscard]] std::span<const block_color> schem_blocks();

std::vector<std::filesystem::path> write_schem(const voxel_shape& v, const std::filesystem::path& path,
                                               const write_options& options);

} // namespace voxelize
