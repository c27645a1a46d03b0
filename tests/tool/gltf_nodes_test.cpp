// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Nodes that a scene shows, and their transforms: hidden nodes, nodes scaled to nothing, GPU instancing; and what
// --lenient puts right.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <cmath>

using gltf_test::builder;
using gltf_test::json;
using voxelize::scene;

namespace {

scene load(const builder& file, bool lenient = false) {
    voxelize::gltf_options options;
    options.lenient = lenient;
    return voxelize::load_gltf(file.glb(), {}, {}, options);
}

std::string error_of(const builder& file, bool lenient = false) {
    try {
        (void)load(file, lenient);
    } catch (const voxelize::gltf_error& error) {
        EXPECT_TRUE(lenient || !error.lenient_helps || load(file, true).triangle_count() > 0);
        return error.what();
    }
    return "no error";
}

std::string text_of(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    return text;
}

// The world position of corner CORNER of all that is shown, in order.
std::vector<glm::dvec3> shown(const scene& scene, std::size_t corner = 0) {
    std::vector<glm::dvec3> places;
    for (const voxelize::instance& one : scene.instances)
        places.push_back(one.to_world(scene.primitives.at(one.primitive).positions.at(corner)));
    return places;
}

using places = std::vector<glm::dvec3>;

TEST(GltfNodes, HiddenNodesHideAllBelowThem) {
    builder file;
    file.triangle();
    const json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
    const json visible = {{"KHR_node_visibility", {{"visible", true}}}};
    file.root["extensionsUsed"] = {"KHR_node_visibility"};
    file.root["nodes"] = {{{"mesh", 0}, {"translation", {1, 0, 0}}},
                          {{"mesh", 0}, {"extensions", hidden}, {"children", {2}}},
                          {{"mesh", 0}, {"extensions", visible}, {"translation", {3, 0, 0}}},
                          {{"mesh", 0}, {"extensions", visible}, {"translation", {4, 0, 0}}}};
    scene scene = load(file);
    EXPECT_EQ((places{{1, 0, 0}, {4, 0, 0}}), shown(scene));
    EXPECT_EQ("", text_of(scene.warnings));
    for (json& node : file.root["nodes"]) node["extensions"] = hidden;
    scene = load(file);
    EXPECT_TRUE(shown(scene).empty());
    EXPECT_EQ("every mesh of the scene is hidden or scaled to nothing\n", text_of(scene.warnings));
    file.root["nodes"][0]["extensions"]["KHR_node_visibility"]["visible"] = 0;
    EXPECT_EQ("nodes[0].extensions.KHR_node_visibility.visible: must be true or false, it is 0", error_of(file));
}

TEST(GltfNodes, WhatIsScaledToNothingIsNotShown) {
    builder file;
    file.triangle();
    file.root["nodes"] = {{{"mesh", 0}},
                          {{"mesh", 0}, {"translation", {50, 0, 0}}, {"scale", {0, 0, 0}}, {"children", {2}}},
                          {{"mesh", 0}, {"translation", {1, 0, 0}}},
                          {{"mesh", 0}, {"matrix", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 1}}},
                          {{"mesh", 0}, {"translation", {7, 0, 0}}, {"scale", {1, 1, 0}}}}; // flat is not nothing
    const scene scene = load(file);
    EXPECT_EQ((places{{0, 0, 0}, {7, 0, 0}}), shown(scene));
    EXPECT_EQ("", text_of(scene.warnings));
}

