// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Materials of a model in the voxelize program's files: pictures and how they are laid on, colours and
// what they are multiplied with, masks, both sides of faces.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <numbers>
#include <utility>

using namespace tool_test;

namespace {

// (x, y) of the one layer of a grid, as sRGB and alpha.
glm::u8vec4 pixel(const array& colors, std::size_t x, std::size_t y) {
    return colors.at<glm::u8vec4>(y * colors.shape[2] + x);
}

TEST(Tool, PicturesStandUpright) {
    const scratch_folder folder;
    builder file;
    const std::vector<std::uint8_t> quarters{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255};
    const int material = gltf_test::add_textured_material(file, 2, 2, quarters);
    gltf_test::add_square(file, 0)["material"] = material;
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "color", "--origin", "0,0,-0.5",
                                        "--voxel-size", "0.125,0.125,1", "--extent", "8,8,1"});
    ASSERT_EQ(0, result.code) << result.err;
    const array colors = read_npy(folder / "o.npy");
    EXPECT_EQ((std::vector<std::size_t>{1, 8, 8, 4}), colors.shape);
    EXPECT_EQ("|u1", colors.type);
    EXPECT_EQ(glm::u8vec4(255, 0, 0, 255), pixel(colors, 0, 7)); // the picture's top left
    EXPECT_EQ(glm::u8vec4(0, 255, 0, 255), pixel(colors, 7, 7));
    EXPECT_EQ(glm::u8vec4(0, 0, 255, 255), pixel(colors, 0, 0));
    EXPECT_EQ(glm::u8vec4(255, 255, 255, 255), pixel(colors, 7, 0));
}

// The colour of one voxel of PicturesStandUpright's picture as a letter: r, g above b, w.
char letter(const array& colors, std::size_t x, std::size_t y) {
    const glm::u8vec4 c = pixel(colors, x, y);
    if (c == glm::u8vec4(255, 0, 0, 255)) return 'r';
    if (c == glm::u8vec4(0, 255, 0, 255)) return 'g';
    if (c == glm::u8vec4(0, 0, 255, 255)) return 'b';
    return c == glm::u8vec4(255, 255, 255, 255) ? 'w' : '?';
}

// The top row from the left and the left column from the top of that picture laid on the square. No texel's border
// crosses one of these voxels, nor the nearest point on the other triangle where both meet in one.
std::string top_and_left(const json& transform, int wrap_s, int wrap_t) {
    const scratch_folder folder;
    builder file;
    const std::vector<std::uint8_t> quarters{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255};
    const int material = gltf_test::add_textured_material(file, 2, 2, quarters);
    json& info = file.root["materials"].back()["pbrMetallicRoughness"]["baseColorTexture"];
    if (!transform.empty()) info["extensions"]["KHR_texture_transform"] = transform;
    file.root["extensionsUsed"] = json::array({"KHR_texture_transform"});
    file.root["samplers"].back()["wrapS"] = wrap_s;
    file.root["samplers"].back()["wrapT"] = wrap_t;
    gltf_test::add_square(file, 0)["material"] = material;
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "color", "--origin", "0,0,-0.5",
                                        "--voxel-size", "0.125,0.125,1", "--extent", "8,8,1"});
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_EQ("", result.err);
    const array colors = read_npy(folder / "o.npy");
    std::string text;
    for (std::size_t x = 0; x < 8; ++x) text += letter(colors, x, 7);
    text += ' ';
    for (std::size_t y = 8; y-- > 0;) text += letter(colors, 0, y);
    return text;
}

TEST(Tool, TexturesWrapAsTheirSamplersSay) {
    constexpr int repeat = 10497, mirrored = 33648, clamped = 33071;
    const json twice{{"scale", {2, 2}}};
    EXPECT_EQ("rrrrgggg rrrrbbbb", top_and_left({}, repeat, repeat));
    EXPECT_EQ("rrggrrgg rrbbrrbb", top_and_left(twice, repeat, repeat));
    EXPECT_EQ("rrggggrr rrbbrrbb", top_and_left(twice, mirrored, repeat));
    EXPECT_EQ("rrggrrgg rrbbbbrr", top_and_left(twice, repeat, mirrored));
    EXPECT_EQ("rrgggggg rrbbbbrr", top_and_left(twice, clamped, mirrored));
    EXPECT_EQ("rrggrrgg rrbbbbbb", top_and_left(twice, repeat, clamped));
}

TEST(Tool, TexturesAreTransformed) {
    constexpr int repeat = 10497, clamped = 33071;
    EXPECT_EQ("ggggrrrr ggggwwww", top_and_left({{"offset", {0.5, 0}}}, repeat, repeat));
    EXPECT_EQ("bbbbwwww bbbbbbbb", top_and_left({{"offset", {0, 0.5}}}, clamped, clamped));
    // A quarter turn: coordinates counter-clockwise, hence the picture clockwise; the offset brings it back into place.
    EXPECT_EQ("bbbbrrrr bbbbwwww",
              top_and_left({{"rotation", std::numbers::pi / 2}, {"offset", {0, 1}}}, clamped, clamped));
    // Scaled, then turned: u = 2 v, v = 1 - u.
    EXPECT_EQ(
        "bbbbrrrr bbwwbbww",
        top_and_left({{"rotation", std::numbers::pi / 2}, {"offset", {0, 1}}, {"scale", {1, 2}}}, repeat, repeat));
}

