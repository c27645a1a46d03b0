// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The formats that have readers of their own, by the extension of a file's name.

#include "mesh_reader.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace voxelize {

// True if open_mesh() opens files with this extension (".ply", lower case).
[[nodiscard]] bool is_mesh_format(const std::string& extension);

// The reader of a file whose extension is_mesh_format() knows, whatever its case. Throws model_error.
[[nodiscard]] std::unique_ptr<mesh_reader> open_mesh(const std::filesystem::path& file, const gltf_options& options);

} // namespace voxelize
