// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The voxelize program never replaces a file that the run reads, nor one output by another: exit 1, before anything is
// written.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <map>

using namespace tool_test;

namespace {

void put(const std::string& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// The files of a folder with their content, but those of the runner.
std::map<std::string, std::string> contents(const scratch_folder& folder) {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder.path()))
        if (entry.is_regular_file() && !entry.path().filename().string().starts_with("std"))
            files[fs::relative(entry.path(), folder.path()).string()] = read_file(entry.path());
    return files;
}

// Runs the program, which says MESSAGE and leaves all files as they are.
void expect_refused(const scratch_folder& folder, const std::vector<std::string>& arguments,
                    const std::string& message) {
    const auto before = contents(folder);
    const outcome result = run(folder, arguments);
    EXPECT_EQ(1, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(message)) << result.err << "does not have\n" << message;
    EXPECT_TRUE(before == contents(folder)) << arguments[0];
}

const char* const tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 2/1 4/1\n";

// model.obj with model.mtl, which names model.png and a picture that is not read.
void put_obj(const scratch_folder& folder) {
    put(folder / "model.obj", std::string("mtllib model.mtl\nusemtl a\n") + tetrahedron);
    put(folder / "model.mtl", "newmtl a\nmap_Kd model.png\nmap_Bump bump.png\n");
    put(folder / "model.png", "a picture");
    put(folder / "bump.png", "another");
}

#if VOXELPIPE_TOOL_HAS_ASSIMP
TEST(ToolOutputs, TexturesAndLibrariesOfAnObjStay) {
    const scratch_folder folder;
    put_obj(folder);
    const std::string model = folder / "model.obj";
    const auto refused = [&](const std::vector<std::string>& more, const std::string& output, const std::string& what) {
        std::vector<std::string> arguments{model, "-r", "8", "-o", folder / "model.vox", "-o", folder / output};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_refused(folder, arguments,
                       "output '" + (folder / output) + "' is " + what + " '" + model + "'; name another output");
    };
    refused({}, "model.png", "a texture of");
    refused({"-t", "occupancy"}, "model.png", "a texture of"); // which is not read then
    refused({}, "bump.png", "a texture of");
    refused({}, "model.obj", "the model");
    fs::create_symlink(folder / "model.mtl", folder / "soft.html");
    refused({}, "soft.html", "a material library of");
    // Slab by slab, and as a stream: other readers.
    fs::create_hard_link(folder / "model.png", folder / "x.1.vti");
    expect_refused(folder, {model, "-r", "8", "--resume", "-o", folder / "x.pvti"}, "which is a texture of");
    EXPECT_EQ(0, run(folder, {model, "-r", "8", "-o", folder / "model.vox", "-o", folder / "model2.png"}).code);
    EXPECT_EQ("a picture", read_file(folder / "model.png"));
}

// The shared case, where it is there.
TEST(ToolOutputs, TheReadmesPatternKeepsTheTexture) {
    const fs::path shared = fs::path(VOXELPIPE_GLTF_DIR).parent_path() / "cases" / "formats" / "f01";
    if (!fs::exists(shared / "model.obj")) GTEST_SKIP() << "no shared cases: VOXELPIPE_GLTF_DIR";
    const scratch_folder folder;
    for (const char* const name : {"model.obj", "model.mtl", "model.png"}) fs::copy(shared / name, folder / name);
    expect_refused(folder, {folder / "model.obj", "-o", folder / "model.vox", "-o", folder / "model.png"},
                   "output '" + (folder / "model.png") + "' is a texture of '" + (folder / "model.obj") + "'");
}
#endif

