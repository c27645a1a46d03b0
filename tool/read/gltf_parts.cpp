// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "gltf_parts.hpp"

#include "read/gltf/accessor.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/check.hpp"
#include "read/gltf/container.hpp"
#include "read/gltf/leniency.hpp"
#include "read/gltf/materials.hpp"
#include "read/gltf/nodes.hpp"
#include "read/gltf/parse.hpp"
#include "read/gltf/pose.hpp"
#include "read/gltf/primitives.hpp"
#include "read/gltf/resources.hpp"

#include <tiny_gltf.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

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
    // The place of an address; none for bytes that no file holds as they stand.
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

    // All of it but its instance and texture coordinates, and vertex colours only WITH_COLORS. Nothing for a primitive
    // that cannot be read so.
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
        part.num_triangles = count_of(source) / 3;
        if (source.indices < 0) return part;
        const tinygltf::Accessor& indices = accessor(source.indices);
        if (!locate(source.indices, part.index_file, part.first_index, part.index_bytes) ||
            part.index_bytes != component_bytes(indices))
            return std::nullopt;
        return part;
    }

    // The number of a found primitive's corners.
    [[nodiscard]] std::uint64_t count_of(const tinygltf::Primitive& source) const {
        return accessor(source.indices >= 0 ? source.indices : source.attributes.at("POSITION")).count;
    }

    // The texture coordinates of a found part, none if the primitive has none. False for some that cannot be read so.
    [[nodiscard]] bool find_texcoords(const tinygltf::Primitive& source, const gltf::texture_coordinates& wanted,
                                      gltf_parts::part& part) const {
        const auto attribute = source.attributes.find("TEXCOORD_" + std::to_string(wanted.set));
        if (attribute == source.attributes.end()) return true;
        const tinygltf::Accessor& values = accessor(attribute->second);
        texcoord_layout& layout = part.texcoords.emplace();
        layout.count = values.count;
        layout.transform = wanted.m;
        const bool is_float = values.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
        if (values.count != part.vertices.count || values.type != TINYGLTF_TYPE_VEC2 ||
            (!is_float && !values.normalized) || !find_component(values, layout.type))
            return false;
        return locate(attribute->second, part.texcoord_file, layout.first, layout.stride);
    }

private:
    [[nodiscard]] const tinygltf::Accessor& accessor(int index) const {
        return model_.accessors[static_cast<std::size_t>(index)];
    }
    [[nodiscard]] static std::size_t component_bytes(const tinygltf::Accessor& a) {
        return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType)));
    }
    // Finds where an accessor's elements begin, and how far apart they are. False if they do not lie in a file.
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
    // False for a type that attributes are not read of.
    [[nodiscard]] static bool find_component(const tinygltf::Accessor& values, vertex_component& type) {
        switch (values.componentType) {
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            type = vertex_component::float32;
            return true;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            type = vertex_component::byte;
            return true;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            type = vertex_component::word;
            return true;
        default:
            return false;
        }
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
        if (!find_component(values, colors.type)) return false;
        for (std::size_t c = 0; c < 4; ++c) colors.place[c] = c * component_bytes(values);
        return locate(attribute->second, part.color_file, colors.first, colors.stride);
    }

    const mapped_model& files_;
    const tinygltf::Model& model_;
    const gltf::checked_document& document_;
    const gltf::accessor_reader& accessors_;
};

// A file as far as its text goes, and the readers of its bytes, which refer to each other.
struct open_document {
    open_document(const std::filesystem::path& file, const gltf_limits& limits, const gltf_options& options)
        : files(file), read_file(gltf::folder_reader(file.parent_path())), tolerance{options.lenient, aside.warnings},
          memory{limits}, whole(split()),
          document(gltf::check_document(whole.json, whole.has_binary, memory, tolerance, options)),
          model(gltf::parse(document)), bytes{document, whole.binary, whole.has_binary, read_file,
                                              memory,   tolerance,    files.mapper()},
          accessors{model, document, bytes, memory}, materials{model, accessors, bytes, options, aside} {
        materials.read_factors();
        shown = gltf::shown_meshes(model, accessors, tolerance);
        tolerance.finish();
        gltf::name_files(document, options);
    }
    open_document(const open_document&) = delete;
    open_document& operator=(const open_document&) = delete;

    // Calls visit(shown mesh, number of its part, that part) for all that the scene shows, in its order.
    template <class Visit>
    void for_each_primitive(const Visit& visit) const {
        for (const gltf::shown_mesh& one : shown.meshes)
            for (std::size_t part = 0; part < model.meshes[one.mesh].primitives.size(); ++part)
                visit(one, part, model.meshes[one.mesh].primitives[part]);
    }

