// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --max-memory and the two kinds of files that do not fit: honest ones end with 3 and the figures, and as much as was
// named suffices; those that claim what they do not hold end with 2, soon and in little address space.
#include "two_ways.hpp"

#include <model/memory.hpp>

#include <gtest/gtest.h>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

using namespace tool_test;

namespace {

// A PNG of SIDE^2 pixels of one colour: 8 bits each of red, green, blue.
std::vector<std::byte> flat_png(std::uint32_t side, const std::array<std::uint8_t, 3>& color) {
    std::vector<std::uint8_t> raw;
    raw.reserve(std::size_t{side} * (3 * std::size_t{side} + 1));
    std::vector<std::uint8_t> row{0}; // unfiltered
    for (std::uint32_t x = 0; x < side; ++x) row.insert(row.end(), color.begin(), color.end());
    for (std::uint32_t y = 0; y < side; ++y) raw.insert(raw.end(), row.begin(), row.end());
    uLongf size = compressBound(raw.size());
    std::vector<std::uint8_t> packed(size);
    EXPECT_EQ(Z_OK, compress2(packed.data(), &size, raw.data(), raw.size(), 9));
    packed.resize(size);
    std::vector<std::byte> file = gltf_test::bytes_of("\x89PNG\r\n\x1a\n");
    const auto put = [&](std::uint32_t number) {
        for (int shift = 24; shift >= 0; shift -= 8) file.push_back(static_cast<std::byte>(number >> shift & 0xFF));
    };
    const auto chunk = [&](const std::string& type, const std::vector<std::uint8_t>& data) {
        put(static_cast<std::uint32_t>(data.size()));
        uLong crc = crc32(0, reinterpret_cast<const Bytef*>(type.data()), 4);
        crc = crc32(crc, data.data(), static_cast<uInt>(data.size()));
        for (const char c : type) file.push_back(static_cast<std::byte>(c));
        for (const std::uint8_t b : data) file.push_back(static_cast<std::byte>(b));
        put(static_cast<std::uint32_t>(crc));
    };
    const auto byte = [&](int shift) { return static_cast<std::uint8_t>(side >> shift & 0xFF); };
    chunk("IHDR", {byte(24), byte(16), byte(8), byte(0), byte(24), byte(16), byte(8), byte(0), 8, 2, 0, 0, 0});
    chunk("IDAT", packed);
    chunk("IEND", {});
    return file;
}

// "at least N MiB are needed", or "about": N; 0 where that is not said.
int need_in(const std::string& text) {
    for (const std::string before : {"at least ", "about "})
        if (const std::size_t at = text.find(before); at != std::string::npos)
            return std::stoi(text.substr(at + before.size()));
    return 0;
}

TEST(Memory, TheNeedThatIsNamedSuffices) {
    const scratch_folder folder;
    builder file;
    add_sheet(file, 60);
    for (int i = 0; i < 150; ++i) file.append("nodes", {{"mesh", 0}, {"translation", {i % 12, i / 12, 0}}});
    file.write_glb(folder / "m.glb");
    const two_ways runs{
        folder, folder / "m.glb", {"-r", sanitized ? "40" : "300", "-t", "occupancy,normal,color,triangle", "-q"}};
    const outcome free = runs.draw("free.npz");
    ASSERT_EQ(0, free.code) << free.err;
    if (sanitized) return;
    int limit = 1;
    int tries = 0;
    for (outcome tight; tight.code != 0; ++tries) {
        ASSERT_GT(8, tries) << limit;
        tight = runs.draw("tight.npz", {"--max-memory", std::to_string(limit), "--dense"});
        if (tight.code == 0) {
            const std::uint64_t peak = json::parse(tight.out)["peak_memory_bytes"];
            EXPECT_GE(static_cast<double>(limit), static_cast<double>(peak) / (1 << 20));
            break;
        }
        ASSERT_EQ(3, tight.code) << limit << ": " << tight.err;
        EXPECT_NE(std::string::npos, tight.err.find(std::to_string(limit) + " MiB are allowed by --max-memory"))
            << tight.err;
        ASSERT_LT(limit, need_in(tight.err)) << tight.err;
        limit = need_in(tight.err);
    }
    EXPECT_LE(1, tries); // the program, then all of it
    EXPECT_TRUE(tool_test::read_file(folder / "free.npz") == tool_test::read_file(folder / "tight.npz"));
    EXPECT_GE(static_cast<double>(json::parse(free.out)["peak_memory_bytes"]), 0.7 * limit * (1 << 20));
}

// A coloured cube into bricks, within `limit` MiB and without a limit: in slabs of the same bytes, with a peak below
// `most`.
void expect_same_bricks(const std::vector<std::string>& options, unsigned limit, unsigned most) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {0.9, 0.2, 0.1, 1}));
    file.write_glb(folder / "m.glb");
    const two_ways runs{folder, folder / "m.glb", options};
    const outcome tight = runs.draw("tight.nvdb", {"--max-memory", std::to_string(limit)}),
                  free = runs.draw("free.nvdb");
    ASSERT_EQ(0, tight.code) << tight.err;
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_GT(std::uint64_t{most} << 20, json::parse(tight.out)["peak_memory_bytes"].get<std::uint64_t>());
    EXPECT_LT(1, json::parse(tight.out).value("slabs", 0));
    EXPECT_TRUE(read_file(folder / "tight.nvdb") == read_file(folder / "free.nvdb"));
}

