// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// assimp_scene.hpp in a build without assimp.
#include "assimp_scene.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace voxelize {

bool is_for_assimp(const std::string& extension) {
    constexpr std::array<std::string_view, 12> known{".fbx", ".dae", ".3ds",   ".3mf", ".x3d", ".wrl",
                                                     ".dxf", ".lwo", ".blend", ".amf", ".ase", ".x"};
    return std::find(known.begin(), known.end(), extension) != known.end();
}

scene load_by_assimp(const std::filesystem::path&, const gltf_limits&, const gltf_options&, const load_hooks&) {
    throw model_error(
        "this build reads glTF, OBJ, OFF, PLY and STL only, since it has no assimp: convert the file (`assimp "
        "export IN OUT.glb`, "
        "or Blender), or install libassimp-dev and build again");
}

scene load_by_assimp(std::span<const std::byte>, const std::string& name, const gltf_file_reader&,
                     const gltf_limits& limits, const gltf_options& options, const load_hooks& hooks) {
    return load_by_assimp(std::filesystem::path(name), limits, options, hooks);
}

} // namespace voxelize
