// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A model is other work once a file that it names has changed: --resume then begins a folder of its own, and a list
// makes it again.
#include "tool_test.hpp"

#include <read/named_files.hpp>
#include <run/batch.hpp>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

using namespace tool_test;

namespace {

void write(const std::string& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// Each of FILES, made longer, makes MODEL other work; so does one that goes.
void expect_all_matter(const scratch_folder& folder, const std::string& model, const std::vector<std::string>& files) {
    const voxelize::command_line options;
    std::set<std::string> works{voxelize::work_of(options, model)};
    EXPECT_EQ(1U, works.count(voxelize::work_of(options, model)));
    for (const std::string& file : files) {
        std::ofstream(folder / file, std::ios::app) << "# more";
        EXPECT_TRUE(works.insert(voxelize::work_of(options, model)).second) << file;
    }
    fs::remove(folder / files.back());
    EXPECT_TRUE(works.insert(voxelize::work_of(options, model)).second);
    write(folder / "other.bin", "nothing that a model names");
    EXPECT_EQ(1U, works.count(voxelize::work_of(options, model)));
}

TEST(NamedFiles, BuffersAndPicturesOfGltf) {
    const scratch_folder folder;
    const std::string text =
        R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "a%20b.bin"}, {}, {"uri": "data:;base64,AA"}],
                              "images": [{"uri": "p.png"}, {"uri": "../outside.png"}, 7]})";
    write(folder / "m.gltf", text);
    write(folder / "a b.bin", "0");
    write(folder / "p.png", "0");
    EXPECT_EQ((std::vector<fs::path>{folder.path() / "a b.bin", folder.path() / "p.png"}),
              voxelize::named_files(folder / "m.gltf"));
    expect_all_matter(folder, folder / "m.gltf", {"a b.bin", "p.png"});
    builder inside; // a .glb whose picture lies in a file
    inside.triangle();
    inside.append("images", {{"uri", "p.png"}});
    inside.write_glb(folder / "m.glb");
    EXPECT_EQ(std::vector<fs::path>{folder.path() / "p.png"}, voxelize::named_files(folder / "m.glb"));
}

TEST(NamedFiles, LibrariesAndPicturesOfObj) {
    const scratch_folder folder;
    write(folder / "m.obj", "# mtllib none.mtl\nmtllib my stuff.mtl\r\nv 0 0 0\n  mtllib gone.mtl\n");
    write(folder / "my stuff.mtl", "newmtl a\n\tmap_Kd -s 2 2 1 wood grain.png\nmap_d c:\\pictures\\leaf.png\n");
    write(folder / "wood grain.png", "0");
    write(folder / "leaf.png", "0");
    expect_all_matter(folder, folder / "m.obj", {"m.obj", "my stuff.mtl", "leaf.png", "wood grain.png"});
    write(folder / "gone.mtl", "");
    const auto files = voxelize::named_files(folder / "m.obj");
    EXPECT_EQ((std::vector<fs::path>{folder.path() / "my stuff.mtl", folder.path() / "gone.mtl"}),
              (std::vector<fs::path>{files.begin(), files.begin() + 2}));
}

TEST(NamedFiles, SeveralLibrariesOfALine) {
    const scratch_folder folder;
    write(folder / "m.obj", "mtllib one.mtl my two.mtl gone.mtl\n");
    write(folder / "one.mtl", "newmtl a\n");
    write(folder / "my two.mtl", "newmtl b\nmap_Kd wood.png\n");
    write(folder / "wood.png", "0");
    EXPECT_EQ((std::vector<fs::path>{folder.path() / "one.mtl", folder.path() / "my two.mtl",
                                     folder.path() / "gone.mtl", folder.path() / "wood.png"}),
              voxelize::named_files(folder / "m.obj"));
    write(folder / "one.mtl my two.mtl gone.mtl", "newmtl c\n"); // the whole, where there is such a file
    EXPECT_EQ(std::vector<fs::path>{folder.path() / "one.mtl my two.mtl gone.mtl"},
              voxelize::named_files(folder / "m.obj"));
}

TEST(NamedFiles, NoneOfWhatIsNoModel) {
    const scratch_folder folder;
    for (const char* const name : {"m.gltf", "m.glb", "m.obj", "m.stl"}) {
        EXPECT_TRUE(voxelize::named_files(folder / name).empty()) << name; // not there
        write(folder / name, "glTF\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff and so on");
        EXPECT_TRUE(voxelize::named_files(folder / name).empty()) << name;
    }
}

} // namespace