// Bricks are drawn in slabs that a little memory has room for.
TEST(Memory, WorkOnBricksKeepsWithinALittle) {
    if (sanitized) return;
    expect_same_bricks({"-r", "360", "-t", "color", "--sparse"}, 40, 40);
}

// A solid that is decided in slabs has 30 MiB of bricks, which are joined at the end.
TEST(Memory, ValuesOfSlabsAreHeldOnce) {
    if (sanitized) return;
    expect_same_bricks({"-r", "400", "-t", "color", "--solid", "exterior", "--sparse"}, 60, 56);
}

TEST(Memory, InstancesAreNotCopied) {
    const scratch_folder folder;
    builder file;
    add_sheet(file, 40); // 3200 triangles, 80 KB
    for (int i = 0; i < 1000; ++i) file.append("nodes", {{"mesh", 0}, {"translation", {i % 40, i / 40, 0}}});
    file.write_glb(folder / "m.glb");
    EXPECT_GT(1000000U, std::filesystem::file_size(folder / "m.glb"));
    const outcome result =
        run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "64", "--stats=json", "--backend", "cpu"});
    ASSERT_EQ(0, result.code) << result.err;
    const json stats = json::parse(result.out);
    EXPECT_EQ(3200000, stats["triangles"]);
    EXPECT_EQ(1681000, stats["vertices"]);
    // 24 bytes for each snapped vertex, 16 for each triangle's way to its tiles, and some for the rest.
    if (!sanitized) {
        EXPECT_GT(150.0, static_cast<double>(stats["peak_memory_bytes"]) / (1 << 20));
    }
}

// Pictures that are small as files: each of them shows, or the run says that they do not fit.
TEST(Memory, LargePlainPicturesAllShow) {
    const scratch_folder folder;
    const std::uint32_t side = gltf_test::is_slow_build() ? 512 : 4096; // 64 MiB each
    builder file;
    for (int i = 0; i < 6; ++i) {
        const std::array<std::uint8_t, 3> color{static_cast<std::uint8_t>(40 * i),
                                                static_cast<std::uint8_t>(200 - 30 * i), 77};
        const int view = file.view(flat_png(side, color));
        const int image = file.append("images", {{"bufferView", view}, {"mimeType", "image/png"}});
        const int texture = file.append("textures", {{"source", image}});
        json entry;
        entry["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture;
        gltf_test::add_square(file, 0)["material"] = file.append("materials", entry);
        file.root["nodes"].back()["translation"] = {0, 0, i};
    }
    file.write_glb(folder / "m.glb");
    EXPECT_GT(1000000U, std::filesystem::file_size(folder / "m.glb"));
    const std::vector<std::string> arguments{
        folder / "m.glb", "-o",    folder / "o.npy", "-t",  "color",       "--origin=0,0,-0.5", "-s", "1",
        "--extent",       "1,1,6", "--backend",      "cpu", "--stats=json"};
    const outcome result = run(folder, arguments, sanitized ? 0 : std::uint64_t{6} << 30);
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_EQ(std::string::npos, result.err.find("warning")) << result.err;
    // One picture at a time, and of each the levels that these voxels sample: not six of 85 MiB.
    if (!sanitized) {
        EXPECT_GT(250.0, static_cast<double>(json::parse(result.out)["peak_memory_bytes"]) / (1 << 20));
    }
    const tool_test::array colors = tool_test::read_npy(folder / "o.npy");
    for (int i = 0; i < 6; ++i)
        EXPECT_EQ(glm::u8vec4(40 * i, 200 - 30 * i, 77, 255), colors.at<glm::u8vec4>(static_cast<std::size_t>(i))) << i;
    if (side < 4096) return;
    std::vector<std::string> tight = arguments;
    tight.insert(tight.end(), {"--max-memory", "60"}); // less than one of them
    const outcome refused = run(folder, tight);
    EXPECT_EQ(3, refused.code) << refused.err;
    EXPECT_LT(60, need_in(refused.err)) << refused.err;
    tight[4] = "occupancy,normal,material"; // what needs no picture reads none
    const outcome plain = run(folder, tight);
    EXPECT_EQ(0, plain.code) << plain.err;
}

TEST(Memory, ResultsThatDoNotFitNameTheirSize) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "color,normal", "-r", "1000",
                                        "--max-memory", "900", "--backend", "cpu", "--dense"});
    EXPECT_EQ(3, result.code);
    EXPECT_NE(std::string::npos, result.err.find("voxels: about ")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("900 MiB are allowed by --max-memory: take fewer targets or voxels"))
        << result.err;
}

