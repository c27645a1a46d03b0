// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "checker.hpp"

#include "container.hpp"
#include "extensions.hpp"

#include <tiny_gltf.h>

#include <array>
#include <set>

namespace voxelize::gltf {

namespace {

std::uint64_t component_bytes(std::uint64_t component_type) {
    switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
    default:
        return 0;
    }
}

// Bytes of one element; matrix columns start at multiples of 4. 0 where the type is unknown.
std::uint64_t element_bytes(std::string_view type, std::uint64_t component) {
    struct shape {
        std::string_view name;
        std::uint64_t rows, columns;
    };
    constexpr std::array shapes{shape{"SCALAR", 1, 1}, shape{"VEC2", 2, 1}, shape{"VEC3", 3, 1}, shape{"VEC4", 4, 1},
                                shape{"MAT2", 2, 2},   shape{"MAT3", 3, 3}, shape{"MAT4", 4, 4}};
    for (const shape& known : shapes)
        if (known.name == type)
            return known.columns == 1 ? known.rows * component : known.columns * ((known.rows * component + 3) / 4 * 4);
    return 0;
}

} // namespace

checked_document checker::run() {
    check_asset();
    count_lists();
    check_extensions();
    check_buffers();
    check_buffer_views();
    check_accessors();
    check_images();
    check_samplers();
    check_textures();
    check_materials();
    choose_variant();
    check_meshes();
    check_nodes_and_scenes();
    check_skins();
    choose_animation();
    root_.keep_only({"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "materials", "textures",
                     "samplers", "skins", "animations"});
    if (placeholder_view_) root_.value()["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 1}});
    document_.json = root_.value().dump();
    return std::move(document_);
}

void checker::check_asset() {
    if (!root_.value().is_object()) root_.fail("the JSON text is not an object");
    const json_at asset = root_.required("asset", root_.object("asset"));
    const std::string_view version = asset.required("version", asset.string("version"));
    if (version.substr(0, 2) != "2.") asset.fail("glTF version " + in_quotes(version) + " is not supported, only 2.x");
    if (const auto least = asset.string("minVersion"); least && *least != "2.0")
        asset.fail("the file requires glTF version " + in_quotes(*least) + ", supported is 2.0");
    asset.keep_only({"version"});
}

// The list sizes that references are checked against; what tinygltf will build for each element is charged.
void checker::count_lists() {
    const auto count = [&](std::string_view list, std::size_t bytes_each) {
        const std::size_t size = root_.array_size(list);
        memory_.charge(size, bytes_each, std::string(list));
        return size;
    };
    num_buffers_ = count("buffers", sizeof(buffer_source));
    num_views_ = count("bufferViews", sizeof(tinygltf::BufferView) + sizeof(view));
    num_accessors_ = count("accessors", sizeof(tinygltf::Accessor));
    num_images_ = count("images", sizeof(image_source));
    num_samplers_ = count("samplers", sizeof(tinygltf::Sampler));
    num_textures_ = count("textures", sizeof(tinygltf::Texture));
    num_materials_ = count("materials", sizeof(tinygltf::Material));
    num_meshes_ = count("meshes", sizeof(tinygltf::Mesh));
    num_nodes_ = count("nodes", sizeof(tinygltf::Node));
    num_scenes_ = count("scenes", sizeof(tinygltf::Scene));
    num_skins_ = count("skins", sizeof(tinygltf::Skin));
}

void checker::check_extensions() {
    const auto names = [&](std::string_view key) {
        std::set<std::string> list;
        root_.each(key, [&](const json_at& entry) {
            if (!entry.value().is_string()) entry.fail("must be a string");
            list.insert(entry.value().get<std::string>());
        });
        return list;
    };
    const std::set<std::string> required = names("extensionsRequired");
    for (const std::string& name : required) {
        switch (effect_of(name)) {
        case extension_effect::honoured:
        case extension_effect::appearance:
            break;
        case extension_effect::fallback:
            throw gltf_error("geometry is compressed with " + printable(name) + ", which is not supported");
        case extension_effect::unknown:
            throw gltf_error("the file requires the extension " + printable(name) + ", which is not supported");
        }
    }
    std::set<std::string> used = names("extensionsUsed");
    used.insert(required.begin(), required.end());
    warn_of_extensions(used, extension_effect::appearance, "not supported",
                       ": only base colour, texture and alpha of materials are used");
    warn_of_extensions(used, extension_effect::unknown, "not known and ignored", "");
    warn_of_extensions(used, extension_effect::fallback, "not supported",
                       ": the file's uncompressed copy of the geometry is used");
}

// One line for all extensions of the same effect.
void checker::warn_of_extensions(const std::set<std::string>& used, extension_effect effect, const std::string& what,
                                 const std::string& consequence) {
    constexpr std::size_t most_named = 8;
    std::string list;
    std::size_t count = 0;
    for (const std::string& name : used) {
        if (effect_of(name) != effect || ++count > most_named) continue;
        list += (count == 1 ? "" : ", ") + printable(name);
    }
    if (count == 0) return;
    if (count > most_named) list += " and " + std::to_string(count - most_named) + " more";
    tolerance_.warnings().push_back((count == 1 ? "extension " : "extensions ") + list +
                                    (count == 1 ? " is " : " are ") + what + consequence);
}

void checker::check_buffers() {
    root_.each_object("buffers", [&](const json_at& buffer) {
        buffer_source source;
        source.byte_length = buffer.required("byteLength", buffer.integer("byteLength", 1, largest_integer));
        if (const auto uri = buffer.string("uri")) source.uri = std::string(*uri);
        document_.buffers.push_back(std::move(source));
    });
}

// Nothing stands behind this buffer: compressed files keep such a one in place of their uncompressed copy.
bool checker::is_placeholder(std::size_t buffer) const {
    return !document_.buffers[buffer].uri && !(buffer == 0 && has_binary_chunk_);
}

void checker::check_buffer_views() {
    root_.each_object("bufferViews", [&](const json_at& entry) {
        view checked;
        const std::uint32_t buffer = entry.required("buffer", entry.index("buffer", "buffers", num_buffers_));
        const std::uint64_t offset = entry.integer("byteOffset", 0, largest_integer).value_or(0);
        checked.byte_offset = offset;
        checked.byte_length = entry.required("byteLength", entry.integer("byteLength", 1, largest_integer));
        const std::uint64_t has = document_.buffers[buffer].byte_length;
        if (offset + checked.byte_length > has)
            entry.fail("ends at byte " + std::to_string(offset + checked.byte_length) + " of a buffer with " +
                       std::to_string(has));
        if (const auto stride = entry.integer("byteStride", tolerance_.lenient() ? 1 : 4, 252)) {
            if (*stride % 4 != 0)
                tolerance_.accept(entry.path() + ": byteStride " + std::to_string(*stride) + " is not a multiple of 4",
                                  "it is used as it is");
            checked.byte_stride = *stride;
        }
        document_.meshopt_views.push_back(std::nullopt);
        if (const auto extensions = entry.object("extensions"))
            for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression", "MESHOPT_compression"})
                if (extensions->member(name) && is_placeholder(buffer)) {
                    if (!reads_meshopt)
                        entry.fail("geometry is compressed with " + std::string(name) +
                                   ", which is not supported by this build (it has no meshoptimizer)");
                    document_.meshopt_views.back() =
                        check_meshopt(extensions->required(name, extensions->object(name)), checked.byte_length);
                }
        views_.push_back(checked);
        document_.view_strides.push_back(checked.byte_stride.value_or(0));
        entry.keep_only({"buffer", "byteOffset", "byteLength"});
    });
}

// The stride and the count that mode and filter allow, and bytes that are there.
meshopt_view checker::check_meshopt(const json_at& at, std::uint64_t view_length) const {
    meshopt_view view;
    view.buffer = at.required("buffer", at.index("buffer", "buffers", num_buffers_));
    view.byte_offset = at.integer("byteOffset", 0, largest_integer).value_or(0);
    view.byte_length = at.required("byteLength", at.integer("byteLength", 1, largest_integer));
    view.byte_stride = at.required("byteStride", at.integer("byteStride", 1, 256));
    view.count = at.required("count", at.integer("count", 1, UINT32_MAX));
    if (view.byte_offset + view.byte_length > document_.buffers[view.buffer].byte_length)
        at.fail("ends at byte " + std::to_string(view.byte_offset + view.byte_length) + " of a buffer with " +
                std::to_string(document_.buffers[view.buffer].byte_length));
    if (view.count * view.byte_stride != view_length)
        at.fail("gives " + std::to_string(view.count * view.byte_stride) + " bytes, its buffer view has " +
                std::to_string(view_length));
    const std::string_view mode = at.required("mode", at.string("mode"));
    const std::string_view filter = at.string("filter").value_or("NONE");
    const auto require = [&](bool holds, std::string_view what) {
        if (!holds)
            at.fail(std::string(what) + " cannot have " + std::to_string(view.count) + " elements of " +
                    std::to_string(view.byte_stride) + " bytes");
    };
    if (mode == "ATTRIBUTES") {
        view.mode = meshopt_mode::attributes;
        require(view.byte_stride % 4 == 0, mode);
    } else if (mode == "TRIANGLES" || mode == "INDICES") {
        view.mode = mode == "TRIANGLES" ? meshopt_mode::triangles : meshopt_mode::indices;
        require(view.byte_stride == 2 || view.byte_stride == 4, mode);
        require(mode == "INDICES" || view.count % 3 == 0, mode);
    } else {
        at.fail("mode " + in_quotes(mode) + " is not known");
    }
    if (filter == "OCTAHEDRAL") {
        view.filter = meshopt_filter::octahedral;
        require(view.byte_stride == 4 || view.byte_stride == 8, filter);
    } else if (filter == "QUATERNION") {
        view.filter = meshopt_filter::quaternion;
        require(view.byte_stride == 8, filter);
    } else if (filter == "EXPONENTIAL") {
        view.filter = meshopt_filter::exponential;
        require(view.byte_stride % 4 == 0, filter);
    } else if (filter != "NONE") {
        at.fail("filter " + in_quotes(filter) + " is not supported");
    }
    return view;
}

// Bytes [offset, offset + stride * (count - 1) + element) must lie inside the view. All of it fits 64 bits:
// offset < 2^54, stride < 2^8, count < 2^32.
void checker::check_span(const json_at& at, std::uint32_t view_index, std::uint64_t offset, std::uint64_t stride,
                         std::uint64_t count, std::uint64_t element) const {
    const std::uint64_t end = offset + stride * (count - 1) + element;
    if (end > views_[view_index].byte_length)
        at.fail("needs " + std::to_string(end) + " bytes of bufferViews[" + std::to_string(view_index) +
                "], which has " + std::to_string(views_[view_index].byte_length));
}

void checker::check_accessors() {
    root_.each_object("accessors", [&](const json_at& accessor) {
        const std::uint64_t type =
            accessor.required("componentType", accessor.integer("componentType", 0, largest_integer));
        const std::uint64_t component = component_bytes(type);
        if (component == 0) accessor.fail("componentType " + std::to_string(type) + " is not one of glTF's");
        const std::string_view shape = accessor.required("type", accessor.string("type"));
        const std::uint64_t element = element_bytes(shape, component);
        if (element == 0) accessor.fail("type " + in_quotes(shape) + " is not one of glTF's");
        const std::uint64_t count = accessor.required("count", accessor.integer("count", 1, UINT32_MAX));
        const std::uint64_t offset = accessor.integer("byteOffset", 0, largest_integer).value_or(0);
        (void)accessor.boolean("normalized");
        const auto view_index = accessor.index("bufferView", "bufferViews", num_views_);
        document_.zero_base.push_back(!view_index);
        if (view_index) {
            if (tolerance_.lenient() && (views_[*view_index].byte_offset + offset) % component != 0)
                tolerance_.accept(accessor.path() + ": is not aligned to its components of " +
                                      std::to_string(component) + " bytes",
                                  "it is read where it lies");
            const std::uint64_t stride = views_[*view_index].byte_stride.value_or(element);
            if (stride < element)
                accessor.fail("its elements of " + std::to_string(element) + " bytes overlap at byteStride " +
                              std::to_string(stride));
            check_span(accessor, *view_index, offset, stride, count, element);
        }
        if (const auto sparse = accessor.object("sparse")) check_sparse(*sparse, count, element);
        accessor.keep_only({"bufferView", "byteOffset", "componentType", "normalized", "count", "type", "sparse"});
    });
}

void checker::check_sparse(const json_at& sparse, std::uint64_t accessor_count, std::uint64_t element) const {
    const std::uint64_t count = sparse.required("count", sparse.integer("count", 1, accessor_count));
    const auto part = [&](const char* key, std::uint64_t bytes_each, const json_at& at) {
        const std::uint32_t index = at.required("bufferView", at.index("bufferView", "bufferViews", num_views_));
        if (views_[index].byte_stride) at.fail(std::string("sparse ") + key + " may not have a byteStride");
        // tinygltf keeps these two offsets in an int.
        const std::uint64_t offset = at.integer("byteOffset", 0, INT32_MAX).value_or(0);
        check_span(at, index, offset, bytes_each, count, bytes_each);
    };
    const json_at indices = sparse.required("indices", sparse.object("indices"));
    const std::uint64_t type = indices.required("componentType", indices.integer("componentType", 0, largest_integer));
    if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        indices.fail("componentType " + std::to_string(type) + " is not an unsigned integer");
    part("indices", component_bytes(type), indices);
    part("values", element, sparse.required("values", sparse.object("values")));
    indices.keep_only({"bufferView", "byteOffset", "componentType"});
    sparse.object("values")->keep_only({"bufferView", "byteOffset"});
    sparse.keep_only({"count", "indices", "values"});
}

checked_document check_document(std::string_view json_text, bool has_binary_chunk, budget& memory, leniency& tolerance,
                                const gltf_options& options) {
    check_json_text(json_text, memory.limits());
    json root;
    try {
        root = json::parse(json_text);
    } catch (const json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 1, column 2: ...": without the bracket.
        const std::string_view what = error.what();
        const std::size_t bracket = what.find("] ");
        throw gltf_error("invalid JSON: " +
                         printable(bracket == std::string_view::npos ? what : what.substr(bracket + 2), 200));
    }
    return checker{root, has_binary_chunk, memory, tolerance, options}.run();
}

} // namespace voxelize::gltf