    scene aside; // materials and warnings alone
    mapped_model files;
    gltf_file_reader read_file;
    gltf::leniency tolerance;
    gltf::budget memory;
    gltf::container whole;
    gltf::checked_document document;
    tinygltf::Model model;
    gltf::resources bytes;
    gltf::accessor_reader accessors;
    gltf::material_reader materials;
    gltf::shown_scene shown;

private:
    gltf::container split() {
        memory.grant_input(files.bytes().size());
        return gltf::split_container(files.bytes(), tolerance);
    }
};

// Thrown for a file that cannot be read in parts.
struct no_parts {};

gltf_parts parts_in(open_document& in, const gltf_options& options) {
    if (!in.document.draco_primitives.empty()) throw no_parts{};
    const gltf::pose_reader poses{in.model, in.accessors, in.shown.node_to_world, in.memory};
    const part_finder finder{in.files, in.model, in.document, in.accessors};
    // Without colours only the alpha of those that may cut fragments off is asked for.
    const auto needs_colors = [&](const tinygltf::Primitive& source) {
        return options.colors ||
               (source.material >= 0 &&
                in.aside.materials[static_cast<std::size_t>(source.material)].alpha != alpha_mode::opaque);
    };
    gltf_parts found;
    bool has_default = false;
    std::set<std::pair<std::size_t, std::size_t>> known; // by mesh and part
    std::uint64_t num_untextured = 0, num_with_rest = 0;
    in.for_each_primitive([&](const gltf::shown_mesh& shown, std::size_t number, const tinygltf::Primitive& source) {
        if (poses.is_posed(shown, source) || !shown.to_world.is_finite()) throw no_parts{};
        std::optional<gltf_parts::part> part = finder.find(source, needs_colors(source));
        if (!part) throw no_parts{};
        bool is_untextured = false;
        if (source.material >= 0)
            if (const auto wanted = in.materials.want_texture(static_cast<std::size_t>(source.material))) {
                if (!finder.find_texcoords(source, *wanted, *part)) throw no_parts{};
                is_untextured = !part->texcoords;
            }
        if (known.insert({shown.mesh, number}).second) {
            found.vertices.push_back({part->vertices, part->vertex_file});
            if (is_untextured) ++num_untextured;
            if (finder.count_of(source) % 3 != 0) ++num_with_rest;
        }
        in.memory.charge(1, sizeof(gltf_parts::part), "nodes");
        has_default = has_default || source.material < 0;
        if (part->num_triangles == 0) return;
        part->name = gltf::name_of(in.model, shown.mesh, number);
        part->to_world = shown.to_world;
        part->material = static_cast<std::uint32_t>(source.material >= 0 ? static_cast<std::size_t>(source.material)
                                                                         : in.model.materials.size());
        found.parts.push_back(std::move(*part));
    });
    const auto warn = [&](std::uint64_t count, const char* what) { // in the order of the loader
        if (count != 0) in.aside.warnings.push_back(std::to_string(count) + ' ' + what);
    };
    warn(num_with_rest, gltf::with_rest);
    warn(num_untextured, gltf::without_texcoords);
    if (has_default) in.aside.materials.push_back(gltf::default_material());
    found.files = in.files.files();
    found.materials = std::move(in.aside.materials);
    found.warnings = std::move(in.aside.warnings);
    return found;
}

} // namespace

std::optional<gltf_parts> find_parts(const std::filesystem::path& file, const gltf_limits& limits,
                                     const gltf_options& options) {
    if (options.animation) return std::nullopt;
    try {
        open_document in(file, limits, options);
        return parts_in(in, options);
    } catch (const no_parts&) {
        return std::nullopt;
    } catch (const gltf_error&) { // also for files that this way asks more of than the loader: its words are better
        return std::nullopt;
    }
}

gltf_textures read_textures(const std::filesystem::path& file, const gltf_limits& limits, const gltf_options& options,
                            const load_hooks& hooks) {
    open_document in(file, limits, options);
    bool has_default = false;
    in.for_each_primitive([&](const gltf::shown_mesh&, std::size_t, const tinygltf::Primitive& source) {
        has_default = has_default || source.material < 0;
        if (source.material >= 0) (void)in.materials.want_texture(static_cast<std::size_t>(source.material));
    });
    if (has_default) in.aside.materials.push_back(gltf::default_material());
    in.aside.warnings.clear(); // which find_parts() has given
    in.materials.read_textures(hooks);
    return {std::move(in.aside.materials), std::move(in.aside.textures), std::move(in.aside.images),
            std::move(in.aside.warnings)};
}

} // namespace voxelize
