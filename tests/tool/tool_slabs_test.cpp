// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// One model drawn and written slab by slab: by several processes, and by one that is stopped and run again. The folder
// is that of a run which does it at once, byte for byte.
#include "tower.hpp"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

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

TEST(ToolSlabs, ProcessesShareOneModel) {
    const tower t({"-t", "occupancy,count,normal,color,color-outer", "--sparse", "--padding", "2"});
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    for (const char* const rank : {"1", "2", "0"}) {
        const outcome part = t.draw("parts.zarr", {"--world-size", "3", "--rank", rank});
        EXPECT_EQ(0, part.code) << part.err;
        EXPECT_NE(part.err.find(std::string("drew 1 of 3 slabs as process ") + rank + " of 3"), std::string::npos)
            << part.err;
        EXPECT_EQ(fs::exists(t.folder / "parts.zarr"), *rank == '0'); // the last one
        EXPECT_EQ(part.out.find("voxels are covered") != std::string::npos, *rank == '0');
    }
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "parts.zarr");
}

#ifdef VOXELPIPE_MPIEXEC
// Processes at once, as mpiexec starts them.
TEST(ToolSlabs, RanksOfMpiexecShareOneModel) {
    const tower t({"-t", "occupancy,count", "--sparse"});
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    const std::string command = std::string(VOXELPIPE_MPIEXEC " -n 3 " VOXELPIPE_VOXELIZE " ") + (t.folder / "m.glb") +
                                " -o " + (t.folder / "ranks.zarr") + " -r 600 -j 1 -t occupancy,count > " +
                                (t.folder / "log") + " 2>&1";
    EXPECT_EQ(0, std::system(command.c_str())) << read_file(t.folder / "log");
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "ranks.zarr");
}
#endif

TEST(ToolSlabs, AStoppedRunGoesOn) {
    const tower t({"-t", "occupancy,triangle,depth", "--sparse"});
    const outcome whole = t.draw("whole.zarr", {"--stats=json"});
    ASSERT_EQ(0, whole.code);
    ASSERT_EQ(0, t.draw("m.zarr", {"--world-size", "2", "--rank", "0"}).code); // slabs 0 and 2
    ASSERT_EQ(t.unfinished().size(), 1u);
    // Killed while it wrote slab 1: files of it are there, one of them in part, but no mark.
    const fs::path data = t.unfinished()[0] / "data";
    fs::create_directories(data / "occupancy" / "c" / "1" / "0");
    std::ofstream(data / "occupancy" / "c" / "1" / "0" / "0") << "a part";
    std::ofstream(data / "occupancy" / "c" / "1" / "0" / "0.part0") << "another";
    const outcome rest = t.draw("m.zarr", {"--resume", "--stats=json"});
    EXPECT_EQ(0, rest.code) << rest.err;
    EXPECT_NE(rest.err.find("drew 1 of 3 slabs"), std::string::npos) << rest.err;
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "m.zarr");
    const json a = json::parse(whole.out), b = json::parse(rest.out);
    for (const char* const name : {"voxels", "fragments"}) EXPECT_EQ(a.value(name, -1), b.value(name, -2)) << name;
    // Other options are other work; what is there before is replaced when the new one is whole.
    const outcome other = t.draw("m.zarr", {"--resume", "--coverage", "thin"});
    EXPECT_NE(other.err.find("drew 3 of 3 slabs"), std::string::npos) << other.err;
    EXPECT_FALSE(files_of(t.folder / "whole.zarr") == files_of(t.folder / "m.zarr"));
}

