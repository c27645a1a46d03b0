// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The voxelize program, end to end, on models that the tests write. Its options: tool_options_test.cpp; what materials
// come to: tool_materials_test.cpp.
#include "tool_test.hpp"

#include <model/targets.hpp>
#include <write/formats/formats.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace tool_test;

namespace {

constexpr const char* all_targets =
    "occupancy,count,color,color-max,color-replace,color-outer,normal,material,triangle,depth";

TEST(Tool, WrongCommandLinesAreExplained) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    const std::string out = folder / "o.npy";
    const auto expect = [&](std::vector<std::string> arguments, const std::string& part) {
        const outcome result = run(folder, arguments);
        EXPECT_EQ(1, result.code) << part;
        EXPECT_EQ("", result.out);
        EXPECT_NE(std::string::npos, result.err.find(part)) << result.err;
        EXPECT_EQ(0U, result.err.find("voxelize: ")) << result.err;
        EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 2) << result.err;
        EXPECT_FALSE(std::filesystem::exists(out));
    };
    expect({}, "INPUT is required");
    expect({model}, "--output is required");
    expect({model, "-o", folder / "o.abc"}, "must be one of .npy");
    expect({model, "-o", folder / "o.npy", "--levels"}, "--levels: .npy has no levels");
    expect({model, "-o", folder / "o.vti", "--pieces", "3"}, "--pieces: .vti has no pieces");
    expect({model, "-o", out, "-o", out}, "given twice");
    expect({model, "-o", out, "--target", "colour"}, "is not one of occupancy, count");
    expect({model, "-o", out, "--resolution", "0"}, "at least 1");
    expect({model, "-o", out, "--resolution", "many"}, "--resolution");
    expect({model, "-o", out, "-r", "8", "--padding", "4"}, "leaves nothing");
    expect({model, "-o", out, "-r", "8", "--padding", "-1"}, "negative");
    expect({model, "-o", out, "-r", "8", "--voxel-size", "1"}, "do not go together");
    expect({model, "-o", out, "--voxel-size", "0"}, "positive");
    expect({model, "-o", out, "--voxel-size", "1,2"}, "one number or three");
    expect({model, "-o", out, "--voxel-size", "nan"}, "one number or three");
    expect({model, "-o", out, "--origin", "0,0,0"}, "all three");
    expect({model, "-o", out, "--origin", "0,0", "--voxel-size", "1", "--extent", "1,1,1"}, "three numbers");
    expect({model, "-o", out, "--origin", "0,0,0", "--voxel-size", "1", "--extent", "4,0,4"}, "extent");
    expect({model, "-o", out, "--origin", "0,0,0", "--voxel-size", "1", "--extent", "4,4,4", "-r", "3"}, "do not go");
    expect({model, "-o", out, "--coverage", "thick"}, "thick");
    expect({model, "-o", out, "--backend", "gpu"}, "gpu");
    expect({model, "-o", out, "--threads", "-1"}, "--threads");
    expect({model, "-o", out, "--image-size", "100"}, "--image-size");
    expect({model, "-o", out, "--background", "mauve"}, "mauve");
    expect({model, "-o", out, "-o", folder / "o.binvox", "--voxel-size", "1,1,2"}, "one voxel size for all axes");
    expect({model, "-o", out, "-o", folder / "o.vox", "--voxel-size", "1,1,2"}, ".vox has one voxel size for all axes");
    expect({model, "-o", out, "--no-such-option", "5"}, "there is no option --no-such-option");
    expect({model, model, "-o", out}, "m.glb\": one INPUT is read; --list FILE reads many");
    expect({model, "-o"}, "--output needs a value");
    expect({model, "-o", out, "--padding", "x"}, "--padding does not take \"x\"");
    expect({model, "-o", out, "--vote=maybe"}, "--vote does not take \"maybe\"");
    expect({model, "-o", out, "--zoom", "0"}, "--zoom: a number above 0, not \"0\"");
    expect({model, "-o", out, "--background", "red"}, "--background takes sky, white, dark, transparent, #rrggbb, or");
    expect({model, "-o", out, "-r", "1.5"}, "--resolution takes one whole number or three, ");
    expect({model, "-o", out, "-r", "99999999999"}, "--resolution: \"99999999999\" has a number that is too large");
    expect({model, "-o", out, "--origin", "0,0,0", "-s", "1", "--extent", "1,2.5,1"}, "three whole numbers, X,Y,Z");
    expect({model, "-o", out, "--threads", "1.5"}, "--threads: a whole number from 0 to 1024, not \"1.5\"");
    expect({model, "-o", out, "--devices", "0"}, "--devices: a whole number from 1 to 9999, or all, not \"0\"");
    expect({model, "-o", out, "--world-size", "2", "--rank", "2"}, "--rank must be below --world-size: it is 2 of 2");
    expect({model, "-o", out, "--animation", "0", "--time", "inf"}, "--time takes a finite number of seconds");
    expect({model, "-o", out, "--max-memory", "lots"},
           "--max-memory: a whole number from 1 to 1073741824, not \"lots\"");
    expect({model, "-o", out, "--scale", "nan"}, "--scale: a number from 1e-30 to 1e+30, not \"nan\"");
    expect({model, "-o", out, "-r", "8x8"}, "one whole number or three, X,Y,Z or XxYxZ, not \"8x8\"");
}

