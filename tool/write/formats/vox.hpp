// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// MagicaVoxel's .vox. MagicaVoxel is z up; with write_options::up == y a voxel (i,j,k) of the volume therefore stands
// at (i, nz-1-k, j) of the file, a quarter turn about x, so that the model stands upright and is not mirrored. With up
// == z it stands at (i,j,k). The format knows neither origin nor voxel size; a grid whose voxel sizes differ from axis
// to axis is refused.
//
// A model is at most 256 voxels a side. What fits is one model in a version 150 file, which every reader knows. A
// larger grid becomes blocks of 256, each that is not empty a model, placed by a scene graph of transform, group and
// shape nodes in a version 200 file. The middle of the grid stands on the origin, its lowest layer on the ground.
// MagicaVoxel's scene has the coordinates -1000 to 999: write_options::warn hears of models beyond.
//
// Colours come from the "color" channel (u8, three or four components, alpha unused) through a palette of 255; without
// one, all voxels are clay.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_vox(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