// Each ends soon, in 6 GB of address space, with its code and one line.
void expect_refusal(const std::string& name, const std::string& bytes, int code) {
    const scratch_folder folder;
    std::ofstream(folder / "m.glb", std::ios::binary) << bytes;
    rusage before{}, after{};
    getrusage(RUSAGE_CHILDREN, &before);
    const outcome result =
        run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "color", "-r", "64", "--backend", "cpu"},
            sanitized ? 0 : std::uint64_t{6} << 30);
    getrusage(RUSAGE_CHILDREN, &after);
    EXPECT_EQ(code, result.code) << name << ": " << result.err;
    EXPECT_NE(std::string::npos, result.err.find("MiB")) << name << ": " << result.err;
    EXPECT_EQ(1, std::count(result.err.begin(), result.err.end(), '\n')) << name << ": " << result.err;
    // Processor time, whatever else the machine does.
    EXPECT_GT(20, after.ru_utime.tv_sec - before.ru_utime.tv_sec + after.ru_stime.tv_sec - before.ru_stime.tv_sec)
        << name;
}

std::string text_of(const builder& file) {
    const std::vector<std::byte> bytes = file.glb();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(Memory, FilesThatClaimWhatTheyDoNotHoldEndWithTwo) {
    builder zeros; // an accessor over nothing
    zeros.triangle();
    zeros.root["accessors"][0].erase("bufferView");
    zeros.root["accessors"][0]["count"] = 4294967295;
    expect_refusal("zeros", text_of(zeros), 2);

    builder shared; // one accessor under the primitives of many meshes
    add_sheet(shared, 100);
    const json primitive = shared.root["meshes"][0]["primitives"][0];
    for (int i = 0; i < 20000; ++i) shared.root["meshes"][0]["primitives"].push_back(primitive);
    shared.append("nodes", {{"mesh", 0}});
    expect_refusal("shared", text_of(shared), 2);

    builder square; // many nodes of a mesh with many primitives
    square.triangle();
    const json part = square.root["meshes"][0]["primitives"][0];
    for (int i = 0; i < 3000; ++i) square.root["meshes"][0]["primitives"].push_back(part);
    for (int i = 0; i < 3000; ++i) square.append("nodes", {{"mesh", 0}});
    expect_refusal("square", text_of(square), 2);

    std::string objects = R"({"asset": {"version": "2.0"}, "materials": [{})";
    for (int i = 1; i < 400000; ++i) objects += ",{}";
    expect_refusal("objects", objects + "]}", 2);
}

// Nothing is wrong with a file that shows a mesh as often as it likes; it may be too large.
TEST(Memory, InstancesWithoutEndEndWithThree) {
    if (sanitized) GTEST_SKIP() << "without a bound of address space they fit some machines";
    builder file;
    add_sheet(file, 140);
    for (int i = 0; i < 20000; ++i) file.append("nodes", {{"mesh", 0}, {"translation", {i % 100, i / 100, 0}}});
    expect_refusal("instances", text_of(file), 3);
}

// A program that a large process has started is not larger for that.
TEST(Memory, ThePeakIsTheProgramsOwn) {
    if (sanitized) return;
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const std::vector<char> large(std::size_t{300} << 20, '\1');
    const outcome result =
        run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-r", "16", "--stats=json", "--backend", "cpu"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_GT(100.0, static_cast<double>(json::parse(result.out)["peak_memory_bytes"]) / (1 << 20)) << large.back();
}

TEST(Memory, TheMachinesLimitIsPartOfWhatItHas) {
    const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    const auto limit = static_cast<double>(voxelize::memory::machine_limit());
    EXPECT_GE(0.9 * pages + 1, limit);
    EXPECT_LT(64 << 20, limit);
}

} // namespace