TEST(Tool, ModelsThatCannotBeUsedEndWithTwo) {
    const scratch_folder folder;
    const auto expect = [&](const std::string& model, const std::string& part) {
        const outcome result = run(folder, {model, "-o", folder / "o.npy"});
        EXPECT_EQ(2, result.code) << part;
        EXPECT_EQ("", result.out);
        EXPECT_NE(std::string::npos, result.err.find(part)) << result.err;
        // The error is the last line; warnings may stand above it.
        const std::size_t last = result.err.find_last_of('\n', result.err.size() - 2);
        const std::string line = result.err.substr(last == std::string::npos ? 0 : last + 1);
        EXPECT_EQ(0U, line.find("voxelize: " + model + ": ")) << result.err;
        EXPECT_EQ('\n', line.back()) << result.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "o.npy"));
    };
    expect(folder / "none.glb", "no such file");
    expect(folder.path().string(), "not a regular file");
    std::ofstream(folder / "text.glb") << "hello";
    expect(folder / "text.glb", "neither a GLB");
    builder empty;
    empty.write_glb(folder / "empty.glb");
    expect(folder / "empty.glb", "no triangles");
    builder nowhere;
    nowhere.mesh({{"POSITION", nowhere.accessor(std::vector<float>(9, NAN), "VEC3")}});
    nowhere.write_glb(folder / "nowhere.glb");
    expect(folder / "nowhere.glb", "finite position");
    builder bad;
    bad.triangle()["indices"] = 7;
    bad.write_glb(folder / "bad.glb");
    expect(folder / "bad.glb", "meshes[0].primitives[0].indices: 7 is not in accessors");
}

TEST(Tool, OtherFailuresHaveTheirOwnCodes) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    const outcome output = run(folder, {model, "-o", folder / "away/o.npy"});
    EXPECT_EQ(4, output.code) << output.err;
    EXPECT_NE(std::string::npos, output.err.find("o.npy")) << output.err;
    const outcome large = run(folder, {model, "-o", folder / "o.npy", "--origin", "0,0,0", "--voxel-size", "1",
                                       "--extent", "1000000,1000000,1000000", "--dense"});
    EXPECT_EQ(3, large.code) << large.err;
    EXPECT_NE(std::string::npos, large.err.find("MiB")) << large.err;
}

TEST(Tool, AFileBeyondTheLimitOfTheShellLeavesNothing) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    rlimit before{};
    ASSERT_EQ(0, getrlimit(RLIMIT_FSIZE, &before));
    const rlimit bound{8192, before.rlim_max}; // as `ulimit -f`, which the program inherits
    ASSERT_EQ(0, setrlimit(RLIMIT_FSIZE, &bound));
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "64"});
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(4, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("o.npy")) << result.err;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        EXPECT_EQ(std::string::npos, entry.path().filename().string().find("o.npy")) << entry.path();
}

