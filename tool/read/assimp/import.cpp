// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "import.hpp"

#include "file_name.hpp"
#include "file_system.hpp"
#include "linear_color.hpp"
#include "model/finite.hpp"
#include "package_3mf.hpp"
#include "read/gltf/text.hpp"

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

namespace voxelize::assimp {

namespace {

// ---- Materials
// -------------------------------------------------------------------------------------------------------

wrap_mode wrap_of(aiTextureMapMode mode) {
    if (mode == aiTextureMapMode_Mirror) return wrap_mode::mirrored_repeat;
    return mode == aiTextureMapMode_Wrap ? wrap_mode::repeat : wrap_mode::clamp_to_edge;
}

void add_material(model& result, const aiMaterial& source, const aiScene& scene) {
    material entry;
    texture_source texture;
    aiString name;
    if (source.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS) entry.name = gltf::printable(name.C_Str());
    for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
        aiString path;
        aiTextureMapMode modes[3] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
        if (texture.is_there() || source.GetTextureCount(type) == 0 ||
            source.GetTexture(type, 0, &path, nullptr, nullptr, nullptr, nullptr, modes) != aiReturn_SUCCESS)
            continue;
        const auto [embedded, index] = scene.GetEmbeddedTextureAndIndex(path.C_Str());
        texture.path = embedded != nullptr ? "" : path.C_Str();
        texture.embedded = embedded != nullptr ? index : -1;
        texture.wrap_s = wrap_of(modes[0]);
        texture.wrap_t = wrap_of(modes[1]);
    }
    // The one that assimp makes where a file has none is grey; without a material a surface is white.
    if (entry.name != AI_DEFAULT_MATERIAL_NAME) {
        aiColor4D color(1, 1, 1, 1);
        if (source.Get(AI_MATKEY_BASE_COLOR, color) != aiReturn_SUCCESS)
            (void)source.Get(AI_MATKEY_COLOR_DIFFUSE, color);
        // Exporters leave black beside a texture.
        if (texture.is_there() && color.r == 0 && color.g == 0 && color.b == 0) color = aiColor4D(1, 1, 1, color.a);
        float opacity = 1;
        if (source.Get(AI_MATKEY_OPACITY, opacity) != aiReturn_SUCCESS || !(opacity >= 0 && opacity <= 1)) opacity = 1;
        entry.base_color = {linear_of(color.r), linear_of(color.g), linear_of(color.b), opacity};
        if (opacity < 1) entry.alpha = alpha_mode::blend;
    }
    int two_sided = 0;
    (void)source.Get(AI_MATKEY_TWOSIDED, two_sided);
    entry.double_sided = two_sided != 0;
    result.materials.push_back(std::move(entry));
    result.textures.push_back(std::move(texture));
}

void add_embedded(model& result, const aiTexture& source) {
    embedded_picture picture;
    if (source.mHeight == 0) { // an encoded file of mWidth bytes
        const auto* const bytes = reinterpret_cast<const std::byte*>(source.pcData);
        picture.bytes.assign(bytes, bytes + source.mWidth);
    } else {
        picture.width = source.mWidth;
        picture.height = source.mHeight;
        const std::size_t pixels = std::size_t{source.mWidth} * source.mHeight;
        for (std::size_t i = 0; i < pixels; ++i)
            for (const unsigned char channel :
                 {source.pcData[i].r, source.pcData[i].g, source.pcData[i].b, source.pcData[i].a})
                picture.bytes.push_back(static_cast<std::byte>(channel));
    }
    result.embedded.push_back(std::move(picture));
}

// ---- Meshes and nodes
// ------------------------------------------------------------------------------------------------

struct left_out {
    std::size_t bent = 0;     // meshes with bones
    std::size_t unusable = 0; // vertices
    std::size_t no_place = 0; // instances
};

// Triangles and lines in one list of vertices; see parts_of.
primitive read_mesh(const aiMesh& source, std::size_t index, const model& result, left_out& without) {
    primitive part;
    part.name = source.mName.length != 0 ? gltf::printable(source.mName.C_Str()) : "mesh " + std::to_string(index);
    part.material = source.mMaterialIndex;
    if (source.mMaterialIndex >= result.materials.size()) throw std::runtime_error("a mesh has no material");
    part.positions.reserve(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
        const aiVector3D& p = source.mVertices[i];
        part.positions.emplace_back(p.x, p.y, p.z);
    }
    part.triangles.reserve(source.mNumFaces);
    for (unsigned i = 0; i < source.mNumFaces; ++i) {
        const aiFace& face = source.mFaces[i];
        for (unsigned corner = 0; corner < face.mNumIndices; ++corner)
            if (face.mIndices[corner] >= source.mNumVertices) throw std::runtime_error("an index is out of range");
        if (face.mNumIndices == 1 || face.mNumIndices == 2)
            part.lines.emplace_back(face.mIndices[0], face.mIndices[face.mNumIndices - 1]);
        // A polygon that could not be triangulated is a fan.
        for (unsigned corner = 2; corner < face.mNumIndices; ++corner)
            part.triangles.emplace_back(face.mIndices[0], face.mIndices[corner - 1], face.mIndices[corner]);
    }
    if (source.mNumFaces == 0)
        for (unsigned i = 0; i < source.mNumVertices; ++i) part.lines.emplace_back(i, i);
    for (const glm::vec3& p : part.positions)
        if (!is_finite(p)) ++without.unusable;
    if (source.HasBones()) ++without.bent;
    if (result.textures[part.material].is_there() && source.HasTextureCoords(0)) {
        part.texcoords.reserve(source.mNumVertices);
        for (unsigned i = 0; i < source.mNumVertices; ++i) // v runs upwards there
            part.texcoords.emplace_back(source.mTextureCoords[0][i].x, 1 - source.mTextureCoords[0][i].y);
    }
    if (source.HasVertexColors(0)) {
        part.colors.reserve(source.mNumVertices);
        for (unsigned i = 0; i < source.mNumVertices; ++i) {
            const aiColor4D& c = source.mColors[0][i];
            const float alpha = c.a >= 0 && c.a <= 1 ? c.a : 1;
            part.colors.emplace_back(linear_of(c.r), linear_of(c.g), linear_of(c.b), alpha);
        }
    }
    return part;
}

// The primitives of a mesh: none, its triangles, its lines, or both.
std::vector<primitive> parts_of(primitive&& mesh) {
    std::vector<primitive> parts;
    if (mesh.lines.empty() && mesh.triangles.empty()) return parts;
    if (!mesh.lines.empty() && !mesh.triangles.empty()) {
        parts.push_back(mesh);
        parts[0].lines.clear();
        mesh.triangles.clear();
    }
    parts.push_back(std::move(mesh));
    return parts;
}

affine transform_of(const aiMatrix4x4& m) {
    affine result;
    result.m = {{{m.a1, m.a2, m.a3, m.a4}, {m.b1, m.b2, m.b3, m.b4}, {m.c1, m.c2, m.c3, m.c4}}};
    return result;
}

void read_nodes(model& result, const aiNode& root, const std::vector<std::vector<std::uint32_t>>& primitives_of,
                left_out& without) {
    struct visit {
        const aiNode* node;
        affine to_world;
    };
    std::vector<visit> pending{{&root, transform_of(root.mTransformation)}};
    while (!pending.empty()) {
        const visit current = pending.back();
        pending.pop_back();
        for (unsigned i = 0; i < current.node->mNumMeshes; ++i) {
            const unsigned mesh = current.node->mMeshes[i];
            if (mesh >= primitives_of.size()) throw std::runtime_error("a node shows a mesh that is not there");
            if (primitives_of[mesh].empty()) continue;
            if (!current.to_world.is_finite()) {
                ++without.no_place;
                continue;
            }
            for (const std::uint32_t number : primitives_of[mesh])
                result.instances.push_back({number, current.to_world});
        }
        for (unsigned i = current.node->mNumChildren; i-- > 0;) {
            const aiNode* const child = current.node->mChildren[i];
            pending.push_back({child, current.to_world.after(transform_of(child->mTransformation))});
        }
    }
}

// Collada's importer turns the file's units into metres.
void warn_of_units(model& result, const aiNode& root) {
    const aiMatrix4x4& m = root.mTransformation;
    const double scale = std::cbrt(std::abs(static_cast<double>(m.Determinant())));
    if (std::abs(scale - 1) < 1e-6 || !(scale > 0)) return;
    char text[32];
    std::snprintf(text, sizeof(text), "%.6g", scale);
    result.warnings.push_back("the file's unit is " + std::string(text) + " m: lengths are in metres");
}

// It also turns the axis that the file states as upright to Y.
void warn_of_axes(model& result, std::span<const std::byte> bytes) {
    const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    constexpr std::string_view key = "<up_axis>", blank = " \t\r\n";
    const std::size_t at = text.find(key);
    if (at == std::string_view::npos) return;
    const std::size_t value = text.find_first_not_of(blank, at + key.size());
    if (value == std::string_view::npos) return;
    const std::string_view axis = text.substr(value, 4);
    if (axis == "Z_UP")
        result.warnings.emplace_back("the file states Z as upright: it is turned to Y, so x, y, z become x, z, -y");
    if (axis == "X_UP")
        result.warnings.emplace_back("the file states X as upright: it is turned to Y, so x, y, z become -y, x, z");
}

} // namespace

