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
#include <memory>
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

// The files of a model as memory: its own, and those in its folder that it names.
class mapped_model {
public:
    explicit mapped_model(const std::filesystem::path& file) : folder_(file.parent_path()) { add(file); }

    [[nodiscard]] std::span<const std::byte> bytes() const { return mapped_[0]->bytes(); }
    [[nodiscard]] const std::vector<std::filesystem::path>& files() const { return files_; }
    [[nodiscard]] gltf::file_mapper mapper() {
        return [this](const std::filesystem::path& relative) { return add(folder_ / relative); };
    }
    struct place {
        std::size_t file;
        std::uint64_t byte;
    };
    // Where an address lies; nowhere for bytes that no file holds as they stand.
    [[nodiscard]] std::optional<place> place_of(const std::byte* address) const {
        for (std::size_t f = 0; f < mapped_.size(); ++f) {
            const std::span<const std::byte> held = mapped_[f]->bytes();
            if (std::less<>{}(address, held.data()) || !std::less<>{}(address, held.data() + held.size())) continue;
            return place{f, static_cast<std::uint64_t>(address - held.data())};
        }
        return std::nullopt;
    }

private:
    std::span<const std::byte> add(const std::filesystem::path& file) {
        mapped_.push_back(std::make_unique<gltf::mapped_file>(file, UINT64_MAX));
        files_.push_back(file);
        return mapped_.back()->bytes();
    }

    std::filesystem::path folder_;
    std::vector<std::unique_ptr<gltf::mapped_file>> mapped_;
    std::vector<std::filesystem::path> files_;
};

// Primitives of a document as parts of a mapped model.
class part_finder {
public:
    part_finder(const mapped_model& files, const tinygltf::Model& model, const gltf::checked_document& document,
                const gltf::accessor_reader& accessors)
        : files_(files), model_(model), document_(document), accessors_(accessors) {}

    // All of it but its instance, and vertex colours only WITH_COLORS. Nothing for a primitive that cannot be read so.
    [[nodiscard]] std::optional<gltf_parts::part> find(const tinygltf::Primitive& source, bool with_colors) const {
        const auto position = source.attributes.find("POSITION");
        if (position == source.attributes.end() || source.mode != TINYGLTF_MODE_TRIANGLES) return std::nullopt;
        const tinygltf::Accessor& vertices = accessor(position->second);
        if (vertices.type != TINYGLTF_TYPE_VEC3 || vertices.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
            return std::nullopt;
        gltf_parts::part part;
        part.vertices.count = vertices.count;
        for (std::size_t a = 0; a < 3; ++a) part.vertices.place[a] = a * sizeof(float);
        if (!locate(position->second, part.vertex_file, part.vertices.first, part.vertices.stride)) return std::nullopt;
        if (with_colors && !find_colors(source, part)) return std::nullopt;
        part.num_triangles = vertices.count / 3;
        if (source.indices < 0) return part;
        const tinygltf::Accessor& indices = accessor(source.indices);
        part.num_triangles = indices.count / 3;
        if (!locate(source.indices, part.index_file, part.first_index, part.index_bytes) ||
            part.index_bytes != component_bytes(indices))
            return std::nullopt;
        return part;
    }

private:
    [[nodiscard]] const tinygltf::Accessor& accessor(int index) const {
        return model_.accessors[static_cast<std::size_t>(index)];
    }
    [[nodiscard]] static std::size_t component_bytes(const tinygltf::Accessor& a) {
        return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType)));
    }
    // Where an accessor's elements begin, and how far apart they are. False if they do not lie in a file.
    [[nodiscard]] bool locate(int index, std::size_t& file, std::uint64_t& first, std::size_t& stride) const {
        if (const auto view = static_cast<std::size_t>(accessor(index).bufferView);
            view < document_.meshopt_views.size() && document_.meshopt_views[view])
            return false;
        const auto elements = accessors_.in_place(static_cast<std::size_t>(index));
        const auto place = elements ? files_.place_of(elements->first) : std::nullopt;
        if (!place) return false;
        file = place->file;
        first = place->byte;
        stride = elements->stride;
        return true;
    }
    // False for colours that the loader reads in another way, or refuses.
    [[nodiscard]] bool find_colors(const tinygltf::Primitive& source, gltf_parts::part& part) const {
        const auto attribute = source.attributes.find("COLOR_0");
        if (attribute == source.attributes.end()) return true;
        const tinygltf::Accessor& values = accessor(attribute->second);
        color_layout& colors = part.colors.emplace();
        colors.count = values.count;
        colors.has_alpha = values.type == TINYGLTF_TYPE_VEC4;
        if (values.count != part.vertices.count || (values.type != TINYGLTF_TYPE_VEC3 && !colors.has_alpha))
            return false;
        switch (values.componentType) {
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            colors.type = color_layout::component::float32;
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            colors.type = color_layout::component::byte;
            break;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            colors.type = color_layout::component::word;
            break;
        default:
            return false;
        }
        for (std::size_t c = 0; c < 4; ++c) colors.place[c] = c * component_bytes(values);
        return locate(attribute->second, part.color_file, colors.first, colors.stride);
    }

    const mapped_model& files_;
    const tinygltf::Model& model_;
    const gltf::checked_document& document_;
    const gltf::accessor_reader& accessors_;
};

