// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// What a run is said to need is what it needs: for every format, from dense and sparse grids. The peaks are those that
// the system gives for the process.
#include "tool_test.hpp"

#include <write/formats/formats.hpp>

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

using namespace tool_test;

namespace {

struct measured : outcome {
    double peak = 0; // MiB
};

// `limit` in MiB; 0: none.
measured run_within(const scratch_folder& folder, std::vector<std::string> arguments, int limit) {
    if (limit != 0) arguments.insert(arguments.end(), {"--max-memory", std::to_string(limit)});
    const pid_t child = start(folder, arguments);
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    measured result;
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = read_file(folder / "stdout.txt");
    result.err = read_file(folder / "stderr.txt");
    result.peak = static_cast<double>(usage.ru_maxrss) / 1024;
    return result;
}

// The figure of "at least N MiB are needed" or "about N MiB"; 0 where that is not said.
int need_in(const std::string& text) {
    for (const std::string before : {"at least ", "about "})
        if (const std::size_t at = text.find(before); at != std::string::npos)
            return std::stoi(text.substr(at + before.size()));
    return 0;
}

// A hash of each file of a folder by its name in it. They are read bit by bit: what this process holds counts as the
// peak of those that it starts.
std::map<std::string, std::size_t> files_in(const std::filesystem::path& folder) {
    std::map<std::string, std::size_t> files;
    std::string bytes(std::size_t{1} << 16, '\0');
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        std::size_t& hash = files[std::filesystem::relative(entry.path(), folder).string()];
        std::ifstream file(entry.path(), std::ios::binary);
        while (file) {
            file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
            const std::string_view piece(bytes.data(), static_cast<std::size_t>(file.gcount()));
            hash = 31 * hash + std::hash<std::string_view>()(piece);
        }
    }
    return files;
}

// A ball of some thousand triangles.
void write_ball(const std::string& path) {
    constexpr unsigned rings = 32, sides = 64;
    const double pi = std::acos(-1.0);
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (unsigned r = 0; r <= rings; ++r)
        for (unsigned s = 0; s < sides; ++s) {
            const double down = pi * r / rings, around = 2 * pi * s / sides;
            for (const double p :
                 {std::sin(down) * std::cos(around), std::sin(down) * std::sin(around), std::cos(down)})
                positions.push_back(static_cast<float>(p));
        }
    for (unsigned r = 0; r < rings; ++r)
        for (unsigned s = 0; s < sides; ++s) {
            const unsigned a = r * sides + s, b = r * sides + (s + 1) % sides;
            if (r != 0) indices.insert(indices.end(), {a, a + sides, b});
            if (r + 1 != rings) indices.insert(indices.end(), {b, a + sides, b + sides});
        }
    builder file;
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    primitive["material"] = gltf_test::add_material(file, {0.9, 0.2, 0.1, 1});
    file.write_glb(path);
}

struct needs {
    std::string extension, targets, storage;
    int resolution;

    friend std::ostream& operator<<(std::ostream& out, const needs& n) {
        return out << n.extension << ' ' << n.targets << ' ' << n.storage << ' ' << n.resolution;
    }
};

#ifdef VOXELPIPE_ALL_NEEDS // a program of its own, which takes minutes
const std::vector<std::string> all_targets{"occupancy", "color", "normal", "count", "color,normal,count"};
constexpr int dense_resolution = 144, sparse_resolution = 320;
const std::vector<double> multiples{0.75, 1.0, 1.5, 2.0};
#else
const std::vector<std::string> all_targets{"color,normal,count"};
constexpr int dense_resolution = 112, sparse_resolution = 200;
const std::vector<double> multiples{1.0, 1.5, 2.0};
#endif

// Those that a format holds: all, one share for layers of shades, colours for the others.
std::vector<std::string> targets_of(const voxelize::format& f) {
    if (f.has_layers) return {"fraction"};
    return f.all_channels ? all_targets : std::vector<std::string>{"color"};
}

