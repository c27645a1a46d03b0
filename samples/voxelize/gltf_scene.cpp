// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "gltf_scene.hpp"

#include "gltf/accessor.hpp"
#include "gltf/animation.hpp"
#include "gltf/budget.hpp"
#include "gltf/check.hpp"
#include "gltf/container.hpp"
#include "gltf/mapped_file.hpp"
#include "gltf/materials.hpp"
#include "gltf/nodes.hpp"
#include "gltf/pose.hpp"
#include "gltf/primitives.hpp"
#include "gltf/resources.hpp"
#include "gltf/text.hpp"

#include <tiny_gltf.h>

#include <functional>
#include <new>
#include <utility>

namespace voxelize {

namespace {

tinygltf::Model parse(const gltf::checked_document& document) {
    tinygltf::Model model;
    tinygltf::TinyGLTF parser;
    std::string error;
    std::string warning;
    if (!parser.LoadASCIIFromString(&model, &error, &warning, document.json.data(),
                                    static_cast<unsigned int>(document.json.size()), ""))
        throw gltf_error("tinygltf: " + gltf::printable(error.substr(0, error.find('\n')), 200));
    return model;
}

void load(scene& result, std::span<const std::byte> bytes, const gltf_file_reader& read_file, const gltf_limits& limits,
          const gltf_options& options, const load_hooks& hooks) {
    gltf::leniency tolerance{options.lenient, result.warnings};
    gltf::budget memory{limits};
    memory.grant_input(bytes.size());
    const gltf::container parts = gltf::split_container(bytes, tolerance);
    const gltf::checked_document document =
        gltf::check_document(parts.json, parts.has_binary, memory, tolerance, options);
    const gltf::resources resources{document, parts.binary, parts.has_binary, read_file, memory, tolerance};
    tinygltf::Model model = parse(document);
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
    if (hooks.geometry) hooks.geometry(result);
    materials.read_textures(hooks);
    primitives.finish();
    tolerance.finish();
}

bool same_transform(const affine& a, const affine& b) {
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 4; ++column)
            if (a.m[row][column] != b.m[row][column]) return false;
    return true;
}

// Parts of a file that is mapped to `bytes`.
std::optional<gltf_parts> parts_in(std::span<const std::byte> bytes, const gltf_limits& limits,
                                   const gltf_options& options) {
    scene aside;
    gltf::leniency tolerance{options.lenient, aside.warnings};
    gltf::budget memory{limits};
    memory.grant_input(bytes.size());
    const gltf::container whole = gltf::split_container(bytes, tolerance);
    if (!whole.has_binary || options.animation) return std::nullopt;
    const gltf::checked_document document =
        gltf::check_document(whole.json, whole.has_binary, memory, tolerance, options);
    if (!document.draco_primitives.empty()) return std::nullopt;
    if (document.buffers.size() != 1 || document.buffers[0].uri) return std::nullopt;
    const tinygltf::Model model = parse(document);
    const gltf_file_reader no_files;
    const gltf::resources resources{document, whole.binary, whole.has_binary, no_files, memory, tolerance};
    const gltf::accessor_reader accessors{model, document, resources, memory};
    gltf::material_reader materials{model, accessors, resources, options, aside};
    materials.read_factors();
    for (const material& m : aside.materials)
        if (m.alpha != alpha_mode::opaque) return std::nullopt;
    const gltf::shown_scene shown_scene = gltf::shown_meshes(model, accessors, tolerance);
    const gltf::pose_reader poses{model, accessors, shown_scene.node_to_world, memory};
    // Where an accessor's elements begin in the file.
    const auto place = [&](std::size_t index, std::size_t& stride) -> std::optional<std::uint64_t> {
        if (const auto& view = model.accessors[index].bufferView;
            view >= 0 && static_cast<std::size_t>(view) < document.meshopt_views.size() &&
            document.meshopt_views[static_cast<std::size_t>(view)])
            return std::nullopt;
        const auto elements = accessors.in_place(index);
        if (!elements || std::less<>{}(elements->first, bytes.data()) ||
            !std::less<>{}(elements->first, bytes.data() + bytes.size()))
            return std::nullopt;
        stride = elements->stride;
        return static_cast<std::uint64_t>(elements->first - bytes.data());
    };
    gltf_parts found;
    for (const gltf::shown_mesh& shown : shown_scene.meshes)
        for (const tinygltf::Primitive& source : model.meshes[shown.mesh].primitives) {
            const auto position = source.attributes.find("POSITION");
            if (position == source.attributes.end() || source.mode != TINYGLTF_MODE_TRIANGLES ||
                poses.is_posed(shown, source) || !shown.to_world.is_finite())
                return std::nullopt;
            const auto at = static_cast<std::size_t>(position->second);
            const tinygltf::Accessor& vertices = model.accessors[at];
            if (vertices.type != TINYGLTF_TYPE_VEC3 || vertices.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
                return std::nullopt;
            gltf_parts::part part;
            part.vertices.count = vertices.count;
            for (std::size_t a = 0; a < 3; ++a) part.vertices.place[a] = a * sizeof(float);
            const auto first = place(at, part.vertices.stride);
            if (!first) return std::nullopt;
            part.vertices.first = *first;
            part.num_triangles = vertices.count / 3;
            if (source.indices >= 0) {
                const tinygltf::Accessor& indices = model.accessors[static_cast<std::size_t>(source.indices)];
                const auto first_index = place(static_cast<std::size_t>(source.indices), part.index_bytes);
                if (!first_index) return std::nullopt;
                part.first_index = *first_index;
                part.num_triangles = indices.count / 3;
                if (part.index_bytes != static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(
                                            static_cast<std::uint32_t>(indices.componentType))))
                    return std::nullopt;
            }
            if (part.num_triangles == 0) continue;
            if (found.parts.empty()) found.to_world = shown.to_world;
            if (!same_transform(found.to_world, shown.to_world)) return std::nullopt;
            found.parts.push_back(part);
        }
    tolerance.finish();
    found.warnings = std::move(aside.warnings);
    return found;
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

std::optional<gltf_parts> find_parts(const std::filesystem::path& file, const gltf_limits& limits,
                                     const gltf_options& options) {
    const gltf::mapped_file mapped(file, UINT64_MAX);
    try {
        return parts_in(mapped.bytes(), limits, options);
    } catch (const gltf_error&) { // also for files that this way asks more of than the loader: its words are better
        return std::nullopt;
    }
}

} // namespace voxelize
