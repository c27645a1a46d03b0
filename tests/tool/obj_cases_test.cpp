// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Odd but valid files that people have, of the folder VOXELPIPE_CASES_DIR, and what is right: voxels, colours and
// messages of the voxelize program.
#include "tool_runner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

using namespace tool_test;

namespace {

fs::path shared_cases() { return fs::path(VOXELPIPE_CASES_DIR) / "formats"; }

class ObjCases : public testing::Test {
protected:
    void SetUp() override {
        if (!fs::exists(shared_cases() / "control.obj")) GTEST_SKIP() << "no shared cases: VOXELPIPE_CASES_DIR";
    }

    // The voxels of a file in a grid of 16^3 around the unit cube, and what the program says.
    std::size_t voxels_of(const fs::path& file,
                          const std::string& options = "-s .25 --origin=-1,-1,-1 --extent 16,16,16 -t occupancy") {
        std::vector<std::string> arguments{file.string(), "-o", folder_ / "o.npy", "--backend", "cpu"};
        std::istringstream words(options);
        for (std::string word; words >> word;) arguments.push_back(word);
        outcome_ = run(folder_, arguments);
        EXPECT_EQ(0, outcome_.code) << file << ": " << outcome_.err;
        if (outcome_.code != 0) return 0;
        array_ = read_npy(folder_ / "o.npy");
        return array_.data.size() -
               static_cast<std::size_t>(std::count(array_.data.begin(), array_.data.end(), std::byte{0}));
    }
    // The file's only colour, as "r g b a"; more are joined.
    std::string color_of(const fs::path& file) {
        (void)voxels_of(file, "-s .25 --origin=-1,-1,-1 --extent 16,16,16 -t color");
        std::string found;
        for (std::size_t at = 0; at + 4 <= array_.data.size(); at += 4) {
            if (array_.at<std::uint8_t>(at + 3) == 0) continue;
            std::ostringstream text;
            for (std::size_t c = 0; c < 4; ++c)
                text << (c != 0 ? " " : "") << static_cast<int>(array_.at<std::uint8_t>(at + c));
            if (found.find(text.str()) == std::string::npos) found += text.str();
        }
        return found;
    }
    scratch_folder folder_;
    outcome outcome_;
    array array_;
};

TEST_F(ObjCases, EachLayoutIsTheUnitCube) {
    for (const char* const name :
         {"control", "f04_no_vt", "f06_bom_vertices", "f06_indented", "f14_comment_after_face", "f14_leading_dot",
          "f14_parm", "f14_weight", "f15_aniso", "f15_two_libraries", "f11"}) {
        EXPECT_EQ(208U, voxels_of(shared_cases() / (std::string(name) + ".obj"))) << name;
        EXPECT_EQ("", outcome_.err) << name;
    }
    EXPECT_EQ(208U, voxels_of(shared_cases() / "f27_surface.obj"));
    EXPECT_NE(std::string::npos, outcome_.err.find("line 21: 'surf 0 1 0 1 9 10 11 12' is a free-form surface"));
}

TEST_F(ObjCases, PointsStandBehindObjectsToo) {
    EXPECT_EQ(16U, voxels_of(shared_cases() / "f24_control.obj"));
    const std::string text = read_file(shared_cases() / "f24_control.obj");
    for (const char* const before : {"o cloud\n", "g cloud\n", "o a\ng b\n"}) {
        std::ofstream(folder_ / "m.obj") << before << text;
        EXPECT_EQ(16U, voxels_of(folder_ / "m.obj")) << before;
    }
}

TEST_F(ObjCases, ColoursAreThoseOfTheFile) {
    EXPECT_EQ("0 0 255 255", color_of(shared_cases() / "f11.obj"));
    EXPECT_EQ("255 0 0 255", color_of(shared_cases() / "f15_aniso.obj"));
    EXPECT_EQ("255 0 0 255", color_of(shared_cases() / "f15_two_libraries.obj"));
    // Alone, without the library that it names last.
    for (const char* const name : {"f15_two_libraries.obj", "f15d.mtl"})
        fs::copy_file(shared_cases() / name, folder_.path() / name);
    EXPECT_EQ("255 255 255 255", color_of(folder_ / "f15_two_libraries.obj"));
    EXPECT_EQ("voxelize: warning: the material library \"f15c.mtl\" cannot be read: surfaces are white\n",
              outcome_.err);
}

TEST_F(ObjCases, AlphaOfAPictureCuts) {
    const std::string cut = "-t occupancy --alpha cutoff -s .5 --origin 0,0,0 --extent 8,8,1";
    const std::size_t voxels = voxels_of(shared_cases() / "f08_picture.obj", cut);
    EXPECT_LE(32U, voxels);
    EXPECT_GE(40U, voxels);
    EXPECT_EQ(64U, voxels_of(shared_cases() / "f08_picture.obj", "-t occupancy -s .5 --origin 0,0,0 --extent 8,8,1"));
}

TEST_F(ObjCases, MapCoordinatesAreAsSharpAsTheOrigin) {
    const std::string grid = "-t occupancy -s .05 --extent 24,24,24 --origin ";
    EXPECT_EQ(2205U, voxels_of(shared_cases() / "f12_origin.obj", grid + "0,0,0"));
    const auto near = array_.data;
    EXPECT_EQ(2205U, voxels_of(shared_cases() / "f12_utm.obj", grid + "431234,4649776,100"));
    EXPECT_TRUE(near == array_.data);
}

// Base materials, a part in another file of the archive, and a Collada file with another upright axis.
TEST_F(ObjCases, OtherFormats) {
    if (!VOXELPIPE_TOOL_HAS_ASSIMP) GTEST_SKIP() << "no assimp";
    EXPECT_EQ(208U, voxels_of(shared_cases() / "f17_path.3mf"));
    EXPECT_EQ("", outcome_.err);
    (void)voxels_of(shared_cases() / "f26_zup.dae", "-s 1 -t occupancy");
    EXPECT_EQ("voxelize: warning: the file states Z as upright: it is turned to Y, so x, y, z become x, z, -y\n",
              outcome_.err);
    EXPECT_EQ((std::vector<std::size_t>{2, 1, 3}), array_.shape);
}

TEST_F(ObjCases, AListMayHaveAByteOrderMark) {
    fs::copy_file(shared_cases() / "f18_list.txt", folder_.path() / "list.txt");
    for (const char* const name : {"control.obj", "f11.obj", "f11.mtl", "f11.png"})
        fs::copy_file(shared_cases() / name, folder_.path() / name);
    const fs::path before = fs::current_path();
    fs::current_path(folder_.path()); // its paths are relative
    const outcome result = run(folder_, {"--list", "list.txt", "-o", folder_ / "{name}.npy", "-r", "4"});
    fs::current_path(before);
    EXPECT_EQ(0, result.code) << result.err;
    for (const char* const name : {"control.npy", "f11.npy"}) EXPECT_TRUE(fs::exists(folder_.path() / name)) << name;
}

} // namespace
