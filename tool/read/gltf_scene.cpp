// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "gltf_scene.hpp"

#include "read/gltf/accessor.hpp"
#include "read/gltf/animation.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/check.hpp"
#include "read/gltf/container.hpp"
#include "read/gltf/materials.hpp"
#include "read/gltf/nodes.hpp"
#include "read/gltf/parse.hpp"
#include "read/gltf/pose.hpp"
#include "read/gltf/primitives.hpp"
#include "read/gltf/resources.hpp"
#include "read/gltf/text.hpp"

#include <tiny_gltf.h>

#include <functional>
#include <memory>
#include <new>
#include <utility>

namespace voxelize {

namespace {

void load(scene& result, std::span<const std::byte> bytes, const gltf_file_reader& read_file, const gltf_limits& limits,
          const gltf_options& options, const load_hooks& hooks) {
    gltf::leniency tolerance{options.lenient, result.warnings};
    gltf::budget memory{limits};
    memory.grant_input(bytes.size());
    const gltf::container parts = gltf::split_container(bytes, tolerance);
    const gltf::checked_document document =
        gltf::check_document(parts.json, parts.has_binary, memory, tolerance, options);
    gltf::name_files(document, options);
    const gltf::resources resources{document, parts.binary, parts.has_binary, read_file, memory, tolerance};
    tinygltf::Model model = gltf::parse(document);
    const gltf::accessor_reader accessors{model, document, resources, memory};
    gltf::material_reader materials{model, accessors, resources, options, result};
    materials.read_factors();
    if (options.animation) gltf::apply_animation(model, accessors, options.seconds, result.warnings);
    const gltf::shown_scene shown_scene = gltf::shown_meshes(model, accessors, tolerance);
    const gltf::pose_reader poses{model, accessors, shown_scene.node_to_world, memory};
    gltf::primitive_reader primitives{model, accessors, materials, poses, memory, result, options.threads};
    for (const gltf::shown_mesh& shown : shown_scene.meshes)
        for (std::size_t part = 0; part < model.meshes[shown.mesh].primitives.size(); ++part)
            primitives.show(shown, part);
    tolerance.finish();
    primitives.finish();
    if (hooks.geometry) hooks.geometry(result);
    materials.read_textures(hooks);
}

} // namespace

scene load_gltf(std::span<const std::byte> bytes, const gltf_file_reader& read_file, const gltf_limits& limits,
                const gltf_options& options, const load_hooks& hooks) {
    scene result;
    const auto fail = [&](gltf_error error) {
        error.warnings = std::move(result.warnings);
        throw error;
    };
    try {
        load(result, bytes, read_file, limits, options, hooks);
    } catch (const gltf_error& error) {
        fail(error);
    } catch (const std::bad_alloc&) { // an honest file that does not fit
        throw;
    } catch (const std::exception& error) { // nothing of the libraries underneath gets past
        fail(gltf_error(gltf::printable(error.what(), 200)));
    }
    return result;
}

scene load_gltf(const std::filesystem::path& file, const gltf_limits& limits, const gltf_options& options,
                const load_hooks& hooks) {
    const gltf::mapped_file mapped(file, limits.max_file_bytes);
    return load_gltf(mapped.bytes(), gltf::folder_reader(file.parent_path()), limits, options, hooks);
}

} // namespace voxelize