// A grid has some MiB to some tens of them. Fractions are dense, but for those that are named.
std::vector<needs> all_needs() {
    std::vector<needs> all;
    for (const voxelize::format& f : voxelize::formats())
        for (const std::string& wanted : targets_of(f)) {
            const bool is_bits = wanted == "occupancy";
            if (!f.only_sparse)
                all.push_back({std::string(f.extension), wanted, "--dense", is_bits ? 600 : dense_resolution});
            if (wanted != "fraction")
                all.push_back({std::string(f.extension), wanted, "--sparse", is_bits ? 1000 : sparse_resolution});
        }
#ifdef VOXELPIPE_ALL_NEEDS
    all.push_back({".npy", "fraction", "--dense", dense_resolution});
    all.push_back({".npy", "area_vector", "--dense", dense_resolution});
    all.push_back({".npy", "area,centroid", "--dense", dense_resolution});
    all.push_back({".npy", "aperture_y", "--dense", dense_resolution});
    all.push_back({".nvdb", "fraction", "--sparse", sparse_resolution});
    all.push_back({".npz", "fraction,centroid", "--sparse", 160});
    all.push_back({".vti", "area", "--sparse", sparse_resolution});
    all.push_back({".npy", "links,link_triangle", "--sparse", sparse_resolution});
    for (const char* const extension : {".inp", ".msh"})
        all.push_back({extension, "occupancy,material", "--sparse", sparse_resolution});
#endif
    return all;
}

void expect_named_need(const scratch_folder& folder,
                       const std::function<measured(const std::string& to, int limit)>& draw);

// Runs with the named need and with multiples of it, against one without a limit.
void expect_need(const needs& how) {
    const scratch_folder folder;
    write_ball(folder / "m.glb");
    const auto draw = [&](const std::string& to, int limit) {
        std::filesystem::create_directories(folder / to);
        std::vector<std::string> arguments{folder / "m.glb",
                                           "-o",
                                           folder / (to + "/o" + how.extension),
                                           "-t",
                                           how.targets,
                                           "-r",
                                           std::to_string(how.resolution),
                                           how.storage,
                                           "--image-size",
                                           "64x48",
                                           "-j",
                                           "2",
                                           "-q",
                                           "--backend",
                                           "cpu"};
        if (how.extension == ".pvti") arguments.insert(arguments.end(), {"--pieces", "2"}); // which follow the limit
        return run_within(folder, arguments, limit);
    };
    expect_named_need(folder, draw);
}

// draw(to, limit): writes into the folder `to`.
void expect_named_need(const scratch_folder& folder,
                       const std::function<measured(const std::string& to, int limit)>& draw) {
    const measured free = draw("free", 0);
    ASSERT_EQ(0, free.code) << free.err;
    // Room for the program and the model, and for little more.
    constexpr int first_limit = 16;
    const measured refused = draw("refused", first_limit);
    ASSERT_EQ(3, refused.code) << refused.peak << ": " << refused.err;
    EXPECT_TRUE(std::filesystem::is_empty(folder / "refused"));
    const int need = need_in(refused.err);
    ASSERT_LT(first_limit, need) << refused.err;
    for (const double multiple : multiples) {
        const int limit = static_cast<int>(std::ceil(multiple * need));
        SCOPED_TRACE(std::to_string(limit) + " MiB; without a limit " + std::to_string(free.peak));
        const measured tight = draw("tight", limit);
        if (multiple < 1) {
            EXPECT_EQ(3, tight.code) << "the need that is named is too high, " << need << ": " << tight.err;
            continue;
        }
        ASSERT_EQ(0, tight.code) << tight.err;
        EXPECT_GE(limit, tight.peak);
        EXPECT_TRUE(files_in(folder / "free") == files_in(folder / "tight"));
        std::filesystem::remove_all(folder / "tight");
    }
}

class MemoryNeeds : public testing::TestWithParam<needs> {};

TEST_P(MemoryNeeds, AreWhatIsSaid) {
    if (sanitized) GTEST_SKIP() << "shadow memory is no part of the figures";
    expect_need(GetParam());
}

