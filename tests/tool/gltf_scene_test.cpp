// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// glTF features, one small file each, written by the test.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

using gltf_test::builder;
using gltf_test::json;
using voxelize::scene;

namespace {

scene load(const builder& file) { return voxelize::load_gltf(file.glb()); }

std::vector<glm::uvec3> triangles(std::initializer_list<glm::uvec3> list) { return list; }

bool warns(const scene& scene, std::string_view part) {
    for (const std::string& warning : scene.warnings)
        if (warning.find(part) != std::string::npos) return true;
    return false;
}

TEST(GltfScene, TriangleIsTakenAsItStands) {
    builder file;
    file.triangle();
    const scene scene = load(file);
    ASSERT_EQ(1U, scene.primitives.size());
    EXPECT_EQ((std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), scene.primitives[0].positions);
    EXPECT_EQ(triangles({{0, 1, 2}}), scene.primitives[0].triangles);
    EXPECT_TRUE(scene.primitives[0].texcoords.empty());
    EXPECT_TRUE(scene.primitives[0].colors.empty());
    ASSERT_EQ(1U, scene.materials.size());
    EXPECT_EQ(glm::vec4(1), scene.materials[0].base_color);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfScene, EveryIndexTypeGivesTheSameTriangles) {
    const auto with = [](auto value, const char* type) {
        builder file;
        file.triangle()["indices"] = file.accessor(std::vector<decltype(value)>{2, 0, 1, 0, 1, 2}, type);
        return load(file).primitives.at(0).triangles;
    };
    const auto expected = triangles({{2, 0, 1}, {0, 1, 2}});
    EXPECT_EQ(expected, with(std::uint8_t{}, "SCALAR"));
    EXPECT_EQ(expected, with(std::uint16_t{}, "SCALAR"));
    EXPECT_EQ(expected, with(std::uint32_t{}, "SCALAR"));
}

// World positions of the corners of instance N.
std::vector<glm::vec3> world_positions(const scene& scene, std::size_t n) {
    const voxelize::instance& shown = scene.instances.at(n);
    std::vector<glm::vec3> result;
    for (const glm::vec3& p : scene.primitives.at(shown.primitive).positions) result.emplace_back(shown.to_world(p));
    return result;
}

// Positions in a plane, corner i at (i, i % 2).
builder zigzag(int corners) {
    builder file;
    std::vector<float> positions;
    for (int i = 0; i < corners; ++i)
        positions.insert(positions.end(), {static_cast<float>(i), static_cast<float>(i % 2), 0});
    file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    return file;
}

TEST(GltfScene, StripKeepsTheWinding) {
    builder file = zigzag(5);
    file.root["meshes"][0]["primitives"][0]["mode"] = 5;
    const scene scene = load(file);
    EXPECT_EQ(triangles({{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}), scene.primitives.at(0).triangles);
    for (const glm::uvec3& t : scene.primitives[0].triangles) {
        const auto& p = scene.primitives[0].positions;
        EXPECT_GT(0, glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z); // all seen from the same side
    }
}

TEST(GltfScene, StripDropsItsStitches) {
    builder file = zigzag(6);
    json& primitive = file.root["meshes"][0]["primitives"][0];
    primitive["mode"] = 5;
    primitive["indices"] = file.accessor(std::vector<std::uint16_t>{0, 1, 2, 2, 3, 3, 4, 5}, "SCALAR");
    EXPECT_EQ(triangles({{0, 1, 2}, {3, 5, 4}}), load(file).primitives.at(0).triangles);
}

TEST(GltfScene, FanTurnsAroundItsFirstVertex) {
    builder file = zigzag(5);
    file.root["meshes"][0]["primitives"][0]["mode"] = 6;
    EXPECT_EQ(triangles({{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}), load(file).primitives.at(0).triangles);
}

TEST(GltfScene, DegenerateTrianglesOfAListStay) {
    builder file;
    file.triangle()["indices"] = file.accessor(std::vector<std::uint8_t>{0, 1, 1}, "SCALAR");
    EXPECT_EQ(triangles({{0, 1, 1}}), load(file).primitives.at(0).triangles);
}

TEST(GltfScene, LeftoverIndicesMakeNoTriangle) {
    builder file = zigzag(5);
    const scene scene = load(file);
    EXPECT_EQ(triangles({{0, 1, 2}}), scene.primitives.at(0).triangles);
    EXPECT_TRUE(warns(scene, "left over"));
}

TEST(GltfScene, PointsAndLinesAreListed) {
    const auto lines = [](int mode, int corners, bool expect_warning = false) {
        builder file = zigzag(corners);
        file.root["meshes"][0]["primitives"][0]["mode"] = mode;
        const scene scene = load(file);
        EXPECT_EQ(expect_warning, warns(scene, "left over that make no line")) << mode << ' ' << corners;
        EXPECT_EQ(0U, scene.triangle_count());
        return scene.primitives.empty() ? std::vector<glm::uvec2>{} : scene.primitives.at(0).lines;
    };
    using list = std::vector<glm::uvec2>;
    EXPECT_EQ((list{{0, 0}, {1, 1}, {2, 2}}), lines(0, 3));
    EXPECT_EQ((list{{0, 1}, {2, 3}}), lines(1, 4));
    EXPECT_EQ((list{{0, 1}, {2, 3}}), lines(1, 5, true));
    EXPECT_EQ((list{{0, 1}, {1, 2}, {2, 3}, {3, 0}}), lines(2, 4));
    EXPECT_EQ((list{{0, 1}, {1, 2}, {2, 3}}), lines(3, 4));
    EXPECT_EQ((list{{0, 1}, {1, 0}}), lines(2, 2));
    EXPECT_EQ(list{}, lines(2, 1, true));
    EXPECT_EQ(list{}, lines(3, 1, true));
    EXPECT_EQ(list{}, lines(1, 1, true));
}

TEST(GltfScene, IndicesOfLinesAreFollowedAndChecked) {
    const auto file = [](const std::vector<std::uint16_t>& indices) {
        builder result = zigzag(4);
        json& primitive = result.root["meshes"][0]["primitives"][0];
        primitive["mode"] = 3;
        primitive["indices"] = result.accessor(indices, "SCALAR");
        return result;
    };
    const scene scene = load(file({3, 0, 2}));
    EXPECT_EQ((std::vector<glm::uvec2>{{3, 0}, {0, 2}}), scene.primitives.at(0).lines);
    EXPECT_EQ(2U, scene.line_count());
    EXPECT_THROW((void)load(file({3, 0, 4})), voxelize::gltf_error);
}

TEST(GltfScene, QuantizedPositionsAreIntegersOrFractions) {
    const auto with = [](auto least, auto most, bool normalized) {
        using Value = decltype(most);
        builder file;
        file.root["extensionsRequired"] = {"KHR_mesh_quantization"};
        file.mesh({{"POSITION",
                    file.accessor(std::vector<Value>{least, 0, most, most, 0, 0, 0, most, 0}, "VEC3", normalized)}});
        return world_positions(load(file), 0).at(0);
    };
    EXPECT_EQ(glm::vec3(-1, 0, 1), with(std::int8_t{-128}, std::int8_t{127}, true));
    EXPECT_EQ(glm::vec3(-128, 0, 127), with(std::int8_t{-128}, std::int8_t{127}, false));
    EXPECT_EQ(glm::vec3(1, 0, 1), with(std::uint8_t{255}, std::uint8_t{255}, true));
    EXPECT_EQ(glm::vec3(-1, 0, 1), with(std::int16_t{-32767}, std::int16_t{32767}, true));
    EXPECT_EQ(glm::vec3(3, 0, 65535), with(std::uint16_t{3}, std::uint16_t{65535}, false));
}

TEST(GltfScene, InterleavedVerticesAreReadByStride) {
    builder file;
    // position, colour (normalised bytes)
    struct vertex {
        float position[3];
        std::uint8_t color[4];
    };
    const std::vector<vertex> vertices{
        {{0, 0, 0}, {255, 0, 0, 255}}, {{1, 0, 0}, {0, 255, 0, 51}}, {{0, 1, 0}, {0, 0, 255, 0}}};
    const int view = file.view(std::as_bytes(std::span(vertices)), sizeof(vertex));
    const int position = file.append(
        "accessors", {{"bufferView", view}, {"componentType", gltf_test::f32}, {"count", 3}, {"type", "VEC3"}});
    const int color = file.append("accessors", {{"bufferView", view},
                                                {"byteOffset", 12},
                                                {"componentType", gltf_test::u8},
                                                {"normalized", true},
                                                {"count", 3},
                                                {"type", "VEC4"}});
    file.mesh({{"POSITION", position}, {"COLOR_0", color}});
    const scene scene = load(file);
    EXPECT_EQ((std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), scene.primitives.at(0).positions);
    EXPECT_EQ((std::vector<glm::vec4>{{1, 0, 0, 1}, {0, 1, 0, 0.2F}, {0, 0, 1, 0}}), scene.primitives.at(0).colors);
}

TEST(GltfScene, ColorsOfThreeComponentsAreOpaque) {
    builder file;
    json& primitive = file.triangle();
    primitive["attributes"]["COLOR_0"] =
        file.accessor(std::vector<float>{0.25F, 0.5F, 0.75F, 0, 0, 0, 1, 1, 1}, "VEC3");
    EXPECT_EQ(glm::vec4(0.25F, 0.5F, 0.75F, 1), load(file).primitives.at(0).colors.at(0));
}

builder sparse_triangle(bool base_view, std::vector<std::uint16_t> places) {
    builder file;
    file.triangle();
    json& accessor = file.root["accessors"][0];
    if (!base_view) accessor.erase("bufferView");
    const std::vector<float> values{5, 6, 7, 8, 9, 10};
    accessor["sparse"] = {
        {"count", places.size()},
        {"indices", {{"bufferView", file.view(std::as_bytes(std::span(places)))}, {"componentType", gltf_test::u16}}},
        {"values", {{"bufferView", file.view(std::as_bytes(std::span(values)))}}}};
    return file;
}

TEST(GltfScene, SparseValuesReplaceTheirBase) {
    EXPECT_EQ((std::vector<glm::vec3>{{5, 6, 7}, {1, 0, 0}, {8, 9, 10}}),
              load(sparse_triangle(true, {0, 2})).primitives.at(0).positions);
}

TEST(GltfScene, SparseValuesStandOverZeros) {
    EXPECT_EQ((std::vector<glm::vec3>{{0, 0, 0}, {5, 6, 7}, {8, 9, 10}}),
              load(sparse_triangle(false, {1, 2})).primitives.at(0).positions);
}

TEST(GltfScene, IndicesWithoutABufferViewAreZerosOrSparse) {
    builder file;
    json& primitive = file.triangle();
    const std::vector<std::uint16_t> places{1, 2};
    const std::vector<std::uint8_t> values{1, 2};
    primitive["indices"] = file.append(
        "accessors",
        {{"componentType", gltf_test::u8},
         {"count", 3},
         {"type", "SCALAR"},
         {"sparse",
          {{"count", 2},
           {"indices",
            {{"bufferView", file.view(std::as_bytes(std::span(places)))}, {"componentType", gltf_test::u16}}},
           {"values", {{"bufferView", file.view(std::as_bytes(std::span(values)))}}}}}});
    EXPECT_EQ(triangles({{0, 1, 2}}), load(file).primitives.at(0).triangles);
    file.root["accessors"][1].erase("sparse");
    EXPECT_EQ(triangles({{0, 0, 0}}), load(file).primitives.at(0).triangles);
}

TEST(GltfScene, NodeTransformsComposeFromTheRoot) {
    builder file;
    file.triangle();
    file.root["nodes"] = {
        {{"translation", {10, 0, 0}}, {"children", {1}}},
        // a quarter turn about z, then twice the size
        {{"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}, {"scale", {2, 2, 2}}, {"children", {2}}},
        {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}, {"mesh", 0}},
    };
    const scene scene = load(file);
    const std::vector<glm::vec3> p = world_positions(scene, 0);
    const std::vector<glm::vec3> expected{{10, 0, 10}, {10, 2, 10}, {8, 0, 10}};
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(glm::length(p.at(i) - expected[i]), 1e-6F) << i;
    EXPECT_EQ(triangles({{0, 1, 2}}), scene.primitives[0].triangles);
}

TEST(GltfScene, MatricesAreComposedInDouble) {
    // 2^24 + 1 is no float: composed in float, the translations would cancel to 0.
    builder file;
    file.triangle();
    file.root["nodes"] = {{{"translation", {16777217.0, 0, 0}}, {"children", {1}}},
                          {{"translation", {-16777216.0, 0, 0}}, {"mesh", 0}}};
    EXPECT_EQ(glm::vec3(1, 0, 0), world_positions(load(file), 0).at(0));
}

TEST(GltfScene, QuaternionsAreBroughtToLengthOne) {
    builder file;
    file.triangle();
    file.root["nodes"][0]["rotation"] = {0, 0, 3, 3};
    EXPECT_LT(glm::length(world_positions(load(file), 0).at(1) - glm::vec3(0, 1, 0)), 1e-6F);
}

TEST(GltfScene, TransformsKnowWhetherTheyMirror) {
    builder file;
    file.triangle();
    const auto mirrors = [&](const std::vector<double>& scale) {
        file.root["nodes"][0]["scale"] = scale;
        const scene scene = load(file);
        EXPECT_EQ(triangles({{0, 1, 2}}), scene.primitives.at(0).triangles);
        return scene.instances.at(0).to_world.mirrors();
    };
    EXPECT_TRUE(mirrors({-1, 1, 1}));
    EXPECT_FALSE(mirrors({-1, -1, 1}));
}

TEST(GltfScene, AMeshIsKeptOnceAndShownByEachOfItsNodes) {
    builder file;
    file.triangle();
    file.append("nodes", {{"mesh", 0}, {"translation", {0, 0, 3}}});
    const scene scene = load(file);
    EXPECT_EQ(1U, scene.primitives.size());
    ASSERT_EQ(2U, scene.instances.size());
    EXPECT_EQ(glm::vec3(1, 0, 0), world_positions(scene, 0)[1]);
    EXPECT_EQ(glm::vec3(1, 0, 3), world_positions(scene, 1)[1]);
    EXPECT_EQ(2U, scene.triangle_count());
    EXPECT_EQ(6U, scene.vertex_count());
}

TEST(GltfScene, NodesWithoutAFinitePlaceAreLeftOut) {
    builder file;
    file.triangle();
    file.root["nodes"] = {{{"scale", {1e200, 1e200, 1e200}}, {"children", {1}}},
                          {{"scale", {1e200, 1e200, 1e200}}, {"mesh", 0}},
                          {{"mesh", 0}}};
    const scene scene = load(file);
    EXPECT_EQ(1U, scene.instances.size());
    EXPECT_TRUE(warns(scene, "1 node(s) with a transform that is not finite"));
}

TEST(GltfScene, TheDefaultSceneIsTakenElseTheFirst) {
    builder file;
    file.triangle();
    file.append("nodes", {{"mesh", 0}, {"translation", {7, 0, 0}}});
    file.append("nodes", {{"mesh", 0}, {"translation", {9, 0, 0}}});
    file.root["scenes"] = {{{"nodes", {1}}}, {{"nodes", {2}}}};
    scene first = load(file);
    ASSERT_EQ(1U, first.instances.size());
    EXPECT_EQ(7, world_positions(first, 0)[0].x);
    EXPECT_TRUE(warns(first, "2 scenes"));
    file.root["scene"] = 1;
    EXPECT_EQ(9, world_positions(load(file), 0)[0].x);
    file.root.erase("scene");
    file.root.erase("scenes");
    EXPECT_EQ(3U, load(file).instances.size());
}

TEST(GltfScene, MeshesWithoutAnyNodeStandAsTheyAre) {
    builder file;
    file.triangle();
    file.root.erase("nodes");
    const scene scene = load(file);
    EXPECT_EQ(1U, scene.primitives.size());
    EXPECT_TRUE(warns(scene, "no nodes"));
}

TEST(GltfScene, MaterialsKeepTheirFactors) {
    builder file;
    file.triangle()["material"] = 1;
    file.triangle();
    file.root["materials"] = {{{"name", "glass\n"}, {"alphaMode", "BLEND"}},
                              {{"name", "leaf"},
                               {"alphaMode", "MASK"},
                               {"alphaCutoff", 0.25},
                               {"doubleSided", true},
                               {"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.25, 1, 0.75}}}}}};
    const scene scene = load(file);
    ASSERT_EQ(3U, scene.materials.size());
    EXPECT_EQ("glass?", scene.materials[0].name);
    EXPECT_EQ(voxelize::alpha_mode::blend, scene.materials[0].alpha);
    EXPECT_EQ(glm::vec4(0.5F, 0.25F, 1, 0.75F), scene.materials[1].base_color);
    EXPECT_EQ(voxelize::alpha_mode::mask, scene.materials[1].alpha);
    EXPECT_EQ(0.25F, scene.materials[1].alpha_cutoff);
    EXPECT_TRUE(scene.materials[1].double_sided);
    EXPECT_EQ(1U, scene.primitives[0].material);
    EXPECT_EQ(2U, scene.primitives[1].material); // the default, after the file's own
    EXPECT_EQ("default", scene.materials[2].name);
}

// A triangle with coordinates, a material and a texture of 2 x 1 pixels; the picture is left to the test.
builder textured() {
    builder file;
    json& primitive = file.triangle();
    primitive["attributes"]["TEXCOORD_0"] = file.accessor(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2");
    primitive["material"] = 0;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    file.root["textures"] = {{{"source", 0}, {"sampler", 0}}};
    file.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
    return file;
}

const std::vector<std::uint8_t> red_and_green{255, 0, 0, 255, 0, 255, 0, 128};

void expect_textured(const scene& scene) {
    ASSERT_EQ(1U, scene.images.size()) << (scene.warnings.empty() ? "" : scene.warnings[0]);
    EXPECT_EQ(2U, scene.images[0].width);
    EXPECT_EQ(1U, scene.images[0].height);
    EXPECT_EQ(red_and_green, scene.images[0].rgba);
    ASSERT_EQ(0, scene.materials[0].texture);
    EXPECT_EQ(voxelize::wrap_mode::clamp_to_edge, scene.textures[0].wrap_s);
    EXPECT_EQ(voxelize::wrap_mode::mirrored_repeat, scene.textures[0].wrap_t);
    EXPECT_EQ(voxelize::filter_mode::nearest, scene.textures[0].filter);
    EXPECT_EQ((std::vector<glm::vec2>{{0, 0}, {1, 0}, {0, 1}}), scene.primitives[0].texcoords);
}

TEST(GltfScene, PictureInABufferView) {
    builder file = textured();
    const int view = file.view(gltf_test::png(2, 1, red_and_green));
    file.root["images"] = {{{"bufferView", view}, {"mimeType", "image/png"}}};
    expect_textured(load(file));
}

TEST(GltfScene, PictureInADataUri) {
    builder file = textured();
    file.root["images"] = {
        {{"uri", "data:image/png;base64," + gltf_test::base64(gltf_test::png(2, 1, red_and_green))}}};
    expect_textured(load(file));
}

TEST(GltfScene, PictureAndBufferInFiles) {
    builder file = textured();
    file.root["images"] = {{{"uri", "a%20picture.png"}}};
    file.root["buffers"] = {{{"byteLength", file.binary.size()}, {"uri", "sub/../data.bin"}}};
    std::vector<std::byte> longer = file.binary;
    longer.resize(longer.size() + 5); // a file may be longer than its declared length
    const auto reader = [&](const std::filesystem::path& path, std::uint64_t) {
        if (path == "a picture.png") return gltf_test::png(2, 1, red_and_green);
        if (path == "data.bin") return longer;
        throw voxelize::gltf_error("unexpected " + path.string());
    };
    expect_textured(voxelize::load_gltf(gltf_test::bytes_of(file.root.dump()), reader));
}

TEST(GltfScene, FilesAreFoundBesideTheGltf) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "voxelpipe_gltf_scene";
    std::filesystem::create_directories(folder / "textures");
    builder file = textured();
    file.root["images"] = {{{"uri", "textures/p.png"}}};
    file.root["buffers"] = {{{"byteLength", file.binary.size()}, {"uri", "data.bin"}}};
    const auto write = [&](const std::filesystem::path& name, const std::vector<std::byte>& bytes) {
        std::ofstream(folder / name, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    write("textures/p.png", gltf_test::png(2, 1, red_and_green));
    write("data.bin", file.binary);
    write("scene.gltf", gltf_test::bytes_of(file.root.dump()));
    expect_textured(voxelize::load_gltf(folder / "scene.gltf"));
    std::filesystem::remove_all(folder);
}

TEST(GltfScene, BufferInADataUri) {
    builder file;
    file.triangle();
    file.root["buffers"] = {{{"byteLength", file.binary.size()},
                             {"uri", "data:application/octet-stream;base64," + gltf_test::base64(file.binary)}}};
    EXPECT_EQ(1U, voxelize::load_gltf(gltf_test::bytes_of(file.root.dump())).triangle_count());
}

TEST(GltfScene, TextureTransformScalesThenTurnsThenMoves) {
    builder file = textured();
    const int view = file.view(gltf_test::png(2, 1, red_and_green));
    file.root["images"] = {{{"bufferView", view}}};
    json& info = file.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"]["KHR_texture_transform"] = {
        {"offset", {10, 20}}, {"rotation", std::numbers::pi / 2}, {"scale", {2, 3}}};
    const scene scene = load(file);
    const auto& uv = scene.primitives.at(0).texcoords;
    // Counter-clockwise with v downwards: u turns to -v, v turns to u.
    EXPECT_LT(glm::length(uv.at(0) - glm::vec2(10, 20)), 1e-5F);
    EXPECT_LT(glm::length(uv.at(1) - glm::vec2(10, 18)), 1e-5F);
    EXPECT_LT(glm::length(uv.at(2) - glm::vec2(13, 20)), 1e-5F);
}

TEST(GltfScene, TextureTransformOverridesTheSet) {
    builder file = textured();
    const int view = file.view(gltf_test::png(2, 1, red_and_green));
    file.root["images"] = {{{"bufferView", view}}};
    json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = file.accessor(std::vector<std::uint8_t>{255, 0, 0, 51, 0, 0}, "VEC2", true);
    attributes["TEXCOORD_2"] = file.accessor(std::vector<std::uint16_t>{0, 65535, 0, 0, 0, 0}, "VEC2", true);
    json& info = file.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["texCoord"] = 1;
    EXPECT_EQ((std::vector<glm::vec2>{{1, 0}, {0, 0.2F}, {0, 0}}), load(file).primitives.at(0).texcoords);
    info["extensions"]["KHR_texture_transform"] = {{"texCoord", 2}};
    EXPECT_EQ((std::vector<glm::vec2>{{0, 1}, {0, 0}, {0, 0}}), load(file).primitives.at(0).texcoords);
    info["extensions"]["KHR_texture_transform"] = {{"texCoord", 3}};
    const scene without = load(file);
    EXPECT_TRUE(without.primitives.at(0).texcoords.empty());
    EXPECT_TRUE(warns(without, "texture coordinates"));
}

TEST(GltfScene, APictureThatCannotBeHadIsAWarning) {
    const auto with = [](const json& image) {
        builder file = textured();
        file.root["images"] = json::array({image});
        const scene scene = load(file);
        EXPECT_EQ(voxelize::material::no_texture, scene.materials.at(0).texture);
        EXPECT_TRUE(scene.primitives.at(0).texcoords.empty());
        EXPECT_EQ(1U, scene.warnings.size());
        return scene.warnings.empty() ? std::string{} : scene.warnings.front();
    };
    EXPECT_NE(std::string::npos, with({{"uri", "away.png"}}).find("other files are not read"));
    EXPECT_NE(std::string::npos, with({{"uri", "../away.png"}}).find("leaves the folder"));
    EXPECT_NE(std::string::npos,
              with({{"uri", "data:image/png;base64,AAAA"}}).find("neither PNG, JPEG, WebP, TGA nor BMP"));
    EXPECT_NE(std::string::npos, with({{"uri", "data:image/png;base64,iVBORw0KGgo="}}).find("the PNG is cut short"));
    EXPECT_NE(std::string::npos, with(json::object()).find("neither a uri"));
}

TEST(GltfScene, IntegersWrittenAsFloatsAreIntegers) {
    builder file;
    file.triangle()["mode"] = 4.0;
    file.root["accessors"][0]["count"] = 3.0;
    EXPECT_EQ(1U, load(file).triangle_count());
}

TEST(GltfScene, WhatIsLeftOutIsNamed) {
    builder file;
    file.triangle();
    file.root["animations"] = {{{"channels", json::array()}}};
    file.root["extensionsUsed"] = {"KHR_materials_sheen", "ACME_secret", "KHR_texture_transform",
                                   "KHR_materials_unlit"};
    const scene scene = load(file);
    EXPECT_EQ(1U, scene.triangle_count());
    for (const char* part : {"1 animation(s)", "KHR_materials_sheen", "ACME_secret"})
        EXPECT_TRUE(warns(scene, part)) << part;
    EXPECT_EQ(3U, scene.warnings.size());
}

// Two triangles; the variant "night" gives the first another material, "day" none.
builder varied() {
    builder file;
    for (int m = 0; m < 3; ++m) file.append("materials", {{"name", "m" + std::to_string(m)}});
    file.root["extensionsUsed"] = {"KHR_materials_variants"};
    file.root["extensionsRequired"] = {"KHR_materials_variants"};
    file.root["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
    json& first = file.triangle();
    first["material"] = 0;
    first["extensions"]["KHR_materials_variants"]["mappings"] = {{{"variants", {0}}, {"material", 1}},
                                                                 {{"variants", {1}}, {"material", 2}}};
    file.triangle()["extensions"]["KHR_materials_variants"]["mappings"] = {{{"variants", {0}}, {"material", 2}}};
    return file;
}

std::vector<std::uint32_t> materials_of(const builder& file, std::optional<std::string> variant) {
    voxelize::gltf_options options;
    options.variant = std::move(variant);
    const scene made = voxelize::load_gltf(file.glb(), {}, {}, options);
    std::vector<std::uint32_t> materials;
    for (const voxelize::instance& shown : made.instances)
        materials.push_back(made.primitives[shown.primitive].material);
    if (!options.variant) {
        EXPECT_TRUE(warns(made, "the file has 2 material variant(s), \"day\", \"night\": surfaces have their own"));
    } else {
        EXPECT_TRUE(made.warnings.empty());
    }
    return materials;
}

TEST(GltfScene, VariantsGiveOtherMaterials) {
    using numbers = std::vector<std::uint32_t>;
    const builder file = varied();
    EXPECT_EQ((numbers{0, 3}), materials_of(file, std::nullopt)); // 3: the default material
    EXPECT_EQ((numbers{1, 2}), materials_of(file, "day"));
    EXPECT_EQ((numbers{2, 3}), materials_of(file, "night"));
}

TEST(GltfScene, VariantsThatAreNotThereAreErrors) {
    const auto error_of = [](const builder& file, const char* variant) -> std::string {
        voxelize::gltf_options options;
        options.variant = variant;
        try {
            (void)voxelize::load_gltf(file.glb(), {}, {}, options);
        } catch (const voxelize::gltf_error& error) {
            return error.what();
        }
        return "";
    };
    builder file = varied();
    EXPECT_EQ("there is no material variant \"dusk\"; the file has \"day\", \"night\"", error_of(file, "dusk"));
    builder none;
    none.triangle();
    EXPECT_EQ("there is no material variant \"day\", the file has none", error_of(none, "day"));
    json& mapping = file.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][1];
    const std::string where = "meshes[0].primitives[0].extensions.KHR_materials_variants.mappings[1]";
    mapping["variants"] = {2};
    EXPECT_EQ(where + ".variants[0]: 2 is not in variants, which has 2", error_of(file, "day"));
    mapping["variants"] = {1};
    mapping["material"] = 9;
    EXPECT_EQ(where + ".material: 9 is not in materials, which has 3", error_of(file, "day"));
}

TEST(GltfScene, PositionsThatAreNotFiniteAreCounted) {
    builder file;
    file.mesh({{"POSITION", file.accessor(std::vector<float>{NAN, 0, 0, 1, INFINITY, 0, 0, 1, 0}, "VEC3")}});
    const scene scene = load(file);
    EXPECT_EQ(1U, scene.triangle_count());
    EXPECT_TRUE(warns(scene, "2 vertices at positions that are not finite"));
}

} // namespace
