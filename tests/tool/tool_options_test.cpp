// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The options of the voxelize program: the help names them all, and those of pictures and files do what it says.
#include "tool_test.hpp"

#include <model/targets.hpp>
#include <write/formats/formats.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <set>
#include <sstream>

using namespace tool_test;

namespace {

// All that the program takes, as the help writes it.
std::set<std::string> all_options() {
    return {"-o,--output FILE",
            "-t,--target NAME",
            "--list FILE",
            "--world-size W",
            "--rank R",
            "--jobs J",
            "--resume",
            "-r,--resolution N|NXxNYxNZ",
            "--padding N",
            "-s,--voxel-size S[,SY,SZ]",
            "--origin X,Y,Z",
            "--extent NX,NY,NZ",
            "--scale F",
            "--solid RULE",
            "--solid-extent WHICH",
            "--close-holes [=EDGES]",
            "--vote",
            "--winding",
            "--closing R",
            "--distance",
            "--band N|whole",
            "--blocks FILE",
            "--slice-bits N",
            "--space AXES",
            "--unsigned",
            "--half",
            "--corners",
            "--iso D",
            "--remesh",
            "--place WHERE",
            "--embedded",
            "--quads",
            "--report",
            "--fill,--fill-color WHAT",
            "--animation NAME",
            "--time T",
            "--variant NAME",
            "--lenient",
            "--coverage RULE",
            "--depth-axis AXIS",
            "--alpha RULE",
            "--clamp",
            "--outside",
            "--neighbours 18|26",
            "--backend NAME",
            "--strategy NAME",
            "--devices N|all",
            "-j,--threads N",
            "--max-memory MIB",
            "--work-memory MIB",
            "--device-memory MIB",
            "--sparse",
            "--dense",
            "--image-size WxH",
            "--azimuth DEG",
            "--elevation DEG",
            "--zoom F",
            "--fov DEG",
            "--samples N",
            "--background COLOUR",
            "--no-color",
            "--no-edges",
            "--no-ground",
            "--up AXIS",
            "--compression N",
            "--zarr-codec NAME",
            "--levels",
            "--pieces N",
            "--merge",
            "--points",
            "--threshold FRACTION",
            "--stats [json]",
            "-q,--quiet",
            "-h,--help",
            "--version"};
}

// The first column of the help, which the parser writes; each entry must have a description beside or below it.
std::set<std::string> options_of(const std::string& help) {
    constexpr std::size_t column = 28; // where descriptions begin
    std::set<std::string> options;
    std::istringstream lines(help.substr(0, help.find("TARGETS (")));
    for (std::string line; std::getline(lines, line);) {
        if (line.rfind("  -", 0) != 0) continue;
        const bool beside = line.size() > column && line[column - 1] == ' ';
        std::string name = line.substr(2, beside ? column - 2 : std::string::npos);
        name.erase(name.find_last_not_of(' ') + 1);
        EXPECT_TRUE(options.insert(name).second) << name << " stands there twice";
        if (!beside) std::getline(lines, line);
        EXPECT_TRUE(line.size() > column && line[column] != ' ') << name << " is not described";
    }
    return options;
}

TEST(Tool, HelpNamesEverything) {
    const scratch_folder folder;
    const outcome help = run(folder, {"--help"});
    EXPECT_EQ(0, help.code);
    EXPECT_EQ("", help.err);
    for (const voxelize::target_info& entry : voxelize::target_table)
        EXPECT_NE(std::string::npos, help.out.find("  " + std::string(entry.name))) << entry.name;
    for (const voxelize::format& entry : voxelize::formats())
        EXPECT_NE(std::string::npos, help.out.find("  " + std::string(entry.extension))) << entry.extension;
    EXPECT_EQ(all_options(), options_of(help.out));
    for (const char* part : {"INPUT", "EXIT CODES", "EXAMPLES", "one -o for each file"})
        EXPECT_NE(std::string::npos, help.out.find(part)) << part;
    std::istringstream lines(help.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;

    const outcome version = run(folder, {"--version"});
    EXPECT_EQ(0, version.code);
    EXPECT_EQ(0U, version.out.find("voxelize ")) << version.out;
}

// Offsets in a PNG's header: width and height (their low bytes; the high ones are 0 here) and the kind of its
// pixels.
constexpr std::size_t png_width = 19, png_height = 23, png_kind = 25;

TEST(Tool, EveryPictureOptionChangesThePicture) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto picture = [&](const std::vector<std::string>& how, const std::string& size = "64x48") {
        const std::string out = folder / "o.png";
        std::filesystem::remove(out);
        std::vector<std::string> arguments{folder / "m.glb", "-q", "-r", "5", "-o", out, "--image-size", size};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        const std::string bytes = read_file(out);
        EXPECT_LT(png_kind, bytes.size());
        return bytes;
    };
    const std::string plain = picture({});
    std::map<std::string, std::string> seen{{plain, "no option"}};
    const std::vector<std::vector<std::string>> changes{{"--azimuth", "60"},
                                                        {"--azimuth", "-60"},
                                                        {"--elevation", "60"},
                                                        {"--elevation", "-25"},
                                                        {"--zoom", "1.5"},
                                                        {"--zoom", "0.5"},
                                                        {"--fov", "0"},
                                                        {"--fov", "60"},
                                                        {"--samples", "1"},
                                                        {"--samples", "3"},
                                                        {"--background", "white"},
                                                        {"--background", "dark"},
                                                        {"--background", "transparent"},
                                                        {"--background", "#ff0000"},
                                                        {"--background", "#ff0000,#0000ff"},
                                                        {"--no-color"},
                                                        {"--no-edges"},
                                                        {"--no-ground"},
                                                        {"--up", "z"}};
    for (const std::vector<std::string>& how : changes) {
        const std::string name = how[0] + (how.size() > 1 ? ' ' + how[1] : "");
        const std::string bytes = picture(how);
        const auto [same, fresh] = seen.emplace(bytes, name);
        EXPECT_TRUE(fresh) << name << " gives the picture of " << same->second;
        EXPECT_EQ(name == "--background transparent" ? 6 : 2, bytes[png_kind]) << name; // RGBA, RGB
        EXPECT_EQ(64, bytes[png_width]) << name;
        EXPECT_EQ(48, bytes[png_height]) << name;
    }
    const std::string tall = picture({}, "30x40");
    EXPECT_EQ(30, tall[png_width]);
    EXPECT_EQ(40, tall[png_height]);

    // Options that leave it as it is: the defaults, spelt out, and options of other files.
    EXPECT_TRUE(plain == picture({"--azimuth", "35", "--elevation", "25", "--zoom", "1", "--fov", "28", "--samples",
                                  "2", "--background", "sky", "--up", "y"}));
    EXPECT_TRUE(plain == picture({"--compression", "9", "--depth-axis", "x", "--threads", "1"}));
    // Without colours it is the picture of the occupancy alone, whether or not colours are computed.
    for (const char* targets : {"occupancy", "occupancy,color"})
        EXPECT_TRUE(picture({"--no-color"}) == picture({"--no-color", "--target", targets})) << targets;
    EXPECT_TRUE(picture({"--no-color"}) == picture({"--target", "occupancy"}));
}

// The content of a chunk of a .vox with one model.
std::string vox_chunk(const std::string& file, const std::string& name) {
    const std::size_t at = file.find(name); // then the length of the content, of the children, the content
    if (at == std::string::npos || at + 12 > file.size()) return {};
    return file.substr(at + 12, static_cast<unsigned char>(file[at + 4]));
}

// One triangle in voxel (0, 1, 2) of a grid of 5 x 4 x 3. MagicaVoxel's z is up.
TEST(Tool, UpTurnsTheVox) {
    const scratch_folder folder;
    builder file;
    const int positions =
        file.accessor(std::vector<float>{0.2F, 1.2F, 2.2F, 0.8F, 1.2F, 2.2F, 0.2F, 1.8F, 2.4F}, "VEC3");
    file.mesh({{"POSITION", positions}});
    file.write_glb(folder / "m.glb");
    const auto vox = [&](const std::vector<std::string>& how) {
        const std::string out = folder / "o.vox";
        std::vector<std::string> arguments{folder / "m.glb", "-q",    "-o",           out, "--origin", "0,0,0",
                                           "--extent",       "5,4,3", "--voxel-size", "1"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return read_file(out);
    };
    const auto ints = [](std::initializer_list<char> values) { // little-endian
        std::string bytes;
        for (const char value : values) bytes += {value, '\0', '\0', '\0'};
        return bytes;
    };
    const std::string y = vox({});
    EXPECT_EQ(ints({5, 3, 4}), vox_chunk(y, "SIZE"));
    EXPECT_EQ((ints({1}) + std::string{0, 0, 1}), vox_chunk(y, "XYZI").substr(0, 7)); // (i, 3 - 1 - k, j)
    EXPECT_EQ(y, vox({"--up", "y"}));
    const std::string z = vox({"--up", "z"});
    EXPECT_EQ(ints({5, 4, 3}), vox_chunk(z, "SIZE"));
    EXPECT_EQ((ints({1}) + std::string{0, 1, 2}), vox_chunk(z, "XYZI").substr(0, 7));
}

// A picture, or a format that shows colours, leaves the names and the content of other outputs as they are.
TEST(Tool, OutputsDoNotRenameEachOther) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto voxelize = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-q", "-r", "12", "--image-size", "32x24"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
    };
    for (const char* extension : {".npy", ".npz", ".vti", ".nrrd", ".nii", ".nii.gz"}) {
        const std::string alone = folder / std::string("alone").append(extension);
        const std::string beside = folder / std::string("beside").append(extension);
        voxelize({"-o", alone});
        voxelize({"-o", beside, "-o", folder / "a.png", "-o", folder / "a.vox"});
        EXPECT_TRUE(read_file(alone) == read_file(beside)) << extension;
        voxelize({"-o", alone, "-t", "count"});
        voxelize({"-o", folder / "a.glb", "-o", beside, "-o", folder / "a.binvox", "-t", "count"});
        EXPECT_TRUE(read_file(alone) == read_file(beside)) << extension;
    }
    // Targets that are asked for are in all of them.
    voxelize({"-o", folder / "b.npy", "-o", folder / "b.vox", "-t", "occupancy,color"});
    EXPECT_TRUE(std::filesystem::exists(folder / "b.occupancy.npy"));
    EXPECT_TRUE(std::filesystem::exists(folder / "b.color.npy"));
    EXPECT_FALSE(std::filesystem::exists(folder / "b.npy"));
    // Colours reach the formats that show them.
    voxelize({"-o", folder / "c.npy", "-o", folder / "c.xyz"});
    voxelize({"-o", folder / "d.xyz", "-t", "color"});
    EXPECT_TRUE(read_file(folder / "c.xyz") == read_file(folder / "d.xyz"));
    EXPECT_TRUE(std::filesystem::exists(folder / "c.npy"));
}