INSTANTIATE_TEST_SUITE_P(All, MemoryNeeds, testing::ValuesIn(all_needs()),
                         [](const auto& info) { return std::to_string(info.index); });

#ifndef VOXELPIPE_ALL_NEEDS

// Balls of several colours, all of them one draw of a PLY: its connected parts are the bodies.
void write_coloured_balls(const std::string& path, unsigned rings = 24) {
    constexpr unsigned balls = 5;
    const unsigned sides = 2 * rings;
    const double pi = std::acos(-1.0);
    std::ofstream file(path);
    file << "ply\nformat ascii 1.0\nelement vertex " << balls * (rings + 1) * sides
         << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
            "property uchar blue\nelement face "
         << balls * rings * sides << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (unsigned b = 0; b < balls; ++b)
        for (unsigned r = 0; r <= rings; ++r)
            for (unsigned s = 0; s < sides; ++s) {
                const double down = pi * r / rings, around = 2 * pi * s / sides;
                file << 1.2 * (b % 3) + std::sin(down) * std::cos(around) << ' '
                     << 1.5 * (b / 3) + std::sin(down) * std::sin(around) << ' ' << std::cos(down) << ' ' << 50 * b
                     << " 0 99\n";
            }
    for (unsigned b = 0; b < balls; ++b)
        for (unsigned r = 0; r < rings; ++r)
            for (unsigned s = 0; s < sides; ++s) {
                const unsigned row = (b * (rings + 1) + r) * sides, next = (s + 1) % sides;
                file << "4 " << row + s << ' ' << row + sides + s << ' ' << row + sides + next << ' ' << row + next
                     << '\n';
            }
}

// What a run of .npz, or of the format that is named last, is said to need.
void expect_need_of(const std::string& model, const std::vector<std::string>& how,
                    const std::string& extension = ".npz") {
    SCOPED_TRACE(extension);
    const scratch_folder folder;
    write_coloured_balls(folder / model);
    expect_named_need(folder, [&](const std::string& to, int limit) {
        std::filesystem::create_directories(folder / to);
        std::vector<std::string> arguments{
            folder / model, "-o", folder / (to + "/o" + extension), "-t", "color", "-j", "2", "-q", "--backend", "cpu"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        return run_within(folder, arguments, limit);
    });
}

// What --fill holds is a part of the need: the connected parts and the bodies of voxels, and the tree of triangles in
// which the nearest one is found.
TEST(MemoryNeedsOfFills, AreWhatIsSaid) {
    if (sanitized) return;
    expect_need_of("m.ply", {"--solid", "nonzero", "--fill", "body", "--dense", "-r", "64"});
    expect_need_of("m.ply", {"--solid", "nonzero", "--fill", "body", "--sparse", "-r", "96"});
    expect_need_of("m.ply", {"--solid", "nonzero", "--fill", "nearest", "--dense", "-r", "40"});
}

TEST(MemoryNeedsOfFills, GrowWithTheirLists) {
    if (sanitized) return;
    const scratch_folder folder;
    write_coloured_balls(folder / "m.ply", 64);
    const auto need_with = [&](const std::string& fill) {
        const measured refused =
            run_within(folder,
                       {folder / "m.ply", "-o", folder / "o.npy", "-t", "color", "--solid", "nonzero", "--fill", fill,
                        "--dense", "-r", "80", "-j", "2", "-q", "--backend", "cpu"},
                       20);
        EXPECT_EQ(3, refused.code) << refused.err;
        return need_in(refused.err);
    };
    const int mean = need_with("mean");
    EXPECT_LT(mean, need_with("body"));
    EXPECT_LT(mean, need_with("nearest"));
}

// Where voxels meet in edges alone, the sheets of a .stl stand apart, and each corner of theirs has an entry.
TEST(MemoryNeedsOfSheets, AreWhatIsSaid) {
    if (sanitized) return;
    expect_need_of("m.ply", {"--coverage", "thin", "--dense", "-r", "80"}, ".stl");
}

// A run that cannot fit ends with its need before it draws anything.
void expect_early_end(const std::vector<std::string>& how, int limit, std::uint64_t address_space, double least) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {0.9, 0.2, 0.1, 1}));
    file.write_glb(folder / "cube.glb");
    write_ball(folder / "ball.glb");
    std::vector<std::string> arguments = how;
    arguments.front() = folder / how.front();
    arguments.insert(arguments.end(), {"-q", "--backend", "cpu"});
    if (limit != 0) arguments.insert(arguments.end(), {"--max-memory", std::to_string(limit)});
    for (const std::string to : {"o.npy", "o.npz"}) {
        SCOPED_TRACE(how.front() + " " + to);
        std::vector<std::string> all = arguments;
        all.insert(all.end(), {"-o", folder / to});
        rusage before{}, after{};
        getrusage(RUSAGE_CHILDREN, &before);
        const outcome result = run(folder, all, address_space);
        getrusage(RUSAGE_CHILDREN, &after);
        EXPECT_EQ(3, result.code) << result.err;
        EXPECT_LT(least, need_in(result.err)) << result.err;
        EXPECT_GT(2 * least, need_in(result.err)) << result.err;
        const auto seconds = [](const rusage& u) { return u.ru_utime.tv_sec + u.ru_stime.tv_sec; };
        EXPECT_GT(10, seconds(after) - seconds(before)); // of all processors, whatever else the machine does
    }
}

