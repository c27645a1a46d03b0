// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The voxelize program with --sparse, with .nvdb, and where it chooses bricks by itself: the voxels and values of dense
// runs, the same pictures, the same files each time.
#include "tool_test.hpp"

#include <model/targets.hpp>

#include <gtest/gtest.h>

#include <map>

using namespace tool_test;

namespace {

constexpr const char* all_targets =
    "occupancy,count,color,color-max,color-replace,color-outer,normal,material,triangle,depth";

// Voxels of the coords in the dense arrays, and nothing else in those.
void expect_same_voxels(const scratch_folder& folder) {
    const array coords = read_npy(folder / "s.npy");
    ASSERT_EQ("<i4", coords.type);
    ASSERT_EQ(2U, coords.shape.size());
    ASSERT_EQ(3U, coords.shape[1]);
    const array bits = read_npy(folder / "d.occupancy.npy");
    std::map<std::size_t, std::size_t> ranks; // by the dense index
    for (std::size_t r = 0; r < coords.shape[0]; ++r) {
        const auto x = coords.at<std::uint32_t>(3 * r), y = coords.at<std::uint32_t>(3 * r + 1),
                   z = coords.at<std::uint32_t>(3 * r + 2);
        ASSERT_TRUE(x < bits.shape[2] && y < bits.shape[1] && z < bits.shape[0]);
        ranks[(z * bits.shape[1] + y) * bits.shape[2] + x] = r;
    }
    ASSERT_EQ(coords.shape[0], ranks.size());
    ASSERT_LT(1000U, ranks.size());
    std::size_t covered = 0;
    for (std::size_t i = 0; i < bits.voxels(); ++i) {
        covered += bits.at<std::uint8_t>(i);
        ASSERT_EQ(bits.at<std::uint8_t>(i) != 0, ranks.contains(i)) << i;
    }
    EXPECT_EQ(ranks.size(), covered);
    for (const voxelize::target_info& entry : voxelize::target_table) {
        if (entry.id == voxelize::target::occupancy) continue;
        const std::string name(entry.name);
        const array dense = read_npy(folder / ("d." + name + ".npy")),
                    sparse = read_npy(folder / ("s." + name + ".npy"));
        ASSERT_EQ(dense.type, sparse.type) << name;
        ASSERT_EQ(ranks.size(), sparse.shape[0]) << name;
        const std::size_t size = dense.data.size() / dense.voxels();
        ASSERT_EQ(ranks.size() * size, sparse.data.size()) << name;
        for (const auto& [i, r] : ranks)
            ASSERT_EQ(0, std::memcmp(dense.data.data() + i * size, sparse.data.data() + r * size, size)) << name << i;
    }
}

TEST(ToolSparse, HoldsTheVoxelsAndValuesOfADenseRun) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "world.glb");
    gltf_test::lined_world().write_glb(folder / "lines.glb");
    for (const char* model : {"world.glb", "lines.glb"})
        for (const char* coverage : {"conservative", "thin"})
            for (const std::string& padding : gltf_test::some_of<std::string>({"0", "5"}, 2)) {
                const auto voxelize = [&](const char* out, const char* how) {
                    const outcome result =
                        run(folder, {folder / model, "-o", folder / out, "-r", "48", "-t", all_targets, "--coverage",
                                     coverage, "--padding", padding, how});
                    ASSERT_EQ(0, result.code) << result.err;
                    EXPECT_EQ(std::string(how) == "--sparse",
                              result.out.find("bricks of 8 x 8 x 8") != std::string::npos)
                        << result.out;
                };
                voxelize("s.npy", "--sparse");
                voxelize("d.npy", "--dense");
                expect_same_voxels(folder);
            }
}

// A .nvdb makes the tool keep bricks, which changes no other output.
TEST(ToolSparse, ArraysStayGridsWhateverElseIsWritten) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const char* const targets : {"occupancy", "occupancy,color,normal"}) {
        const auto draw = [&](const std::vector<std::string>& outputs) {
            std::vector<std::string> arguments{folder / "m.glb", "-r", "24", "-t", targets, "--compression", "0"};
            for (const std::string& output : outputs) arguments.insert(arguments.end(), {"-o", folder / output});
            const outcome result = run(folder, arguments);
            EXPECT_EQ(0, result.code) << result.err;
            return result;
        };
        draw({"alone.npy", "alone.npz"});
        EXPECT_NE(std::string::npos, draw({"beside.npy", "x.nvdb", "beside.npz"}).err.find("a sparse grid of"));
        const std::vector<std::string> several{".npz", ".occupancy.npy", ".color.npy", ".normal.npy"};
        const std::vector<std::string> one{".npz", ".npy"};
        for (const std::string& end : std::string(targets) == "occupancy" ? one : several) {
            const std::string alone = read_file(folder / ("alone" + end));
            EXPECT_LT(1000U, alone.size()) << end;
            EXPECT_TRUE(alone == read_file(folder / ("beside" + end))) << end;
        }
    }
    EXPECT_EQ(3U, read_npy(folder / "beside.npy").shape.size()); // of the one target, before
}