TEST(ToolOutputs, AGltfItsBuffersAndPicturesStay) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    file.append("images", {{"uri", "a%20b.png"}});
    json text = file.root;
    text["buffers"] = {{{"byteLength", file.binary.size()}, {"uri", "data.bin"}}};
    put(folder / "m.gltf", text.dump());
    put(folder / "data.bin", {reinterpret_cast<const char*>(file.binary.data()), file.binary.size()});
    put(folder / "a b.png", "a picture");
    const std::string model = folder / "m.gltf";
    expect_refused(folder, {model, "-o", folder / "a b.png"}, "is a texture of '" + model + "'");
    fs::create_symlink(folder / "data.bin", folder / "b.npz");
    expect_refused(folder, {model, "-o", folder / "b.npz"}, "is a buffer of '" + model + "'");
    file.write_glb(folder / "m.glb");
    for (const std::string& spelling :
         {std::string("m.glb"), std::string("./m.glb"), "../" + folder.path().filename().string() + "/m.glb"}) {
        const std::string output = folder / spelling;
        expect_refused(folder, {folder / "m.glb", "-o", output},
                       "output '" + output + "' is the model '" + (folder / "m.glb") + "'; name another output");
    }
}

TEST(ToolOutputs, TwoOutputsAreTwoFiles) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    const std::string model = folder / "m.glb";
    file.write_glb(model);
    const auto refused = [&](std::vector<std::string> arguments, const std::string& message) {
        arguments.insert(arguments.begin(), {model, "-r", "8"});
        expect_refused(folder, arguments, message);
    };
    refused({"-o", folder / "x.npy", "-o", folder / "./x.npy"}, "is the same file as output");
    refused({"--pieces", "2", "-o", folder / "x.pvti", "-o", folder / "x.1.vti"}, "may both become");
    const outcome apart = run(folder, {model, "-r", "8", "--pieces", "2", "-o", folder / "x.pvti", "-o",
                                       folder / "x.3.vti", "-o", folder / "x.npy"});
    EXPECT_EQ(0, apart.code) << apart.err;
}

TEST(ToolOutputs, ListsKeepTheirModelsAndEachOther) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    fs::create_directory(folder / "m");
    for (const char* const name : {"m/a.glb", "m/ba.glb"}) file.write_glb(folder / name);
    builder with_picture = file;
    with_picture.append("images", {{"uri", "c.png"}});
    with_picture.write_glb(folder / "m/other.glb");
    put(folder / "m/c.png", "a picture");
    put(folder / "l.txt", (folder / "m/a.glb") + "\n" + (folder / "m/ba.glb") + "\n" + (folder / "m/other.glb") + "\n");
    const auto refused = [&](const std::vector<std::string>& outputs, const std::string& message) {
        std::vector<std::string> arguments{"--list", folder / "l.txt", "-r", "8"};
        for (const std::string& output : outputs) arguments.insert(arguments.end(), {"-o", folder / output});
        expect_refused(folder, arguments, message);
    };
    refused({"m/{name}.glb"}, "m/a.glb' is the model '" + (folder / "m/a.glb"));
    refused({"m/./{name}.glb"}, "is the model");
    refused({"out/b{name}.npy", "out/{name}.npy"}, "out/ba.npy' is the same file as output"); // of two models
    // A picture of one model, by the name of another.
    file.write_glb(folder / "m/c.glb");
    put(folder / "l.txt", (folder / "m/c.glb") + "\n" + (folder / "m/other.glb") + "\n");
    refused({"m/{name}.png"}, "m/c.png' is a texture of '" + (folder / "m/other.glb"));
    // The list, and a manifest, by links.
    fs::create_symlink(folder / "l.txt", folder / "c.npy");
    refused({"{name}.npy"}, "is the list '" + (folder / "l.txt"));
    fs::create_directory(folder / "out");
    put(folder / "out/manifest.7.jsonl", "");
    fs::create_symlink(folder / "out/manifest.7.jsonl", folder / "out/c.npz");
    refused({"out/{name}.npz"}, "is the manifest '" + (folder / "out/manifest.7.jsonl"));
    fs::rename(folder / "l.txt", folder / "out/manifest.0.jsonl"); // which the run would append to
    const outcome own = run(folder, {"--list", folder / "out/manifest.0.jsonl", "-o", folder / "out/{name}.npy"});
    EXPECT_EQ(1, own.code) << own.err;
    EXPECT_FALSE(fs::exists(folder / "out/c.npy"));
}

