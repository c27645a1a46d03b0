// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Models for tests of the tool.

#include "gltf_builder.hpp"

#include <cmath>

namespace gltf_test {

// A square from (0, 0, z) to (1, 1, z) that faces +z; its picture stands upright as seen from there.
inline json& add_square(builder& file, float z) {
    const int positions = file.accessor(std::vector<float>{0, 0, z, 1, 0, z, 1, 1, z, 0, 1, z}, "VEC3");
    const int texcoords = file.accessor(std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0}, "VEC2");
    const int indices = file.accessor(std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3}, "SCALAR");
    json& primitive = file.mesh({{"POSITION", positions}, {"TEXCOORD_0", texcoords}});
    primitive["indices"] = indices;
    return primitive;
}

inline int add_material(builder& file, const std::vector<double>& color, const json& more = json::object()) {
    json entry = more;
    entry["pbrMetallicRoughness"]["baseColorFactor"] = color;
    return file.append("materials", entry);
}

// A material with a picture of WIDTH x HEIGHT, sampled nearest.
inline int add_textured_material(builder& file, std::uint32_t width, std::uint32_t height,
                                 const std::vector<std::uint8_t>& rgba, const json& more = json::object()) {
    const int view = file.view(png(width, height, rgba));
    const int image = file.append("images", {{"bufferView", view}, {"mimeType", "image/png"}});
    const int sampler = file.append("samplers", {{"magFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33071}});
    const int texture = file.append("textures", {{"source", image}, {"sampler", sampler}});
    json entry = more;
    entry["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture;
    return file.append("materials", entry);
}

// A sheet of SIDE^2 quads and seven heights, STEP one above the other, with one of its vertices at the origin, as mesh
// 0; no node shows it.
inline void add_sheet(builder& file, int side, float step = 0.05F) {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x)
            positions.insert(positions.end(),
                             {static_cast<float>(x) / static_cast<float>(side),
                              static_cast<float>(y) / static_cast<float>(side), static_cast<float>(x * y % 7) * step});
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const auto at = static_cast<std::uint32_t>(y * (side + 1) + x),
                       up = at + static_cast<std::uint32_t>(side) + 1;
            indices.insert(indices.end(), {at, at + 1, up + 1, at, up + 1, up});
        }
    const int index_accessor = file.accessor(indices, "SCALAR");
    file.mesh({{"POSITION", file.accessor(positions, "VEC3")}})["indices"] = index_accessor;
    file.root["nodes"] = json::array();
}

// A relief that rises over 2 SIDE^2 triangles, which share no vertex.
inline json& add_relief(builder& file, int side) {
    std::vector<float> positions;
    for (int n = 0; n < 2 * side * side; ++n)
        for (int corner = 0; corner < 3; ++corner) {
            const int x = n / 2 % side + (n % 2 == 0 ? corner == 1 : corner != 2),
                      y = n / 2 / side + (n % 2 == 0 ? corner == 2 : corner != 0);
            const float u = static_cast<float>(x) / static_cast<float>(side),
                        v = static_cast<float>(y) / static_cast<float>(side);
            positions.insert(positions.end(), {u, v, 0.1F + 0.5F * u + 0.3F * v * std::sin(9 * u)});
        }
    return file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
}

// A sheet, and a triangle without indices, under a node that turns, mirrors and stretches them.
inline void add_two_parts(builder& file, int side) {
    add_sheet(file, side, 0.02F);
    const int alone = file.accessor(std::vector<float>{0, 0, 0.1f, 1, 0, 0.2f, 0, 1, 0.3f}, "VEC3");
    file.root["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", alone}}}});
    file.append("nodes", {{"mesh", 0}, {"matrix", {0, 0, 2, 0, 1, 0, 0, 0, 0, -1.5, 0, 0, 7, 8, 9, 1}}});
}

// The surface of the cube from (0, 0, 0) to (1, 1, 1), 12 triangles that face outwards, moved and scaled by its node.
inline void add_cube(builder& file, const std::vector<double>& translation, double scale, int material) {
    std::vector<float> positions;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(corner >> axis & 1));
    const std::vector<std::uint8_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                            2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    primitive["material"] = material;
    json& node = file.root["nodes"].back();
    node["translation"] = translation;
    node["scale"] = {scale, scale, scale};
}

// Two cubes of two materials, one of them leaning, and a half-transparent mask: something of everything.
inline builder small_world() {
    builder file;
    add_cube(file, {0, 0, 0}, 1, add_material(file, {0.8, 0.1, 0.05, 1}, {{"name", "brick"}}));
    add_cube(file, {0.6, 0.9, 0.2}, 0.7, add_material(file, {0.1, 0.2, 0.9, 0.5}, {{"alphaMode", "BLEND"}}));
    file.root["nodes"].back()["rotation"] = {0.2, 0.3, 0.1, 0.9};
    const std::vector<std::uint8_t> holes{255, 255, 0, 255, 255, 255, 255, 0, 255, 255, 255, 0, 0, 255, 255, 255};
    const int mask = add_textured_material(file, 2, 2, holes, {{"alphaMode", "MASK"}, {"alphaCutoff", 0.5}});
    add_square(file, 1.4F)["material"] = mask;
    return file;
}

// A list of vertices drawn in MODE, with their colours.
inline json& add_vertices(builder& file, int mode, const std::vector<float>& positions,
                          const std::vector<float>& colors) {
    const int color = file.accessor(colors, "VEC3");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}, {"COLOR_0", color}});
    primitive["mode"] = mode;
    return primitive;
}

// A cube and a square with lines and points: a loop before all triangles, a strip of a material that blends, two
// segments, one of which lies in a face of the cube, and points inside, outside and on a face.
inline builder lined_world() {
    builder file;
    add_vertices(file, 2, {-0.2F, 0.5F, 0.5F, 0.5F, 1.6F, 0.4F, 1.3F, 0.3F, 0.7F}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    add_cube(file, {0, 0, 0}, 1, add_material(file, {0.8, 0.1, 0.05, 1}, {{"name", "brick"}}));
    add_square(file, 1.4F);
    const int glass = add_material(file, {0.1, 0.2, 0.9, 0.5}, {{"alphaMode", "BLEND"}});
    add_vertices(file, 3, {0, 0, 1.2F, 1, 0.2F, 1.3F, 0.5F, 1.1F, 1.1F, 0, 0.4F, 1.5F},
                 {1, 1, 1, 1, 1, 1, 0.5F, 0.5F, 0.5F, 1, 1, 0})["material"] = glass;
    add_vertices(file, 1, {0.1F, 0.1F, 1, 0.9F, 0.8F, 1, 0.5F, 0.5F, -0.3F, 0.5F, 0.5F, 1.6F},
                 {0, 1, 0, 0, 1, 1, 1, 0, 1, 1, 1, 1});
    add_vertices(file, 0, {0.5F, 0.5F, 0.5F, 1.2F, 1.2F, 1.2F, 0.25F, 0.25F, 1, -0.1F, -0.1F, -0.1F},
                 {1, 0.5F, 0, 0, 0.5F, 1, 1, 1, 0, 0.2F, 0.2F, 0.2F});
    file.root["nodes"].back()["rotation"] = {0.05, 0.1, 0.02, 0.99};
    return file;
}

} // namespace gltf_test