TEST(ToolSparse, SolidsHoldTheVoxelsAndValuesOfADenseRun) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const std::vector<std::vector<std::string>> solids{
        {"--solid", "nonzero"},
        {"--solid", "each_draw", "--solid-extent", "centre", "--fill-color", "#102030"},
        {"--solid", "exterior", "--closing", "1", "--padding", "5"}};
    for (const std::vector<std::string>& solid : solids) {
        std::string messages[2];
        for (const bool sparse : {false, true}) {
            std::vector<std::string> arguments{folder / "m.glb",
                                               "-o",
                                               folder / (sparse ? "s.npy" : "d.npy"),
                                               "-r",
                                               "40",
                                               "-t",
                                               all_targets,
                                               sparse ? "--sparse" : "--dense"};
            arguments.insert(arguments.end(), solid.begin(), solid.end());
            const outcome result = run(folder, arguments);
            ASSERT_EQ(0, result.code) << result.err;
            messages[sparse ? 1 : 0] = result.err;
        }
        EXPECT_EQ(messages[0], messages[1]);
        expect_same_voxels(folder);
    }
}

// The inside of one body is tiles, some of which a surface opens.
TEST(ToolSparse, CountsOfOneBodyAreThoseOfADenseRun) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {1, 0, 0, 1}));
    file.write_glb(folder / "m.glb");
    const auto draw = [&](const std::string& out, const char* how) {
        const outcome result = run(folder, {folder / "m.glb", "-q", "-o", folder / out, "-r", "64", "--solid",
                                            "each_draw", "-t", "count,color", "--compression", "0", how});
        ASSERT_EQ(0, result.code) << result.err;
    };
    draw("d.vti", "--dense");
    draw("s.vti", "--sparse");
    EXPECT_TRUE(read_file(folder / "d.vti") == read_file(folder / "s.vti"));
}

// A picture drawn from bricks, dense files read from them, shapes, and .nvdb by either way.
TEST(ToolSparse, WritesTheSameFilesAsADenseRun) {
    constexpr const char* extensions[] = {".png", ".nvdb", ".vti", ".vox", ".glb"};
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const char* const resolution = gltf_test::is_slow_build() ? "45" : "90";
    const auto voxelize = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> arguments{folder / "m.glb", "-r", resolution, "--image-size", "320x240"};
        for (const char* extension : extensions) {
            arguments.emplace_back("-o");
            arguments.push_back(folder / (name + extension));
        }
        arguments.insert(arguments.end(), more.begin(), more.end());
        const outcome result = run(folder, arguments);
        ASSERT_EQ(0, result.code) << result.err;
    };
    voxelize("d", {"--dense"});
    voxelize("s", {"--sparse"});
    voxelize("one", {"--sparse", "-j", "1"});
    voxelize("five", {"--sparse", "-j", "5"});
    voxelize("slabs", {"--sparse", "--work-memory", "1"});
    for (const std::string extension : extensions) {
        const std::string dense = read_file(folder / ("d" + extension));
        EXPECT_LT(100U, dense.size());
        for (const char* name : {"s", "one", "five", "slabs"})
            EXPECT_TRUE(dense == read_file(folder / (name + extension))) << name << extension;
    }
}

// Shapes of several .vox models, of joined faces, of points, of the other axis upright, of solids without colours.
TEST(ToolSparse, WritesTheSameShapesAsADenseRun) {
    const char* const several = gltf_test::is_slow_build() ? "70" : "270"; // one model and several
    const std::vector<std::vector<std::string>> runs{
        {"-r", several, "--coverage", "thin", "--up", "z", "-o", "$.vox"},
        {"-r", "61", "--merge", "--up", "z", "-o", "$.glb", "-o", "$.obj", "-o", "$.ply", "-o", "$.stl", "-o",
         "$.schem"},
        {"-r", "50", "--points", "-t", "occupancy", "-o", "$.ply", "-o", "$.vox", "-o", "$.xyz"},
        {"-r", "50", "--solid", "exterior", "-t", "occupancy", "-o", "$.glb", "-o", "$.binvox", "-o", "$.schem", "-o",
         "$.nrrd", "-o", "$.nii", "-o", "$.nii.gz"}};
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const std::vector<std::string>& one : runs) {
        std::vector<std::string> names;
        for (const char* how : {"--dense", "--sparse"}) {
            std::vector<std::string> arguments{folder / "m.glb", how};
            for (std::string argument : one) {
                if (argument.front() == '$') {
                    if (how == std::string("--dense")) names.push_back(argument.substr(1));
                    argument = folder / (how + argument.substr(1));
                }
                arguments.push_back(argument);
            }
            const outcome result = run(folder, arguments);
            ASSERT_EQ(0, result.code) << result.err;
        }
        for (const std::string& name : names) {
            const std::string dense = read_file(folder / ("--dense" + name));
            EXPECT_LT(100U, dense.size());
            EXPECT_TRUE(dense == read_file(folder / ("--sparse" + name))) << name;
        }
    }
}