TEST(GltfNodes, GpuInstancesStandInTheNodesSpace) {
    builder file;
    file.triangle();
    const double half = std::sqrt(0.5);
    const float q = static_cast<float>(half);
    const int translation = file.accessor(std::vector<float>{0, 0, 0, 3, 0, 0, 6, 0, 0}, "VEC3");
    const int rotation = file.accessor(std::vector<float>{0, 0, 0, 1, 0, 0, q, q, 0, 0, 0, 2}, "VEC4");
    const int scale = file.accessor(std::vector<float>{1, 1, 1, 2, 2, 2, 0, 0, 0}, "VEC3");
    file.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
    file.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    json& node = file.root["nodes"][0];
    node["translation"] = {0, 10, 0};
    json& attributes = node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    attributes = {{"TRANSLATION", translation}};
    EXPECT_EQ((places{{0, 10, 0}, {3, 10, 0}, {6, 10, 0}}), shown(load(file)));
    EXPECT_EQ((places{{1, 10, 0}, {4, 10, 0}, {7, 10, 0}}), shown(load(file), 1));

    attributes = {{"TRANSLATION", translation}, {"ROTATION", rotation}, {"SCALE", scale}, {"_ID", translation}};
    scene scene = load(file);
    EXPECT_EQ("", text_of(scene.warnings));
    const places corners = shown(scene, 1); // (1, 0, 0): as it stands; turned to y and doubled; scaled to nothing
    ASSERT_EQ(2U, corners.size());
    EXPECT_EQ(glm::dvec3(1, 10, 0), corners[0]);
    EXPECT_LT(glm::length(glm::dvec3(3, 12, 0) - corners[1]), 1e-6);

    // Rotations may be normalised integers.
    attributes = {{"ROTATION", file.accessor(std::vector<std::int8_t>{0, 0, 127, 127}, "VEC4", true)}};
    EXPECT_LT(glm::length(glm::dvec3(0, 11, 0) - shown(load(file), 1).at(0)), 1e-6);
}

TEST(GltfNodes, GpuInstancesThatDoNotFitAreErrors) {
    const auto with = [](const char* name, const std::vector<float>& values, const char* type) {
        builder file;
        file.triangle();
        const int three = file.accessor(std::vector<float>(9), "VEC3");
        json& attributes = file.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        attributes = {{"TRANSLATION", three}};
        attributes[name] = file.accessor(values, type);
        return error_of(file);
    };
    const std::string where = "nodes[0].extensions.EXT_mesh_gpu_instancing";
    EXPECT_EQ(where + ".attributes: SCALE has 2 elements, another has 3", with("SCALE", std::vector<float>(6), "VEC3"));
    EXPECT_EQ(where + ".attributes: TRANSLATION is not a VEC3 of floats",
              with("TRANSLATION", std::vector<float>(6), "VEC2"));
    EXPECT_EQ(where + ".attributes: ROTATION is not a VEC4 of floats or of signed 8 or 16 bit integers",
              with("ROTATION", std::vector<float>(9), "VEC3"));
    EXPECT_EQ(where + ": ROTATION 0: is not a quaternion of a rotation",
              with("ROTATION", std::vector<float>(12), "VEC4"));
    builder file;
    file.triangle();
    file.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json::object();
    EXPECT_EQ(where + ".attributes: has none of TRANSLATION, ROTATION and SCALE", error_of(file));
}

// A warning that names the fault, and the scene that was meant.
void expect_lenient(const builder& file, const std::string& fault, const std::string& remedy, const places& expected) {
    EXPECT_EQ(fault, error_of(file));
    const scene scene = load(file, true);
    EXPECT_EQ(fault + "; " + remedy + "\n", text_of(scene.warnings));
    EXPECT_EQ(expected, shown(scene));
}

TEST(GltfLenient, ANodeThatIsInTheSceneTwiceIsShownOnce) {
    builder file;
    file.triangle();
    file.root["scenes"] = {{{"nodes", {0, 0}}}};
    expect_lenient(file, "nodes[0]: is in the scene twice", "it is shown once", {{0, 0, 0}});

    file.root["nodes"] = {{{"translation", {5, 0, 0}}, {"children", {1}}}, {{"mesh", 0}}};
    file.root["scenes"] = {{{"nodes", {1, 0}}}};
    expect_lenient(file, "nodes[1]: is in the scene twice", "it is shown once, below its parent", {{5, 0, 0}});

    file.root["nodes"] = {{{"translation", {5, 0, 0}}, {"children", {2}}},
                          {{"translation", {7, 0, 0}}, {"children", {2}}},
                          {{"mesh", 0}}};
    file.root["scenes"] = {{{"nodes", {0, 1}}}};
    expect_lenient(file, "nodes[2]: is a child of two nodes", "it stays below the first", {{5, 0, 0}});
}

// A triangle behind one byte too much: no part of it is aligned.
builder unaligned() {
    builder file;
    file.triangle();
    file.binary.insert(file.binary.begin(), std::byte{1});
    file.root["bufferViews"][0]["byteOffset"] = 1;
    return file;
}