// Grey texel 188: linear ((188 / 255 + 0.055) / 1.055)^2.4 = 0.502886, alpha 204 / 255 = 0.8. Times the factors 0.5 it
// is 0.251443 and 0.4. Vertex colours are linear fractions of 65535: red grows from 0 at the left to 1 at the right,
// green is 32768, blue 13107 (0.2), alpha 52428 (0.8). Products above 0.0031308 become 255 (1.055 l^(1/2.4) - 0.055).
TEST(Tool, VertexColoursMultiplyFactorAndTexture) {
    const scratch_folder folder;
    builder file;
    const int material = gltf_test::add_textured_material(
        file, 1, 1, {188, 188, 188, 204},
        {{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 0.5}}}}});
    json& square = gltf_test::add_square(file, 0);
    square["material"] = material;
    std::vector<std::uint16_t> colors;
    for (const std::uint16_t red : std::vector<std::uint16_t>{0, 65535, 65535, 0})
        colors.insert(colors.end(), {red, 32768, 13107, 52428});
    square["attributes"]["COLOR_0"] = file.accessor(colors, "VEC4", true);
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "color", "--origin", "0,0,-0.5",
                                        "--voxel-size", "0.125,0.125,1", "--extent", "8,8,1"});
    ASSERT_EQ(0, result.code) << result.err;
    const array voxels = read_npy(folder / "o.npy");
    // Red at the middle of the first column: 0.251443 / 16 = 0.0157152, which is 33.6; of the last one, times 15 / 16:
    // 0.235728, 133.3. Green: 0.251443 * 0.500008 = 0.125724, 99.4. Blue: 0.0502886, 63.4. Alpha: 0.4 * 0.8, 81.6.
    EXPECT_EQ(glm::u8vec4(34, 99, 63, 82), pixel(voxels, 0, 7));
    EXPECT_EQ(glm::u8vec4(133, 99, 63, 82), pixel(voxels, 7, 0));
}

TEST(Tool, AlphaMaskLeavesHoles) {
    const scratch_folder folder;
    builder file;
    const std::vector<std::uint8_t> left_only{255, 255, 255, 128, 255, 255, 255, 126};
    const int material = gltf_test::add_textured_material(file, 2, 1, left_only, {{"alphaMode", "MASK"}});
    gltf_test::add_square(file, 0)["material"] = material;
    file.write_glb(folder / "m.glb");
    // By the targets that need shading and by occupancy alone, which elsewhere takes a shorter way.
    for (const char* targets : {"occupancy", "occupancy,color"}) {
        const outcome result =
            run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-o", folder / "o.npz", "-t", targets, "--origin",
                         "0,0,-0.5", "--voxel-size", "0.125,0.125,1", "--extent", "8,8,1", "--stats", "json"});
        ASSERT_EQ(0, result.code) << result.err;
        const json stats = json::parse(result.out);
        EXPECT_EQ(32, stats["voxels"]);
        EXPECT_LT(31, stats["fragments_discarded"]);
        const array bits = read_npy(folder / (targets == std::string("occupancy") ? "o.npy" : "o.occupancy.npy"));
        for (std::size_t y = 0; y < 8; ++y)
            for (std::size_t x = 0; x < 8; ++x)
                EXPECT_EQ(x < 4, bits.at<std::uint8_t>(y * 8 + x) != 0) << x << ' ' << y;
    }
}

// A leaning square, once as it is and once seen from behind.
TEST(Tool, BothSidesOfAFaceCount) {
    const scratch_folder folder;
    const auto voxels = [&](bool clockwise, bool double_sided, const std::string& coverage) {
        builder file;
        const int material = gltf_test::add_material(file, {0.2, 0.4, 0.6, 1}, {{"doubleSided", double_sided}});
        json& square = gltf_test::add_square(file, 0);
        square["material"] = material;
        if (clockwise) square["indices"] = file.accessor(std::vector<std::uint8_t>{0, 2, 1, 0, 3, 2}, "SCALAR");
        file.root["nodes"].back()["rotation"] = {0.2, 0.3, 0.1, 0.9};
        file.write_glb(folder / "m.glb");
        const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "24", "--coverage",
                                            coverage, "-t", "occupancy,color,normal"});
        EXPECT_EQ(0, result.code) << result.err;
        return std::array{read_npy(folder / "o.occupancy.npy"), read_npy(folder / "o.color.npy"),
                          read_npy(folder / "o.normal.npy")};
    };
    for (const char* coverage : {"conservative", "thin"}) {
        const auto front = voxels(false, false, coverage);
        std::size_t covered = 0;
        for (std::size_t i = 0; i < front[0].voxels(); ++i) covered += front[0].at<std::uint8_t>(i) != 0;
        EXPECT_LT(200U, covered) << coverage;
        for (const auto& [clockwise, double_sided] :
             {std::pair{true, false}, std::pair{false, true}, std::pair{true, true}}) {
            SCOPED_TRACE(std::string(coverage) + (clockwise ? ", clockwise" : "") + (double_sided ? ", double" : ""));
            const auto other = voxels(clockwise, double_sided, coverage);
            EXPECT_TRUE(front[0].data == other[0].data) << "occupancy";
            EXPECT_TRUE(front[1].data == other[1].data) << "color";
            ASSERT_EQ(front[2].voxels(), other[2].voxels());
            for (std::size_t i = 0; i < front[2].voxels(); ++i) { // only normals tell front from back
                const glm::vec3 expected = front[2].at<glm::vec3>(i) * (clockwise ? -1.0F : 1.0F);
                ASSERT_EQ(expected, other[2].at<glm::vec3>(i)) << i;
            }
        }
    }
}

} // namespace
