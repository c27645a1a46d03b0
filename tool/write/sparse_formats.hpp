// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Writers of sparse volumes. .nvdb holds a grid for each channel (occupancy as a mask); .vdb see vdb.hpp. .npz holds
// coords, (n, 3) int32 with columns x, y and z, in the Morton order of the voxels, and an array for each channel but
// the occupancy; .npy holds the coords, and each channel in a file of its own beside it. Without write_options::lists
// both hold the dense grid. .png is drawn from the bricks. .vti, .pvti, .nrrd, .nii, .nii.gz, .zarr and these read the
// bricks as if they were dense, piece by piece; formats of shapes (voxel_shape.hpp) read the bricks themselves. No
// output makes a dense volume.

#include "model/sparse_volume.hpp"
#include "write/formats/formats.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

// True of a channel whose grid states the class of fog, in .vdb and .nvdb: how much of each voxel is inside.
[[nodiscard]] inline bool is_fog(const channel& c) {
    return c.name == "fraction" && c.type == scalar::f32 && c.components == 1;
}

// Formats that hold occupied voxels alone.
[[nodiscard]] bool is_sparse_format(const std::filesystem::path& path);
// As write() of formats.hpp, for a sparse volume.
std::vector<std::filesystem::path> write_sparse(const sparse_volume& v, const std::filesystem::path& path,
                                                const write_options& options);

#ifdef VOXELIZE_HAS_OPENVDB
// The occupied voxels of a dense volume as .vdb; of a distance field the band, as a level set where it is one
// (level_set.hpp).
std::vector<std::filesystem::path> write_vdb(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);
#endif
// The same as .nvdb.
std::vector<std::filesystem::path> write_nvdb(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

// True for formats whose writers take the channels piece by piece, so that no dense one is ever there.
[[nodiscard]] bool is_streamed(const std::string& extension);

} // namespace voxelize
