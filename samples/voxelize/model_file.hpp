// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model's file, of whatever format -> scene.

#include "gltf_scene.hpp"
#include "scene.hpp"

#include <filesystem>

namespace voxelize {

struct load_options {
    gltf_limits limits;
    gltf_options gltf;
};

// Throws model_error.
[[nodiscard]] scene load_model(const std::filesystem::path& file, const load_options& options = {});

} // namespace voxelize
