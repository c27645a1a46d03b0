// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The program on a GPU: with --backend cuda it writes the files that it writes with --backend cpu, byte for byte, for
// models below VOXELPIPE_GLTF_DIR and one that the test writes; auto takes the GPU; too little of its memory is said.
// Reported as not run (exit code 77) where the program finds no GPU that it can use.
#include "tool_test.hpp"

#include <draw/cuda_device.hpp>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

using namespace tool_test;

namespace {

namespace fs = std::filesystem;

const std::string all_targets =
    "occupancy,count,color,color-max,color-replace,color-outer,normal,material,triangle,depth";

// The folder of models: the environment's, for tests moved to another machine, or that of the build.
fs::path models() {
    const char* const elsewhere = std::getenv("VOXELPIPE_GLTF_DIR");
    return elsewhere != nullptr ? elsewhere : VOXELPIPE_GLTF_DIR;
}

json stats_of(const outcome& result) {
    EXPECT_EQ(0, result.code) << result.err;
    return result.code == 0 ? json::parse(result.out) : json::object();
}

// Runs the program on both backends and compares its files and counts.
void expect_same_files(const scratch_folder& folder, const fs::path& model, std::vector<std::string> options,
                       const std::vector<std::string>& names) {
    const auto has = [&](const char* option) {
        return std::find(options.begin(), options.end(), option) != options.end();
    };
    const bool has_stages = !has("--distance") && !has("--remesh") && !has("--sparse");
    std::string what = model.filename().string();
    for (const std::string& option : options) what += ' ' + option;
    SCOPED_TRACE(what);
    json stats[2];
    for (const char* backend : {"cpu", "cuda"}) {
        std::vector<std::string> arguments{model.string(), "-q", "--stats", "json", "--backend", backend};
        arguments.insert(arguments.end(), options.begin(), options.end());
        fs::create_directories(folder.path() / backend);
        for (const std::string& name : names)
            arguments.insert(arguments.end(), {"-o", (folder.path() / backend / name).string()});
        const bool cuda = backend == std::string_view("cuda");
        stats[cuda ? 1 : 0] = stats_of(run(folder, arguments));
        EXPECT_EQ(backend, stats[cuda ? 1 : 0]["backend"]);
    }
    if (testing::Test::HasFailure()) return;
    for (const char* count : {"triangles", "triangles_dropped", "fragments", "fragments_discarded", "voxels"})
        EXPECT_EQ(stats[0][count], stats[1][count]) << count;
    EXPECT_NE("", stats[1]["device"]);
    EXPECT_LT(0, stats[1]["device_memory_bytes"]);
    double sum = 0;
    for (const char* stage : {"options", "read", "place", "cuda_start", "write", "other"})
        EXPECT_TRUE(stats[1]["ms"].contains(stage)) << stage;
    for (const char* stage : {"upload", "vertex_shade", "coarse_raster", "tile_sort", "tile_split", "clear",
                              "fine_raster", "tile_resolve", "cuda_calls", "resolve"})
        ASSERT_TRUE(!has_stages || stats[1]["ms"].contains(stage)) << stage;
    for (const auto& [stage, time] : stats[1]["ms"].items()) {
        EXPECT_LE(0.0, time) << stage;
        if (stage != "total") sum += time.get<double>();
    }
    if (has_stages) EXPECT_LT(0.0, stats[1]["ms"]["fine_raster"]);
    EXPECT_NEAR(sum, stats[1]["ms"]["total"], 1e-6);
    // Some formats take a file for each target.
    ASSERT_EQ(stats[0]["files"].size(), stats[1]["files"].size());
    EXPECT_LE(names.size(), stats[0]["files"].size());
    for (std::size_t i = 0; i < stats[0]["files"].size(); ++i) {
        const fs::path cpu = stats[0]["files"][i].get<std::string>();
        const fs::path cuda = stats[1]["files"][i].get<std::string>();
        EXPECT_EQ(cpu.filename(), cuda.filename());
        const std::string bytes = read_file(cpu);
        EXPECT_LT(0U, bytes.size()) << cpu;
        EXPECT_TRUE(bytes == read_file(cuda)) << cpu.filename() << " differs";
    }
}

TEST(GpuFiles, OfLinesAndPoints) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::lined_world().write_glb(model);
    for (const char* coverage : {"conservative", "thin"}) {
        expect_same_files(folder, model, {"-r", "64", "--coverage", coverage, "-t", all_targets}, {"a.npz"});
        expect_same_files(folder, model, {"-r", "120", "--coverage", coverage, "--work-memory", "1", "-t", all_targets},
                          {"a.npz"});
    }
}

