// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes by name: a scene of the folder, a generated mesh, or a file; and for a scene that is absent the generated mesh
// of the same character.

#include "mesh_file.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace bench {

// "icosphere", "torus_knot", "torus_knot_fine", "hairball_generated", "room", "one_triangle", a scene's name, or a .vpm
// or .vpz file. Throws std::runtime_error where there is no such mesh.
[[nodiscard]] mesh_data find_mesh(const std::filesystem::path& folder, const std::string& name);

// The five scenes; where one is absent its stand-in, and a line in `notes` that says so and why.
[[nodiscard]] std::vector<std::string> available_scenes(const std::filesystem::path& folder,
                                                        std::vector<std::string>& notes);

} // namespace bench