TEST(MemoryNeedsOfBricks, AreKnownBeforeTheyAreDrawn) {
    if (sanitized) return;
    expect_early_end({"cube.glb", "-r", "20000"}, 300, 0, 5000);
    expect_early_end({"ball.glb", "-r", "6000"}, 100, 0, 400);
}

TEST(MemoryNeedsOfCells, AreWhatIsSaid) {
    if (sanitized) GTEST_SKIP() << "shadow memory is no part of the figures";
    expect_need({".nvdb", "fraction,area,centroid", "--sparse", 240});
    expect_need({".npz", "links", "--sparse", 160});
}

TEST(MemoryNeedsOfCells, AreKnownBeforeTheyAreDrawn) {
    if (sanitized) return;
    expect_early_end({"ball.glb", "-r", "6000", "-t", "fraction", "--sparse"}, 100, 0, 300000);
    expect_early_end({"ball.glb", "-r", "6000", "-t", "links"}, 100, 0, 80000);
}

// Against what the machine has, which is bounded here: it may have any amount.
TEST(MemoryNeedsOfBricks, AreKnownWithoutALimit) {
    if (sanitized) return;
    expect_early_end({"cube.glb", "-r", "100000"}, 0, std::uint64_t{8} << 30, 100000);
}

// The inside of a solid is read from its tiles, where it was made of bricks first.
TEST(MemoryNeedsOfZarr, TwoTargetsOf256CubedFit64MiB) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ball(folder / "m.glb");
    for (const std::vector<std::string>& how :
         {std::vector<std::string>{"-t", "color,normal"}, {"-t", "color,count", "--solid", "nonzero"}}) {
        SCOPED_TRACE(how[1]);
        const auto draw = [&](const std::string& to, int limit) {
            std::filesystem::create_directories(folder / to);
            std::vector<std::string> arguments{
                folder / "m.glb", "-o", folder / (to + "/o.zarr"), "-r", "256", "-j", "2", "-q", "--backend", "cpu"};
            arguments.insert(arguments.end(), how.begin(), how.end());
            return run_within(folder, arguments, limit);
        };
        const measured free = draw("free", 0), tight = draw("tight", 64);
        ASSERT_EQ(0, free.code) << free.err;
        ASSERT_EQ(0, tight.code) << tight.err;
        EXPECT_GE(64, tight.peak);
        EXPECT_TRUE(files_in(folder / "free") == files_in(folder / "tight"));
    }
}

#endif

} // namespace
