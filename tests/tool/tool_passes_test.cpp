// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Slabs whose values follow from the whole grid: what passes over all slabs find is kept in their folder, so processes
// share it, and a run that goes on does not repeat it. The files are those of a run which does it at once.
#include "tower.hpp"

#include <draw/pass_files.hpp>

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

// Three passes: walls, columns, and mean colours.
const std::vector<std::string> all_passes{
    "-t", "occupancy,color,color-outer", "--solid", "exterior", "--closing", "2", "--padding", "3", "--sparse"};

// The slabs that a run drew for passes.
int pass_slabs(const outcome& run) {
    EXPECT_EQ(0, run.code) << run.err;
    return run.code == 0 ? json::parse(run.out).value("pass_slabs", -1) : -1;
}

TEST(ToolPasses, ALaterProcessRepeatsNone) {
    const tower t(all_passes);
    const outcome whole = t.draw("whole.zarr", {"--stats=json"});
    ASSERT_EQ(0, whole.code) << whole.err;
    EXPECT_EQ(-1, pass_slabs(whole)); // nobody shares them
    int drawn = 9;
    for (const char* const rank : {"1", "2", "0"}) {
        EXPECT_EQ(drawn, pass_slabs(t.draw("parts.zarr", {"--world-size", "3", "--rank", rank, "--stats=json"})))
            << rank;
        drawn = 0;
    }
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "parts.zarr");
    // Other options share nothing with these.
    EXPECT_EQ(0, t.draw("m.zarr", {"--world-size", "3", "--rank", "1"}).code);
    EXPECT_EQ(9, pass_slabs(t.draw("m.zarr", {"--world-size", "3", "--rank", "2", "--scale", "2", "--stats=json"})));
    EXPECT_EQ(2u, t.unfinished().size());
}

// Each pass alone, in pieces whose borders cut bricks and lie within the closing of each other.
TEST(ToolPasses, PiecesThatCutBricks) {
    const std::vector<std::string> kinds[] = {
        {"-t", "color-outer"},
        {"-t", "color", "--solid", "nonzero", "--fill", "mean"},
        {"-t", "occupancy", "--solid", "exterior"},
        {"-t", "occupancy", "--solid", "exterior", "--closing", "9", "--padding", "2"},
    };
    for (const std::vector<std::string>& kind : kinds) {
        const tower t(kind, 6); // 60 layers
        fs::create_directories(t.folder / "whole");
        fs::create_directories(t.folder / "parts");
        ASSERT_EQ(0, t.draw("whole/m.pvti", {"--sparse", "--pieces", "9"}).code);
        int drawn = 9;
        for (const char* const rank : {"3", "1", "0", "2"}) {
            EXPECT_EQ(drawn, pass_slabs(t.draw("parts/m.pvti", {"--pieces", "9", "--world-size", "4", "--rank", rank,
                                                                "--stats=json", "--backend", "cpu"})));
            drawn = 0;
        }
        EXPECT_TRUE(files_of(t.folder / "whole") == files_of(t.folder / "parts")) << kind[1];
    }
}

#ifdef VOXELPIPE_MPIEXEC
// Processes at once, which find what the others have not found yet.
TEST(ToolPasses, RanksOfMpiexecShareThem) {
    const tower t(all_passes);
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    std::string command = std::string(VOXELPIPE_MPIEXEC " -n 3 " VOXELPIPE_VOXELIZE " ") + (t.folder / "m.glb") +
                          " -o " + (t.folder / "ranks.zarr") + " -r 600 -j 1";
    for (const std::string& word : all_passes) command += ' ' + word;
    command += " > " + (t.folder / "log") + " 2>&1";
    EXPECT_EQ(0, std::system(command.c_str())) << read_file(t.folder / "log");
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "ranks.zarr");
}
#endif

// kill -9 once the passes are done.
TEST(ToolPasses, AKilledRunRepeatsNone) {
    const tower t(all_passes, 300); // 12 slabs
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    const auto is_there = [&](const std::string& name) {
        const std::vector<fs::path> folders = t.unfinished();
        return !folders.empty() && fs::exists(folders[0] / name);
    };
    const pid_t child = t.begin("m.zarr", {"--resume"});
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!is_there("pass.means.11") && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    kill(child, SIGKILL);
    ASSERT_EQ(128 + SIGKILL, wait_for(t.folder, child).code); // it did not end before
    ASSERT_FALSE(is_there("done.11"));
    EXPECT_EQ(0, pass_slabs(t.draw("m.zarr", {"--resume", "--stats=json"})));
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "m.zarr");
}

// What a crash of the machine left of a file is found again.
TEST(ToolPasses, TornFilesAreNotTrusted) {
    const tower t(all_passes);
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    const auto draw = [&](const char* rank) {
        return pass_slabs(t.draw("m.zarr", {"--world-size", "3", "--rank", rank, "--stats=json"}));
    };
    ASSERT_EQ(9, draw("1"));
    ASSERT_EQ(t.unfinished().size(), 1u);
    const fs::path folder = t.unfinished()[0];
    fs::resize_file(folder / "pass.walls.0", fs::file_size(folder / "pass.walls.0") / 2);
    fs::resize_file(folder / "pass.columns.2", 0);
    {
        std::fstream file(folder / "pass.means.1", std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(-8, std::ios::end);
        file.put('\7');
    }
    EXPECT_EQ(2, draw("2")); // which is flooded by itself, without the walls of slab 0
    fs::resize_file(folder / "pass.borders.0", fs::file_size(folder / "pass.borders.0") - 1);
    EXPECT_EQ(1, draw("0")); // within a flood of the whole
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "m.zarr");
}

TEST(PassFiles, GiveBackWhatIsWhole) {
    const scratch_folder folder;
    const voxelize::pass_files files(folder.path(), 0);
    EXPECT_FALSE(files.read("a.0"));
    const std::array bytes{std::byte{1}, std::byte{2}, std::byte{3}};
    files.write("a.0", bytes);
    files.write("a.1", {});
    ASSERT_TRUE(files.read("a.0"));
    EXPECT_EQ(std::vector(bytes.begin(), bytes.end()), *files.read("a.0"));
    ASSERT_TRUE(files.read("a.1"));
    EXPECT_TRUE(files.read("a.1")->empty());
    const std::string whole = read_file(folder / "pass.a.0");
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string changed = whole;
        changed[at] = static_cast<char>(changed[at] ^ 4);
        std::ofstream(folder / "pass.a.0", std::ios::binary) << changed;
        EXPECT_FALSE(files.read("a.0")) << at;
        std::ofstream(folder / "pass.a.0", std::ios::binary) << whole.substr(0, at);
        EXPECT_FALSE(files.read("a.0")) << at;
    }
    std::ofstream(folder / "pass.a.0", std::ios::binary) << whole << '\0';
    EXPECT_FALSE(files.read("a.0"));
}

} // namespace