// Three squares in one layer: red below green below a blue that is half transparent.
TEST(Tool, ColorsMeetAsTheirTargetSays) {
    const scratch_folder folder;
    builder file;
    for (const auto& [z, color, mode] : {std::tuple{0.0F, std::vector<double>{1, 0, 0, 1}, "OPAQUE"},
                                         std::tuple{0.1F, std::vector<double>{0, 1, 0, 1}, "OPAQUE"},
                                         std::tuple{0.2F, std::vector<double>{0, 0, 0.2, 0.2}, "BLEND"}}) {
        const int material = gltf_test::add_material(file, color, {{"alphaMode", mode}});
        gltf_test::add_square(file, z)["material"] = material;
    }
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", all_targets, "--origin",
                                        "0.25,0,-0.5", "--voxel-size", "0.125,0.125,1", "--extent", "1,1,1"});
    ASSERT_EQ(0, result.code) << result.err;
    const auto color = [&](const std::string& name) {
        return read_npy(folder / ("o." + name + ".npy")).at<glm::u8vec4>(0);
    };
    EXPECT_EQ(3U, read_npy(folder / "o.count.npy").at<std::uint32_t>(0));
    EXPECT_EQ(glm::u8vec4(180, 180, 37, 187), color("color")); // linear 1/2.2, 1/2.2, 0.2*0.2/2.2; alpha 2.2/3
    EXPECT_EQ(glm::u8vec4(0, 0, 124, 51), color("color-outer"));
    EXPECT_EQ(glm::u8vec4(255, 255, 124, 255), color("color-max"));
    EXPECT_EQ(glm::u8vec4(0, 0, 124, 51), color("color-replace"));
    EXPECT_EQ(2, read_npy(folder / "o.material.npy").at<std::int32_t>(0));
    EXPECT_EQ(4, read_npy(folder / "o.triangle.npy").at<std::int32_t>(0)); // the lower right one of the third square
    EXPECT_EQ(0.0F, read_npy(folder / "o.depth.npy").at<float>(0));
    EXPECT_EQ(glm::vec3(0, 0, 1), read_npy(folder / "o.normal.npy").at<glm::vec3>(0));
}