// kill -9 in the middle, twice. What is left is no output and no Zarr group; the run that goes on gives the same files.
TEST(ToolSlabs, AKilledRunGoesOn) {
    const tower t({"-t", "occupancy,color", "--sparse", "--padding", "2"}, 1024); // 40 slabs
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    const auto marks = [&] {
        int count = 0;
        for (const fs::path& folder : t.unfinished())
            for (int s = 0; s < 40; ++s) count += fs::exists(folder / ("done." + std::to_string(s))) ? 1 : 0;
        return count;
    };
    int done = 0;
    for (const int least : {1, 8}) {
        const pid_t child = t.begin("m.zarr", {"--resume"});
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
        while (marks() < least && std::chrono::steady_clock::now() < end)
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        kill(child, SIGKILL);
        const outcome killed = wait_for(t.folder, child);
        ASSERT_EQ(128 + SIGKILL, killed.code) << killed.err; // it did not end before
        done = marks();
        ASSERT_GE(done, least);
        ASSERT_LT(done, 40);
        EXPECT_FALSE(fs::exists(t.folder / "m.zarr"));
        ASSERT_EQ(t.unfinished().size(), 1u);
        for (const auto& [name, content] : files_of(t.unfinished()[0]))
            EXPECT_NE(fs::path(name).filename(), "zarr.json");
    }
    const outcome rest = t.draw("m.zarr", {"--resume"});
    EXPECT_EQ(0, rest.code) << rest.err;
    EXPECT_NE(rest.err.find("drew " + std::to_string(40 - done) + " of 40 slabs"), std::string::npos) << rest.err;
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "m.zarr");
}

// The same command twice at once, and a third that is killed while another waits for it.
TEST(ToolSlabs, TwoRunsAtOnceEndWell) {
    const tower t({"-t", "occupancy,color", "--sparse", "--padding", "2"}, 256); // 10 slabs
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    for (const bool is_killed : {false, true}) {
        SCOPED_TRACE(is_killed);
        fs::remove_all(t.folder / "m.zarr");
        const pid_t first = t.begin("m.zarr", {"--resume"});
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
        while (t.unfinished().empty() && std::chrono::steady_clock::now() < end)
            std::this_thread::sleep_for(std::chrono::microseconds(100));
        const pid_t second = t.begin("m.zarr", {"--resume"});
        std::this_thread::sleep_for(std::chrono::milliseconds(is_killed ? 5 : 0));
        if (is_killed) kill(first, SIGKILL);
        const outcome a = wait_for(t.folder, first), b = wait_for(t.folder, second);
        EXPECT_TRUE(a.code == 0 || (is_killed && a.code == 128 + SIGKILL)) << a.code << a.err;
        EXPECT_EQ(0, b.code) << b.err;
        EXPECT_TRUE(t.unfinished().empty());
        expect_same_group(t, "whole.zarr", "m.zarr");
    }
}

