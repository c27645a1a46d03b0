// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse volumes as .vdb, by OpenVDB; only in builds that have it. A grid for each channel: the occupancy as a mask,
// counts as 32-bit integers (64 bits where one needs them), colours as vectors of linear light with their alpha as a
// grid NAME.alpha where any is not 1, fractions as fog, everything else as it is. Voxel centres lie at integer
// coordinates, as OpenVDB has them. The same volume gives the same bytes.

#include "model/sparse_volume.hpp"
#include "write/formats/formats.hpp"
#include "write/level_set.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

// Throws write_error.
std::vector<std::filesystem::path> write_vdb(const sparse_volume& v, const std::filesystem::path& path,
                                             const write_options& options);

// The band of a distance field, its distances as a level set where they are one; other channels as above.
std::vector<std::filesystem::path> write_vdb(const band_bricks& field, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
