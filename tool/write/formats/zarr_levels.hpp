// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Mip levels of a channel of a Zarr group, as OME-Zarr multiscales (OME-NGFF 0.5): array `0` is the channel, a voxel of
// array `n` covers 2^n of its voxels along each axis. Levels are made by the library's reducers from blocks of 128^3
// voxels, so memory does not grow with the grid.

#include "formats.hpp"

#include "model/volume.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace voxelize {

// Arrays below the first: as many as lead to 64 voxels along each axis, and 7 at most.
[[nodiscard]] int num_zarr_levels(const volume& v);

// Blocks of the grid, after each of which write_zarr_levels() calls advance.
[[nodiscard]] std::uint64_t num_level_blocks(const volume& v);

// Writes the arrays 1, 2, ... of the channel into folders of these names in `folder`, which exists. Throws write_error
// for a channel whose name is no target: how its values are reduced is not known.
void write_zarr_levels(const volume& v, const channel& c, const std::filesystem::path& folder,
                       const write_options& options, const std::function<void()>& advance);

// The same slab by slab: what the blocks between two layers make of all levels goes into a file, and the arrays are
// made of the files of all slabs, byte for byte. Slabs have slab_layers layers, a multiple of 128; `v` holds the values
// of its slab in the one, and its shape is enough in the other.
void write_slab_levels(const volume& v, const channel& c, const std::filesystem::path& file, std::int64_t first_layer,
                       std::int64_t last_layer, const write_options& options);
void join_slab_levels(const volume& v, const channel& c, const std::filesystem::path& folder, std::int64_t slab_layers,
                      const std::function<std::filesystem::path(std::int64_t slab)>& file,
                      const write_options& options);

// The description of the group that holds the arrays.
[[nodiscard]] std::string multiscale_description(const volume& v, const channel& c);

} // namespace voxelize
