// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A model whose triangles do not fit into the run's memory: they go from the file to the slabs that they reach, through
// temporary files, and one slab at a time is drawn into bricks by sparse_pipeline.hpp. The voxels and values are those
// of a run that holds the model.

#include "../command_line.hpp"
#include "../stl_file.hpp"
#include "../voxelizer.hpp"
#include "sparse_volume.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace voxelize {

// The command's input as a stream, where it has to be one: a binary STL file that takes more memory than there is, for
// targets that need no colours, on the CPU. None: the model is loaded.
[[nodiscard]] std::optional<stl_file> streamed_input(const command_line& options);

// scale: of all lengths. folder: for temporary files. say: is told once in how many slabs the model is drawn. Throws as
// run_voxelizer does, model_error for a file that ends early, and write_error for a folder that is full.
[[nodiscard]] sparse_volume run_streamed_voxelizer(stl_file& model, double scale, const voxelize_request& request,
                                                   const std::filesystem::path& folder, voxelize_stats& stats,
                                                   const std::function<void(const std::string&)>& say);

} // namespace voxelize