TEST(Tool, AllTargetsAgreeOnWhatIsCovered) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const char* coverage : {"conservative", "thin"}) {
        const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "40", "-t", all_targets,
                                            "--coverage", coverage, "--depth-axis", "y", "--stats", "json"});
        ASSERT_EQ(0, result.code) << result.err;
        const json stats = json::parse(result.out);
        const array bits = read_npy(folder / "o.occupancy.npy");
        const array count = read_npy(folder / "o.count.npy");
        const array color = read_npy(folder / "o.color.npy");
        const array most = read_npy(folder / "o.color-max.npy");
        const array last = read_npy(folder / "o.color-replace.npy");
        const array normal = read_npy(folder / "o.normal.npy");
        const array material = read_npy(folder / "o.material.npy");
        const array triangle = read_npy(folder / "o.triangle.npy");
        const array depth = read_npy(folder / "o.depth.npy");
        EXPECT_EQ("|u1", bits.type);
        EXPECT_EQ("<u4", count.type);
        EXPECT_EQ("<f4", normal.type);
        EXPECT_EQ("<i4", triangle.type);
        const double voxel = stats["grid"]["voxel_size"][1];
        const double origin = stats["grid"]["origin"][1];
        std::uint64_t voxels = 0;
        std::uint64_t fragments = 0;
        for (std::size_t i = 0; i < bits.voxels(); ++i) {
            const bool covered = bits.at<std::uint8_t>(i) != 0;
            voxels += covered;
            fragments += count.at<std::uint32_t>(i);
            ASSERT_EQ(covered, count.at<std::uint32_t>(i) != 0) << i;
            ASSERT_EQ(covered, color.at<glm::u8vec4>(i).a != 0) << i;
            ASSERT_EQ(covered, last.at<glm::u8vec4>(i).a != 0) << i;
            ASSERT_EQ(covered, triangle.at<std::int32_t>(i) >= 0) << i;
            ASSERT_EQ(covered, !std::isnan(depth.at<float>(i))) << i;
            if (!covered) {
                ASSERT_EQ(-1, triangle.at<std::int32_t>(i));
                ASSERT_EQ(-1, material.at<std::int32_t>(i));
                ASSERT_EQ(glm::vec3(0), normal.at<glm::vec3>(i));
                continue;
            }
            const int number = triangle.at<std::int32_t>(i);
            ASSERT_EQ(number < 12 ? 0 : number < 24 ? 1 : 2, material.at<std::int32_t>(i)) << i;
            for (int c = 0; c < 4; ++c) {
                ASSERT_LE(last.at<glm::u8vec4>(i)[c], most.at<glm::u8vec4>(i)[c]) << i;
                ASSERT_LE(color.at<glm::u8vec4>(i)[c], most.at<glm::u8vec4>(i)[c]) << i;
            }
            const float length = glm::length(normal.at<glm::vec3>(i));
            ASSERT_TRUE(length == 0 || std::abs(length - 1) < 1e-5F) << i;
            if (std::string(coverage) == "thin") continue;
            // The nearest point of the triangle lies in the voxel's column along the dominant axis, at worst beside it.
            const double low = origin + voxel * static_cast<double>(i / bits.shape[2] % bits.shape[1]);
            ASSERT_LT(low - 1.5 * voxel, depth.at<float>(i)) << i;
            ASSERT_GT(low + 2.5 * voxel, depth.at<float>(i)) << i;
        }
        EXPECT_EQ(stats["voxels"], voxels);
        EXPECT_EQ(stats["fragments"], fragments);
        EXPECT_LT(0U, voxels);
    }
}

// Every subset of the targets gives the channels that all of them together give.
TEST(Tool, TargetsDoNotDisturbEachOther) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto voxelize = [&](const std::string& targets, const std::string& out) {
        const outcome result = run(folder, {folder / "m.glb", "-q", "-o", folder / out, "-r", "24", "-t", targets});
        ASSERT_EQ(0, result.code) << result.err;
        EXPECT_EQ("", result.out + result.err);
    };
    voxelize(all_targets, "all.npy");
    for (const voxelize::target_info& entry : voxelize::target_table) {
        const std::string name(entry.name);
        voxelize(name, "one.npy");
        EXPECT_EQ(tool_test::read_file(folder / ("all." + name + ".npy")), tool_test::read_file(folder / "one.npy"))
            << name;
        voxelize(name + ",depth,count", "few.npy");
        EXPECT_EQ(tool_test::read_file(folder / ("all." + name + ".npy")),
                  tool_test::read_file(folder / ("few." + name + ".npy")))
            << name;
    }
}

TEST(Tool, ThreadsAndSlabsChangeNothing) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto voxelize = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-o",  folder / "o.npy", "-r",  "45", "-t", all_targets,
                                           "--backend",      "cpu", "--stats",        "json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        json stats = json::parse(result.out);
        std::string bytes;
        for (const voxelize::target_info& entry : voxelize::target_table)
            bytes += tool_test::read_file(folder / ("o." + std::string(entry.name) + ".npy"));
        const int slabs = stats["slabs"];
        for (const char* key : {"ms", "peak_memory_bytes", "threads", "slabs"}) stats.erase(key);
        return std::tuple{bytes, stats.dump(), slabs};
    };
    const auto [bytes, stats, slabs] = voxelize({"--threads", "1"});
    EXPECT_EQ(1, slabs);
    for (const std::vector<std::string>& how : {std::vector<std::string>{"--threads", "2"},
                                                {"--threads", "7"},
                                                {"--work-memory", "1"},
                                                {"--work-memory", "2", "--threads", "3"}}) {
        const auto [other_bytes, other_stats, other_slabs] = voxelize(how);
        EXPECT_TRUE(bytes == other_bytes) << how[0] << ' ' << how[1];
        EXPECT_EQ(stats, other_stats);
        EXPECT_EQ(how[0] == "--work-memory", other_slabs > 1);
    }
}

