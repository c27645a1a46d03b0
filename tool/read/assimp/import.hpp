// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// assimp's scene -> ours. This runs in a process of its own: assimp is not made for hostile files.

#include "wire.hpp"

#include "read/gltf_scene.hpp"

#include <cstddef>
#include <span>
#include <string>

namespace voxelize::assimp {

// True if assimp has an importer for files with this extension (".obj", lower case).
[[nodiscard]] bool reads(const std::string& extension);

// The model in BYTES, the content of the file NAME (without a folder; its extension chooses the importer). READ_FILE
// gives the files that it names (materials), relative to it. Throws std::exception, and whatever else a broken file
// makes of assimp: crash, endless loop, exhausted memory.
[[nodiscard]] model read_model(std::span<const std::byte> bytes, const std::string& name,
                               const gltf_file_reader& read_file);

} // namespace voxelize::assimp
