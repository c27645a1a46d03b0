// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Which outputs would replace a file that is read, or each other: by device and inode, and by the names that formats
// say they write.
#include "run/output_check.hpp"

#include "write/formats/formats.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using namespace voxelize;

class OutputCheck : public testing::Test {
protected:
    OutputCheck()
        : folder_(fs::path(testing::TempDir()) / ("output_check_" + std::to_string(getpid()))),
          before_(fs::current_path()) {
        fs::create_directories(folder_ / "a");
        fs::current_path(folder_);
    }
    ~OutputCheck() override {
        fs::current_path(before_);
        fs::remove_all(folder_);
    }
    static void touch(const fs::path& file) { std::ofstream(file) << "content"; }

    fs::path folder_, before_;
};

// A grid of 8 x 8 x 8 voxels with these channels.
volume shape_of(const std::vector<std::string>& channels, std::int64_t side = 8) {
    volume v;
    v.extent = {side, side, side};
    for (const std::string& name : channels)
        v.channels.push_back({name, name == "occupancy" ? scalar::bit : scalar::u32, 1, {}});
    return v;
}

std::vector<std::string> names(const fs::path& path, const volume& shape, held_as held = held_as::grid,
                               const write_options& options = {}) {
    std::vector<std::string> all;
    for (const fs::path& file : names_of(shape, path, options, held).files) all.push_back(file.string());
    return all;
}

// What a check says of outputs beside inputs; empty: nothing.
std::string conflict(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs,
                     const volume& shape = shape_of({"occupancy"}), const write_options& options = {}) {
    try {
        output_check check(outputs);
        for (const fs::path& input : inputs) check.add_input(input, "the model '" + input.string() + "'");
        for (const fs::path& output : outputs)
            check.add_output(output, names_of(shape, output, options, held_as::grid));
        return "";
    } catch (const output_conflict& error) {
        return error.what();
    }
}

TEST_F(OutputCheck, AnInputIsFoundByEverySpellingAndLink) {
    touch("m.glb");
    fs::create_hard_link("m.glb", "hard.glb");
    fs::create_symlink("m.glb", "soft.glb");
    fs::create_directory_symlink("a", "linked");
    touch("a/b.glb");
    EXPECT_EQ("output 'm.glb' is the model 'm.glb'; name another output", conflict({"m.glb"}, {"m.glb"}));
    for (const fs::path& same :
         {fs::path("./m.glb"), fs::path("a/../m.glb"), fs::path("hard.glb"), fs::path("soft.glb"), folder_ / "m.glb"}) {
        EXPECT_EQ("output '" + same.string() + "' is the model 'm.glb'; name another output",
                  conflict({"m.glb"}, {same}));
        EXPECT_NE("", conflict({same}, {"m.glb"}));
    }
    EXPECT_NE("", conflict({"a/b.glb"}, {"linked/b.glb"}));
    EXPECT_EQ("", conflict({"m.glb"}, {"M.glb", "m2.glb", "a/m.glb"}));
}

TEST_F(OutputCheck, OutputsThatAreNotThereAreComparedByFolderAndName) {
    fs::create_directory_symlink("a", "linked");
    EXPECT_EQ("output './x.npy' is the same file as output 'x.npy'; name another output",
              conflict({}, {"x.npy", "./x.npy"}));
    EXPECT_NE("", conflict({}, {"a/x.npy", "linked/x.npy"}));
    EXPECT_NE("", conflict({}, {"new/deep/x.npy", "a/../new/./deep/x.npy"}));
    EXPECT_EQ("", conflict({}, {"x.npy", "X.npy", "a/x.npy", "x.npz", "new/x.npy"}));
    fs::create_symlink("/dev/null", "null.npy"); // devices are not replaced
    EXPECT_EQ("", conflict({"null.npy"}, {"null.npy"}));
}

TEST_F(OutputCheck, FormatsSayWhichFilesTheyWrite) {
    const volume one = shape_of({"count"}), two = shape_of({"occupancy", "count"});
    using list = std::vector<std::string>;
    EXPECT_EQ(list{"x.npy"}, names("x.npy", one));
    EXPECT_EQ((list{"d/x.occupancy.nrrd", "d/x.count.nrrd"}), names("d/x.nrrd", two));
    EXPECT_EQ((list{"x.count.npy", "x.npy"}), names("x.npy", two, held_as::list));
    EXPECT_EQ((list{"x.count.npy", "x.npy", "x.occupancy.npy"}), names("x.npy", two, held_as::unknown));
    volume faces = shape_of({"fraction"});
    faces.faces = {shape_of({"aperture_x"}), shape_of({"aperture_z"})};
    EXPECT_EQ((list{"x.vti", "x.aperture_x.vti", "x.aperture_z.vti"}), names("x.vti", faces));
    EXPECT_EQ((list{"x.fraction.nii.gz", "x.aperture_x.nii.gz", "x.aperture_z.nii.gz"}), names("x.nii.gz", faces));
    EXPECT_EQ(list{"x.npz"}, names("x.npz", faces));
    faces.channels.clear();
    EXPECT_EQ((list{"x.aperture_x.vti", "x.aperture_z.vti"}), names("x.vti", faces));
    faces.faces.resize(1);
    EXPECT_EQ(list{"x.vti"}, names("x.vti", faces));
    EXPECT_EQ(list{"x.npy"}, names("x.npy", faces));
    write_options pieces;
    pieces.pieces = 2;
    EXPECT_EQ((list{"x.pvti", "x.1.vti", "x.2.vti"}), names("x.pvti", one, held_as::grid, pieces));
    for (const format& f : formats()) { // and write no others
        SCOPED_TRACE(f.extension);
        volume v = shape_of({}, 8);
        v.voxel_size = {1, 1, 1};
        v.add("occupancy", scalar::bit).data[0] = std::byte{1};
        if (!f.has_layers) v.add("count", scalar::u32); // their shades are of one target
        write_options options = pieces;
        options.preview.width = options.preview.height = 16;
        std::set<std::string> written, said;
        for (const fs::path& file : write(v, "a/out" + std::string(f.extension), options))
            written.insert(file.string());
        for (const std::string& file : names("a/out" + std::string(f.extension), v, held_as::grid, options))
            said.insert(file);
        EXPECT_EQ(written, said);
    }
}

