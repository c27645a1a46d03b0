// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Colours of voxels: textures finer than voxels, alpha, walls with two sides. The program, end to end.
#include "tool_test.hpp"

#include <draw/outside.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

using namespace tool_test;

namespace {

// Colours of the covered voxels of one target, and what the program said.
struct colors_of {
    std::vector<glm::u8vec4> colors;
    std::string err;

    colors_of(const scratch_folder& folder, const builder& file, const std::string& name,
              const std::vector<std::string>& how) {
        file.write_glb(folder / "m.glb");
        std::vector<std::string> arguments{folder / "m.glb", "-o", folder / "o.npy", "-t", "occupancy," + name};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        err = result.err;
        const array bits = read_npy(folder / "o.occupancy.npy");
        const array values = read_npy(folder / ("o." + name + ".npy"));
        for (std::size_t i = 0; i < bits.voxels(); ++i)
            if (bits.at<std::uint8_t>(i) != 0) colors.push_back(values.at<glm::u8vec4>(i));
        EXPECT_FALSE(colors.empty());
    }
    void expect_all(const glm::u8vec4& color) const {
        for (const glm::u8vec4& c : colors) ASSERT_EQ(color, c);
    }
};

// A square with a picture of SIDE x SIDE texels, black and white in turn.
builder checkered_square(std::uint32_t side) {
    std::vector<std::uint8_t> rgba;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            for (int c = 0; c < 4; ++c) rgba.push_back(c == 3 || (x + y) % 2 == 0 ? 255 : 0);
    builder file;
    const int material = gltf_test::add_textured_material(file, side, side, rgba);
    gltf_test::add_square(file, 0)["material"] = material;
    return file;
}

// Half black and half white is a linear half: the byte 188, whatever the resolution and wherever the centres lie.
TEST(ToolColor, TexelsFinerThanVoxelsGiveTheMeanOfTheArea) {
    const scratch_folder folder;
    const builder file = checkered_square(256);
    for (const char* resolution : {"7", "16", "37", "100", "128"})
        colors_of(folder, file, "color", {"-r", resolution}).expect_all({188, 188, 188, 255});
    for (const char* target : {"color-max", "color-replace", "color-outer"})
        colors_of(folder, file, target, {"-r", "50"}).expect_all({188, 188, 188, 255});
}

// As soon as a voxel is no larger than a texel the sampler decides, and black and white are seen.
TEST(ToolColor, TexelsLargerThanVoxelsAreSampledAsTheyAre) {
    const scratch_folder folder;
    const colors_of result(folder, checkered_square(8), "color-replace", {"-r", "64"});
    std::set<int> reds;
    for (const glm::u8vec4& c : result.colors) reds.insert(c.r);
    EXPECT_EQ((std::set<int>{0, 255}), reds);
}

// Voxels of two sizes along two axes: the longer side in texels counts.
TEST(ToolColor, TheFootprintIsThatOfTheVoxel) {
    const scratch_folder folder;
    const builder file = checkered_square(64);
    const auto grid = [](const char* size, const char* extent) {
        return std::vector<std::string>{"--origin", "0,0,-0.5", "--voxel-size", size, "--extent", extent};
    };
    colors_of(folder, file, "color-replace", grid("0.0625,0.0078125,1", "16,128,1")).expect_all({188, 188, 188, 255});
    colors_of(folder, file, "color-replace", grid("0.0078125,0.0625,1", "128,16,1")).expect_all({188, 188, 188, 255});
    const colors_of fine(folder, file, "color-replace", grid("0.0078125,0.0078125,1", "128,128,1"));
    EXPECT_TRUE(std::any_of(fine.colors.begin(), fine.colors.end(), [](const glm::u8vec4& c) { return c.r == 0; }));
}

// A red square under a decal: what its alpha does.
colors_of with_decal(const scratch_folder& folder, double alpha, const std::vector<std::string>& how,
                     const std::string& target = "color") {
    builder file;
    const int red = gltf_test::add_material(file, {1, 0, 0, 1});
    const int decal = gltf_test::add_material(file, {0, 1, 0, alpha}, {{"alphaMode", "BLEND"}});
    gltf_test::add_square(file, 0)["material"] = red;
    gltf_test::add_square(file, 0.01F)["material"] = decal;
    std::vector<std::string> arguments{"--origin", "0.1,0.1,-0.5", "--voxel-size", "0.8,0.8,1", "--extent", "1,1,1"};
    arguments.insert(arguments.end(), how.begin(), how.end());
    return {folder, file, target, arguments};
}

TEST(ToolColor, AlphaIsTheWeightOfTheMean) {
    const scratch_folder folder;
    for (const std::vector<std::string>& how : {std::vector<std::string>{}, {"--alpha", "weight"}}) {
        const glm::u8vec4 invisible = with_decal(folder, 0, how).colors[0];
        EXPECT_EQ(glm::u8vec3(255, 0, 0), glm::u8vec3(invisible));
        // Linear 1 / 1.25 and 0.25 / 1.25; the alphas' mean is 1.25 / 2.
        with_decal(folder, 0.25, how).expect_all({231, 124, 0, 159});
    }
}

TEST(ToolColor, AlphaCutsOffBelowOneHalf) {
    const scratch_folder folder;
    const std::vector<std::string> cutoff{"--alpha", "cutoff"};
    with_decal(folder, 0, cutoff).expect_all({255, 0, 0, 255});
    with_decal(folder, 0.49, cutoff).expect_all({255, 0, 0, 255});
    with_decal(folder, 0.51, cutoff).expect_all({188, 188, 0, 255});
}

TEST(ToolColor, AlphaIsIgnored) {
    const scratch_folder folder;
    for (const double alpha : {0.0, 0.5, 1.0})
        with_decal(folder, alpha, {"--alpha", "ignore"}).expect_all({188, 188, 0, 255});
}

// The decal lies above, but where it is invisible the red below is what one sees.
TEST(ToolColor, WhatIsInvisibleIsNotOutside) {
    const scratch_folder folder;
    with_decal(folder, 0, {}, "color-outer").expect_all({255, 0, 0, 255});
    with_decal(folder, 0.5, {}, "color-outer").expect_all({0, 255, 0, 128});
}

// A voxel with nothing but an invisible fragment has its colour, and alpha 0.
TEST(ToolColor, InvisibleAloneKeepsItsColour) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_square(file, 0)["material"] = gltf_test::add_material(file, {0, 1, 0, 0}, {{"alphaMode", "BLEND"}});
    colors_of(folder, file, "color", {"-r", "4"}).expect_all({0, 255, 0, 0});
}

