// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The program on every glTF file below VOXELPIPE_GLTF_DIR, and on models that the test writes: it ends with 0 exactly
// where the model loads and has triangles, otherwise with 2 and one line. And the bytes that it computes are those that
// golden_volumes.txt keeps: coverage, colours, normals, depths. The table does not know of compilers and flags: .ci/run
// compares with it what g++ and clang++ make, what sanitizers see, and what -march=native with contraction gives.
//
// VOXELPIPE_WRITE_GOLDEN_VOLUMES=FILE in the environment writes the table of what is computed now, to be reviewed.
#include "tool_test.hpp"

#include <draw/voxelizer.hpp>
#include <model/placement.hpp>
#include <model/targets.hpp>
#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <span>
#include <sstream>

using namespace tool_test;

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> shared_models() {
    std::vector<fs::path> list;
    if (std::string_view(VOXELPIPE_GLTF_DIR).empty()) {
        std::puts("VOXELPIPE_GLTF_DIR is not set: only models that the test writes");
        return list;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(VOXELPIPE_GLTF_DIR))
        if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb") list.push_back(entry.path());
    std::sort(list.begin(), list.end());
    return list;
}

bool is_drawable(const fs::path& file) {
    try {
        const voxelize::scene scene = voxelize::load_gltf(file);
        return scene.triangle_count() + scene.line_count() != 0 && !voxelize::bounds_of(scene).empty;
    } catch (const voxelize::gltf_error&) {
        return false;
    }
}

TEST(Models, EveryFileVoxelizesOrSaysWhyNot) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "world.glb");
    std::ofstream(folder / "broken.glb") << "glTF";
    // gltf_files_test loads them all.
    std::vector<fs::path> files = gltf_test::some_of(shared_models(), 4);
    files.emplace_back(folder / "world.glb");
    files.emplace_back(folder / "broken.glb");
    for (const fs::path& file : files) {
        const std::string out = folder / "o.npz";
        const outcome result =
            tool_test::run(folder, {file.string(), "-o", out, "-r", "12", "-t", "occupancy,color,normal"});
        if (is_drawable(file)) {
            EXPECT_EQ(0, result.code) << file << ": " << result.err;
            EXPECT_TRUE(fs::remove(out)) << file;
        } else {
            EXPECT_EQ(2, result.code) << file;
            std::istringstream lines(result.err);
            int errors = 0;
            for (std::string line; std::getline(lines, line);) errors += !line.starts_with("voxelize: warning: ");
            EXPECT_EQ(1, errors) << result.err;
            EXPECT_FALSE(fs::exists(out)) << file;
        }
    }
}

// 64-bit FNV-1a.
std::uint64_t hash(std::span<const std::byte> bytes) {
    std::uint64_t h = 0xCBF29CE484222325;
    for (const std::byte b : bytes) h = (h ^ std::to_integer<std::uint64_t>(b)) * 0x100000001B3;
    return h;
}

// One line: the covered voxels and the hash of every channel.
std::string summary(const fs::path& file, int resolution, voxelpipe::coverage coverage) {
    voxelize::scene scene = voxelize::load_gltf(file);
    voxelize::voxelize_request request;
    voxelize::grid_request grid;
    grid.resolution = resolution;
    request.grid = voxelize::place_grid(grid, voxelize::bounds_of(scene));
    request.coverage = coverage;
    request.targets.clear();
    for (const voxelize::target_info& entry : voxelize::target_table) request.targets.push_back(entry.id);
    voxelize::voxelize_stats stats;
    const voxelize::volume volume = voxelize::run_voxelizer(std::move(scene), request, stats);
    std::ostringstream line;
    line << stats.voxels << " voxels, " << stats.fragments << " fragments" << std::hex;
    for (const voxelize::channel& channel : volume.channels) line << ' ' << channel.name << ' ' << hash(channel.data);
    return line.str();
}

TEST(Models, VolumesAreTheGoldenOnes) {
    const scratch_folder folder;
    fs::create_directories(folder / "generated");
    gltf_test::small_world().write_glb(folder / "generated/small_world");
    gltf_test::lined_world().write_glb(folder / "generated/lined_world");

    std::map<std::string, std::string> found;
    const auto add = [&](const fs::path& root, const std::string& name) {
        for (const auto& [label, coverage] : {std::pair{"conservative", voxelpipe::coverage::conservative},
                                              std::pair{"thin", voxelpipe::coverage::thin}})
            found[name + ' ' + label] = summary(root / name, 96, coverage);
    };
    add(folder.path(), "generated/small_world");
    add(folder.path(), "generated/lined_world");
    const fs::path shared = VOXELPIPE_GLTF_DIR;
    if (shared.empty()) {
        std::puts("VOXELPIPE_GLTF_DIR is not set: only the model that the test writes");
    } else {
        const std::vector<const char*> names{"DamagedHelmet.glb",
                                             "gltf-transform/BoxVertexColors.glb",
                                             "gltf-transform/chr_knight.glb",
                                             "trimesh/AlphaBlendModeTest.glb",
                                             "trimesh/BoxTextured.glb",
                                             "trimesh/CesiumMilkTruck.glb",
                                             "trimesh/Duck.glb",
                                             "trimesh/mode5.gltf",
                                             "xeogl/2CylinderEngine/2CylinderEngine.gltf"};
        for (const char* name : gltf_test::some_of(names, 3)) add(shared, name);
    }
    if (const char* file = std::getenv("VOXELPIPE_WRITE_GOLDEN_VOLUMES")) {
        std::ofstream stream(file);
        stream << "# SPDX-FileCopyrightText: 2026 The VoxelPipe authors\n# SPDX-License-Identifier: Apache-2.0\n"
                  "# What models come to at 96 voxels along their longest side; see models_test.cpp.\n";
        for (const auto& [name, line] : found) stream << name << ": " << line << '\n';
    }
    std::ifstream stream(VOXELPIPE_GOLDEN_VOLUMES);
    ASSERT_TRUE(stream) << VOXELPIPE_GOLDEN_VOLUMES;
    std::size_t compared = 0;
    for (std::string line; std::getline(stream, line);) {
        const std::size_t colon = line.find(": ");
        if (line.front() == '#' || colon == std::string::npos) continue;
        const auto match = found.find(line.substr(0, colon));
        if (match == found.end()) continue; // the shared models are not there
        EXPECT_EQ(line.substr(colon + 2), match->second) << match->first;
        ++compared;
    }
    EXPECT_EQ(found.size(), compared) << "a model has no line in the table";
}

} // namespace