TEST(Tool, MergeAndPointsChangeTheFilesThatTheyName) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {0.5, 0.5, 0.5, 1}));
    file.write_glb(folder / "m.glb");
    const auto size = [&](const char* extension, const std::vector<std::string>& how) {
        const std::string out = folder / std::string("o").append(extension);
        std::vector<std::string> arguments{folder / "m.glb", "-q", "-r", "16", "-o", out};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return std::filesystem::file_size(out);
    };
    for (const char* extension : {".glb", ".obj", ".ply", ".stl"})
        EXPECT_LT(10 * size(extension, {"--merge"}), size(extension, {})) << extension;
    EXPECT_EQ(size(".xyz", {"--merge"}), size(".xyz", {}));
    EXPECT_NE(size(".ply", {"--points"}), size(".ply", {}));
    EXPECT_EQ(size(".glb", {"--points"}), size(".glb", {}));
}

// The stages add up to the time that the program took, and little of it is in none of them.
TEST(Tool, StatsAccountForTheTime) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const char* extension : {".npz", ".vox", ".png", ".glb"}) {
        const auto start = std::chrono::steady_clock::now();
        const outcome result =
            run(folder, {folder / "m.glb", "-q", "-r", "200", "-o", folder / ("o" + std::string(extension)),
                         "--image-size", "320x240", "--stats", "json"});
        const double wall = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        ASSERT_EQ(0, result.code) << result.err;
        const auto ms = gltf_test::json::parse(result.out)["ms"];
        double sum = 0;
        for (const auto& [stage, time] : ms.items())
            if (stage != "total") sum += time.get<double>();
        EXPECT_NEAR(sum, ms["total"], 1e-6);
        EXPECT_LE(sum, wall);
        EXPECT_LT(ms["other"], 0.25 * sum + 20) << extension;
        for (const char* stage : {"options", "read", "place", "write", "release"})
            EXPECT_TRUE(ms.contains(stage)) << stage;
    }
}

