// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Morph targets, skins and animations: a model in the pose that its file states, or in that of one moment.
#include "gltf_builder.hpp"

#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

using gltf_test::builder;
using gltf_test::json;
using voxelize::scene;

namespace {

using points = std::vector<glm::dvec3>;

scene load(const builder& file, std::optional<std::string> animation = {}, double seconds = 0) {
    voxelize::gltf_options options;
    options.animation = std::move(animation);
    options.seconds = seconds;
    return voxelize::load_gltf(file.glb(), {}, {}, options);
}

std::string error_of(const builder& file, std::optional<std::string> animation = {}) {
    try {
        (void)load(file, std::move(animation));
    } catch (const voxelize::gltf_error& error) {
        return error.what();
    }
    return "no error";
}

std::string text_of(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    return text;
}

// The corners in the world of what is shown at place WHICH.
points corners(const scene& scene, std::size_t which = 0) {
    points result;
    const voxelize::instance& shown = scene.instances.at(which);
    for (const glm::vec3& p : scene.primitives.at(shown.primitive).positions) result.push_back(shown.to_world(p));
    return result;
}

void expect_near(const points& expected, const points& found, double tolerance = 1e-6) {
    ASSERT_EQ(expected.size(), found.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_LT(glm::length(expected[i] - found[i]), tolerance)
            << i << ": " << found[i].x << ' ' << found[i].y << ' ' << found[i].z;
}

// A triangle with two targets: the first lifts corner 1 by 1, the second (sparse, over zeros) moves corner 2 by 4 in x.
builder morphing() {
    builder file;
    json& primitive = file.triangle();
    const int lift = file.accessor(std::vector<float>{0, 0, 0, 0, 0, 1, 0, 0, 0}, "VEC3");
    const std::vector<std::uint8_t> place{2};
    const std::vector<float> offset{4, 0, 0};
    const int indices = file.view(std::as_bytes(std::span(place)));
    const int values = file.view(std::as_bytes(std::span(offset)));
    const int move =
        file.append("accessors", {{"componentType", gltf_test::f32},
                                  {"count", 3},
                                  {"type", "VEC3"},
                                  {"sparse",
                                   {{"count", 1},
                                    {"indices", {{"bufferView", indices}, {"componentType", gltf_test::u8}}},
                                    {"values", {{"bufferView", values}}}}}});
    primitive["targets"] = {{{"POSITION", lift}, {"NORMAL", lift}}, {{"POSITION", move}}};
    return file;
}

TEST(GltfPose, MorphTargetsStandAtTheirWeights) {
    builder file = morphing();
    expect_near({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, corners(load(file)));
    file.root["meshes"][0]["weights"] = {0.5, 0};
    expect_near({{0, 0, 0}, {1, 0, 0.5}, {0, 1, 0}}, corners(load(file)));
    // A node's weights take the place of the mesh's; a second node keeps those.
    file.root["nodes"][0]["weights"] = {0, 0.25};
    file.append("nodes", {{"mesh", 0}, {"translation", {0, 0, 10}}});
    const scene scene = load(file);
    expect_near({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, corners(scene, 0));
    expect_near({{0, 0, 10}, {1, 0, 10.5}, {0, 1, 10}}, corners(scene, 1));
    EXPECT_EQ("", text_of(scene.warnings));
}

TEST(GltfPose, MorphTargetsMayBeQuantized) {
    builder file;
    file.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    json& primitive = file.mesh(
        {{"POSITION", file.accessor(std::vector<std::uint8_t>{0, 0, 0, 255, 0, 0, 0, 255, 0}, "VEC3", true)}});
    primitive["targets"] = {
        {{"POSITION", file.accessor(std::vector<std::int8_t>{0, 0, 127, 0, 0, -127, 0, 0, -128}, "VEC3", true)}}};
    file.root["meshes"][0]["weights"] = {2};
    expect_near({{0, 0, 2}, {1, 0, -2}, {0, 1, -2}}, corners(load(file)));
}

TEST(GltfPose, MorphTargetsThatDoNotFitAreErrors) {
    builder file = morphing();
    file.root["meshes"][0]["weights"] = {1, 1};
    file.root["accessors"][1]["count"] = 2;
    EXPECT_EQ("meshes[0].primitives[0].targets[0]: POSITION has 2 elements, the base shape 3", error_of(file));
    file.root["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = 99;
    EXPECT_EQ("meshes[0].primitives[0].targets[0].POSITION: 99 is not in accessors, which has 3", error_of(file));
}

// A triangle of 100 units a side, bound to one joint or two; nodes 1 and 2 are the joints.
builder skinned(std::vector<std::uint8_t> joints, std::vector<float> weights) {
    builder file;
    json& primitive =
        file.mesh({{"POSITION", file.accessor(std::vector<float>{0, 0, 0, 100, 0, 0, 0, 100, 0}, "VEC3")}});
    primitive["attributes"]["JOINTS_0"] = file.accessor(joints, "VEC4");
    primitive["attributes"]["WEIGHTS_0"] = file.accessor(weights, "VEC4");
    file.root["nodes"][0]["skin"] = 0;
    file.root["skins"] = {{{"joints", {1, 2}}}};
    file.append("nodes", json::object());
    file.append("nodes", json::object());
    return file;
}

const std::vector<std::uint8_t> first_joint(12, 0);
const std::vector<float> whole{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};

TEST(GltfPose, JointsDecideAndTheNodeDoesNot) {
    builder file = skinned(first_joint, whole);
    json& nodes = file.root["nodes"];
    nodes[0]["translation"] = {1000, 0, 0}; // of the mesh's node: a skin overrides it
    nodes[0]["scale"] = {0, 0, 0};
    nodes[1]["scale"] = {0.01, 0.01, 0.01};
    nodes[1]["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    const scene scene = load(file);
    expect_near({{0, 0, 0}, {1, 0, 0}, {0, 0, -1}}, corners(scene));
    EXPECT_EQ("", text_of(scene.warnings));
    EXPECT_EQ(glm::uvec3(0, 1, 2), scene.primitives[0].triangles[0]);
}

TEST(GltfPose, WeightsBlendJoints) {
    // Corner 0 follows joint 0, corner 1 half each (in weights that do not add up to 1), corner 2 none.
    builder file = skinned({0, 0, 0, 0, 0, 1, 0, 0, 1, 1, 1, 1}, {1, 0, 0, 0, 0.2F, 0.2F, 0, 0, 0, 0, 0, 0});
    file.root["nodes"][1]["translation"] = {0, 0, 10};
    file.root["nodes"][2]["translation"] = {0, 0, 30};
    expect_near({{0, 0, 10}, {100, 0, 20}, {0, 100, 10}}, corners(load(file)));
}

TEST(GltfPose, ASecondSetOfJointsCounts) {
    builder file = skinned(first_joint, {0.5F, 0, 0, 0, 0.5F, 0, 0, 0, 0.5F, 0, 0, 0});
    json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = file.accessor(std::vector<std::uint16_t>(12, 1), "VEC4");
    attributes["WEIGHTS_1"] =
        file.accessor(std::vector<std::uint8_t>{0, 0, 0, 128, 0, 0, 0, 128, 0, 0, 0, 128}, "VEC4", true);
    file.root["nodes"][2]["translation"] = {0, 0, 8};
    const double share = 128.0 / 255 / (128.0 / 255 + 0.5);
    expect_near({{0, 0, 8 * share}, {100, 0, 8 * share}, {0, 100, 8 * share}}, corners(load(file)), 1e-4);
}

TEST(GltfPose, InverseBindMatricesComeFirst) {
    builder file = skinned(first_joint, whole);
    std::vector<float> matrices(32);
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t d = 0; d < 4; ++d) matrices[16 * i + 5 * d] = 1;
    matrices[12] = -100; // joint 0 was bound at x = 100
    file.root["skins"][0]["inverseBindMatrices"] = file.accessor(matrices, "MAT4");
    json& accessor = file.root["accessors"].back();
    accessor["count"] = 2;
    file.root["nodes"][1]["scale"] = {-2, 2, 2};
    const scene scene = load(file);
    expect_near({{200, 0, 0}, {0, 0, 0}, {200, 200, 0}}, corners(scene));
    EXPECT_EQ(glm::uvec3(0, 2, 1), scene.primitives[0].triangles[0]); // the joint mirrors: fronts stay fronts
    accessor["count"] = 1;
    EXPECT_EQ("skins[0]: has 2 joints and 1 inverseBindMatrices", error_of(file));
}

// Far away, a float of the world would be half a unit coarse.
TEST(GltfPose, SkinsFarFromTheOriginKeepTheirShape) {
    builder file = skinned(first_joint, whole);
    file.root["nodes"][1]["translation"] = {4186133.37, 834965.61, 4723773.93};
    file.root["nodes"][1]["scale"] = {0.01, 0.01, 0.01};
    const points found = corners(load(file));
    expect_near(
        {{4186133.37, 834965.61, 4723773.93}, {4186134.37, 834965.61, 4723773.93}, {4186133.37, 834966.61, 4723773.93}},
        found);
}

TEST(GltfPose, OneMeshMayHaveSeveralPoses) {
    builder file = skinned(first_joint, whole);
    file.root["skins"].push_back({{"joints", {2}}});
    file.root["nodes"][2]["translation"] = {0, 0, 7};
    file.append("nodes", {{"mesh", 0}, {"skin", 1}});
    file.append("nodes", {{"mesh", 0}, {"translation", {0, 0, 9}}}); // without a skin
    const scene scene = load(file);
    EXPECT_EQ(3U, scene.instances.size());
    for (const auto& [which, z] : {std::pair{0U, 0.0}, std::pair{1U, 7.0}, std::pair{2U, 9.0}})
        expect_near({{0, 0, z}, {100, 0, z}, {0, 100, z}}, corners(scene, which));
}

TEST(GltfPose, SkinsThatDoNotFitAreErrors) {
    builder file = skinned({2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, whole);
    EXPECT_EQ("meshes[0].primitives[0]: joint 2 of vertex 0 is not in the skin, which has 2", error_of(file));
    file.root["skins"][0]["joints"] = {1, 2, 3};
    EXPECT_EQ("skins[0].joints[2]: 3 is not in nodes, which has 3", error_of(file));
    file.root["skins"][0]["joints"] = json::array();
    EXPECT_EQ("skins[0]: has no joints", error_of(file));
    file.root["nodes"][0]["skin"] = 1;
    EXPECT_EQ("nodes[0].skin: 1 is not in skins, which has 1", error_of(file));
}

// Node 0 is moved by `channel`, with keys at 1 s and 3 s.
builder moving(const char* path, const std::vector<float>& values, const char* type, const char* interpolation) {
    builder file;
    file.triangle();
    const int times = file.accessor(std::vector<float>{1, 3}, "SCALAR");
    const int output = file.accessor(values, type);
    file.root["animations"] = {
        {{"name", "rest"}, {"samplers", 3}}, // broken, and nobody asks for it
        {{"name", "go"},
         {"samplers", {{{"input", times}, {"output", output}, {"interpolation", interpolation}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}}}};
    return file;
}

double x_at(const builder& file, double seconds) { return corners(load(file, "go", seconds)).at(0).x; }

TEST(GltfAnimation, KeysAreInterpolatedAsTheSamplerSays) {
    const builder linear = moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR");
    for (const auto& [seconds, x] :
         {std::pair{-5.0, 2.0}, std::pair{1.0, 2.0}, std::pair{1.5, 3.0}, std::pair{3.0, 6.0}, std::pair{99.0, 6.0}})
        EXPECT_DOUBLE_EQ(x, x_at(linear, seconds)) << seconds;
    const builder step = moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "STEP");
    EXPECT_EQ(2, x_at(step, 2.999));
    EXPECT_EQ(6, x_at(step, 3));
    // In-tangent, value, out-tangent: a slope of 1 a second at the first key, of 0 at the second.
    const builder spline =
        moving("translation", {0, 0, 0, 2, 0, 0, 1, 0, 0, 0, 0, 0, 6, 0, 0, 0, 0, 0}, "VEC3", "CUBICSPLINE");
    EXPECT_EQ(2, x_at(spline, 1));
    EXPECT_EQ(6, x_at(spline, 3));
    EXPECT_DOUBLE_EQ(0.5 * 2 + 0.5 * 6 + 0.125 * 1 * 2, x_at(spline, 2)); // the Hermite basis at one half
    // By number, and without a name.
    EXPECT_EQ(3, corners(load(linear, "1", 1.5)).at(0).x);
}

TEST(GltfAnimation, RotationsTakeTheShorterArc) {
    const float h = std::sqrt(0.5F);
    // From no turn to a quarter turn about z, given by the quaternion's other sign.
    const builder file = moving("rotation", {0, 0, 0, 1, 0, 0, -h, -h}, "VEC4", "LINEAR");
    const double angle = std::acos(-1) / 4; // half way
    expect_near({{0, 0, 0}, {std::cos(angle), std::sin(angle), 0}, {-std::sin(angle), std::cos(angle), 0}},
                corners(load(file, "go", 2)));
}

TEST(GltfAnimation, ScaleToNothingHides) {
    const builder file = moving("scale", {1, 1, 1, 0, 0, 0}, "VEC3", "STEP");
    EXPECT_EQ(1U, load(file, "go", 1).triangle_count());
    EXPECT_EQ(0U, load(file, "go", 3).triangle_count());
}

TEST(GltfAnimation, WeightsMoveMorphTargets) {
    builder file = moving("weights", {0, 0, 1, 0.5F}, "SCALAR", "LINEAR");
    json& primitive = file.root["meshes"][0]["primitives"][0];
    const int lift = file.accessor(std::vector<float>{0, 0, 0, 0, 0, 1, 0, 0, 0}, "VEC3");
    const int move = file.accessor(std::vector<float>{0, 0, 0, 0, 0, 0, 4, 0, 0}, "VEC3");
    primitive["targets"] = {{{"POSITION", lift}}, {{"POSITION", move}}};
    expect_near({{0, 0, 0}, {1, 0, 0.5}, {1, 1, 0}}, corners(load(file, "go", 2)));
}

TEST(GltfAnimation, WithoutARequestTheFileDecides) {
    const scene scene = load(moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR"));
    expect_near({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, corners(scene));
    EXPECT_EQ("the file has 2 animation(s): nodes stand as the file places them, --animation poses them\n",
              text_of(scene.warnings));
}

TEST(GltfAnimation, WhatIsNotThereIsAnErrorThatNamesWhatIs) {
    const builder file = moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR");
    EXPECT_EQ("there is no animation \"run\"; the file has \"rest\", \"go\"", error_of(file, "run"));
    EXPECT_EQ("there is no animation \"2\"; the file has \"rest\", \"go\"", error_of(file, "2"));
    EXPECT_EQ("animations[0].samplers: must be an array", error_of(file, "rest"));
    builder none;
    none.triangle();
    EXPECT_EQ("there is no animation \"run\", the file has none", error_of(none, "run"));
}

TEST(GltfAnimation, KeysThatDoNotFitAreErrors) {
    const std::string where = "the animation's channels[0]: ";
    EXPECT_EQ(where + "its output has 3 numbers, 2 keys need 6",
              error_of(moving("translation", {2, 0, 0}, "VEC3", "LINEAR"), "go"));
    EXPECT_EQ(where + "its output is of the wrong type for rotation",
              error_of(moving("rotation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR"), "go"));
    EXPECT_EQ("animations[1].samplers[0]: interpolation \"WAVE\" is not one of glTF's",
              error_of(moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "WAVE"), "go"));
    builder back = moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR");
    back.root["animations"][1]["samplers"][0]["input"] = back.accessor(std::vector<float>{3, 1}, "SCALAR");
    EXPECT_EQ(where + "its times do not ascend at key 1", error_of(back, "go"));
    builder matrix = moving("translation", {2, 0, 0, 6, 0, 0}, "VEC3", "LINEAR");
    matrix.root["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1};
    EXPECT_EQ("1 channel(s) of the animation move nodes that have a matrix: they are left out\n",
              text_of(load(matrix, "go").warnings));
}

} // namespace
