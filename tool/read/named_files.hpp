// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files that a model's file names, which make the model together with it.

#include <filesystem>
#include <vector>

namespace voxelize {

// Buffers and pictures of a glTF file; the material libraries of an OBJ file, and the pictures that these name. In the
// order of the file, whether or not they are there; of a name with options, all that it may mean and that is there.
// Nothing for other formats, and for files that cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> named_files(const std::filesystem::path& model);

// Returns the pictures that a material library (.mtl) names and that exist. The model lies in `folder`.
[[nodiscard]] std::vector<std::filesystem::path> named_pictures(const std::filesystem::path& library,
                                                                const std::filesystem::path& folder);

} // namespace voxelize
