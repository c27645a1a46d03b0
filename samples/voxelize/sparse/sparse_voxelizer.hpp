// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// scene + options -> sparse volume, on the CPU: the values that run_voxelizer gives, of the voxels that exist.

#include "../voxelizer.hpp"
#include "sparse_volume.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <filesystem>
#include <span>
#include <string>

namespace voxelize {

// The user's choice between bricks and a dense grid.
enum class storage_choice : std::uint8_t { automatic, sparse, dense };

struct storage_decision {
    bool sparse = false;
    std::string reason; // half a line, if the choice was automatic and fell on bricks
};

// Bricks where an output has no dense form, or where a dense grid does not fit the run's memory. Throws backend_error
// where --sparse cannot be had.
[[nodiscard]] storage_decision choose_storage(storage_choice choice, const voxelize_request& request,
                                              std::span<const std::filesystem::path> outputs);

// Draws the part `inside` of a grid; the volume has the shape of the whole. Consumes the scene. Throws std::bad_alloc.
[[nodiscard]] sparse_volume draw_sparse(scene& model, const voxelize_request& inside, const voxelpipe::grid& whole,
                                        voxelize_stats& stats);

// The walls of a flood of --solid exterior: all voxels that triangles touch in layers of the request's grid, whatever
// materials cut off. Consumes the scene. Throws std::bad_alloc.
[[nodiscard]] sparse_volume draw_walls(scene&& model, const voxelize_request& request,
                                       const voxelpipe::slabs::layer_range& layers);

// Consumes the scene. A flood or a vote whose bits do not fit into the run's memory is drawn in slabs. folder: for
// temporary files. Throws as run_voxelizer does, and write_error for a folder that is full.
[[nodiscard]] sparse_volume run_sparse_voxelizer(scene&& model, const voxelize_request& request,
                                                 const std::filesystem::path& folder, voxelize_stats& stats);

} // namespace voxelize