TEST_F(OutputCheck, GeneratedNamesCount) {
    write_options options;
    options.pieces = 3;
    touch("x.count.npy");
    const volume two = shape_of({"occupancy", "count"});
    EXPECT_EQ("output 'x.npy' may become 'x.count.npy', which is the model 'x.count.npy'; name another output",
              conflict({"x.count.npy"}, {"x.npy"}, two));
    EXPECT_EQ("output 'y.count.npz' is the same file as output 'y.count.npz'; name another output",
              conflict({}, {"y.count.npz", "y.count.npz"}, two));
    EXPECT_EQ("", conflict({}, {"y.npy", "y.count.npz"}, two));
    EXPECT_EQ("output 'x.2.vti' and output 'x.pvti' may both become 'x.2.vti'; name another output",
              conflict({}, {"x.pvti", "x.2.vti"}, two, options));
    EXPECT_NE("", conflict({}, {"x.3.vti", "x.pvti"}, two, options));
    EXPECT_EQ("", conflict({}, {"x.4.vti", "x.pvti", "x.vti"}, two, options));
    // Pieces of a .pvti of more pieces go with it.
    options.pieces = 5;
    volume v = shape_of({});
    v.add("count", scalar::u32);
    (void)write(v, "x.pvti", options);
    options.pieces = 3;
    EXPECT_NE("", conflict({}, {"x.4.vti", "x.pvti"}, two, options));
    EXPECT_EQ("", conflict({}, {"x.6.vti", "x.pvti"}, two, options));
}

TEST_F(OutputCheck, AMeshThatMayBeSplitTakesTheNumberedNames) {
    touch("m.2.obj");
    const volume shape = shape_of({"occupancy"}); // 1728 faces at most
    write_options options;
    EXPECT_EQ("", conflict({"m.2.obj"}, {"m.obj"}, shape, options));
    options.faces_per_file = 800;
    EXPECT_EQ("output 'm.obj' may become 'm.2.obj', which is the model 'm.2.obj'; name another output",
              conflict({"m.2.obj"}, {"m.obj"}, shape, options));
    EXPECT_EQ("", conflict({"m.4.obj", "m.0.obj", "m.02.obj", "n.2.obj", "a/m.2.obj"}, {"m.obj"}, shape, options));
    EXPECT_NE("", conflict({}, {"m.obj", "m.3.obj"}, shape, options));
    EXPECT_NE("", conflict({}, {"m.3.obj", "m.obj"}, shape, options));
    touch("other.obj");
    fs::create_symlink("other.obj", "m.1.obj"); // a part would be written into what the link leads to
    EXPECT_NE("", conflict({"other.obj"}, {"m.obj"}, shape, options));
}

TEST_F(OutputCheck, AFolderThatIsReplacedHoldsNothingThatIsNeeded) {
    fs::create_directories("out.zarr/models");
    touch("out.zarr/models/m.glb");
    EXPECT_EQ("output 'out.zarr' is a folder that holds the model 'out.zarr/models/m.glb'; name another output",
              conflict({"out.zarr/models/m.glb"}, {"out.zarr"}));
    EXPECT_NE("", conflict({}, {"out.zarr", "out.zarr/x.npy"}));
    EXPECT_NE("", conflict({}, {"out.zarr/x.npy", "./out.zarr"}));
    EXPECT_EQ("", conflict({"a/m.glb"}, {"out.zarr", "x.npy"}));
}

TEST_F(OutputCheck, NamedFilesAreCalledWhatTheyAre) {
    const auto message = [](const fs::path& file, const fs::path& model) -> std::string {
        touch(file);
        output_check check;
        check.add_named(file, model);
        try {
            check.add_output(file, {{file}, {}});
        } catch (const output_conflict& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ("output 'm.png' is a texture of 'm.obj'; name another output", message("m.png", "m.obj"));
    EXPECT_EQ("output 'm.mtl' is a material library of 'm.obj'; name another output", message("m.mtl", "m.obj"));
    EXPECT_EQ("output 'm.vti' is a buffer of 'm.gltf'; name another output", message("m.vti", "m.gltf"));
    EXPECT_EQ("output 'm.ply' is a file of 'm.3mf'; name another output", message("m.ply", "m.3mf"));
}

TEST_F(OutputCheck, KnownOutputsMayBeAddedAgain) {
    output_check check;
    check.add_output("x.npy", {{"x.npy"}, {}});
    EXPECT_NO_THROW(check.add_output("x.npy", {{"x.npy"}, {}}, true));
    EXPECT_THROW(check.add_output("x.npy", {{"x.npy"}, {}}), output_conflict);
    EXPECT_THROW(check.add_output("y.npy", {{"x.npy"}, {}}, true), output_conflict);
}

} // namespace
