// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "model_file.hpp"

#include "assimp/file_name.hpp"
#include "assimp_scene.hpp"
#include "memory.hpp"

#include <algorithm>

namespace voxelize {

namespace {

scene load(const std::filesystem::path& file, const load_options& options) {
    const std::string extension = assimp::lower_extension(file);
    if (!is_for_assimp(extension)) return load_gltf(file, options.limits, options.gltf);
    if (options.gltf.animation) throw model_error("--animation is for glTF models");
    gltf_limits limits = options.limits;
    limits.room = std::min(limits.room, memory::room());
    return load_by_assimp(file, limits);
}

} // namespace

scene load_model(const std::filesystem::path& file, const load_options& options) {
    scene result = load(file, options);
    if (options.scale != 1)
        for (instance& shown : result.instances) {
            shown.to_world = affine::scaling(options.scale).after(shown.to_world);
            if (!shown.to_world.is_finite()) throw model_error("--scale is too large for the model");
        }
    return result;
}

} // namespace voxelize
