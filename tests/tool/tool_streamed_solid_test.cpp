// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Floods and votes of models that do not fit --max-memory, whose slabs depend on each other, and distances, whose slabs
// need triangles beyond them: the same voxels, values and counts as of a run that holds the model.
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

constexpr int side = 320;

struct mesh {
    std::vector<std::array<float, 3>> vertices;
    std::vector<std::array<std::int32_t, 3>> faces;
};

// A wavy ball from 0.05 to 0.95 of 2 SIDE^2 triangles; without those of a window of HOLE quads a side, which looks
// along x, y and z a little.
mesh ball_with(int hole) {
    mesh ball;
    constexpr double pi = 3.14159265358979;
    for (int v = 0; v <= side; ++v)
        for (int u = 0; u < side; ++u) {
            const double a = 2 * pi * u / side, b = pi * v / side, r = 0.4 + 0.05 * std::sin(5 * a) * std::sin(4 * b);
            ball.vertices.push_back({static_cast<float>(0.5 + r * std::cos(a) * std::sin(b)),
                                     static_cast<float>(0.5 + r * std::sin(a) * std::sin(b)),
                                     static_cast<float>(0.5 - r * std::cos(b))});
        }
    for (int v = 0; v < side; ++v)
        for (int u = 0; u < side; ++u) {
            if (u >= 30 && u < 30 + hole && v >= 110 && v < 110 + hole) continue;
            const int next = (u + 1) % side, a = v * side + u, b = v * side + next;
            ball.faces.push_back({a, b, b + side});
            ball.faces.push_back({a, b + side, a + side});
        }
    return ball;
}

// By the extension: .ply, .stl, binary both, or .obj.
void write_ball(const fs::path& file, int hole) {
    const mesh ball = ball_with(hole);
    std::ofstream out(file, std::ios::binary);
    const auto put = [&](const auto& value) { out.write(reinterpret_cast<const char*>(&value), sizeof(value)); };
    if (file.extension() == ".ply") {
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << ball.vertices.size() + spare_vertices
            << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << ball.faces.size()
            << "\nproperty list uchar int vertex_indices\nend_header\n";
        for (const auto& vertex : ball.vertices) put(vertex);
        out << std::string(sizeof(ball.vertices[0]) * spare_vertices, '\0');
        for (const auto& face : ball.faces) {
            put(std::uint8_t{3});
            put(face);
        }
    } else if (file.extension() == ".stl") {
        out << std::string(80, ' ');
        put(static_cast<std::uint32_t>(ball.faces.size()));
        for (const auto& face : ball.faces) {
            put(std::array<float, 3>{});
            for (const std::int32_t corner : face) put(ball.vertices[static_cast<std::size_t>(corner)]);
            put(std::uint16_t{0});
        }
    } else {
        for (const auto& [x, y, z] : ball.vertices) out << "v " << x << ' ' << y << ' ' << z << '\n';
        for (const auto& [a, b, c] : ball.faces) out << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
    }
}

TEST(StreamedSolids, FloodsOfClosedAndOpenModels) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.ply", 0);
    two_ways{folder, folder / "m.ply", {"-r", "60", "--solid", "exterior"}}.expect_equal(60);
    // The hole is of about four voxels.
    write_ball(folder / "m.ply", 16);
    const two_ways leaks{folder, folder / "m.ply", {"-r", "60", "--solid", "exterior", "-t", "occupancy,normal"}};
    leaks.expect_equal(60);
    const outcome shell = leaks.draw_streamed(60);
    EXPECT_NE(std::string::npos, shell.err.find("finds nothing enclosed")) << shell.err;
    const two_ways closes{
        folder,
        folder / "m.ply",
        {"-r", "60", "--solid", "exterior", "--closing", "2", "--padding", "3", "-t", "occupancy,count,depth"}};
    for (const int memory : {52, 64}) closes.expect_equal(memory);
    const outcome whole = closes.draw_streamed(60);
    EXPECT_LT(4 * json::parse(shell.out).value("voxels", 0), json::parse(whole.out).value("voxels", 0));
    // The model leaves the grid.
    two_ways{folder,
             folder / "m.ply",
             {"--voxel-size", "0.02", "--origin", "0.3,0.1,0.4", "--extent", "30,50,30", "--solid", "exterior",
              "--closing", "1"}}
        .expect_equal(60);
}