// What other programs, and no program, made of a folder's name.
TEST(ToolOutputs, AZarrOfOthersStays) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    file.write_glb(folder / "m.glb");
    const std::string zarr = folder / "x.zarr";
    fs::create_directories(folder / "x.zarr/a");
    for (const char* const description : {R"({"zarr_format": 3, "node_type": "group", "attributes": {}})",
                                          R"({"zarr_format": 3, "node_type": "array", "shape": [4]})", ""}) {
        put(folder / "x.zarr/a/data", "of years");
        if (*description != 0) put(folder / "x.zarr/zarr.json", description);
        if (*description == 0) fs::remove(folder / "x.zarr/zarr.json");
        for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--resume"}}) {
            const auto before = contents(folder);
            std::vector<std::string> arguments{folder / "m.glb", "-r", "8", "-o", zarr};
            if (more.empty()) arguments.insert(arguments.end(), {"-o", folder / "y.npy"});
            arguments.insert(arguments.end(), more.begin(), more.end());
            const outcome result = run(folder, arguments);
            EXPECT_EQ(4, result.code) << result.err;
            EXPECT_NE(std::string::npos, result.err.find("cannot write '" + zarr + "': it exists")) << result.err;
            EXPECT_TRUE(before == contents(folder));
        }
    }
    fs::remove_all(zarr);
    for (int time = 0; time < 2; ++time) // its own is replaced
        EXPECT_EQ(0, run(folder, {folder / "m.glb", "-r", time == 0 ? "8" : "9", "-o", zarr}).code);
}

// What a killed run left is taken.
TEST(ToolOutputs, PartsOfKilledRunsGo) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    file.write_glb(folder / "m.glb");
    put(folder / "x.npy.part0", "half");
    put(folder / "x.npy.part1", "of another");
    for (const char* const left : {"x.zarr.part0", "x.zarr.part2"}) {
        fs::create_directories(folder / (std::string(left) + "/occupancy/c"));
        put(folder / (std::string(left) + "/.voxelize.part"), "");
    }
    fs::create_directory(folder / "x.zarr.part1"); // killed before it had a lock
    const outcome result = run(folder, {folder / "m.glb", "-r", "8", "-o", folder / "x.npy", "-o", folder / "x.zarr"});
    ASSERT_EQ(0, result.code) << result.err;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder.path()))
        EXPECT_EQ(std::string::npos, entry.path().filename().string().find(".part")) << entry.path();
    EXPECT_FALSE(fs::exists(folder / "x.zarr/.voxelize.part"));
    // A folder of the user's with such a name stays.
    fs::create_directory(folder / "x.zarr.part0");
    put(folder / "x.zarr.part0/mine.txt", "mine");
    EXPECT_EQ(0, run(folder, {folder / "m.glb", "-r", "8", "-o", folder / "x.zarr"}).code);
    EXPECT_EQ("mine", read_file(folder / "x.zarr.part0/mine.txt"));
}

// Formats with numbers of 16 or 32 bits: before the grid is drawn, and before the outputs that are named earlier are
// written.
TEST(ToolOutputs, AFormatThatCannotNumberTheGridIsNamedFirst) {
    const scratch_folder folder;
    put(folder / "bar.obj", "v 0 0 0\nv 40000 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    put(folder / "cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    const auto refused = [&](std::vector<std::string> arguments, const std::string& output,
                             const std::string& message) {
        arguments[0] = folder / arguments[0];
        arguments.insert(arguments.end(), {"-o", folder / "first.npy", "-o", folder / output});
        const outcome result = run(folder, arguments);
        EXPECT_EQ(4, result.code) << result.err;
        EXPECT_NE(std::string::npos, result.err.find(message)) << result.err << "does not have\n" << message;
        EXPECT_FALSE(fs::exists(folder / "first.npy"));
    };
    const std::string sides = "which ends at 32767 voxels along an axis: this grid has 40000 x 1 x 1; use .npz";
    refused({"bar.obj", "--voxel-size", "1"}, "a.nii.gz", sides);
    refused({"bar.obj", "--voxel-size", "1"}, "a.schem", sides);
    refused({"cube.obj", "-r", "1300"}, "a.litematic", "2147483647 voxels in all: this grid has 1300 x 1300 x 1300");
    EXPECT_EQ(0, run(folder, {folder / "bar.obj", "-r", "32767", "-o", folder / "a.nii"}).code);
}

} // namespace