TEST(Tool, GridsAreWhatWasAskedFor) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0.1, 0.2, -0.3}, 2, gltf_test::add_material(file, {1, 1, 1, 1}));
    file.root["nodes"].back()["scale"] = {2, 1, 0.5};
    file.write_glb(folder / "m.glb");
    const auto grid = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-q", "-o", folder / "o.npy", "--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return json::parse(result.out)["grid"];
    };
    // The nodes' bounds: 0.1 to 2.1, 0.2 to 1.2, -0.3 to 0.2.
    const json resolution = grid({"-r", "20"});
    EXPECT_EQ(json({20, 10, 5}), resolution["extent"]);
    EXPECT_NEAR(2.0 * 1.0002 / 20, resolution["voxel_size"][0], 1e-7);
    array bits = read_npy(folder / "o.npy");
    EXPECT_EQ((std::vector<std::size_t>{5, 10, 20}), bits.shape);

    const json padded = grid({"-r", "20", "--padding", "3"});
    EXPECT_EQ(20, padded["extent"][0]);
    bits = read_npy(folder / "o.npy");
    for (std::size_t i = 0; i < bits.voxels(); ++i) {
        const std::size_t at[3] = {i % bits.shape[2], i / bits.shape[2] % bits.shape[1],
                                   i / bits.shape[2] / bits.shape[1]};
        for (std::size_t a = 0; a < 3; ++a)
            if (at[a] < 3 || at[a] + 3 >= bits.shape[2 - a]) {
                ASSERT_EQ(0, bits.at<std::uint8_t>(i)) << at[0] << ' ' << at[1] << ' ' << at[2];
            }
    }

    const json lattice = grid({"--voxel-size", "0.25"});
    EXPECT_EQ(json({9, 5, 3}), lattice["extent"]);
    EXPECT_EQ(json({0.0, 0.0, -0.5}), lattice["origin"]);
    EXPECT_EQ(json({5, 3, 5}), grid({"--voxel-size", "0.5,0.5,0.125"})["extent"]);
    EXPECT_EQ(json({5, 3, 2}), grid({"--voxel-size", "0.5,0.5,0.5", "-o", folder / "o.binvox"})["extent"]);
    EXPECT_TRUE(std::filesystem::exists(folder / "o.binvox"));
    EXPECT_EQ(json({7, 5, 7}), grid({"--voxel-size", "0.5,0.5,0.125", "--padding", "1"})["extent"]);

    const json exact = grid({"--origin", "-1,0.5,0", "--voxel-size", "0.1,0.2,0.3", "--extent", "7,6,5"});
    EXPECT_EQ(json({7, 6, 5}), exact["extent"]);
    EXPECT_EQ(json({-1.0, 0.5, 0.0}), exact["origin"]);
    EXPECT_EQ(json({0.1, 0.2, 0.3}), exact["voxel_size"]);
}

TEST(Tool, AModelOutsideTheGridIsAWarning) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "--origin", "50,50,50",
                                        "--voxel-size", "1", "--extent", "4,4,4"});
    EXPECT_EQ(0, result.code);
    EXPECT_NE(std::string::npos, result.err.find("outside the grid")) << result.err;
}