// Processes that come late, as those of slow hosts do: without a slab of their own, and while another process makes the
// output.
TEST(ToolSlabs, LateProcessesLeaveNothing) {
    const tower t({});
    for (const char* const rank : {"3", "1", "2", "0", "3"})
        EXPECT_EQ(0, t.draw("m.zarr", {"--world-size", "4", "--rank", rank}).code);
    EXPECT_TRUE(fs::exists(t.folder / "m.zarr"));
    EXPECT_TRUE(t.unfinished().empty());

    ASSERT_EQ(0, t.draw("n.zarr", {"--world-size", "2", "--rank", "0"}).code);
    ASSERT_EQ(t.unfinished().size(), 1u);
    const fs::path folder = t.unfinished()[0];
    const int lock = ::open((folder / "lock").c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_GE(lock, 0);
    ASSERT_EQ(0, ::flock(lock, LOCK_EX));
    const pid_t late = t.begin("n.zarr", {"--world-size", "2", "--rank", "0"});
    const auto waits = [&] { // "1: -> FLOCK  ADVISORY  WRITE 123 ..."
        const std::string all = read_file("/proc/locks"), process = " " + std::to_string(late) + " ";
        for (std::size_t at = all.find(process); at != std::string::npos; at = all.find(process, at + 1)) {
            const std::size_t line = all.rfind('\n', at) + 1;                             // 0 of the first
            if (all.substr(line, at - line).find("->") != std::string::npos) return true; // it holds others
        }
        return false;
    };
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!waits() && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(waits());
    fs::remove_all(folder);
    ::close(lock);
    const outcome result = wait_for(t.folder, late);
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_NE(result.err.find("drew 0 of 3 slabs"), std::string::npos) << result.err;
    EXPECT_TRUE(t.unfinished().empty());
}

// Without a lock two processes might make the output at once.
TEST(ToolSlabs, AFolderWithoutALockIsRefused) {
    const tower t({});
    ASSERT_EQ(0, t.draw("m.zarr", {"--world-size", "2", "--rank", "0"}).code);
    ASSERT_EQ(t.unfinished().size(), 1u);
    fs::remove(t.unfinished()[0] / "lock");
    fs::create_directory(t.unfinished()[0] / "lock");
    const outcome result = t.draw("m.zarr", {"--resume"});
    EXPECT_NE(0, result.code);
    EXPECT_NE(result.err.find("lock: "), std::string::npos) << result.err;
}

// As if somebody cleared the folder while the run went on.
TEST(ToolSlabs, SlabsThatAreGoneAreAFailure) {
    const tower t({"-t", "occupancy,color", "--sparse"}, 1024); // 40 slabs
    const pid_t child = t.begin("m.zarr", {"--resume"});
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    bool removed = false;
    while (!removed && std::chrono::steady_clock::now() < end) {
        for (const fs::path& folder : t.unfinished()) removed = removed || fs::remove(folder / "done.0");
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    const outcome result = wait_for(t.folder, child);
    EXPECT_EQ(4, result.code) << result.err;
    EXPECT_NE(result.err.find("are gone"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(t.folder / "m.zarr"));
}

// Blocks of levels reach over slabs.
TEST(ToolSlabs, Levels) {
    const tower t({"-t", "occupancy,color,normal,material", "--levels", "--sparse"});
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    for (const char* const rank : {"2", "1", "0"})
        EXPECT_EQ(0, t.draw("parts.zarr", {"--world-size", "3", "--rank", rank}).code);
    EXPECT_TRUE(t.unfinished().empty());
    expect_same_group(t, "whole.zarr", "parts.zarr");
    EXPECT_TRUE(fs::exists(t.folder / "parts.zarr/color/4/zarr.json")); // 600 layers, down to 38
}

// Pieces whose borders lie within bricks.
TEST(ToolSlabs, PiecesOfPvti) {
    const tower t({"-t", "occupancy,count,normal", "--sparse", "--padding", "3"});
    fs::create_directories(t.folder / "whole");
    fs::create_directories(t.folder / "parts");
    ASSERT_EQ(0, t.draw("whole/m.pvti", {"--pieces", "5"}).code);
    ASSERT_EQ(0, t.draw("parts/m.pvti", {"--pieces", "7"}).code); // whose pieces 6 and 7 go
    for (const char* const rank : {"1", "0"}) {
        const outcome part = t.draw("parts/m.pvti", {"--pieces", "5", "--world-size", "2", "--rank", rank});
        EXPECT_EQ(0, part.code) << part.err;
        EXPECT_NE(part.err.find(*rank == '1' ? "drew 2 of 5 slabs" : "drew 3 of 5 slabs"), std::string::npos)
            << part.err;
    }
    const auto whole = files_of(t.folder / "whole"), parts = files_of(t.folder / "parts");
    EXPECT_EQ(whole.size(), 6u);
    EXPECT_TRUE(whole == parts) << parts.size() << " files";
    // Until the last piece is there, what was there before stays.
    ASSERT_EQ(0, t.draw("parts/m.pvti", {"--pieces", "2", "--world-size", "2", "--rank", "1"}).code);
    EXPECT_EQ(read_file(t.folder / "whole/m.pvti"), read_file(t.folder / "parts/m.pvti"));
    EXPECT_EQ(0, t.draw("parts/m.pvti", {"--pieces", "2", "--world-size", "2", "--rank", "0"}).code);
    EXPECT_EQ(files_of(t.folder / "parts").size(), 3u);
}

TEST(ToolSlabs, SolidsAndTheirHoles) {
    const tower t({"-t", "occupancy,color", "--solid", "nonzero", "--close-holes", "--sparse"});
    ASSERT_EQ(0, t.draw("whole.zarr", {}).code);
    const outcome parts = t.draw("parts.zarr", {"--resume"});
    EXPECT_EQ(0, parts.code) << parts.err;
    expect_same_group(t, "whole.zarr", "parts.zarr");
}

TEST(ToolSlabs, SaysWhatCannotBeDoneBySlabs) {
    const tower t({});
    const auto error = [&](const std::string& out, const std::vector<std::string>& more) {
        std::vector<std::string> all{"--resume"};
        all.insert(all.end(), more.begin(), more.end());
        const outcome result = t.draw(out, all);
        EXPECT_EQ(result.code, 1);
        return result.err;
    };
    EXPECT_NE(error("m.npz", {}).find("--resume needs one output, a .zarr or .pvti"), std::string::npos);
    EXPECT_NE(error("m.zarr", {"--dense"}).find("no --dense"), std::string::npos);
}

} // namespace
