// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Colours that follow from the whole grid, of models that do not fit --max-memory and of slabs that are written one by
// one: color-outer and the mean colours of solids. The same values as of a run that holds the model and the grid.
#include "gltf_builder.hpp"
#include "two_ways.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

constexpr const char* colors = "occupancy,color,color-max,color-outer";

// Two wavy balls, one close within the other, of 2 SIDE^2 triangles each; vertices are coloured by their place, those
// of the inner one the other way round.
void write_balls(const fs::path& file, int side) {
    std::ofstream out(file, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << 2 * side * (side + 1) + spare_vertices
        << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty "
           "uchar blue\nelement face "
        << 4 * side * side << "\nproperty list uchar int vertex_indices\nend_header\n";
    const auto put = [&](const auto& value) { out.write(reinterpret_cast<const char*>(&value), sizeof(value)); };
    constexpr double pi = 3.14159265358979;
    for (const bool inner : {false, true})
        for (int v = 0; v <= side; ++v)
            for (int u = 0; u < side; ++u) {
                const double a = 2 * pi * u / side, b = pi * v / side,
                             r = (inner ? 0.985 : 1) * (0.4 + 0.05 * std::sin(5 * a) * std::sin(4 * b));
                const double p[3]{r * std::cos(a) * std::sin(b), r * std::sin(a) * std::sin(b), -r * std::cos(b)};
                for (const double c : p) put(static_cast<float>(c));
                for (const double c : p) put(static_cast<std::uint8_t>(std::lround(127.5 + (inner ? -250 : 250) * c)));
            }
    out << std::string(15 * spare_vertices, '\0');
    for (const int first : {0, side * (side + 1)})
        for (int v = 0; v < side; ++v)
            for (int u = 0; u < side; ++u) {
                const int next = (u + 1) % side, a = first + v * side + u, b = first + v * side + next;
                for (const auto& [p, q, r] : {std::array{a, b, b + side}, std::array{a, b + side, a + side}}) {
                    put(std::uint8_t{3});
                    for (const int corner : {p, q, r}) put(std::int32_t{corner});
                }
            }
}

TEST(StreamedColors, OuterColoursOfSurfaces) {
    if (sanitized) return;
    const scratch_folder folder;
    write_balls(folder / "m.ply", 230);
    two_ways{folder, folder / "m.ply", {"-r", "60", "-t", colors, "--padding", "2"}}.expect_equal(52);
    two_ways{folder, folder / "m.ply", {"-r", "60", "-t", "color-outer", "--coverage", "thin"}}.expect_equal(60);
    // The model leaves the grid.
    two_ways{folder,
             folder / "m.ply",
             {"--voxel-size", "0.02", "--origin", "-0.2,-0.4,-0.1", "--extent", "30,50,30", "-t", "color-outer,normal"}}
        .expect_equal(60);
}

TEST(StreamedColors, MeansFillSolids) {
    if (sanitized) return;
    const scratch_folder folder;
    write_balls(folder / "m.ply", 230);
    two_ways{folder, folder / "m.ply", {"-r", "60", "-t", colors, "--solid", "nonzero", "--fill", "mean"}}.expect_equal(
        60);
    two_ways{
        folder,
        folder / "m.ply",
        {"-r", "60", "-t", "color,count", "--solid", "exterior", "--closing", "1", "--padding", "3", "--fill", "mean"}}
        .expect_equal(60);
    // The balls are bodies of one draw, which a stream does not tell apart.
    const outcome bodies =
        two_ways{folder, folder / "m.ply", {"-r", "60", "-t", "color", "--solid", "nonzero", "--max-memory", "60"}}
            .draw("o.npz");
    EXPECT_EQ(3, bodies.code);
    EXPECT_NE(std::string::npos, bodies.err.find("--fill body needs the connected parts")) << bodies.err;
}

// Holes that a mask cuts let sides see what lies behind, and a sheet that blends.
TEST(StreamedColors, MasksAndBlendsOfGltf) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_relief(file, 320)["material"] = gltf_test::add_material(file, {0.9, 0.2, 0.1, 1});
    const std::vector<std::uint8_t> holes{255, 255, 0, 255, 255, 255, 255, 0, 255, 255, 255, 0, 0, 255, 255, 255};
    gltf_test::add_square(file, 0.6F)["material"] =
        gltf_test::add_textured_material(file, 2, 2, holes, {{"alphaMode", "MASK"}, {"alphaCutoff", 0.5}});
    gltf_test::add_square(file, 0.9F)["material"] =
        gltf_test::add_material(file, {0.1, 0.2, 0.9, 0.5}, {{"alphaMode", "BLEND"}});
    file.write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-r", "80", "-t", colors}}.expect_equal(60);
    two_ways{folder, folder / "m.glb", {"-r", "80", "-t", "color-outer", "--solid", "exterior"}}.expect_equal(60);
}