std::optional<gltf_parts> parts_in(mapped_model& files, const gltf_limits& limits, const gltf_options& options) {
    if (options.animation) return std::nullopt;
    scene aside;
    gltf::leniency tolerance{options.lenient, aside.warnings};
    gltf::budget memory{limits};
    memory.grant_input(files.bytes().size());
    const gltf::container whole = gltf::split_container(files.bytes(), tolerance);
    const gltf::checked_document document =
        gltf::check_document(whole.json, whole.has_binary, memory, tolerance, options);
    if (!document.draco_primitives.empty()) return std::nullopt;
    const tinygltf::Model model = parse(document);
    const gltf_file_reader no_files;
    const gltf::resources resources{document, whole.binary, whole.has_binary, no_files,
                                    memory,   tolerance,    files.mapper()};
    const gltf::accessor_reader accessors{model, document, resources, memory};
    gltf::material_reader materials{model, accessors, resources, options, aside};
    materials.read_factors();
    const gltf::shown_scene shown_scene = gltf::shown_meshes(model, accessors, tolerance);
    const gltf::pose_reader poses{model, accessors, shown_scene.node_to_world, memory};
    const part_finder finder{files, model, document, accessors};
    // Without colours only the alpha of those that may cut fragments off is asked for.
    const auto needs_colors = [&](const tinygltf::Primitive& source) {
        return options.colors ||
               (source.material >= 0 &&
                aside.materials[static_cast<std::size_t>(source.material)].alpha != alpha_mode::opaque);
    };
    const auto is_textured = [&](const tinygltf::Primitive& source) {
        return source.material >= 0 && materials.want_texture(static_cast<std::size_t>(source.material));
    };
    gltf_parts found;
    bool has_default = false;
    for (const gltf::shown_mesh& shown : shown_scene.meshes)
        for (std::size_t number = 0; number < model.meshes[shown.mesh].primitives.size(); ++number) {
            const tinygltf::Primitive& source = model.meshes[shown.mesh].primitives[number];
            if (poses.is_posed(shown, source) || !shown.to_world.is_finite() || is_textured(source))
                return std::nullopt;
            std::optional<gltf_parts::part> part = finder.find(source, needs_colors(source));
            if (!part) return std::nullopt;
            memory.charge(1, sizeof(gltf_parts::part), "nodes");
            has_default = has_default || source.material < 0;
            if (part->num_triangles == 0) continue;
            part->name = gltf::name_of(model, shown.mesh, number);
            part->to_world = shown.to_world;
            part->material = static_cast<std::uint32_t>(source.material >= 0 ? static_cast<std::size_t>(source.material)
                                                                             : model.materials.size());
            found.parts.push_back(std::move(*part));
        }
    tolerance.finish();
    if (has_default) aside.materials.push_back(gltf::default_material());
    found.files = files.files();
    found.materials = std::move(aside.materials);
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
    try {
        mapped_model files(file);
        return parts_in(files, limits, options);
    } catch (const gltf_error&) { // also for files that this way asks more of than the loader: its words are better
        return std::nullopt;
    }
}

} // namespace voxelize
