// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// One model drawn and written slab by slab: by several processes, and by one that is stopped and run again. The folder
// is that of a run which does it at once, byte for byte.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

// A closed tower that turns as it rises, with a colour: with 60 floors, three slabs of 256 layers at 12 x 12 x 600
// voxels.
void write_tower(const fs::path& path, int floors) {
    constexpr int sides = 8;
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (int f = 0; f <= floors; ++f)
        for (int s = 0; s < sides; ++s) {
            const double a = 6.283185307179586 * s / sides + 0.05 * f;
            positions.insert(positions.end(), {static_cast<float>(5 + 5 * std::cos(a)),
                                               static_cast<float>(5 + 5 * std::sin(a)), static_cast<float>(10 * f)});
        }
    const auto at = [](int f, int s) { return static_cast<std::uint32_t>(f * sides + s % sides); };
    for (int s = 0; s < sides; ++s)
        for (int f = 0; f < floors; ++f)
            indices.insert(indices.end(),
                           {at(f, s), at(f, s + 1), at(f + 1, s), at(f, s + 1), at(f + 1, s + 1), at(f + 1, s)});
    for (int s = 1; s + 1 < sides; ++s) {
        indices.insert(indices.end(), {at(0, 0), at(0, s + 1), at(0, s)});
        indices.insert(indices.end(), {at(floors, 0), at(floors, s), at(floors, s + 1)});
    }
    builder file;
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    primitive["material"] = 0;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.3, 0.1, 1}}}}}};
    file.write_glb(path);
}

// Every file below a folder, by its path in it.
std::map<std::string, std::string> files_of(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = read_file(entry.path());
    return files;
}

struct tower {
    scratch_folder folder;
    std::vector<std::string> how;
    int floors;

    explicit tower(std::vector<std::string> how_, int floors_ = 60) : how(std::move(how_)), floors(floors_) {
        write_tower(folder / "m.glb", floors);
    }
    [[nodiscard]] pid_t begin(const std::string& out, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{
            folder / "m.glb", "-o", folder / out, "-r", std::to_string(10 * floors), "-j", "2"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return start(folder, arguments);
    }
    [[nodiscard]] outcome draw(const std::string& out, const std::vector<std::string>& more) const {
        return wait_for(folder, begin(out, more));
    }
    // The folders of slabs that are there.
    [[nodiscard]] std::vector<fs::path> unfinished() const {
        std::vector<fs::path> found;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder.path()))
            if (entry.path().extension() == ".slabs") found.push_back(entry.path());
        return found;
    }
};

void expect_same_group(const tower& t, const std::string& a, const std::string& b) {
    const auto x = files_of(t.folder / a), y = files_of(t.folder / b);
    EXPECT_GT(x.size(), 4u);
    EXPECT_TRUE(x == y) << x.size() << " and " << y.size() << " files";
}

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
        const std::size_t at = all.find(process);
        return at != std::string::npos && all.rfind("->", at) > all.rfind('\n', at);
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
    const tower flood({"--solid", "exterior", "--sparse"});
    ASSERT_EQ(0, flood.draw("whole.zarr", {}).code);
    EXPECT_EQ(0, flood.draw("parts.zarr", {"--resume"}).code);
    expect_same_group(flood, "whole.zarr", "parts.zarr");
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
