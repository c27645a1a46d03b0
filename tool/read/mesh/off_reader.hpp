// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// OFF, text or binary (the big end first), with the prefixes ST, C, N and 4 in any order; nOFF where it has three
// dimensions. Colours of vertices and faces are integers to 255 or fractions; one number alone, which names a place in
// a map that the file does not have, is passed over with a warning. Normals and texture coordinates are passed over.

#include "mesh_reader.hpp"

#include <filesystem>
#include <memory>

namespace voxelize {

// Reads the whole file once, to count it. Throws model_error where the file is no OFF.
[[nodiscard]] std::unique_ptr<mesh_reader> open_off(const std::filesystem::path& path, const gltf_options& options);

} // namespace voxelize