TEST(Tool, StatsAreOneJsonObject) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const outcome result = run(folder, {"--stats", "json", folder / "m.glb", "-o", folder / "a.npy", "-o",
                                        folder / "b.vti", "--backend", "cpu"});
    ASSERT_EQ(0, result.code) << result.err;
    const json stats = json::parse(result.out); // the whole of standard output
    EXPECT_EQ(26, stats["triangles"]);
    EXPECT_EQ(0, stats["triangles_dropped"]);
    EXPECT_EQ(20, stats["vertices"]);
    EXPECT_EQ("cpu", stats["backend"]);
    EXPECT_EQ("conservative", stats["coverage"]);
    EXPECT_EQ(json({"occupancy"}), stats["targets"]);
    EXPECT_EQ(json({"brick", "", ""}), stats["materials"]);
    EXPECT_EQ(2U, stats["files"].size());
    EXPECT_EQ(128, std::max({stats["grid"]["extent"][0], stats["grid"]["extent"][1], stats["grid"]["extent"][2]}));
    EXPECT_LT(1000000, stats["peak_memory_bytes"]);
    double sum = 0;
    for (const char* stage :
         {"read", "upload", "vertex_shade", "coarse_raster", "tile_sort", "clear", "fine_raster", "resolve", "write"})
        ASSERT_TRUE(stats["ms"].contains(stage)) << stage;
    for (const auto& [stage, time] : stats["ms"].items()) {
        EXPECT_LE(0.0, time) << stage;
        if (stage != "total") sum += time.get<double>();
    }
    EXPECT_NEAR(sum, stats["ms"]["total"], 1e-6);

    // Before INPUT, without a value: text.
    const outcome text = run(folder, {"-q", "--stats", folder / "m.glb", "-o", folder / "a.npy", "--backend", "cpu"});
    ASSERT_EQ(0, text.code) << text.err;
    EXPECT_EQ("", text.err);
    for (const char* part : {"triangles           26", "fine_raster ms", "peak memory MiB"})
        EXPECT_NE(std::string::npos, text.out.find(part)) << text.out;
}

TEST(Tool, ColourIsTheDefaultWhereItShows) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto targets = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-q",   "--stats", "json", "-r", "16",
                                           "--image-size",   "32x24"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return json::parse(result.out)["targets"];
    };
    EXPECT_EQ(json({"occupancy"}), targets({"-o", folder / "a.npy"}));
    EXPECT_EQ(json({"occupancy", "color"}), targets({"-o", folder / "a.png"}));
    EXPECT_EQ(json({"occupancy", "color"}), targets({"-o", folder / "a.vox", "-o", folder / "a.npz"}));
    EXPECT_EQ(json({"occupancy", "color"}), targets({"-o", folder / "a.html"}));
    EXPECT_NE(std::string::npos, read_file(folder / "a.html").find("\"name\":\"color\"")); // and the page has them
    EXPECT_EQ(json({"occupancy"}), targets({"-o", folder / "a.png", "--no-color"}));
    EXPECT_EQ(json({"count", "occupancy"}), targets({"-o", folder / "a.binvox", "-t", "count"}));
    EXPECT_EQ(json({"count", "depth"}), targets({"-o", folder / "a.vti", "-t", "count", "-t", "depth", "-t", "count"}));
}

TEST(Tool, EveryFormatTakesEveryTarget) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const voxelize::format& entry : voxelize::formats()) {
        if (entry.has_layers) continue; // slices hold one target: tool_slices_test.cpp
        const std::string out = folder / std::string("o").append(entry.extension);
        const outcome result =
            run(folder, {folder / "m.glb", "-o", out, "-r", "20", "-t", all_targets, "--image-size", "64x48"});
        EXPECT_EQ(0, result.code) << entry.extension << ": " << result.err;
        const std::size_t at = result.out.find("wrote ");
        ASSERT_NE(std::string::npos, at) << result.out;
        const std::string first = result.out.substr(at + 6, result.out.find('\n', at) - at - 6);
        const bool is_folder = std::filesystem::is_directory(first);
        EXPECT_LT(0U, std::filesystem::file_size(is_folder ? first + "/zarr.json" : first)) << first;
    }
}

// One that the format does not show by itself, too: what it needs beside it is computed.
TEST(Tool, EveryFormatTakesOneTarget) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const voxelize::format& entry : voxelize::formats())
        for (const char* storage : {"--dense", "--sparse"}) {
            const std::string out = folder / std::string("o").append(entry.extension);
            const char* const target = entry.has_layers ? "occupancy" : "count"; // slices have shares alone
            const outcome result = run(folder, {folder / "m.glb", "-q", "-o", out, "-r", "20", "-t", target, storage,
                                                "--image-size", "64x48"});
            EXPECT_EQ(0, result.code) << entry.extension << ": " << result.err;
        }
}

} // namespace
