// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// KHR_draco_mesh_compression and EXT_meshopt_compression: what the test compresses comes back; damaged data is refused.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <cmath>

#ifdef VOXELIZE_HAS_MESHOPT
#include <meshoptimizer.h>
#endif
#ifdef VOXELIZE_HAS_DRACO
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#endif

using gltf_test::builder;
using gltf_test::json;
using voxelize::scene;

namespace {

[[maybe_unused]] std::string error_of(const builder& file) {
    try {
        (void)voxelize::load_gltf(file.glb());
    } catch (const voxelize::gltf_error& error) {
        return error.what();
    }
    return "no error";
}

// Corners on a bent grid of SIDE x SIDE, and the triangles between them.
[[maybe_unused]] std::vector<float> grid_corners(int side) {
    std::vector<float> corners;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            corners.insert(corners.end(),
                           {static_cast<float>(x), static_cast<float>(y), static_cast<float>(x * y) / 8});
    return corners;
}

[[maybe_unused]] std::vector<std::uint32_t> grid_indices(int side) {
    std::vector<std::uint32_t> indices;
    for (int y = 0; y + 1 < side; ++y)
        for (int x = 0; x + 1 < side; ++x) {
            const auto at = static_cast<std::uint32_t>(y * side + x);
            const auto below = at + static_cast<std::uint32_t>(side);
            indices.insert(indices.end(), {at, at + 1, below, at + 1, below + 1, below});
        }
    return indices;
}

constexpr int side = 9;
constexpr std::size_t num_corners = side * side;
constexpr std::size_t num_indices = std::size_t{6} * (side - 1) * (side - 1);

#ifdef VOXELIZE_HAS_MESHOPT

// A view that is only compressed: buffer 1 has nothing behind it.
int compressed_view(builder& file, const std::vector<unsigned char>& bytes, std::size_t stride, std::size_t count,
                    const char* mode) {
    const int source = file.view(std::as_bytes(std::span(bytes)));
    const json at = file.root["bufferViews"][static_cast<std::size_t>(source)];
    return file.append("bufferViews", {{"buffer", 1},
                                       {"byteOffset", 0},
                                       {"byteLength", stride * count},
                                       {"extensions",
                                        {{"EXT_meshopt_compression",
                                          {{"buffer", 0},
                                           {"byteOffset", at["byteOffset"]},
                                           {"byteLength", bytes.size()},
                                           {"byteStride", stride},
                                           {"count", count},
                                           {"mode", mode}}}}}});
}

builder with_meshopt(const char* index_mode) {
    builder file;
    const std::vector<float> corners = grid_corners(side);
    const std::vector<std::uint32_t> indices = grid_indices(side);
    std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(num_corners, 12));
    vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), corners.data(), num_corners, 12));
    std::vector<unsigned char> faces(2 * meshopt_encodeIndexBufferBound(num_indices, num_corners));
    faces.resize(std::string_view(index_mode) == "TRIANGLES"
                     ? meshopt_encodeIndexBuffer(faces.data(), faces.size(), indices.data(), num_indices)
                     : meshopt_encodeIndexSequence(faces.data(), faces.size(), indices.data(), num_indices));
    const int vertex_view = compressed_view(file, vertices, 12, num_corners, "ATTRIBUTES");
    const int index_view = compressed_view(file, faces, 4, num_indices, index_mode);
    const int position = file.append(
        "accessors",
        {{"bufferView", vertex_view}, {"componentType", gltf_test::f32}, {"count", num_corners}, {"type", "VEC3"}});
    const int index = file.append(
        "accessors",
        {{"bufferView", index_view}, {"componentType", gltf_test::u32}, {"count", num_indices}, {"type", "SCALAR"}});
    file.mesh({{"POSITION", position}})["indices"] = index;
    file.root["buffers"] = {{{"byteLength", file.binary.size()}}, {{"byteLength", 100000}}};
    file.root["extensionsUsed"] = {"EXT_meshopt_compression"};
    file.root["extensionsRequired"] = {"EXT_meshopt_compression"};
    return file;
}

