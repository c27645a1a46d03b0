// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// obj_file.hpp in a build without assimp.
#include "obj_file.hpp"

namespace voxelize {

opened_stream open_obj(const std::filesystem::path&, std::uint64_t, const std::filesystem::path&, const gltf_options&) {
    return {};
}

} // namespace voxelize
