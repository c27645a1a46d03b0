// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The arithmetic between a measured time and the table that shows it.

#include "gpu_report.hpp"
#include "machine.hpp"
#include "output.hpp"
#include "published_gpu_figures.hpp"
#include "scene_choice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <unistd.h>

namespace {

using namespace bench;

sample of(double median) { return {median, median * 0.9, median * 1.1, median * 0.8, median * 2, 20}; }

gpu_row row(std::string_view scene, int n, gpu_cell cell, double ms) {
    gpu_row r;
    r.scene = scene;
    r.resolution = n;
    r.cell = cell;
    r.triangles = 1000;
    r.fragments = 4000;
    r.whole = of(ms);
    r.published = published_anchor(scene, n, cell);
    return r;
}

TEST(Statistics, QuartilesLieBetweenTheSortedNumbers) {
    const sample s = summarize({5, 1, 3, 2, 4});
    EXPECT_EQ(s.median, 3);
    EXPECT_EQ(s.low_quartile, 2);
    EXPECT_EQ(s.high_quartile, 4);
    EXPECT_EQ(s.least, 1);
    EXPECT_EQ(s.most, 5);
    EXPECT_EQ(s.runs, 5);
    const sample even = summarize({4, 1, 2, 3});
    EXPECT_EQ(even.median, 2.5);
    EXPECT_EQ(even.low_quartile, 1.75);
    EXPECT_EQ(summarize({7}).high_quartile, 7);
    EXPECT_EQ(summarize({}).runs, 0);
}

TEST(Statistics, GeometricMeanLeavesOutWhatIsMissing) {
    EXPECT_DOUBLE_EQ(geometric_mean({2, 8}), 4);
    EXPECT_DOUBLE_EQ(geometric_mean({2, 0, 8}), 4);
    EXPECT_EQ(geometric_mean({0, 0}), 0);
    EXPECT_EQ(geometric_mean({}), 0);
}

TEST(GpuCells, NamesParseToTheirCells) {
    std::set<std::string_view> names;
    for (const gpu_cell cell : gpu_cells) {
        gpu_cell back{};
        ASSERT_TRUE(parse(name_of(cell), back));
        EXPECT_EQ(back, cell);
        names.insert(name_of(cell));
    }
    EXPECT_EQ(names.size(), gpu_cells.size());
    gpu_cell cell{};
    EXPECT_FALSE(parse("bit", cell));
}

TEST(GpuCells, FramebufferBytesIncludePadding) {
    EXPECT_EQ(framebuffer_bytes(gpu_cell::bit_conservative, 128), 128u * 128 * 128 / 8);
    EXPECT_EQ(framebuffer_bytes(gpu_cell::bit_thin, 33), 8u * 33 * 33); // rows are padded to words
    EXPECT_EQ(framebuffer_bytes(gpu_cell::float_add_conservative, 1024), std::uint64_t{4} << 30);
    EXPECT_EQ(framebuffer_bytes(gpu_cell::abuffer_thin, 128), 0u);
    EXPECT_EQ(framebuffer_bytes(gpu_cell::float_add_tracked_conservative, 1024), 0u);
}

// The quoted targets follow from the quoted anchors by the documented rule, so a wrong digit fails the test.
TEST(PublishedGpuFigures, TargetsFollowFromTheAnchors) {
    std::set<std::pair<std::string_view, int>> cells;
    for (const published_gpu_scene& s : published_gpu_scenes) {
        SCOPED_TRACE(std::string(s.scene) + " " + std::to_string(s.resolution));
        cells.emplace(s.scene, s.resolution);
        // All are printed with three decimals.
        const double rounding = 0.0012;
        EXPECT_NEAR(s.target_bit, std::min(s.original_bit, s.peer_bit) / 3, rounding);
        EXPECT_NEAR(s.target_bit_thin, s.original_bit_thin / 3, rounding);
        EXPECT_NEAR(s.target_abuffer, s.original_abuffer / 3, rounding);
        // A third of the 2011 time leaves two thirds of the clear of a float target. The float and the
        // bit floor differ by the two clears.
        const double clear = (s.target_float - s.original_float / 3) * 1.5;
        EXPECT_GT(clear, 0);
        EXPECT_NEAR(clear, s.resolution == 128 ? 0.0067 : s.resolution == 512 ? 0.134 : 0.936, 0.003);
        EXPECT_LT(s.floor_bit, s.floor_float);
        EXPECT_LT(s.target_bit, s.original_bit);
        EXPECT_GT(s.paper_float, s.original_float) << "the GTX 480 was slower";
    }
    EXPECT_EQ(cells.size(), published_gpu_scenes.size());
    for (const std::string_view scene : scene_names)
        for (const int n : {128, 512, 1024}) EXPECT_TRUE(cells.contains({scene, n})) << scene << n;
}

TEST(PublishedGpuFigures, NoTargetUnderOnePointThreeTimesTheFloor) {
    for (const published_gpu_scene& s : published_gpu_scenes)
        for (const gpu_cell cell : gpu_cells) {
            const gpu_anchor a = published_anchor(s.scene, s.resolution, cell);
            EXPECT_GE(a.target, 1.3 * a.floor);
            EXPECT_EQ(a.fastest() > 0, cell != gpu_cell::abuffer_conservative &&
                                           cell != gpu_cell::bit_counted_conservative &&
                                           untracked(cell) != gpu_cell::float_replace_conservative);
        }
    const gpu_anchor dragon = published_anchor("dragon", 128, gpu_cell::bit_conservative);
    EXPECT_EQ(dragon.fastest(), 0.058);
    EXPECT_EQ(dragon.peer_name, forceflow);
    EXPECT_EQ(published_anchor("conference", 1024, gpu_cell::bit_conservative).fastest(), 1.222);
    EXPECT_EQ(published_anchor("room", 128, gpu_cell::bit_thin).fastest(), 0);
    EXPECT_EQ(published_anchor("dragon", 256, gpu_cell::bit_thin).fastest(), 0);
}

TEST(GpuReport, RatiosFollowFromTheTimes) {
    gpu_row r = row("dragon", 512, gpu_cell::bit_conservative, 0.055);
    r.baseline = of(0.22);
    r.floor_ms = 0.0275;
    EXPECT_DOUBLE_EQ(r.ahead_of_fastest(), 2.0); // 0.110, the peer's
    EXPECT_DOUBLE_EQ(r.ahead_of_baseline(), 4.0);
    EXPECT_DOUBLE_EQ(r.times_floor(), 2.0);
    EXPECT_NEAR(r.of_target(), 0.037 / 0.055, 1e-12);
    r.whole = {};
    EXPECT_EQ(r.ahead_of_fastest(), 0) << "no time, no ratio";
}

TEST(GpuReport, MeansCountTheCellsThatReachTheirGoals) {
    std::vector<gpu_row> rows{row("dragon", 512, gpu_cell::bit_conservative, 0.110 / 8),
                              row("dragon", 128, gpu_cell::bit_conservative, 0.058 / 2),
                              row("dragon", 512, gpu_cell::abuffer_conservative, 1.0)};
    rows.push_back(row("room", 512, gpu_cell::bit_conservative, 1)); // no figure
    rows.push_back(row("dragon", 1024, gpu_cell::bit_conservative, 1));
    rows.back().whole = {};
    rows.back().failure = "out of memory";
    rows[0].async = of(0.110 / 9); // the other row has no time
    const std::string text = gpu_means(rows).csv();
    // number, mean of 8 and 2, least, at 1.5 or more, at the target; async: mean, least, at 1.5 or more
    EXPECT_NE(text.find("bit_conservative,3,4.00 ×,2.00 ×,2,1,9.00 ×,9.00 ×,1,"), std::string::npos) << text;
    EXPECT_NE(text.find("abuffer_conservative,1,-,-,-,-,-,-,-,"), std::string::npos) << text;
    EXPECT_NE(text.find("all with a figure,2,4.00 ×"), std::string::npos) << text;
}

TEST(Numbers, WholeOnesHaveNoDecimals) {
    EXPECT_EQ(plain(100017228), "100017228");
    EXPECT_EQ(plain(0.1), "0.1");
    EXPECT_EQ(plain(409.6), "409.6");
    EXPECT_EQ(significant(0.012345), "0.0123");
    EXPECT_EQ(significant(1234), "1234");
}

TEST(GpuReport, EveryRowHasEveryColumn) {
    std::vector<gpu_row> rows{row("dragon", 512, gpu_cell::bit_thin, 0.5), row("room", 512, gpu_cell::bit_thin, 0.5)};
    rows.push_back(row("room", 128, gpu_cell::abuffer_thin, 1));
    rows.back().whole = {};
    rows.back().failure = "a, \"quoted\" failure";
    const std::string csv = gpu_table_all(rows).csv();
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
    const std::string head = csv.substr(0, csv.find('\n'));
    const std::string first = csv.substr(head.size() + 1, csv.find('\n', head.size() + 1) - head.size() - 1);
    EXPECT_EQ(std::count(head.begin(), head.end(), ','), std::count(first.begin(), first.end(), ','));
    EXPECT_NE(csv.find("\"a, \"\"quoted\"\" failure\""), std::string::npos);
    EXPECT_NE(gpu_table_short(rows).markdown().find("0.267"), std::string::npos) << "the 2011 figure";
}

TEST(GpuReport, ListsStagesOfTheRowsThatHaveThem) {
    std::vector<gpu_row> rows{row("dragon", 512, gpu_cell::bit_thin, 0.5), row("room", 512, gpu_cell::bit_thin, 0.5)};
    EXPECT_TRUE(gpu_stage_table(rows).empty());
    rows[1].stages.clear = 0.25;
    rows[1].stages.fine_raster = 0.125;
    const std::string csv = gpu_stage_table(rows).csv();
    EXPECT_EQ(csv, "scene,resolution,cell,vertex_shade,coarse_raster,tile_sort,tile_split,clear,fine_raster,"
                   "tile_resolve,abuffer_emit,all stages,call\n"
                   "room,512,bit_thin,,,,,0.2500,0.1250,,,0.3750,0.5000\n");
}

TEST(SceneChoice, AbsentScenesHaveStandInsAndSaySo) {
    std::vector<std::string> notes;
    const std::vector<std::string> names = available_scenes("", notes);
    ASSERT_EQ(names.size(), scene_names.size());
    EXPECT_EQ(notes.size(), names.size());
    EXPECT_EQ(names.front(), "room");
    EXPECT_NE(notes.front().find("conference is absent"), std::string::npos);
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
    EXPECT_EQ(find_mesh("", "one_triangle").triangles.size(), 1u);
    EXPECT_THROW((void)find_mesh("", "no_such_mesh"), std::runtime_error);
}

TEST(MachineRecord, CommitIsWhatTheCallerSays) {
    ASSERT_EQ(setenv("VOXELPIPE_COMMIT", "0123456789ab", 1), 0);
    EXPECT_EQ(describe_machine().commit, "0123456789ab");
    ASSERT_EQ(unsetenv("VOXELPIPE_COMMIT"), 0);
    EXPECT_FALSE(describe_machine().commit.empty());
}

TEST(Output, WritesItsFilesAndRecordsTheCommand) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("voxelpipe_bench_report_test_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder);
    write_file(folder / "a" / "b.csv", "1,2\n");
    EXPECT_EQ(std::filesystem::file_size(folder / "a" / "b.csv"), 4u);
    EXPECT_THROW(write_file(folder / "a", "a folder"), std::runtime_error);
    std::filesystem::remove_all(folder);
    const char* const words[] = {"/somewhere/bench_gpu_table", "--mesh", "dragon", "--out", "/elsewhere/out"};
    EXPECT_EQ(command_line(5, words), "bench_gpu_table --mesh dragon --out out");
}

} // namespace