// Files of pieces that several processes share, or that one goes on with, are those of a run that holds all.
void expect_same_pieces(const two_ways& model, const std::vector<std::string>& memory) {
    fs::create_directories(model.folder.path() / "free");
    fs::create_directories(model.folder.path() / "parts");
    ASSERT_EQ(0, model.draw("free/m.pvti", {"--sparse", "--pieces", "3"}).code);
    for (const char* const rank : {"1", "0"}) {
        std::vector<std::string> more{"--pieces", "3", "--world-size", "2", "--rank", rank};
        more.insert(more.end(), memory.begin(), memory.end());
        const outcome part = model.draw("parts/m.pvti", more);
        ASSERT_EQ(0, part.code) << part.err;
        EXPECT_EQ(!memory.empty(), part.err.find(" triangles do not fit") != std::string::npos) << part.err;
        // The first process has drawn all slabs for the passes.
        EXPECT_EQ(*rank == '0', json::parse(part.out).value("pass_slabs", -1) == 0) << part.out;
    }
    std::size_t files = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(model.folder.path() / "free")) {
        ++files;
        EXPECT_TRUE(read_file(entry.path()) == read_file(model.folder.path() / "parts" / entry.path().filename()))
            << entry.path();
    }
    EXPECT_EQ(4u, files);
    fs::remove_all(model.folder.path() / "free");
    fs::remove_all(model.folder.path() / "parts");
}

TEST(StreamedColors, SharedSlabs) {
    if (sanitized) return;
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const std::vector<std::string> rules[] = {{}, {"--solid", "nonzero"}, {"--solid", "exterior", "--padding", "3"}};
    for (const std::vector<std::string>& rule : rules) {
        std::vector<std::string> how{"-r", "60", "-t", colors};
        how.insert(how.end(), rule.begin(), rule.end());
        expect_same_pieces({folder, folder / "m.glb", how}, {});
    }
    gltf_test::lined_world().write_glb(folder / "m.glb");
    expect_same_pieces({folder, folder / "m.glb", {"-r", "60", "-t", colors}}, {});
    write_balls(folder / "m.ply", 230);
    expect_same_pieces({folder, folder / "m.ply", {"-r", "60", "-t", colors, "--solid", "nonzero", "--fill", "mean"}},
                       {"--max-memory", "60"});
}

// A loaded model whose flood is decided in slabs has one mean, too.
TEST(StreamedColors, GridsThatDoNotFit) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 0.1, gltf_test::add_material(file, {0.9, 0.2, 0.1, 1}));
    gltf_test::add_cube(file, {0.9, 0.8, 0.95}, 0.05, gltf_test::add_material(file, {0.1, 0.2, 0.9, 1}));
    file.write_glb(folder / "m.glb");
    const two_ways solid{folder, folder / "m.glb", {"-r", "400", "-t", "color", "--solid", "exterior"}};
    const outcome tight = solid.draw("tight.nvdb", {"--sparse", "--max-memory", "52"}),
                  free = solid.draw("free.nvdb", {"--sparse"});
    ASSERT_EQ(0, tight.code) << tight.err;
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_LT(1, json::parse(tight.out).value("slabs", 0));
    EXPECT_EQ(1, json::parse(free.out).value("slabs", 0));
    EXPECT_TRUE(read_file(folder / "free.nvdb") == read_file(folder / "tight.nvdb"));
}

} // namespace
