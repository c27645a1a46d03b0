// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// OBJ models that do not fit --max-memory: the same voxels, values and counts as of a run that holds them, or a refusal
// with the need and the reason.
#include "two_ways.hpp"

#if VOXELPIPE_TOOL_HAS_ASSIMP
#include <gtest/gtest.h>

#include <cmath>
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

// A wavy relief of quads and triangles in groups, with materials.
std::string relief(int side, bool colors) {
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
        }
    for (int y = 0; y < side; ++y) {
        if (y % 16 == 0) text += "usemtl " + std::string(1, static_cast<char>('a' + y / 16 % 3)) + '\n';
        if (y % 50 == 0) text += "o part" + std::to_string(y) + '\n';
        for (int x = 0; x < side; ++x) {
            const int a = y * (side + 1) + x + 1, b = a + side + 1;
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
constexpr int side = 320, mebibytes = 60;

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
        mebibytes);
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

TEST(StreamedObj, WhatCannotBeStreamedIsRefusedWithItsNeed) {
    if (sanitized) return;
    const scratch_folder folder;
    write(folder / "m.mtl", "newmtl a\nmap_Kd stone.png\n");
    write(folder / "m.obj", relief(side, false));
    const std::vector<std::string> tight{"--max-memory", std::to_string(mebibytes)};
    // In the first it surely does not fit; in the second that is found while it is loaded.
    for (const char* const memory : {"40", "60"}) {
        const outcome textured =
            two_ways{folder, folder / "m.obj", {"-r", "60", "-t", "color"}}.draw("no.npz", {"--max-memory", memory});
        EXPECT_EQ(3, textured.code) << textured.err;
        EXPECT_NE(std::string::npos, textured.err.find("textures are not streamed")) << textured.err;
        EXPECT_NE(std::string::npos, textured.err.find(" MiB are needed")) << textured.err;
    }
    two_ways{folder, folder / "m.obj", {"-r", "60"}}.expect_equal(mebibytes);
    // assimp's process counts as well, and has too little.
    const outcome narrow = two_ways{folder, folder / "m.obj", {"-r", "60"}}.draw("no.npz", {"--max-memory", "24"});
    EXPECT_EQ(3, narrow.code) << narrow.err;
    EXPECT_NE(std::string::npos, narrow.err.find("assimp, which reads its groups")) << narrow.err;
    write(folder / "m.obj", relief(side, false) + "l 1 2\n");
    const outcome lines = two_ways{folder, folder / "m.obj", {"-r", "60"}}.draw("no.npz", tight);
    EXPECT_EQ(3, lines.code) << lines.err;
    EXPECT_NE(std::string::npos, lines.err.find("lines and points are not streamed")) << lines.err;
    write(folder / "m.obj", relief(side, false) + "f 1 2 999999\n");
    const outcome damaged = two_ways{folder, folder / "m.obj", {"-r", "60"}}.draw("no.npz", tight);
    EXPECT_EQ(2, damaged.code) << damaged.err;
    EXPECT_NE(std::string::npos, damaged.err.find("out of range")) << damaged.err;
}

} // namespace
#endif
