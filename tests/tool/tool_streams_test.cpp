// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Outputs on standard output, and lists of blocks.
#include "tool_test.hpp"

#include <write/formats/formats.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using namespace tool_test;

namespace {

// A red cube of a material named Brick.
std::string put_cube(const scratch_folder& folder) {
    builder file;
    const int red = gltf_test::add_material(file, {0.9, 0.2, 0.1, 1}, {{"name", "Brick"}});
    gltf_test::add_cube(file, {0, 0, 0}, 1, red);
    file.write_glb(folder / "m.glb");
    return folder / "m.glb";
}

void put(const std::string& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// Every format that can has the bytes of its file there, and all messages are on standard error.
TEST(ToolStreams, StandardOutputHasTheBytesOfTheFile) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    std::vector<std::string> options{"-r", "6", "--image-size", "32x24"};
    for (const voxelize::format& f : voxelize::formats()) {
        if (f.has_layers) continue; // named by {z} in a file's name, of which FORMAT:- has none
        const std::string name(f.extension.substr(1));
        std::vector<std::string> arguments{model, "-o", name + ":-", "--stats"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const outcome streamed = run(folder, arguments);
        EXPECT_FALSE(fs::exists(name + ":-"));
        if (!voxelize::why_no_stream(f).empty()) {
            EXPECT_EQ(1, streamed.code) << name;
            EXPECT_NE(std::string::npos, streamed.err.find(std::string(f.extension) + " cannot go to standard output"))
                << streamed.err;
            EXPECT_EQ("", streamed.out);
            continue;
        }
        ASSERT_EQ(0, streamed.code) << name << streamed.err;
        EXPECT_NE(std::string::npos, streamed.err.find("wrote " + name + ":-")) << streamed.err;
        EXPECT_NE(std::string::npos, streamed.err.find("backend")) << streamed.err;
        arguments[2] = folder / ("written." + name);
        ASSERT_EQ(0, run(folder, arguments).code) << name;
        if (name != "html") { // whose title is the name of the file
            EXPECT_TRUE(read_file(arguments[2]) == streamed.out) << name;
        }
        EXPECT_LT(20u, streamed.out.size()) << name;
    }
}

TEST(ToolStreams, AreRefusedWhereTheyCannotBe) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    const auto refused = [&](std::vector<std::string> arguments, const std::string& message, int code = 1) {
        arguments.insert(arguments.begin(), {model, "-r", "6"});
        const outcome result = run(folder, arguments);
        EXPECT_EQ(code, result.code) << result.err;
        EXPECT_EQ("", result.out);
        EXPECT_NE(std::string::npos, result.err.find(message)) << result.err << "does not have\n" << message;
    };
    refused({"-o", "-"}, "as in -o npy:-");
    refused({"-o", "npy:-", "-o", "ply:-"}, "standard output takes one output");
    refused({"-o", "npy:-", "-t", "color,normal"}, "holds one file", 4);
    refused({"-o", "npy:-", "-t", "color", "--sparse"}, "holds one file", 4);
    refused({"-o", "tiff:-"}, "must be one of");
}

// Standard output may be a file that the run writes, or reads.
TEST(ToolStreams, DoNotReplaceAnotherOutput) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    put(folder / "stdout.txt", "");
    fs::create_symlink(folder / "stdout.txt", folder / "same.npy");
    const outcome result = run(folder, {model, "-r", "6", "-o", "npy:-", "-o", folder / "same.npy"});
    EXPECT_EQ(1, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("name another output")) << result.err;
}

// A pipe without a reader.
TEST(ToolStreams, APipeThatClosesEndsTheRunWithOneMessage) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    const std::string err = folder / "err.txt";
    std::vector<std::string> all{VOXELPIPE_VOXELIZE, model, "-r", "40", "-q", "-o", "xyz:-"};
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    int ends[2];
    ASSERT_EQ(0, pipe(ends));
    const pid_t child = fork();
    if (child == 0) {
        std::signal(SIGPIPE, SIG_DFL);
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        close(ends[1]);
        dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
        execv(argv[0], argv.data());
        _exit(127);
    }
    close(ends[0]);
    close(ends[1]);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    EXPECT_EQ(4, WEXITSTATUS(status));
    EXPECT_EQ("voxelize: cannot write 'xyz:-': write: Broken pipe\n", read_file(err));
}

