// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// OBJ models that do not fit --max-memory: the same voxels, values and counts as of a run that holds them, or a refusal
// with the need and the reason.
#include "two_ways.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// Noise of SIDE x SIDE texels, some of them half transparent.
void write_picture(const fs::path& file, std::uint32_t side) {
    std::vector<std::uint8_t> texels;
    for (std::uint32_t t = 0; t < side * side; ++t)
        for (const std::uint32_t step : {1U, 3U, 7U, 5U}) texels.push_back(static_cast<std::uint8_t>(t * step >> 4));
    const std::vector<std::byte> bytes = gltf_test::png(side, side, texels);
    write(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// A wavy relief of quads and triangles in groups, with materials. TEXCOORDS: of the vertices, some beyond [0, 1]; a
// part of the faces names none.
std::string relief(int side, bool colors, bool texcoords = false) {
    std::string text = "mtllib m.mtl\n";
    const auto at = [&](int i) { return static_cast<double>(i) / side; };
    char line[160];
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x) {
            std::snprintf(line, sizeof(line), "v %.6f %.7g %.8e", at(x), y * side + x == 4711 ? 1e39 : at(y),
                          0.4 + 0.3 * std::sin(9 * at(x) + 4 * at(y)));
            text += line;
            if (colors) {
                std::snprintf(line, sizeof(line), " %.3f %.3f %.3f", at(x), at(y), at(x * y % side));
                text += line;
            }
            text += '\n';
            if (texcoords) {
                std::snprintf(line, sizeof(line), "vt %.5f %.6g\n", 3 * at(x) - 1, 2 * at(y) + 0.1 * at(x));
                text += line;
            }
        }
    for (int y = 0; y < side; ++y) {
        if (y % 16 == 0) text += "usemtl " + std::string(1, static_cast<char>('a' + y / 16 % 3)) + '\n';
        if (y % 50 == 0) text += "o part" + std::to_string(y) + '\n';
        for (int x = 0; x < side; ++x) {
            const int a = y * (side + 1) + x + 1, b = a + side + 1;
            if (texcoords && y % 40 != 7) {
                std::snprintf(line, sizeof(line), "f %d/%d %d/%d %d/%d %d/%d\n", a, a, a + 1, a + 1, b + 1, b + 1, b,
                              b);
                text += line;
                continue;
            }
            if (x % 3 == 0)
                std::snprintf(line, sizeof(line), "f %d %d %d\nf %d %d %d\n", a, a + 1, b + 1, a, b + 1, b);
            else
                std::snprintf(line, sizeof(line), "f %d %d %d %d\n", a, a + 1, b + 1, b);
            text += line;
        }
    }
    return text;
}

constexpr const char* library = "newmtl a\nKd 0.2 0.5 1\nnewmtl b\nKd 1 0.1 0\nd 0.5\nnewmtl c\nKd 0.1 0.9 0.1\n";
constexpr int side = 320, mebibytes = 60, solid_mebibytes = 36, textured_mebibytes = 64;

TEST(StreamedObj, TheSameVoxelsAndValues) {
    if (sanitized) return;
    const scratch_folder folder;
    write(folder / "m.mtl", library);
    write(folder / "m.obj", relief(side, false));
    two_ways{folder,
             folder / "m.obj",
             {"-r", "60", "-t", "occupancy,count,normal,triangle,depth,material", "--scale", "3", "--padding", "2"}}
        .expect_equal(mebibytes);
    two_ways{folder, folder / "m.obj", {"-r", "60", "-t", "color,color-replace", "--coverage", "thin"}}.expect_equal(
        mebibytes);
    two_ways{folder, folder / "m.obj", {"-r", "60", "--solid", "each_draw", "-t", "occupancy,count"}}.expect_equal(
        solid_mebibytes);
    // Nothing is left of the temporary files.
    EXPECT_EQ(6, std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()))
        << "m.obj, m.mtl, tight.npz, free.npz, streams";
}

TEST(StreamedObj, ColorsOfVertices) {
    if (sanitized) return;
    const scratch_folder folder;
    write(folder / "m.mtl", library);
    write(folder / "m.obj", relief(side, true));
    two_ways{folder, folder / "m.obj", {"-r", "60", "-t", "occupancy,color,color-max,material"}}.expect_equal(
        mebibytes);
}

// Materials with and without a map, one that blends, one whose picture is reduced to what the voxels need, options of
// maps, and colours of the vertices.
TEST(StreamedObj, Textures) {
    if (sanitized) return;
    const scratch_folder folder;
    write(folder / "m.mtl", "newmtl a\nKd 0.2 0.5 1\nmap_Kd -s 2 2 1 -o 0.5 0 0 wide.png\nnewmtl b\nKd 1 0.1 0\nd 0.5\n"
                            "map_Kd -clamp on small.png\nnewmtl c\nKd 0.1 0.9 0.1\n");
    write_picture(folder / "wide.png", 600);
    write_picture(folder / "small.png", 5);
    write(folder / "m.obj", relief(side, true, true));
    const std::vector<std::string> colors{"-r", "60", "-t", "occupancy,color,color-max,color-replace"};
    two_ways{folder, folder / "m.obj", colors}.expect_equal(textured_mebibytes);
    // Nobody asks for colours, but what is half transparent is cut off.
    two_ways{folder, folder / "m.obj", {"-r", "40", "-t", "count,material", "--alpha", "cutoff"}}.expect_equal(
        textured_mebibytes);
    // Pictures that cannot be had are a warning, and the factors are used alone.
    fs::remove(folder / "wide.png");
    write(folder / "small.png", "no picture");
    two_ways{folder, folder / "m.obj", colors}.expect_equal(textured_mebibytes);
    const std::string err = read_file(folder / "stderr.txt");
    EXPECT_NE(std::string::npos, err.find("the texture \"wide.png\" cannot be used: no such file")) << err;
    EXPECT_NE(std::string::npos, err.find("the texture \"small.png\" cannot be used: it is neither")) << err;
}

TEST(StreamedObj, WhatCannotBeStreamedIsRefusedWithItsNeed) {
    if (sanitized) return;
    const scratch_folder folder;
    const std::vector<std::string> tight{"--max-memory", std::to_string(mebibytes)};
    write(folder / "m.obj", relief(side, false));
    write(folder / "m.obj", relief(side, false) + "l 1 2\n");
    // In the first it surely does not fit; in the second that is found while it is drawn.
    for (const char* const memory : {"28", "40"}) {
        const outcome lines = two_ways{folder, folder / "m.obj", {"-r", "60"}}.draw("no.npz", {"--max-memory", memory});
        EXPECT_EQ(3, lines.code) << lines.err;
        EXPECT_NE(std::string::npos, lines.err.find("lines or points, which are not streamed")) << lines.err;
        EXPECT_NE(std::string::npos, lines.err.find(" MiB are needed")) << lines.err;
    }
    write(folder / "m.obj", relief(side, false) + "f 1 2 999999\n");
    const outcome damaged = two_ways{folder, folder / "m.obj", {"-r", "60"}}.draw("no.npz", tight);
    EXPECT_EQ(2, damaged.code) << damaged.err;
    EXPECT_NE(std::string::npos, damaged.err.find("has an invalid vertex index: there are 103041 vertices"))
        << damaged.err;
}

} // namespace
