// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model's file, of whatever format -> scene. STL, PLY and OFF by readers of our own, glTF where the name ends in
// .gltf, .glb or nothing that is known, the rest by assimp.

#include "gltf_scene.hpp"
#include "model/scene.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace voxelize {

struct load_options {
    gltf_limits limits;
    gltf_options gltf;
    double scale = 1; // multiplies all lengths, about the origin; finite and positive
    // Called with each picture as it is decoded; see load_hooks.
    std::function<void(const scene&, picture&, const std::vector<std::uint32_t>& materials)> picture_hook;
};

// For files of other formats: throws model_error if an option is for glTF alone.
void require_no_gltf_options(const gltf_options& options);

// Throws model_error, and std::bad_alloc where an honest file does not fit into memory.
[[nodiscard]] scene load_model(const std::filesystem::path& file, const load_options& options = {});

} // namespace voxelize
