// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Textures that the materials of assimp's model name -> textures and pictures of the scene.

#include "wire.hpp"

#include "model/scene.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf_scene.hpp"

#include <vector>

namespace voxelize::assimp {

// True if SOURCE names a texture that the options ask for: of a colour, or of an alpha that cuts fragments off.
[[nodiscard]] bool asks_for_texture(const material& shown, const texture_source& source, const gltf_options& options);

// Calls options.names_file with the files that the process of assimp has read, and with those that textures may lie in.
void name_files(const model& source, const gltf_options& options);

// Decodes the textures of the materials with ASKED_FOR, one at a time, and sets the materials' numbers of them.
// RESULT has the materials of SOURCE, of which textures and embedded pictures are read; READ_FILE gives those in files.
// One that cannot be had is a warning. Throws picture_memory_error where one does not fit.
void load_pictures(const model& source, const std::vector<bool>& asked_for, const gltf_file_reader& read_file,
                   gltf::budget& memory, scene& result, const load_hooks& hooks);

} // namespace voxelize::assimp