TEST(GpuFiles, OfAModelWithEverythingInIt) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    for (const char* coverage : {"conservative", "thin", "crosshair", "diagonal"}) {
        expect_same_files(folder, model, {"-r", "64", "--coverage", coverage, "-t", all_targets},
                          {"a.npz", "a.vti", "a.nrrd"});
        expect_same_files(folder, model, {"-r", "100", "--coverage", coverage}, {"a.npy", "a.binvox"});
        expect_same_files(folder, model, {"-r", "40", "--coverage", coverage, "-t", "occupancy,count"}, {"a.npz"});
        // One slab a layer or a few.
        expect_same_files(folder, model, {"-r", "120", "--coverage", coverage, "--work-memory", "1", "-t", all_targets},
                          {"a.npz"});
    }
    for (const char* rule : {"nonzero", "even_odd", "positive", "each_draw"})
        for (const char* extent : {"outer", "inner"})
            expect_same_files(
                folder, model,
                {"-r", "90", "--solid", rule, "--solid-extent", extent, "--work-memory", "1", "-t", all_targets},
                {"a.npz"});
    const std::vector<std::vector<std::string>> repairs{{"--solid", "nonzero", "--close-holes"},
                                                        {"--solid", "even_odd", "--vote"},
                                                        {"--solid", "nonzero", "--winding"},
                                                        {"--solid", "exterior", "--closing", "2", "--padding", "3"}};
    for (std::vector<std::string> repair : repairs) {
        repair.insert(repair.end(), {"-r", "70", "-t", all_targets});
        expect_same_files(folder, model, repair, {"a.npz"});
    }
    expect_same_files(folder, model, {"-r", "64", "--image-size", "160x120"}, {"a.vox", "a.png"});
    expect_same_files(folder, model, {"-r", "33", "--depth-axis", "x", "-t", "depth,normal"}, {"a.npz"});
}

// The same drawer's bricks: surfaces with lines, masks and instances, colours that the sides see, solids with tiles,
// repairs and bodies, in one slab and in many.
TEST(GpuFiles, OfBricks) {
    const scratch_folder folder;
    const std::string lined = folder / "lined.glb", model = folder / "m.glb";
    gltf_test::lined_world().write_glb(lined);
    gltf_test::small_world().write_glb(model);
    for (const std::string& shown : {lined, model})
        for (const char* coverage : {"conservative", "thin", "crosshair", "diagonal"}) {
            expect_same_files(folder, shown, {"-r", "100", "--sparse", "--coverage", coverage, "-t", all_targets},
                              {"a.npz"});
            expect_same_files(
                folder, shown,
                {"-r", "300", "--sparse", "--coverage", coverage, "--work-memory", "1", "-t", all_targets}, {"a.npz"});
            expect_same_files(folder, shown, {"-r", "90", "--sparse", "--coverage", coverage}, {"a.nvdb", "a.npy"});
            expect_same_files(folder, shown, {"-r", "70", "--sparse", "--coverage", coverage, "-t", "count"},
                              {"a.npz"});
        }
    for (const char* rule : {"nonzero", "even_odd", "positive", "each_draw"})
        for (const char* extent : {"outer", "inner"}) {
            expect_same_files(folder, model,
                              {"-r", "130", "--sparse", "--solid", rule, "--solid-extent", extent, "-t", all_targets},
                              {"a.npz"});
            expect_same_files(folder, model, {"-r", "200", "--sparse", "--solid", rule, "-t", "occupancy,count"},
                              {"a.nvdb"});
        }
    const std::vector<std::vector<std::string>> repairs{{"--solid", "nonzero", "--close-holes"},
                                                        {"--solid", "even_odd", "--vote"},
                                                        {"--solid", "exterior", "--closing", "2", "--padding", "3"},
                                                        {"--solid", "nonzero", "--fill", "mean"},
                                                        {"--solid", "nonzero", "--fill", "#ff8000"}};
    for (std::vector<std::string> repair : repairs) {
        repair.insert(repair.end(), {"-r", "110", "--sparse", "-t", all_targets});
        expect_same_files(folder, model, repair, {"a.npz"});
    }
    expect_same_files(folder, model, {"-r", "150", "--sparse", "--padding", "5"}, {"a.vox", "a.png", "a.ply"});
}

TEST(GpuFiles, OfDistancesAndRemeshes) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    const std::vector<std::vector<std::string>> distances{
        {"-r", "90"},
        {"-r", "60", "-t", "color,normal,material,triangle,depth,nearest"},
        {"-r", "40", "--band", "whole", "-t", "nearest"},
        {"-r", "50", "--corners", "--solid", "each_draw"},
        {"-r", "50", "--unsigned", "-t", "color"},
        {"-r", "50", "--close-holes"}};
    for (std::vector<std::string> options : distances) {
        options.push_back("--distance");
        expect_same_files(folder, model, options, {"a.npz", "a.nvdb"});
    }
    for (const char* place : {"sharp", "mean", "corner"}) {
        expect_same_files(folder, model, {"-r", "70", "--remesh", "--place", place}, {"a.glb", "a.npz"});
        expect_same_files(folder, model, {"-r", "40", "--remesh", "--place", place, "--iso", "0.1", "--quads"},
                          {"a.ply"});
    }
    expect_same_files(folder, model, {"-r", "60", "--remesh", "--solid", "exterior", "--closing", "1"}, {"a.glb"});
}

