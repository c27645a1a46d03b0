// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "checker.hpp"

#include <tiny_gltf.h>

#include <utility>

namespace voxelize::gltf {

void checker::check_meshes() {
    root_.each_object("meshes", [&](const json_at& mesh) {
        (void)mesh.string("name");
        memory_.charge(mesh.array_size("primitives"), sizeof(tinygltf::Primitive), "meshes");
        mesh.each_object("primitives", [&](const json_at& primitive) { check_primitive(primitive); });
        check_numbers_list(mesh, "weights");
        mesh.keep_only({"name", "primitives", "weights"});
    });
}

void checker::check_primitive(const json_at& primitive) {
    const json_at attributes = primitive.required("attributes", primitive.object("attributes"));
    for (const auto& entry : attributes.value().items())
        (void)attributes.index(entry.key(), "accessors", num_accessors_);
    (void)primitive.integer("mode", 0, 6);
    (void)primitive.index("material", "materials", num_materials_);
    if (const auto indices = primitive.index("indices", "accessors", num_accessors_))
        check_index_accessor(primitive, *indices);
    check_targets(primitive);
    if (const auto extensions = primitive.object("extensions")) {
        const auto position = attributes.index("POSITION", "accessors", num_accessors_);
        if (const auto variants = extensions->object("KHR_materials_variants")) use_variant(primitive, *variants);
        const auto draco = extensions->object("KHR_draco_mesh_compression");
        if (draco && (!position || document_.zero_base[*position])) check_draco(primitive, *draco);
    }
    primitive.keep_only({"attributes", "mode", "material", "indices", "targets"});
}

// A primitive whose accessors are empty but for what Draco gives.
void checker::check_draco(const json_at& primitive, const json_at& extension) {
    if (!reads_draco)
        primitive.fail(
            "geometry is compressed with KHR_draco_mesh_compression, which is not supported by this build (it "
            "has no Draco)");
    draco_primitive result;
    result.where = primitive.path();
    result.buffer_view = extension.required("bufferView", extension.index("bufferView", "bufferViews", num_views_));
    const auto describe = [&](std::uint32_t index) {
        const json& accessor = root_.value()["accessors"][index];
        draco_accessor wanted;
        wanted.accessor = index;
        wanted.component_type = accessor["componentType"].get<std::uint32_t>();
        const auto& type = accessor["type"].get_ref<const std::string&>();
        wanted.components = type == "SCALAR"          ? 1
                            : type.starts_with("VEC") ? static_cast<std::uint32_t>(type[3] - '0')
                                                      : 0;
        if (wanted.components == 0) extension.fail("a matrix cannot be compressed");
        wanted.count = accessor["count"].get<std::uint64_t>();
        return wanted;
    };
    const json_at attributes = primitive.required("attributes", primitive.object("attributes"));
    const json_at ids = extension.required("attributes", extension.object("attributes"));
    for (const auto& entry : ids.value().items()) {
        const auto id = static_cast<std::uint32_t>(*ids.integer(entry.key(), 0, UINT32_MAX));
        const auto accessor = attributes.index(entry.key(), "accessors", num_accessors_);
        if (!accessor) ids.fail(in_quotes(entry.key()) + " is not an attribute of the primitive");
        result.attributes.push_back(describe(*accessor));
        result.attributes.back().attribute = id;
    }
    const auto indices = primitive.index("indices", "accessors", num_accessors_);
    if (!indices) primitive.fail("is compressed with KHR_draco_mesh_compression and has no indices");
    result.indices = describe(*indices);
    memory_.charge(1, sizeof(draco_primitive) + result.attributes.size() * sizeof(draco_accessor), "meshes");
    document_.draco_primitives.push_back(std::move(result));
}

void checker::check_index_accessor(const json_at& primitive, std::uint32_t index) {
    json& accessor = root_.value()["accessors"][index];
    const auto type = accessor["componentType"].get<std::uint64_t>();
    if (accessor["type"] != "SCALAR" ||
        (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
         type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT))
        primitive.fail("indices are not scalars of an unsigned integer type");
    if (document_.zero_base[index]) {
        accessor["bufferView"] = num_views_; // tinygltf insists on one: the placeholder of run()
        placeholder_view_ = true;
    } else if (views_[accessor["bufferView"].get<std::size_t>()].byte_stride) {
        tolerance_.accept(primitive.path() + ": indices lie in a buffer view with a byteStride", "it is followed");
    }
}

void checker::check_nodes_and_scenes() {
    std::size_t with_matrix_and_parts = 0;
    root_.each_object("nodes", [&](const json_at& node) {
        (void)node.string("name");
        (void)node.index("mesh", "meshes", num_meshes_);
        node.each("children", [&](const json_at& child) { (void)child.as_index("nodes", num_nodes_); });
        const bool matrix = node.check_numbers("matrix", 16);
        bool parts = node.check_numbers("rotation", 4);
        parts = node.check_numbers("scale", 3) || parts;
        parts = node.check_numbers("translation", 3) || parts;
        if (matrix && parts) ++with_matrix_and_parts;
        (void)node.index("skin", "skins", num_skins_);
        check_numbers_list(node, "weights");
        if (const auto extensions = node.object("extensions")) check_node_extensions(*extensions);
        node.keep_only({"name", "mesh", "children", "matrix", "rotation", "scale", "translation", "skin", "weights",
                        "extensions"});
    });
    if (with_matrix_and_parts != 0)
        tolerance_.warnings().push_back(
            std::to_string(with_matrix_and_parts) +
            " node(s) with a matrix beside translation, rotation or scale: the matrix is used");
    root_.each_object("scenes", [&](const json_at& scene) {
        scene.each("nodes", [&](const json_at& node) { (void)node.as_index("nodes", num_nodes_); });
        scene.keep_only({"nodes"});
    });
    (void)root_.index("scene", "scenes", num_scenes_);
}

void checker::check_node_extensions(const json_at& extensions) const {
    if (const auto visibility = extensions.object("KHR_node_visibility")) {
        (void)visibility->boolean("visible");
        visibility->keep_only({"visible"});
    }
    if (const auto instancing = extensions.object("EXT_mesh_gpu_instancing")) {
        const json_at attributes = instancing->required("attributes", instancing->object("attributes"));
        std::optional<std::uint64_t> count;
        const auto check = [&](const char* name, std::string_view type, bool may_be_integer) {
            const auto index = attributes.index(name, "accessors", num_accessors_);
            if (!index) return;
            const json& accessor = root_.value()["accessors"][*index];
            const auto component = accessor["componentType"].get<std::uint64_t>();
            const bool integer =
                component == TINYGLTF_COMPONENT_TYPE_BYTE || component == TINYGLTF_COMPONENT_TYPE_SHORT;
            if (accessor["type"] != type ||
                !(component == TINYGLTF_COMPONENT_TYPE_FLOAT || (may_be_integer && integer)))
                attributes.fail(std::string(name) + " is not a " + std::string(type) + " of floats" +
                                (may_be_integer ? " or of signed 8 or 16 bit integers" : ""));
            const auto has = accessor["count"].get<std::uint64_t>();
            if (count.value_or(has) != has)
                attributes.fail(std::string(name) + " has " + std::to_string(has) + " elements, another has " +
                                std::to_string(*count));
            count = has;
        };
        check("TRANSLATION", "VEC3", false);
        check("ROTATION", "VEC4", true);
        check("SCALE", "VEC3", false);
        if (!count) attributes.fail("has none of TRANSLATION, ROTATION and SCALE");
        attributes.keep_only({"TRANSLATION", "ROTATION", "SCALE"});
        instancing->keep_only({"attributes"});
    }
    extensions.keep_only({"KHR_node_visibility", "EXT_mesh_gpu_instancing"});
}

} // namespace voxelize::gltf
