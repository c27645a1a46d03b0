// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Fractions whose result does not fit --max-memory: they are drawn in slabs while outputs are written.
#include "fraction_support.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

using namespace tool_test;
using namespace fraction_test;

namespace {

// A result beyond --max-memory is drawn in slabs while it is written: the bytes of a run that holds it, and its counts
// and warnings.
TEST(FractionSlabs, HaveTheBytesOfOneRun) {
    if (sanitized) return; // which takes memory of its own
    const scratch_folder folder;
    builder file;
    shape open = tilted;
    open.triangles.pop_back();
    add(file, open);
    add(file, box({-1, -1, -1}, {1, 3, 1})); // with overlaps
    file.write_glb(folder / "m.glb");
    struct way {
        std::string output;
        unsigned layers, bytes; // a voxel
        std::vector<std::string> more;
    };
    for (const way& w :
         {way{"o.npy", 700, 4, {"-t", "fraction"}}, way{"o.npz", 300, 20, {"-t", "fraction,area,centroid"}},
          way{"o.zarr", 1600, 4, {"-t", "fraction", "--close-holes"}},
          way{"o.vti", 700, 4, {"-t", "fraction", "--outside", "--clamp"}},
          way{"o.nii.gz", 300, 16, {"-t", "area,centroid"}}, way{"{z}.png", 700, 4, {"-t", "fraction"}}}) {
        SCOPED_TRACE(w.output);
        const auto draw = [&](const std::string& to, const std::vector<std::string>& limit) {
            fs::create_directories(folder / to);
            std::vector<std::string> all{
                folder / "m.glb", "-o",       folder / (to + "/" + w.output),        "--origin",     "-2,-2,-4", "-s",
                "0.03125",        "--extent", "100,100," + std::to_string(w.layers), "--stats=json", "-j",       "2"};
            all.insert(all.end(), w.more.begin(), w.more.end());
            all.insert(all.end(), limit.begin(), limit.end());
            return run(folder, all);
        };
        const outcome whole = draw("whole", {});
        ASSERT_EQ(0, whole.code) << whole.err;
        const json a = json::parse(whole.out);
        const unsigned result = 100 * 100 * w.layers * w.bytes, peak = a["peak_memory_bytes"],
                       limit = (peak - result / 10 * 3) >> 20;
        const outcome tight = draw("tight", {"--max-memory", std::to_string(limit)});
        ASSERT_EQ(0, tight.code) << tight.err;
        const json b = json::parse(tight.out);
        EXPECT_LE(b["peak_memory_bytes"], limit << 20);
        EXPECT_EQ(1, a["slabs"]);
        EXPECT_GT(b["slabs"], 1);
        for (const char* const same : {"voxels", "fractions", "warnings", "fragments", "triangles"})
            EXPECT_EQ(a[same], b[same]) << same;
        EXPECT_FALSE(a["warnings"].empty());
        std::size_t files = 0;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "whole")) {
            if (!entry.is_regular_file()) continue;
            ++files;
            ASSERT_TRUE(read_file(entry.path()) ==
                        read_file(folder / ("tight/" + fs::relative(entry.path(), folder / "whole").string())))
                << entry.path();
        }
        EXPECT_LT(0U, files);
        fs::remove_all(folder / "whole");
        fs::remove_all(folder / "tight");
    }
}

// Rings of empty voxels lie in slabs, too, some of which hold nothing else.
TEST(FractionSlabs, HaveTheirPartOfThePadding) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    add(file, tilted);
    file.write_glb(folder / "m.glb");
    for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{{}, {"--outside"}}) {
        const auto draw = [&](const std::string& to, const std::vector<std::string>& limit) {
            std::vector<std::string> all{
                folder / "m.glb", "-o",           folder / to, "-r", "260", "--padding", "100", "-t",
                "fraction,area",  "--stats=json", "-j",        "2"};
            all.insert(all.end(), more.begin(), more.end());
            all.insert(all.end(), limit.begin(), limit.end());
            return run(folder, all);
        };
        const outcome whole = draw("a.npz", {});
        ASSERT_EQ(0, whole.code) << whole.err;
        const json a = json::parse(whole.out);
        const unsigned peak = a["peak_memory_bytes"];
        const outcome tight = draw("b.npz", {"--max-memory", std::to_string((peak >> 20) * 6 / 10)});
        ASSERT_EQ(0, tight.code) << tight.err;
        const json b = json::parse(tight.out);
        EXPECT_GT(b["slabs"], 2);
        EXPECT_EQ(a["fractions"], b["fractions"]);
        EXPECT_TRUE(read_file(folder / "a.npz") == read_file(folder / "b.npz"));
    }
}

} // namespace
