// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "model_file.hpp"

#include "assimp_scene.hpp"
#include "model/memory.hpp"
#include "read/assimp/file_name.hpp"
#include "read/mesh/mesh_formats.hpp"
#include "read/mesh/mesh_scene.hpp"

#include <algorithm>

namespace voxelize {

namespace {

void scale_lengths(scene& model, double scale) {
    if (scale == 1) return;
    for (instance& shown : model.instances) {
        shown.to_world = affine::scaling(scale).after(shown.to_world);
        if (!shown.to_world.is_finite()) throw model_error("--scale is too large for the model");
    }
}

} // namespace

void require_no_gltf_options(const gltf_options& options) {
    if (options.animation) throw model_error("--animation is for glTF models");
    if (options.variant) throw model_error("--variant is for glTF models");
}

scene load_model(const std::filesystem::path& file, const load_options& options) {
    const load_hooks hooks{[&](scene& model) { scale_lengths(model, options.scale); }, options.picture_hook};
    const std::string extension = assimp::lower_extension(file);
    const bool is_mesh = is_mesh_format(extension);
    if (!is_mesh && !is_for_assimp(extension)) return load_gltf(file, options.limits, options.gltf, hooks);
    require_no_gltf_options(options.gltf);
    if (is_mesh) return scene_of(*open_mesh(file, options.gltf), file, options.limits, options.gltf, hooks);
    gltf_limits limits = options.limits;
    limits.room = std::min(limits.room, memory::room());
    return load_by_assimp(file, limits, options.gltf, hooks);
}

} // namespace voxelize