TEST(StreamedSolids, VotesOfClosedAndOpenModels) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.ply", 60);
    const two_ways whole{folder, folder / "m.ply", {"-r", "60", "--solid", "nonzero", "--vote", "-t", "count,normal"}};
    for (const int memory : {52, 64}) whole.expect_equal(memory);
    two_ways{
        folder,
        folder / "m.ply",
        {"--voxel-size", "0.02", "--origin", "0.3,0.1,0.4", "--extent", "30,50,30", "--solid", "nonzero", "--vote"}}
        .expect_equal(60);
    two_ways{folder, folder / "m.ply", {"-r", "60", "--padding", "4", "--solid", "nonzero", "--winding"}}.expect_equal(
        60);
    write_ball(folder / "m.ply", 0);
    two_ways{folder, folder / "m.ply", {"-r", "60", "--padding", "4", "--solid", "nonzero", "--vote"}}.expect_equal(60);
}

// OBJ: StreamedObj in tool_streamed_obj_test.cpp; a ball of this size fits, read by the OBJ reader.
TEST(StreamedSolids, Stl) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.stl", 16);
    two_ways{folder, folder / "m.stl", {"-r", "60", "--solid", "exterior", "--closing", "2", "-t", "count,triangle"}}
        .expect_equal(60);
}

// Several parts, of which one mirrors, and colours.
TEST(StreamedSolids, PartsOfGltf) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_two_parts(file, 580);
    for (int p = 0; p < 2; ++p)
        file.root["meshes"][0]["primitives"][static_cast<std::size_t>(p)]["material"] =
            gltf_test::add_material(file, {p == 0 ? 1.0 : 0.0, 0.0, 1.0, 1.0});
    file.write_glb(folder / "m.glb");
    two_ways{folder,
             folder / "m.glb",
             {"-r", "64", "-t", "occupancy,color,material", "--solid", "exterior", "--closing", "3"}}
        .expect_equal(60);
    // Each body's own holes are closed.
    two_ways{folder, folder / "m.glb", {"-r", "64", "-t", "color,material", "--solid", "nonzero", "--close-holes"}}
        .expect_equal(60);
    two_ways{folder, folder / "m.glb", {"-r", "64", "-t", "count,triangle", "--solid", "nonzero", "--vote"}}
        .expect_equal(44);
}

// Tiles of bricks, and slabs that several processes share or that one goes on with.
TEST(StreamedSolids, TilesAndSharedSlabs) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.ply", 16);
    const std::vector<std::string> little{"--max-memory", "60"};
    const std::vector<std::string> rules[] = {{"exterior", "--closing", "2"}, {"nonzero", "--vote"}};
    for (const std::vector<std::string>& rule : rules) {
        std::vector<std::string> how{"-r", "60", "--solid"};
        how.insert(how.end(), rule.begin(), rule.end());
        const two_ways solid{folder, folder / "m.ply", how};
        ASSERT_EQ(0, solid.draw("tight.nvdb", little).code);
        ASSERT_EQ(0, solid.draw("free.nvdb", {"--sparse"}).code);
        EXPECT_TRUE(read_file(folder / "free.nvdb") == read_file(folder / "tight.nvdb"));
        fs::create_directories(folder.path() / "free");
        fs::create_directories(folder.path() / "tight");
        ASSERT_EQ(0, solid.draw("free/m.pvti", {"--sparse", "--pieces", "3"}).code);
        for (const char* const rank : {"1", "0"}) {
            const outcome part = solid.draw(
                "tight/m.pvti", {little[0], little[1], "--pieces", "3", "--world-size", "2", "--rank", rank});
            ASSERT_EQ(0, part.code) << part.err;
            EXPECT_NE(std::string::npos, part.err.find(" triangles do not fit")) << part.err;
            // The first process has drawn the walls of all slabs.
            const int drawn = rule[0] != "exterior" ? -1 : *rank == '0' ? 0 : 3;
            EXPECT_EQ(drawn, json::parse(part.out).value("pass_slabs", -1));
        }
        std::size_t files = 0;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder.path() / "free")) {
            if (!entry.is_regular_file()) continue;
            ++files;
            const fs::path other = folder.path() / "tight" / fs::relative(entry.path(), folder.path() / "free");
            EXPECT_TRUE(read_file(entry.path()) == read_file(other)) << other;
        }
        EXPECT_EQ(4u, files);
        fs::remove_all(folder.path() / "free");
        fs::remove_all(folder.path() / "tight");
    }
}

