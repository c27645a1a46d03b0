// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// PLY, as text or binary in both byte orders: its elements vertex, face and tristrips in any order, with properties of
// any types; all others are passed over.

#include "mesh_reader.hpp"

#include <filesystem>
#include <memory>

namespace voxelize {

// Throws model_error where the file is no PLY.
[[nodiscard]] std::unique_ptr<mesh_reader> open_ply(const std::filesystem::path& path, const gltf_options& options);

} // namespace voxelize