TEST(ToolSparse, IsChosenWhereItHasToBeAndSaysSo) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto voxelize = [&](std::vector<std::string> more) {
        more.insert(more.begin(), folder / "m.glb");
        return run(folder, more);
    };
    outcome result = voxelize({"-o", folder / "a.nvdb", "-r", "30"});
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("a sparse grid of")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(".nvdb holds occupied voxels alone")) << result.err;
    result = voxelize({"-o", folder / "a.npz", "-r", "30"});
    EXPECT_EQ("", result.err); // dense
    EXPECT_EQ(std::string::npos, result.out.find("bricks")) << result.out;
    // 400^3 voxels of 20 bytes are 1.2 GiB.
    result = voxelize({"-o", folder / "a.npz", "-o", folder / "a.png", "-r", "400", "-t", "depth,count,normal",
                       "--max-memory", "200", "--image-size", "64x48"});
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("a dense one would take")) << result.err;
    // .vti is dense, but never as a whole. A sanitizer's own memory would count, here and below.
    if (!gltf_test::is_slow_build()) {
        result = voxelize({"-o", folder / "a.vti", "-r", "400", "-t", "depth", "--max-memory", "150"});
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_NE(std::string::npos, result.err.find("a dense one would take")) << result.err;
    }
    // So are shapes of the voxels, which --dense makes too large.
    const std::vector<const char*> shapes =
        gltf_test::is_slow_build() ? std::vector<const char*>{} : std::vector{"a.glb", "a.vox"};
    for (const char* name : shapes) {
        std::vector<std::string> arguments{"-o",         folder / name, "-r",           "400", "-t", "occupancy,color",
                                           "--coverage", "thin",        "--max-memory", "200"};
        result = voxelize(arguments);
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_NE(std::string::npos, result.err.find("a dense one would take")) << result.err;
        arguments.emplace_back("--dense");
        EXPECT_EQ(3, voxelize(arguments).code);
    }
    result = voxelize({"-o", folder / "a.npz", "--sparse", "--dense"});
    EXPECT_EQ(1, result.code) << result.err;
}

// Values of a large grid are drawn into bricks where nobody asks for these: the files are those of --dense, in much
// less memory. Small grids, bits alone and solids stay dense.
TEST(ToolSparse, IsChosenForValuesOfLargeGrids) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    const auto stats = [&](std::vector<std::string> options, const std::string& out) {
        options.insert(options.begin(), {model, "-q", "--backend", "cpu", "--stats", "json", "-o", folder / out});
        const outcome result = run(folder, options);
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_EQ("", result.err);
        return nlohmann::json::parse(result.out);
    };
    const auto is_in_bricks = [](const nlohmann::json& all) { return all.contains("bricks"); };
    const std::vector<std::string> large{"--origin", "-1,-1,0",     "--voxel-size", "0.0005",
                                         "--extent", "4096,4096,1", "-t",           "color,normal"};
    std::vector<std::string> dense = large;
    dense.push_back("--dense");
    const auto in_bricks = stats(large, "b.vti"), as_grid = stats(dense, "d.vti");
    EXPECT_TRUE(is_in_bricks(in_bricks));
    EXPECT_FALSE(is_in_bricks(as_grid));
    EXPECT_EQ(as_grid["voxels"], in_bricks["voxels"]);
    EXPECT_LT(0, in_bricks["voxels"]);
    EXPECT_LT(0, in_bricks["bricks"]);
    EXPECT_LT(0, in_bricks["brick_bytes"]);
    EXPECT_TRUE(read_file(folder / "d.vti") == read_file(folder / "b.vti"));
    EXPECT_GT(as_grid["peak_memory_bytes"].get<double>(), 2 * in_bricks["peak_memory_bytes"].get<double>());
    EXPECT_FALSE(is_in_bricks(stats({"-r", "64", "-t", "color"}, "s.vti")));
    EXPECT_FALSE(is_in_bricks(stats({"-r", "64", "--solid", "nonzero"}, "s.vti")));
}

TEST(ToolSparse, TakesGridsFarBeyondDenseOnes) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "a.nvdb", "-o", folder / "a.png", "-r",
                                        gltf_test::is_slow_build() ? "300" : "1500", "-t", "occupancy", "--coverage",
                                        "thin", "--image-size", "64x48"});
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_LT(100000U, std::filesystem::file_size(folder / "a.nvdb"));
}

} // namespace
