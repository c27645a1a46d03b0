// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "model_file.hpp"

namespace voxelize {

scene load_model(const std::filesystem::path& file, const load_options& options) {
    return load_gltf(file, options.limits, options.gltf);
}

} // namespace voxelize
