// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reads triangle meshes: .vpm (plain) directly, .vpz (packed) through the vpmesh.py that lies beside it, which needs a
// Python with numpy; the unpacked file is kept in a cache folder. CMake looks for both (VOXELPIPE_SCENE_PYTHON and
// VOXELPIPE_SCENE_CACHE); the folder of the scenes is VOXELPIPE_SCENES_DIR.

#include "mesh_data.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

namespace bench {

// The benchmark scenes, in the order of the published tables.
inline constexpr std::array<std::string_view, 5> scene_names{"conference", "dragon", "blade", "hairball",
                                                             "asiandragon"};

// 'VPMESH1\0', uint32 number of vertices, uint32 number of triangles, float32 positions, uint32 indices, little-endian.
// Throws std::runtime_error with the file's name where it cannot be read, is cut short or too long, or an index is out
// of range.
mesh_data read_vpm(const std::filesystem::path& file);

// True if load_scene(folder, name) can work: NAME.vpm is there, or NAME.vpz and a Python with numpy. If not, `why`
// says why in half a line.
bool has_scene(const std::filesystem::path& folder, std::string_view name, std::string& why);

// NAME.vpm of the cache or of `folder`, or NAME.vpz of `folder`, unpacked into the cache. Throws std::runtime_error
// where there is no such scene, and as read_vpm does. Several processes may call it at once.
mesh_data load_scene(const std::filesystem::path& folder, std::string_view name);

// A .vpm, or a .vpz through the cache.
mesh_data read_mesh(const std::filesystem::path& file);

} // namespace bench
