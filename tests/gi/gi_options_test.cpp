// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The program gi as a person runs it: what it writes, and how it ends.

#include "../tool/tool_runner.hpp"

#include <algorithm>

namespace {

using tool_test::outcome;
using tool_test::read_file;
using tool_test::scratch_folder;

outcome run_gi(const scratch_folder& folder, const std::vector<std::string>& arguments) {
    return tool_test::run(folder, arguments); // CMake gives it this program
}

std::vector<std::string> quick(const std::string& output, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--size", "16x9", "-r", "16", "--threads", "2", "-o", output});
    return more;
}

TEST(GiProgram, WritesOnePicture) {
    const scratch_folder folder;
    const outcome made = run_gi(folder, quick(folder / "x.png", {"--frames", "1", "--stats"}));
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_EQ(made.err, "");
    EXPECT_EQ(read_file(folder / "x.png").substr(1, 3), "PNG");
    for (const char* stage : {"bits", "lists", "light", "bounce", "mips", "rays", "cones", "pixels", "frame"})
        EXPECT_NE(made.out.find(std::string("  ") + stage), std::string::npos) << stage;
    const outcome again = run_gi(folder, quick(folder / "y.png", {"--frames", "1"}));
    EXPECT_EQ(read_file(folder / "x.png"), read_file(folder / "y.png")) << again.err;
    const outcome thorough = run_gi(folder, quick(folder / "z.png", {"--frames", "1", "--thorough"}));
    ASSERT_EQ(thorough.code, 0) << thorough.err;
    EXPECT_NE(read_file(folder / "x.png"), read_file(folder / "z.png"));
}

TEST(GiProgram, HasEveryView) {
    const scratch_folder folder;
    std::vector<std::string> pictures;
    for (const char* view : {"final", "direct", "ao", "indirect", "voxels", "level:1", "level:2"}) {
        const outcome made = run_gi(folder, quick(folder / "x.png", {"--frames", "1", "--view", view}));
        ASSERT_EQ(made.code, 0) << made.err;
        pictures.push_back(read_file(folder / "x.png"));
    }
    std::sort(pictures.begin(), pictures.end());
    EXPECT_EQ(std::unique(pictures.begin(), pictures.end()), pictures.end());
}

TEST(GiProgram, NumbersThePicturesOfSeveralFrames) {
    const scratch_folder folder;
    const outcome made = run_gi(folder, quick(folder / "x.png", {"--frames", "3", "-q"}));
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_EQ(made.out + made.err, "");
    for (const char* name : {"x_00000.png", "x_00001.png", "x_00002.png"})
        EXPECT_FALSE(read_file(folder / name).empty()) << name;
}

TEST(GiProgram, NamesMistakes) {
    const scratch_folder folder;
    struct mistake {
        int code;
        std::vector<std::string> arguments;
        const char* says;
    };
    const mistake mistakes[] = {
        {1, {"--no-such-option"}, "--no-such-option"},
        {1, quick(folder / "x.png", {"--view", "sideways"}), "--view is final"},
        {1, quick(folder / "x.png", {"--view", "level:11"}), "--view is final"},
        {1, quick(folder / "x.png", {"--backend", "gpu"}), "--backend is auto, cpu or cuda"},
        {1, {"--size", "16by9"}, "--size is WIDTHxHEIGHT"},
        {1, {"--size", "0x9"}, "--size's width"},
        {1, {"--resolution", "15"}, "--resolution is from 16"},
        {1, {"--frames", "0"}, "--frames is from 1"},
        {1, quick(folder / "x.gif"), "-o ends in .png"},
        {2, quick(folder / "x.png", {"--scene", folder / "none.glb"}), "none.glb"},
        {4, quick(folder / "none/x.png", {"--frames", "1"}), "there is no folder"},
    };
    for (const mistake& m : mistakes) {
        const outcome made = run_gi(folder, m.arguments);
        EXPECT_EQ(made.code, m.code) << m.says << ": " << made.err;
        EXPECT_NE(made.err.find(m.says), std::string::npos) << made.err;
        EXPECT_EQ(made.out, "");
    }
    const outcome help = run_gi(folder, {"--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find("--scene"), std::string::npos);
}

} // namespace