// meshoptimizer may turn the corners of a triangle, not their order.
std::vector<glm::uvec3> turned(std::vector<glm::uvec3> triangles) {
    for (glm::uvec3& t : triangles)
        while (t.x > t.y || t.x > t.z) t = {t.y, t.z, t.x};
    return triangles;
}

TEST(Meshopt, WhatWasCompressedComesBack) {
    const std::vector<float> corners = grid_corners(side);
    const std::vector<std::uint32_t> indices = grid_indices(side);
    for (const char* mode : {"TRIANGLES", "INDICES"}) {
        const scene scene = voxelize::load_gltf(with_meshopt(mode).glb());
        EXPECT_TRUE(scene.warnings.empty());
        const voxelize::primitive& part = scene.primitives.at(0);
        ASSERT_EQ(num_corners, part.positions.size());
        for (std::size_t i = 0; i < num_corners; ++i)
            ASSERT_EQ(glm::vec3(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]), part.positions[i]);
        std::vector<glm::uvec3> expected;
        for (std::size_t i = 0; i < num_indices; i += 3)
            expected.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
        EXPECT_EQ(turned(expected), turned(part.triangles)) << mode;
    }
}

TEST(Meshopt, TheExponentialFilterIsUndone) {
    builder file = with_meshopt("TRIANGLES");
    std::vector<float> corners = grid_corners(side);
    std::vector<std::uint32_t> encoded(corners.size());
    meshopt_encodeFilterExp(encoded.data(), num_corners, 12, 15, corners.data());
    std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(num_corners, 12));
    vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), encoded.data(), num_corners, 12));
    const int view = compressed_view(file, vertices, 12, num_corners, "ATTRIBUTES");
    file.root["bufferViews"].back()["extensions"]["EXT_meshopt_compression"]["filter"] = "EXPONENTIAL";
    file.root["accessors"][0]["bufferView"] = view;
    file.root["buffers"][0]["byteLength"] = file.binary.size();
    const scene scene = voxelize::load_gltf(file.glb());
    for (std::size_t i = 0; i < num_corners; ++i)
        EXPECT_LT(glm::length(glm::vec3(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]) -
                              scene.primitives.at(0).positions.at(i)),
                  0.01F);
}

TEST(Meshopt, WhatDoesNotFitIsRefused) {
    const auto after = [](const char* key, const json& value) {
        builder file = with_meshopt("TRIANGLES");
        for (json& view : file.root["bufferViews"])
            if (view.contains("extensions") && view["byteLength"] == num_corners * 12)
                view["extensions"]["EXT_meshopt_compression"][key] = value;
        return error_of(file);
    };
    const std::string where = "bufferViews[1].extensions.EXT_meshopt_compression";
    EXPECT_EQ(where + ": gives 960 bytes, its buffer view has 972", after("count", num_corners - 1));
    EXPECT_EQ(where + ".byteStride: 300 is not in the range 1 to 256", after("byteStride", 300));
    EXPECT_EQ(where + ": mode \"POINTS\" is not known", after("mode", "POINTS"));
    EXPECT_EQ(where + ": TRIANGLES cannot have 81 elements of 12 bytes", after("mode", "TRIANGLES"));
    EXPECT_EQ(where + ": QUATERNION cannot have 81 elements of 12 bytes", after("filter", "QUATERNION"));
    EXPECT_EQ(where + ": filter \"COLOR\" is not supported", after("filter", "COLOR"));
    EXPECT_EQ(where + ".buffer: 7 is not in buffers, which has 2", after("buffer", 7));
    EXPECT_EQ("bufferViews[1]: its compressed data cannot be decoded by meshoptimizer", after("byteLength", 5));
}

TEST(Meshopt, CompressedBytesMayBeWrong) {
    const builder file = with_meshopt("TRIANGLES");
    for (std::size_t at = 0; at < file.binary.size(); at += 3) {
        builder damaged = file;
        damaged.binary[at] ^= std::byte{0x55};
        (void)error_of(damaged); // any outcome but a crash
    }
}

#endif

#ifdef VOXELIZE_HAS_DRACO