TEST(GpuFiles, OfModelsOfManyKinds) {
    if (models().empty() || !fs::exists(models())) GTEST_SKIP() << "VOXELPIPE_GLTF_DIR is not there";
    const scratch_folder folder;
    int compared = 0;
    for (const char* name : {"DamagedHelmet.glb", "gltf-transform/BoxVertexColors.glb", "gltf-transform/chr_knight.glb",
                             "trimesh/AlphaBlendModeTest.glb", "trimesh/BoxTextured.glb", "trimesh/CesiumMilkTruck.glb",
                             "trimesh/Duck.glb", "trimesh/mode5.gltf", "xeogl/2CylinderEngine/2CylinderEngine.gltf"}) {
        const fs::path model = models() / name;
        if (!fs::exists(model)) continue;
        ++compared;
        for (const char* coverage : {"conservative", "thin"})
            for (const char* storage : {"--dense", "--sparse"})
                expect_same_files(folder, model, {"-r", "160", storage, "--coverage", coverage, "-t", all_targets},
                                  {"a.npz"});
        expect_same_files(folder, model, {"-r", "128"}, {"a.vox"});
    }
    std::printf("%d models compared\n", compared);
    EXPECT_LT(0, compared);
}

// A grid for which the estimate of the CPU's time is long, whatever is in it.
const std::vector<std::string> large_grid{"--origin", "-1,-1,-1", "--voxel-size", "0.001", "--extent", "4000,4000,8"};

TEST(GpuChoice, AutoTakesTheQuickerWayAndSaysWhich) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    std::vector<std::string> arguments{folder / "m.glb", "-q", "-t", "occupancy,triangle", "-o", folder / "o.npz"};
    arguments.insert(arguments.end(), large_grid.begin(), large_grid.end());
    arguments.insert(arguments.end(), {"--stats", "json"});
    const json stats = stats_of(run(folder, arguments));
    EXPECT_EQ("cuda", stats["backend"]);
    EXPECT_FALSE(stats.contains("no_cuda"));
    EXPECT_TRUE(stats.contains("estimate"));
    arguments.back() = "text";
    const outcome text = run(folder, arguments);
    EXPECT_NE(std::string::npos, text.out.find("cuda, " + stats["device"].get<std::string>())) << text.out;
    EXPECT_NE(std::string::npos, text.out.find("(auto: about ")) << text.out;
    const json little =
        stats_of(run(folder, {folder / "m.glb", "-q", "--stats", "json", "-o", folder / "o.npy", "-r", "16"}));
    EXPECT_EQ("cpu", little["backend"]);
    EXPECT_EQ(0U, little["no_cuda"].get<std::string>().find("the CPU is quicker here: about ")) << little["no_cuda"];
}

// More memory than the program may take: cuda ends with 3 and one line, auto turns to the CPU with a warning.
TEST(GpuChoice, TooLittleMemoryIsSaid) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    std::vector<std::string> common{model, "-t", "occupancy,color", "--device-memory", "1", "--dense"};
    common.insert(common.end(), large_grid.begin(), large_grid.end());
    const auto arguments = [&](const std::string& out, const std::string& backend) {
        std::vector<std::string> list = common;
        list.insert(list.end(), {"-o", out, "--backend", backend, "--stats", "json"});
        return list;
    };
    const outcome cuda = run(folder, arguments(folder / "cuda.npz", "cuda"));
    EXPECT_EQ(3, cuda.code);
    EXPECT_EQ(0U, cuda.err.find("voxelize: --backend cuda: the GPU has too little memory")) << cuda.err;
    EXPECT_EQ(1, std::count(cuda.err.begin(), cuda.err.end(), '\n')) << cuda.err;
    EXPECT_FALSE(fs::exists(folder / "cuda.npz"));
    const outcome automatic = run(folder, arguments(folder / "auto.npz", "auto"));
    EXPECT_EQ("cpu", stats_of(automatic)["backend"]);
    EXPECT_NE(std::string::npos, automatic.err.find("warning: the GPU has too little memory")) << automatic.err;
    ASSERT_EQ(0, run(folder, arguments(folder / "cpu.npz", "cpu")).code);
    EXPECT_TRUE(read_file(folder / "cpu.npz") == read_file(folder / "auto.npz"));
}

} // namespace

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (!testing::GTEST_FLAG(list_tests)) {
        const std::string why = why_not(voxelize::look_for_cuda());
        if (!why.empty()) {
            std::printf("not run: %s\n", why.c_str());
            return 77;
        }
    }
    return RUN_ALL_TESTS();
}