// A red cube with a white one just inside, both in the same layer of voxels.
builder double_walls(float gap) {
    builder file;
    const int red = gltf_test::add_material(file, {1, 0, 0, 1});
    const int white = gltf_test::add_material(file, {1, 1, 1, 1});
    gltf_test::add_cube(file, {0, 0, 0}, 10, red);
    const auto low = static_cast<double>(gap);
    gltf_test::add_cube(file, {low, low, low}, 10 - 2 * low, white);
    return file;
}

TEST(ToolColor, OuterIsTheSideThatFacesOutwards) {
    const scratch_folder folder;
    for (const char* coverage : {"conservative", "thin"})
        for (const char* memory : {"128", "1"}) {
            const std::vector<std::string> how{"-r", "40", "--coverage", coverage, "--work-memory", memory};
            const colors_of outer(folder, double_walls(0.05F), "color-outer", how);
            outer.expect_all({255, 0, 0, 255});
        }
    // Nor does a ring of empty voxels around the grid matter.
    colors_of(folder, double_walls(0.05F), "color-outer", {"-r", "40", "--padding", "3"}).expect_all({255, 0, 0, 255});
    // The mean mixes them.
    const colors_of mean(folder, double_walls(0.05F), "color", {"-r", "40"});
    EXPECT_TRUE(std::none_of(mean.colors.begin(), mean.colors.end(), [](const glm::u8vec4& c) { return c.g == 0; }));
}