// Half a turn around z lies between the two, and nothing else; formats without a place for it refuse it.
TEST(Tool, SpaceTurnsTheAffine) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto nii = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-q", "-r", "16", "-o", folder / "o.nii"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return read_file(folder / "o.nii");
    };
    const auto number = [](const std::string& file, std::size_t at) {
        float value = 0;
        std::memcpy(&value, file.data() + at, sizeof(value));
        return value;
    };
    const std::string lps = nii({"--space", "lps"}), ras = nii({"--space", "ras"});
    EXPECT_TRUE(lps == nii({}));
    constexpr std::size_t offsets = 268, rows = 280, row = 16;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float sign = axis < 2 ? -1.0F : 1.0F;
        EXPECT_LT(0.0F, number(ras, rows + (row + 4) * axis));
        for (const std::size_t at : {rows + (row + 4) * axis, rows + row * axis + 12, offsets + 4 * axis})
            EXPECT_EQ(sign * number(ras, at), number(lps, at)) << at;
    }
    EXPECT_TRUE(lps.substr(352) == ras.substr(352));
    const outcome refused = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "--space", "ras"});
    EXPECT_EQ(1, refused.code);
    EXPECT_NE(std::string::npos, refused.err.find("--space: .npy has no axes of patients; .nrrd, .nii")) << refused.err;
}

TEST(Tool, CompressionIsAChoice) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    for (const char* extension : {".npz", ".vti", ".nrrd"}) {
        const auto file = [&](const std::vector<std::string>& how) {
            const std::string out = folder / std::string("o").append(extension);
            std::vector<std::string> arguments{folder / "m.glb", "-q", "-r", "40", "-t", "color", "-o", out};
            arguments.insert(arguments.end(), how.begin(), how.end());
            const outcome result = run(folder, arguments);
            EXPECT_EQ(0, result.code) << result.err;
            return read_file(out);
        };
        const std::string stored = file({"--compression", "0"});
        const std::string fast = file({"--compression", "1"});
        const std::string small = file({"--compression", "9"});
        EXPECT_TRUE(fast == file({})) << extension; // the default
        EXPECT_GT(stored.size(), 2 * fast.size()) << extension;
        EXPECT_GT(fast.size(), small.size()) << extension;
    }
}

} // namespace