builder with_draco() {
    builder file;
    const std::vector<float> corners = grid_corners(side);
    const std::vector<std::uint32_t> indices = grid_indices(side);
    draco::TriangleSoupMeshBuilder soup;
    soup.Start(static_cast<int>(num_indices / 3));
    const int position = soup.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    for (std::size_t face = 0; face < num_indices / 3; ++face)
        soup.SetAttributeValuesForFace(position, draco::FaceIndex(static_cast<std::uint32_t>(face)),
                                       &corners[3 * indices[3 * face]], &corners[3 * indices[3 * face + 1]],
                                       &corners[3 * indices[3 * face + 2]]);
    const std::unique_ptr<draco::Mesh> mesh = soup.Finalize();
    draco::Encoder encoder;
    encoder.SetSpeedOptions(5, 5);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 16);
    draco::EncoderBuffer encoded;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &encoded).ok());
    const int view = file.view(std::as_bytes(std::span(encoded.data(), encoded.size())));
    const int corner_accessor =
        file.append("accessors", {{"componentType", gltf_test::f32}, {"count", mesh->num_points()}, {"type", "VEC3"}});
    const int index_accessor =
        file.append("accessors", {{"componentType", gltf_test::u16}, {"count", num_indices}, {"type", "SCALAR"}});
    json& primitive = file.mesh({{"POSITION", corner_accessor}});
    primitive["indices"] = index_accessor;
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}};
    file.root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    file.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    return file;
}

TEST(Draco, WhatWasCompressedComesBack) {
    const scene scene = voxelize::load_gltf(with_draco().glb());
    EXPECT_TRUE(scene.warnings.empty());
    const voxelize::primitive& part = scene.primitives.at(0);
    EXPECT_EQ(num_indices / 3, part.triangles.size());
    ASSERT_EQ(num_corners, part.positions.size());
    const std::vector<float> corners = grid_corners(side);
    for (const glm::vec3& p : part.positions) { // in an order of Draco's; 16 bits over 8 units
        const auto at = static_cast<std::size_t>(std::lround(p.y) * side + std::lround(p.x));
        EXPECT_LT(glm::length(p - glm::vec3(corners[3 * at], corners[3 * at + 1], corners[3 * at + 2])), 1e-3F);
    }
    for (const glm::uvec3& t : part.triangles)
        EXPECT_LT(0,
                  glm::cross(part.positions[t.y] - part.positions[t.x], part.positions[t.z] - part.positions[t.x]).z);
}

TEST(Draco, WhatDoesNotFitIsRefused) {
    const auto after = [](auto&& change) {
        builder file = with_draco();
        change(file.root, file.root["meshes"][0]["primitives"][0]);
        return error_of(file);
    };
    const std::string where = "meshes[0].primitives[0]";
    EXPECT_EQ("Draco: " + where + ": its data has another number of vertices than its accessors",
              after([](json& root, json&) { root["accessors"][0]["count"] = 80; }));
    EXPECT_EQ("Draco: " + where + ": its data has another number of indices than its accessor",
              after([](json& root, json&) { root["accessors"][1]["count"] = 3; }));
    EXPECT_EQ("Draco: " + where + ": an attribute is not in its data", after([](json&, json& p) {
                  p["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 9;
              }));
    EXPECT_EQ(where + ": is compressed with KHR_draco_mesh_compression and has no indices",
              after([](json&, json& p) { p.erase("indices"); }));
    EXPECT_NE(std::string::npos,
              after([](json& root, json&) { root["accessors"][0]["count"] = 4294967295; }).find("MiB"));
}

TEST(Draco, CompressedBytesMayBeWrong) {
    const builder file = with_draco();
    const std::size_t step = gltf_test::is_slow_build() ? 17 : 3;
    for (std::size_t at = 0; at < file.binary.size(); at += step) {
        builder damaged = file;
        damaged.binary[at] ^= std::byte{0x55};
        (void)error_of(damaged); // any outcome but an end of this process
    }
    builder cut = file;
    cut.root["bufferViews"][0]["byteLength"] = 20;
    EXPECT_EQ("Draco: meshes[0].primitives[0]: its data cannot be decoded", error_of(cut));
}

#endif

} // namespace