TEST(GltfLenient, UnalignedDataIsReadWhereItLies) {
    EXPECT_EQ((places{{0, 0, 0}}), shown(load(unaligned()))); // nothing depends on it: no error either
    const scene scene = load(unaligned(), true);
    EXPECT_EQ((places{{1, 0, 0}}), shown(scene, 1));
    EXPECT_EQ("accessors[0]: is not aligned to its components of 4 bytes; it is read where it lies\n",
              text_of(scene.warnings));

    builder file; // normals of 16 bits behind each position: 18 bytes
    file.triangle();
    std::vector<std::byte> bytes(18 * 3);
    const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (std::size_t i = 0; i < 3; ++i) std::memcpy(&bytes[18 * i], &corners[3 * i], 12);
    file.root["accessors"][0]["bufferView"] = file.view(bytes, 18);
    expect_lenient(file, "bufferViews[1]: byteStride 18 is not a multiple of 4", "it is used as it is", {{0, 0, 0}});
    EXPECT_EQ((places{{1, 0, 0}}), shown(load(file, true), 1));
}

TEST(GltfLenient, IndicesMayHaveAStride) {
    builder file;
    json& primitive = file.triangle();
    const std::vector<std::uint16_t> spread{2, 9, 1, 9, 0, 9};
    const int view = file.view(std::as_bytes(std::span(spread)), 4);
    primitive["indices"] = file.append(
        "accessors", {{"bufferView", view}, {"componentType", gltf_test::u16}, {"count", 3}, {"type", "SCALAR"}});
    expect_lenient(file, "meshes[0].primitives[0]: indices lie in a buffer view with a byteStride", "it is followed",
                   {{0, 0, 0}});
    EXPECT_EQ(glm::uvec3(2, 1, 0), load(file, true).primitives.at(0).triangles.at(0));
}

TEST(GltfLenient, PaddingThatIsMissingIsZero) {
    builder file;
    file.triangle();
    file.root["buffers"] = {{{"byteLength", file.binary.size() + 3}}};
    expect_lenient(file, "buffers[0]: byteLength says 39, the data has 36", "the rest is taken as zero", {{0, 0, 0}});
    file.root["buffers"][0]["byteLength"] = file.binary.size() + 4;
    EXPECT_EQ("buffers[0]: byteLength says 40, the data has 36", error_of(file, true));
}

TEST(GltfLenient, ChunksMayHaveAnyLength) {
    builder file;
    file.triangle();
    std::vector<std::byte> bytes = file.glb();
    // One blank less at the end of the JSON chunk.
    const auto length = std::to_integer<std::uint32_t>(bytes[12]) + 256 * std::to_integer<std::uint32_t>(bytes[13]);
    bytes.insert(bytes.begin() + 20 + length, std::byte{' '});
    for (const auto& [at, number] :
         {std::pair<std::size_t, std::size_t>{8, bytes.size()}, std::pair<std::size_t, std::size_t>{12, length + 1}}) {
        bytes[at] = static_cast<std::byte>(number & 0xFF);
        bytes[at + 1] = static_cast<std::byte>(number >> 8);
    }
    EXPECT_THROW((void)voxelize::load_gltf(bytes), voxelize::gltf_error);
    voxelize::gltf_options options;
    options.lenient = true;
    const scene scene = voxelize::load_gltf(bytes, {}, {}, options);
    EXPECT_EQ(1U, scene.triangle_count());
    EXPECT_EQ("GLB chunk 0: its length is not a multiple of 4; the next chunk follows at once\n",
              text_of(scene.warnings));
}

TEST(GltfLenient, OnlySoManyFaultsAreNamed) {
    builder file;
    file.triangle();
    json& list = file.root["scenes"][0]["nodes"];
    for (int i = 0; i < 100; ++i) list.push_back(0);
    const scene scene = load(file, true);
    EXPECT_EQ(1U, scene.triangle_count());
    ASSERT_EQ(21U, scene.warnings.size());
    EXPECT_EQ("79 more faults of the file were put right by --lenient", scene.warnings.back());
}

// Warnings from before the error are not lost with it.
TEST(GltfLenient, ErrorsBringTheWarningsBeforeThem) {
    builder file;
    file.triangle()["indices"] = file.accessor(std::vector<std::uint16_t>{0, 1, 9}, "SCALAR");
    file.root["extensionsUsed"] = {"ACME_secret"};
    try {
        (void)load(file);
        ADD_FAILURE() << "no error";
    } catch (const voxelize::gltf_error& error) {
        EXPECT_EQ("extension ACME_secret is not known and ignored\n", text_of(error.warnings));
        EXPECT_FALSE(error.lenient_helps);
    }
}

} // namespace