// Turned out of the axes, walls are slopes and stairs.
TEST(ToolColor, OuterHoldsOnSlopesToo) {
    const scratch_folder folder;
    builder file = double_walls(0.05F);
    for (json& node : file.root["nodes"]) node["rotation"] = {0.2, 0.3, 0.1, 0.9273618495495704};
    // The inner cube's translation is not turned with it: give it that of the turned cube.
    const double x = 0.2, y = 0.3, z = 0.1, w = 0.9273618495495704, g = 0.05;
    file.root["nodes"][1]["translation"] = {
        g * ((1 - 2 * (y * y + z * z)) + 2 * (x * y - z * w) + 2 * (x * z + y * w)),
        g * (2 * (x * y + z * w) + (1 - 2 * (x * x + z * z)) + 2 * (y * z - x * w)),
        g * (2 * (x * z - y * w) + 2 * (y * z + x * w) + (1 - 2 * (x * x + y * y)))};
    for (const char* coverage : {"conservative", "thin"}) {
        (void)colors_of(folder, file, "color-outer", {"-r", "48", "--coverage", coverage});
        // A voxel that a side sees has red in it, since the red cube encloses the white one; others need not. At the
        // edges planes of different sides are compared, and thin coverage gives each plane a voxel of its own.
        const array bits = read_npy(folder / "o.occupancy.npy");
        const array colors = read_npy(folder / "o.color-outer.npy");
        voxelize::volume v;
        for (std::size_t a = 0; a < 3; ++a) v.extent[a] = static_cast<std::int64_t>(bits.shape[2 - a]);
        voxelize::channel& occupancy = v.add("occupancy", voxelize::scalar::bit);
        std::size_t at = 0;
        for (std::int64_t k = 0; k < v.extent[2]; ++k)
            for (std::int64_t j = 0; j < v.extent[1]; ++j)
                for (std::int64_t i = 0; i < v.extent[0]; ++i)
                    v.set_bit(occupancy, i, j, k, bits.at<std::uint8_t>(at++) != 0);
        const voxelize::column_table columns = voxelize::columns_of(v, occupancy, glm::ivec3(0), 1);
        int seen = 0, red = 0;
        at = 0;
        for (int k = 0; k < v.extent[2]; ++k)
            for (int j = 0; j < v.extent[1]; ++j)
                for (int i = 0; i < v.extent[0]; ++i, ++at) {
                    if (!v.bit(occupancy, i, j, k) || columns.view().sides_that_see({i, j, k}) == 0) continue;
                    ++seen;
                    red += colors.at<glm::u8vec4>(at) == glm::u8vec4(255, 0, 0, 255) ? 1 : 0;
                }
        EXPECT_LT(3000, seen);
        EXPECT_LT((coverage == std::string_view("thin") ? 0.985 : 0.995) * seen, red) << coverage;
    }
}

TEST(ToolColor, OuterAloneIsOuterBesideOthers) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto outer = [&](const std::string& targets, const std::string& out, const std::string& threads) {
        const outcome result =
            run(folder, {folder / "m.glb", "-q", "-r", "33", "-o", folder / out, "-t", targets, "--threads", threads});
        EXPECT_EQ(0, result.code) << result.err;
    };
    outer("color-outer", "a.npy", "1");
    outer("color-outer,count,normal", "b.npy", "3");
    EXPECT_TRUE(tool_test::read_file(folder / "a.npy") == tool_test::read_file(folder / "b.color-outer.npy"));
}

// Both sides of a sheet: the normals cancel, and the program says so.
TEST(ToolColor, NormalsThatCancelAreSaid) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_square(file, 0);
    gltf_test::add_square(file, 0)["indices"] = file.accessor(std::vector<std::uint8_t>{0, 2, 1, 0, 3, 2}, "SCALAR");
    file.write_glb(folder / "m.glb");
    const outcome result =
        run(folder, {folder / "m.glb", "-r", "8", "-o", folder / "o.npy", "-t", "normal", "--stats", "json"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("warning: the normals of 64 of 64 voxels cancel out")) << result.err;
    EXPECT_EQ(64, json::parse(result.out)["normals_cancelled"]);
    const array normals = read_npy(folder / "o.npy");
    for (std::size_t i = 0; i < normals.voxels(); ++i) ASSERT_EQ(glm::vec3(0), normals.at<glm::vec3>(i));

    builder one;
    gltf_test::add_square(one, 0);
    one.write_glb(folder / "m.glb");
    const outcome quiet =
        run(folder, {folder / "m.glb", "-r", "8", "-o", folder / "o.npy", "-t", "normal", "--stats", "json"});
    EXPECT_EQ(std::string::npos, quiet.err.find("warning")) << quiet.err;
    EXPECT_FALSE(json::parse(quiet.out).contains("normals_cancelled"));
}

} // namespace
