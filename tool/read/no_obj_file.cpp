// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// obj_file.hpp in a build without assimp.
#include "obj_file.hpp"

namespace voxelize {

opened_stream open_obj(const std::filesystem::path&, const stream_room&, const std::filesystem::path&,
                       const gltf_limits&, const gltf_options&) {
    return {};
}

} // namespace voxelize