// A model that fits, in a grid whose dense bits do not: a box with a slit, and a triangle beside it.
TEST(StreamedSolids, GridsThatDoNotFit) {
    if (sanitized) return;
    const scratch_folder folder;
    std::ofstream(folder / "m.obj")
        << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
           "v 0 1 0.497\nv 0 0 0.497\nv 0 0 0.503\nv 0 1 0.503\nv 2 0.4 0.5\nv 2 0.6 0.5\nv 1.5 0.5 0.7\n"
           "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 2 4 8 6\nf 1 10 9 3\nf 5 7 12 11\nf 13 14 15\n";
    const std::vector<std::string> rules[] = {{"exterior", "--closing", "2"}, {"nonzero", "--vote"}};
    for (const std::vector<std::string>& rule : rules) {
        std::vector<std::string> how{"-r", "900", "-t", "occupancy", "--fill-color", "#102030", "--solid"};
        how.insert(how.end(), rule.begin(), rule.end());
        const two_ways solid{folder, folder / "m.obj", how};
        const outcome tight = solid.draw("tight.nvdb", {"--sparse", "--max-memory", "76"}),
                      free = solid.draw("free.nvdb", {"--sparse"});
        ASSERT_EQ(0, tight.code) << tight.err;
        ASSERT_EQ(0, free.code) << free.err;
        EXPECT_TRUE(read_file(folder / "free.nvdb") == read_file(folder / "tight.nvdb"));
        const json a = json::parse(tight.out);
        json b = json::parse(free.out);
        b["solid"].erase("flood"); // the whole is examined
        EXPECT_LT(1, a.value("slabs", 0));
        EXPECT_EQ(1, b.value("slabs", 0));
        EXPECT_LT(90'000'000, a.value("voxels", 0)); // the slit is closed, or outvoted
        for (const char* const name : {"triangles", "fragments", "voxels"})
            EXPECT_EQ(a.value(name, -1), b.value(name, -2)) << name;
        EXPECT_EQ(a["solid"], b["solid"]);
    }
}

// The field piece by piece: in a band, without a sign, with values of the nearest triangle, and by each repair that
// slabs know.
TEST(StreamedDistances, AreThoseOfTheModelThatIsHeld) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.ply", 0);
    two_ways{folder, folder / "m.ply", {"-r", "60", "--padding", "4", "--distance"}}.expect_equal(75, {});
    two_ways{folder,
             folder / "m.ply",
             {"-r", "40", "--distance", "--unsigned", "--band", "1.5", "-t", "nearest,color,normal,depth"}}
        .expect_equal(75, {});
    write_ball(folder / "m.ply", 16);
    // The model leaves the grid: slabs without triangles, and rows that only triangles beside the grid cross.
    two_ways{
        folder,
        folder / "m.ply",
        {"--voxel-size", "0.02", "--origin", "0.3,0.1,-0.4", "--extent", "30,50,70", "--distance", "--close-holes"}}
        .expect_equal(75, {});
    const two_ways open{folder, folder / "m.ply", {"-r", "40", "--distance", "--solid", "positive"}};
    open.expect_equal(75, {});
    EXPECT_NE(std::string::npos, open.draw_streamed(75).err.find("the sign of --distance: the model is not closed"));
}

// A level set has the field in memory, and what is not decided slab by slab needs the model there.
TEST(StreamedDistances, WholeFieldsInMemoryAndWhatNeedsTheModel) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.ply", 0);
    const two_ways values{folder, folder / "m.ply", {"-r", "60", "--padding", "4", "--distance"}};
    const outcome tight = values.draw("tight.nvdb", {"--max-memory", "75"}), free = values.draw("free.nvdb");
    ASSERT_EQ(0, tight.code) << tight.err;
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_NE(std::string::npos, tight.err.find(" triangles do not fit")) << tight.err;
    EXPECT_TRUE(read_file(folder / "tight.nvdb") == read_file(folder / "free.nvdb"));
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--band", "whole"},
                                                 {"--corners"},
                                                 {"--vote"},
                                                 {"--winding"},
                                                 {"--solid", "exterior"}}) {
        std::vector<std::string> all = more;
        all.insert(all.end(), {"--max-memory", "44"});
        const outcome refused = values.draw("no.npz", all);
        EXPECT_EQ(3, refused.code) << more[0] << refused.err;
        EXPECT_NE(std::string::npos, refused.err.find(" MiB are needed")) << refused.err;
    }
}

} // namespace
