// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The program's messages: choices in words, the reason why nothing is covered, one warning for one thing; and the
// examples of --help, as they are printed.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

using namespace tool_test;

namespace {

outcome run_world(const scratch_folder& folder, const std::vector<std::string>& how) {
    gltf_test::small_world().write_glb(folder / "m.glb");
    std::vector<std::string> arguments{folder / "m.glb", "-o", folder / "o.npy"};
    arguments.insert(arguments.end(), how.begin(), how.end());
    return run(folder, arguments);
}

std::ptrdiff_t lines_of(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

TEST(Messages, ChoicesAreListedInWords) {
    const scratch_folder folder;
    const auto error = [&](const std::vector<std::string>& how) {
        const outcome result = run_world(folder, how);
        EXPECT_EQ(1, result.code);
        return result.err.substr(0, result.err.find('\n'));
    };
    EXPECT_EQ("voxelize: --up takes y or z, not \"x\"", error({"--up", "x"}));
    EXPECT_EQ("voxelize: --coverage takes conservative, thin, crosshair or diagonal, not \"thick\"",
              error({"--coverage", "thick"}));
    EXPECT_EQ("voxelize: --depth-axis takes x, y or z, not \"w\"", error({"--depth-axis", "w"}));
    EXPECT_EQ("voxelize: --alpha takes weight, cutoff or ignore, not \"0.5\"", error({"--alpha", "0.5"}));
    EXPECT_EQ("voxelize: --backend takes auto, cpu or cuda, not \"gpu\"", error({"--backend", "gpu"}));
    EXPECT_EQ("voxelize: --stats takes text or json, not \"xml\"", error({"--stats=xml"}));
}

TEST(Messages, AnOptionOfOneValueThatIsGivenTwiceSaysSo) {
    const scratch_folder folder;
    const auto error = [&](const std::vector<std::string>& how) {
        const outcome result = run_world(folder, how);
        EXPECT_EQ(1, result.code);
        return result.err.substr(0, result.err.find('\n'));
    };
    const std::vector<std::pair<std::string, std::string>> options{
        {"--resolution", "8"},  {"--padding", "1"},     {"--voxel-size", "1"},       {"--origin", "0,0,0"},
        {"--extent", "4,4,4"},  {"--scale", "2"},       {"--coverage", "thin"},      {"--alpha", "cutoff"},
        {"--depth-axis", "x"},  {"--solid", "nonzero"}, {"--solid-extent", "outer"}, {"--closing", "1"},
        {"--fill", "mean"},     {"--backend", "cpu"},   {"--strategy", "tiled"},     {"--devices", "1"},
        {"--threads", "1"},     {"--max-memory", "99"}, {"--work-memory", "99"},     {"--image-size", "9x9"},
        {"--azimuth", "1"},     {"--zoom", "1"},        {"--background", "sky"},     {"--up", "y"},
        {"--compression", "1"}, {"--stats", "json"},    {"--zarr-codec", "gzip"},    {"--list", "l.txt"}};
    for (const auto& [option, value] : options)
        EXPECT_EQ("voxelize: " + option + " is given twice; it takes one value", error({option, value, option, value}));
    EXPECT_EQ("voxelize: --resolution is given twice; it takes one value", error({"-r", "8", "-r", "16"}));
    EXPECT_EQ("voxelize: --resolution is given 3 times; it takes one value",
              error({"-r", "8", "--resolution=16", "-r", "9"}));
    EXPECT_EQ("voxelize: --resolution needs a value", error({"-r", "8", "-r"}));
    EXPECT_EQ("voxelize: --output needs a value", error({"-o", folder / "p.npy", "-o"}));
}

TEST(Messages, ResolutionTakesThreeNumbers) {
    const scratch_folder folder;
    const auto extent = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{"--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run_world(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return result.code == 0 ? json::parse(result.out)["grid"]["extent"] : json();
    };
    EXPECT_EQ(json({64, 64, 64}), extent({"-r", "64x64x64"}));
    EXPECT_EQ(json({40, 20, 30}), extent({"-r", "40x20x30"}));
    EXPECT_EQ(json({40, 20, 30}), extent({"--resolution", "40,20,30", "--padding", "2"}));
    EXPECT_EQ(json({40, 20, 30}), extent({"-r", "40", "20", "30"}));
    for (const char* wrong : {"64x64", "x64", "64x64x", "0x4x4", "4x4x4x4", "1.5", "many", "3000000x1x1"})
        EXPECT_EQ(1, run_world(folder, {"-r", wrong}).code) << wrong;
    EXPECT_EQ(1, run_world(folder, {"-r", "8x8x8", "--padding", "4"}).code);
    EXPECT_EQ(1, run_world(folder, {"-r", "8x8x8", "-s", "1"}).code);
}

TEST(Messages, PointsMayStandApart) {
    const scratch_folder folder;
    const auto grid = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{"--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run_world(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return result.code == 0 ? json::parse(result.out)["grid"] : json();
    };
    const json expected = grid({"--origin=-1,-1,-1", "-s", "0.5", "--extent", "6,7,8"});
    EXPECT_EQ(json({-1.0, -1.0, -1.0}), expected["origin"]);
    EXPECT_EQ(json({6, 7, 8}), expected["extent"]);
    EXPECT_EQ(expected, grid({"--origin", "-1", "-1", "-1", "-s", "0.5", "--extent", "6", "7", "8"}));
    EXPECT_EQ(expected, grid({"--origin", "-1,-1,-1", "-s", "0.5", "0.5", "0.5", "--extent", "6x7x8"}));
    // Not what belongs to others: a number of voxels, then the model.
    EXPECT_EQ(0, run(folder, {"-s", "0.5", folder / "m.glb", "-o", folder / "o.npy"}).code);
}

TEST(Messages, OutsideTheGridIsSaidOnlyWhereItIsTrue) {
    const scratch_folder folder;
    const auto warning = [&](const builder& file, std::vector<std::string> how) {
        file.write_glb(folder / "m.glb");
        how.insert(how.begin(), {folder / "m.glb", "-o", folder / "o.npy", "-t", "color"});
        const outcome result = run(folder, how);
        EXPECT_EQ(0, result.code) << result.err;
        EXPECT_EQ(1, lines_of(result.err)) << result.err;
        return result.err;
    };
    builder mask;
    const int material = gltf_test::add_material(mask, {1, 1, 1, 0.25}, {{"alphaMode", "MASK"}});
    gltf_test::add_square(mask, 0)["material"] = material;
    EXPECT_NE(std::string::npos, warning(mask, {"-r", "8"}).find("alpha discards all "));

    builder line;
    line.mesh({{"POSITION", line.accessor(std::vector<float>{0, 0, 0, 1, 1, 1, 2, 2, 2}, "VEC3")}});
    EXPECT_NE(std::string::npos, warning(line, {"-r", "8", "--coverage", "thin"}).find("have no area"));

    builder outside = gltf_test::small_world();
    EXPECT_NE(std::string::npos,
              warning(outside, {"--origin=50,50,50", "-s", "1", "--extent", "4,4,4"}).find("lies outside the grid"));
}

TEST(Messages, TargetsThatNoOutputHoldsAreAWarning) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto warnings = [&](const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb", "-r", "12", "--image-size", "32x24"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << result.err;
        return result.err;
    };
    EXPECT_EQ("voxelize: warning: --target color is in none of the outputs: their formats hold no such values\n",
              warnings({"-t", "color", "-o", folder / "a.binvox"}));
    EXPECT_EQ("", warnings({"-t", "color", "-o", folder / "a.binvox", "-o", folder / "a.npy"}));
    EXPECT_EQ("", warnings({"-t", "color", "-o", folder / "a.vox"}));
    EXPECT_EQ("", warnings({"-o", folder / "a.binvox"}));
    const std::string depth = warnings({"-t", "depth,occupancy", "-o", folder / "a.vox"});
    EXPECT_EQ(1, lines_of(depth)) << depth;
    EXPECT_NE(std::string::npos, depth.find("--target depth")) << depth;
    // A picture shows colours, or else the first of the other values.
    EXPECT_EQ("", warnings({"-t", "occupancy,depth", "-o", folder / "a.png"}));
    for (const char* targets : {"count,depth", "color,depth"}) {
        const std::string second = warnings({"-t", targets, "-o", folder / "a.png"});
        EXPECT_EQ(1, lines_of(second)) << second;
        EXPECT_NE(std::string::npos, second.find("--target depth")) << second;
    }
    EXPECT_EQ(1, lines_of(warnings({"-t", "depth", "--no-color", "-o", folder / "a.png"})));
}

TEST(Messages, ExtensionsOfTheSameKindAreOneWarning) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    file.root["extensionsUsed"] = {"KHR_materials_clearcoat",
                                   "KHR_materials_ior",
                                   "KHR_materials_sheen",
                                   "KHR_lights_punctual",
                                   "KHR_materials_unlit",
                                   "ACME_one",
                                   "ACME_two"};
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "8"});
    EXPECT_EQ(0, result.code);
    EXPECT_EQ(2, lines_of(result.err)) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("extensions KHR_materials_clearcoat, KHR_materials_ior, "
                                                 "KHR_materials_sheen are not supported"))
        << result.err;
    EXPECT_NE(std::string::npos, result.err.find("extensions ACME_one, ACME_two are not known")) << result.err;
}

