// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images as scanners make them, one channel a file, x fastest. Bits are bytes 0 and 1, half floats are floats, which is
// what both formats have. What places an image in the world is the centre of voxel (0,0,0) and the steps from voxel to
// voxel.
//
// NRRD (teem's "nearly raw raster data"), version 4 for its orientation fields: raw or gzip encoding, components as a
// first axis. Its space is that of the model, whose name write_options::space says.
//
// NIfTI-1 in a single file (.nii), or the same in gzip (.nii.gz): its affine leads to RAS coordinates, in single
// precision, as sform and as qform. Three or four bytes a voxel are RGB24 or RGBA32; of other components each is a
// volume of its own along the fifth dimension. The unit is left open, for it is the model's.

#include "formats.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_nrrd(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

// Throws write_error for more than 32767 voxels along an axis, which the format cannot number. Warns where its single
// precision moves a voxel by more than 2^-10 of its size. A compression of 0 is 1 in .nii.gz, and .nii has none.
std::vector<std::filesystem::path> write_nii(const volume& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
