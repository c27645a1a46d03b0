// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What assimp reads, but for formats with readers of their own (mesh/) -> scene. The import runs in a
// process of its own, with bounds on time and memory that grow with the file: a malformed or hostile file gives a
// model_error of one line.
//
// Positions are in the file's own units and axes: nothing is rescaled or turned, but where a format states its unit or
// upright axis and assimp follows that (Collada), which is a warning. Colours of materials and vertices are taken as
// sRGB, what a screen shows; a surface without either is white. A texture is looked for beside the model or below its
// folder, by its last name where its path leads elsewhere; one that cannot be had is a warning. Meshes with bones stand
// as they were bound. The vertices of a mesh without faces are points.

#include "gltf_scene.hpp"
#include "model/scene.hpp"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace voxelize {

// True if files with this extension (".stl", lower case) are for load_by_assimp. In a build without assimp: those that
// assimp is best known for.
[[nodiscard]] bool is_for_assimp(const std::string& extension);

// Loads FILE. Of the options colors and blend_cuts count. Throws model_error, in a build without assimp always, with
// what to do instead; and std::bad_alloc where an honest file does not fit into memory.
[[nodiscard]] scene load_by_assimp(const std::filesystem::path& file, const gltf_limits& limits = {},
                                   const gltf_options& options = {}, const load_hooks& hooks = {});

// The same from memory; NAME is the file's, its extension says the format. Without a reader other files are not read.
[[nodiscard]] scene load_by_assimp(std::span<const std::byte> bytes, const std::string& name,
                                   const gltf_file_reader& read_file = {}, const gltf_limits& limits = {},
                                   const gltf_options& options = {}, const load_hooks& hooks = {});

} // namespace voxelize