// Words of a command line, no quotes.
std::vector<std::string> words(const std::string& line) {
    std::istringstream stream(line);
    std::vector<std::string> list;
    for (std::string word; stream >> word;) list.push_back(word);
    return list;
}

TEST(Messages, ExamplesOfTheHelpWorkAsTheyArePrinted) {
    if (gltf_test::is_slow_build()) GTEST_SKIP() << "a picture of 256 voxels takes minutes";
    const scratch_folder folder;
    const outcome help = run(folder, {"--help"});
    gltf_test::small_world().write_glb(folder / "model.glb");
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path());
    int count = 0;
    std::istringstream lines(help.out);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("  voxelize ")) continue;
        ++count;
        std::vector<std::string> arguments = words(line);
        arguments.erase(arguments.begin());
        const outcome result = run(folder, arguments);
        EXPECT_EQ(0, result.code) << line << '\n' << result.err;
        EXPECT_EQ("", result.err) << line;
        for (std::size_t i = 0; i + 1 < arguments.size(); ++i)
            if (arguments[i] == "-o") {
                EXPECT_TRUE(std::filesystem::exists(arguments[i + 1])) << line;
            }
    }
    std::filesystem::current_path(before);
    EXPECT_EQ(3, count);
}

// Everything that takes a value says what holds without it, or that it is needed only beside another option.
TEST(Messages, HelpNamesTheDefaults) {
    const scratch_folder folder;
    const std::string help = run(folder, {"--help"}).out;
    std::map<std::string, std::string> described; // the first line of an option, and what stands below
    std::istringstream lines(help);
    std::string* last = nullptr;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("  -")) last = &described[line.substr(0, line.find(' ', 2)) + ' '];
        if (line.empty()) last = nullptr;
        if (last != nullptr) *last += line + '\n';
    }
    for (const std::string option :
         {"--target",  "--resolution",  "--padding",    "--coverage",    "--alpha",         "--depth-axis",
          "--backend", "--threads",     "--max-memory", "--work-memory", "--device-memory", "--image-size",
          "--azimuth", "--elevation",   "--zoom",       "--fov",         "--samples",       "--background",
          "--up",      "--compression", "--time"}) {
        const auto found = std::find_if(described.begin(), described.end(),
                                        [&](const auto& entry) { return entry.first.ends_with(option + ' '); });
        ASSERT_NE(described.end(), found) << option;
        EXPECT_NE(std::string::npos, found->second.find("Default:")) << found->second;
    }
    for (const char* group :
         {"Output:", "Grid:", "Model:", "Coverage and values:", "Machine:", "Picture (.png):", "Files:", "Messages:"})
        EXPECT_NE(std::string::npos, help.find('\n' + std::string(group))) << group;
}

} // namespace