bool reads(const std::string& extension) { return Assimp::Importer{}.IsExtensionSupported(extension); }

model read_model(std::span<const std::byte> bytes, const std::string& name, const gltf_file_reader& read_file) {
    const std::string extension = lower_extension(name);
    if (extension == ".3mf")
        if (std::optional<model> package = read_package_3mf(bytes)) return std::move(*package);
    Assimp::Importer importer;
    auto* const files = new file_system(bytes, name, read_file);
    importer.SetIOHandler(files); // the importer owns it
    const aiScene* const scene = importer.ReadFile(name, aiProcess_Triangulate | aiProcess_TransformUVCoords);
    if (scene == nullptr || scene->mRootNode == nullptr) {
        const std::string why = importer.GetErrorString();
        if (why.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
        throw std::runtime_error(why);
    }

    model result;
    for (unsigned i = 0; i < scene->mNumMaterials; ++i) add_material(result, *scene->mMaterials[i], *scene);
    for (unsigned i = 0; i < scene->mNumTextures; ++i) add_embedded(result, *scene->mTextures[i]);
    result.files = files->others();
    left_out without;
    std::vector<std::vector<std::uint32_t>> primitives_of(scene->mNumMeshes); // by mesh
    for (unsigned i = 0; i < scene->mNumMeshes; ++i)
        for (primitive& part : parts_of(read_mesh(*scene->mMeshes[i], i, result, without))) {
            primitives_of[i].push_back(static_cast<std::uint32_t>(result.primitives.size()));
            result.primitives.push_back(std::move(part));
        }
    read_nodes(result, *scene->mRootNode, primitives_of, without);
    if (extension == ".dae" || extension == ".zae") {
        warn_of_units(result, *scene->mRootNode);
        warn_of_axes(result, bytes);
    }
    const auto warn = [&](std::size_t count, const char* what) {
        if (count != 0) result.warnings.push_back(std::to_string(count) + ' ' + what);
    };
    warn(without.bent, "mesh(es) with bones are shown as they were bound");
    warn(without.unusable, not_finite);
    warn(without.no_place, "mesh(es) with a transform that is not finite are left out");
    return result;
}

} // namespace voxelize::assimp
