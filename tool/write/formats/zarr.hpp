// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Zarr, version 3: a folder that is a group, with an array for each channel, named after it, in the order (z, y, x[,
// c]). An array's chunks of 64^3 voxels lie together in files of up to 256^3 (shards, whose index has a CRC-32C).
// Chunks without a drawn voxel take no bytes, and files without such a chunk do not exist.

#include "formats.hpp"

namespace voxelize {

// The folder appears whole or not at all; one that is there is replaced if it is a group that this tool wrote, which
// has the attribute "voxelpipe".
std::vector<std::filesystem::path> write_zarr(const volume& v, const std::filesystem::path& path,
                                              const write_options& options);

// The same group slab by slab, in any order and by any number of processes, into a folder that takes the target's place
// at the end. A slab is a layer of shards, of zarr_slab_layers voxels along z. With levels a slab's part of them lies
// in a file a channel in a folder of its own, until the group is made of all slabs.

inline constexpr std::int64_t zarr_slab_layers = 256;

// The folder that a path means: without a slash at its end, and where a link leads.
[[nodiscard]] std::filesystem::path zarr_target(const std::filesystem::path& path);
// Throws write_error for a target that is there and is no such group.
void check_zarr_target(const std::filesystem::path& target);
[[nodiscard]] written_names zarr_names(const volume& shape, const std::filesystem::path& path,
                                       const write_options& options, held_as held);
// Writes a slab of a volume. Each file appears whole or not at all.
void write_zarr_slab(const volume& v, const std::filesystem::path& folder, const std::filesystem::path& levels,
                     std::int64_t slab, const write_options& options);
// Makes a group of the folder, once all slabs are there. The volume has shape and channels, without values.
void finish_zarr_slabs(const volume& v, const std::filesystem::path& folder, const std::filesystem::path& levels,
                       const write_options& options);
// Renames the folder; a target that is there is replaced if it may be.
void replace_zarr(const std::filesystem::path& folder, const std::filesystem::path& target);

} // namespace voxelize