// Blocks by material and by colour, from a dense and a sparse grid; what the model lacks is named.
TEST(ToolBlocks, AListSaysWhatVoxelsBecome) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    const auto blocks = [&](const std::string& list, const std::string& more) {
        put(folder / "b.txt", list);
        const outcome result = run(folder, {model, "-r", "4", "--solid", "nonzero", "--blocks", folder / "b.txt", "-o",
                                            folder / "m.schem", "-o", folder / "m.litematic", more});
        EXPECT_EQ(0, result.code) << result.err;
        return result.err;
    };
    EXPECT_EQ("", blocks("# blocks\nbricks material Brick\n minecraft:stone  #808080\n", "--dense"));
    const std::string dense = read_file(folder / "m.schem"), dense_lite = read_file(folder / "m.litematic");
    (void)blocks("# blocks\nbricks material Brick\n minecraft:stone  #808080\n", "--sparse");
    EXPECT_TRUE(dense == read_file(folder / "m.schem"));
    EXPECT_TRUE(dense_lite == read_file(folder / "m.litematic"));
    EXPECT_EQ("", blocks("granite #e0d0d0\ngranite #e07b5a\nstone 0,0,0\n", "--dense"));
    EXPECT_FALSE(dense == read_file(folder / "m.schem"));
    EXPECT_NE(std::string::npos,
              blocks("glass material Window\n", "--dense").find("line 1: the model has no material \"Window\""));
}

// A file of another format beside it is what it is alone.
TEST(ToolBlocks, AListChangesNoOtherOutput) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    put(folder / "b.txt", "bricks material Brick\n");
    for (const std::string extension : {".nvdb", ".npz", ".ply"}) {
        const outcome alone = run(folder, {model, "-r", "6", "-o", folder / ("alone" + extension)});
        ASSERT_EQ(0, alone.code) << alone.err;
        const outcome beside = run(folder, {model, "-r", "6", "--blocks", folder / "b.txt", "-o", folder / "m.schem",
                                            "-o", folder / ("beside" + extension)});
        ASSERT_EQ(0, beside.code) << beside.err;
        EXPECT_TRUE(read_file(folder / ("alone" + extension)) == read_file(folder / ("beside" + extension)))
            << extension;
    }
}

TEST(ToolBlocks, AWrongListIsRefusedWithItsLine) {
    const scratch_folder folder;
    const std::string model = put_cube(folder);
    const auto refused = [&](const std::string& list, const std::string& message, const std::string& output) {
        put(folder / "b.txt", list);
        const outcome result = run(folder, {model, "--blocks", folder / "b.txt", "-o", folder / output});
        EXPECT_EQ(1, result.code) << list;
        EXPECT_NE(std::string::npos, result.err.find(message)) << result.err << "does not have\n" << message;
    };
    refused("stone #808080\n\nOak #123456\n", "line 3: \"Oak\" is no block", "m.schem");
    refused("stone #80808\n", "line 1: behind the block stands its colour", "m.schem");
    refused("stone 1,2,300\n", "line 1: behind the block", "m.litematic");
    refused("stone material\n", "line 1: behind the block", "m.schem");
    refused("air #000000\n", "air is what empty voxels are", "m.schem");
    refused("oak_log[axis] #000000\n", "is no block", "m.schem");
    refused("# nothing\n", "there is no block in it", "m.schem");
    refused("stone #808080\n", "--blocks: .npy has no blocks", "m.npy");
    const outcome missing = run(folder, {model, "--blocks", folder / "no.txt", "-o", folder / "m.schem"});
    EXPECT_EQ(1, missing.code);
    EXPECT_NE(std::string::npos, missing.err.find("it cannot be read")) << missing.err;
    // The list is a file that the run reads.
    put(folder / "b.schem", "stone #808080\n");
    const outcome own = run(folder, {model, "--blocks", folder / "b.schem", "-o", folder / "b.schem"});
    EXPECT_EQ(1, own.code);
    EXPECT_NE(std::string::npos, own.err.find("is the list of blocks")) << own.err;
}

// The shared case of two voxels that touch in an edge, where it is there: the edge has two faces of each.
TEST(ToolMeshes, AnEdgeOfTwoVoxelsHasTwoFacesOfEach) {
    const fs::path shared = fs::path(VOXELPIPE_GLTF_DIR).parent_path() / "cases" / "formats" / "f21_edge.obj";
    if (!fs::exists(shared)) GTEST_SKIP() << "no shared cases: VOXELPIPE_GLTF_DIR";
    const scratch_folder folder;
    for (const char* const targets : {"occupancy", "color"}) { // both voxels are of one colour
        const outcome result = run(folder, {shared.string(), "-o", "obj:-", "-s", "1", "--origin", "0,0,0", "--extent",
                                            "2,2,1", "--solid", "nonzero", "--solid-extent", "centre", "-t", targets});
        ASSERT_EQ(0, result.code) << result.err;
        std::map<std::pair<int, int>, int> faces_of; // an edge
        std::istringstream lines(result.out);
        for (std::string line; std::getline(lines, line);) {
            if (!line.starts_with("f ")) continue;
            std::istringstream words(line.substr(2));
            std::vector<int> face;
            for (int vertex = 0; words >> vertex;) face.push_back(vertex);
            for (std::size_t c = 0; c < face.size(); ++c) ++faces_of[std::minmax(face[c], face[(c + 1) % face.size()])];
        }
        EXPECT_EQ(24u, faces_of.size()); // two cubes
        for (const auto& [edge, faces] : faces_of) EXPECT_EQ(2, faces) << edge.first << ' ' << edge.second;
    }
}

} // namespace
