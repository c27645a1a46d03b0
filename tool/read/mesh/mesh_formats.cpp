// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "mesh_formats.hpp"

#include "off_reader.hpp"
#include "ply_reader.hpp"
#include "read/assimp/file_name.hpp"
#include "read/obj/reader.hpp"
#include "stl_reader.hpp"

#include <array>
#include <string_view>
#include <utility>

namespace voxelize {
namespace {

using opener = std::unique_ptr<mesh_reader> (*)(const std::filesystem::path&, const gltf_options&);
constexpr std::array<std::pair<std::string_view, opener>, 4> openers{
    {{".obj", open_obj}, {".off", open_off}, {".ply", open_ply}, {".stl", open_stl}}};

opener opener_of(const std::string& extension) {
    for (const auto& [name, open] : openers)
        if (name == extension) return open;
    return nullptr;
}

} // namespace

bool is_mesh_format(const std::string& extension) { return opener_of(extension) != nullptr; }

std::unique_ptr<mesh_reader> open_mesh(const std::filesystem::path& file, const gltf_options& options) {
    return opener_of(assimp::lower_extension(file))(file, options);
}

} // namespace voxelize
