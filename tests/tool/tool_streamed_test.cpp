// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Models that do not fit --max-memory go through temporary files, and give the same voxels, values and counts as a run
// that holds them.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

// A wavy relief of 2 SIDE^2 triangles; a few are not finite, or without area. COLORED: one of them has a colour.
void write_stl(const fs::path& file, int side, bool colored = false) {
    const auto corner = [&](int x, int y) {
        const auto at = [&](int i) { return static_cast<float>(i) / static_cast<float>(side); };
        return std::array<float, 3>{at(x), at(y), 0.4f + 0.3f * std::sin(9 * at(x) + 4 * at(y))};
    };
    std::vector<char> bytes(84);
    const auto count = static_cast<std::uint32_t>(2 * side * side);
    std::memcpy(bytes.data() + 80, &count, sizeof(count));
    const auto put = [&](std::array<float, 3> a, const std::array<float, 3>& b, const std::array<float, 3>& c, int n) {
        if (n % 5003 == 7) a[1] = std::numeric_limits<float>::quiet_NaN();
        if (n % 5003 == 9) a = b;
        const std::array<std::array<float, 3>, 4> facet{std::array<float, 3>{}, a, b, c};
        const auto* const raw = reinterpret_cast<const char*>(facet.data());
        bytes.insert(bytes.end(), raw, raw + sizeof(facet));
        bytes.push_back('\7');
        bytes.push_back(static_cast<char>(colored && n == 4711 ? 0x81 : 0));
    };
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            put(corner(x, y), corner(x + 1, y), corner(x, y + 1), 2 * (y * side + x));
            put(corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1), 2 * (y * side + x) + 1);
        }
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// A mesh that does not fit goes through temporary files, and gives the same voxels: under --max-memory, and under a
// limit of address space.
TEST(Streamed, MeshesThatDoNotFit) {
    if (sanitized) return;
    const scratch_folder folder;
    write_stl(folder / "m.stl", 480);
    const auto voxelize = [&](const std::string& out, const std::vector<std::string>& how,
                              std::uint64_t address_space = 0) {
        std::vector<std::string> arguments{folder / "m.stl",
                                           "-o",
                                           folder / out,
                                           "-r",
                                           "150",
                                           "-t",
                                           "occupancy,count,normal,triangle,depth",
                                           "--scale",
                                           "3",
                                           "--padding",
                                           "3",
                                           "-j",
                                           "2",
                                           "--backend",
                                           "cpu",
                                           "--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        return run(folder, arguments, address_space);
    };
    const auto expect_streamed = [&](const outcome& streamed, const std::string& out, int most) {
        ASSERT_EQ(0, streamed.code) << streamed.err;
        EXPECT_NE(std::string::npos, streamed.err.find("460800 triangles do not fit")) << streamed.err;
        const json stats = json::parse(streamed.out);
        EXPECT_GE(most, static_cast<double>(stats["peak_memory_bytes"].get<std::uint64_t>()) / (1 << 20));
        EXPECT_LT(1, stats["slabs"].get<int>());
        EXPECT_GT(fs::file_size(folder / out), 1000u);
    };
    const outcome tight = voxelize("tight.npz", {"--max-memory", "90"});
    expect_streamed(tight, "tight.npz", 90);
    // Nothing is left of the temporary files.
    EXPECT_EQ(4, std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()))
        << "m.stl, tight.npz, streams";
#if VOXELPIPE_TOOL_HAS_ASSIMP
    const outcome free = voxelize("free.npz", {"--sparse"});
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_EQ(std::string::npos, free.err.find("do not fit")) << free.err;
    EXPECT_TRUE(read_file(folder / "free.npz") == read_file(folder / "tight.npz"));
    const json a = json::parse(free.out), b = json::parse(tight.out);
    for (const char* const name : {"triangles", "triangles_dropped", "fragments", "voxels"})
        EXPECT_EQ(a.value(name, -1), b.value(name, -1)) << name;
#endif
    const outcome bounded = voxelize("bounded.npz", {"--max-memory", "60"}, std::uint64_t{400} << 20);
    expect_streamed(bounded, "bounded.npz", 60);
    EXPECT_TRUE(read_file(folder / "bounded.npz") == read_file(folder / "tight.npz"));
    // White, without a colour in the file; one that has colours is not streamed, and its need is named.
    const std::vector<std::string> in_color{"--max-memory", "90", "-t", "color,material"};
    const outcome white = voxelize("white.npz", in_color);
    expect_streamed(white, "white.npz", 90);
#if VOXELPIPE_TOOL_HAS_ASSIMP
    ASSERT_EQ(0, voxelize("white_free.npz", {"--sparse", "-t", "color,material"}).code);
    EXPECT_TRUE(read_file(folder / "white_free.npz") == read_file(folder / "white.npz"));
#endif
    write_stl(folder / "m.stl", 480, true);
    EXPECT_EQ(3, voxelize("colors.npz", in_color).code);
}

// The same relief with shared vertices, whose colours and whose faces' flags are passed over. corners(n): what
// face n says that it has.
void write_ply(
    const fs::path& file, int side, const std::function<int(int)>& corners = [](int) { return 3; }) {
    std::ofstream out(file, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\ncomment of a test\nelement vertex " << (side + 1) * (side + 1)
        << "\nproperty uchar red\nproperty double x\nproperty float y\nproperty float z\nelement face "
        << 2 * side * side << "\nproperty uchar flag\nproperty list uchar int vertex_indices\nend_header\n";
    const auto put = [&](const auto& value) { out.write(reinterpret_cast<const char*>(&value), sizeof(value)); };
    const auto at = [&](int i) { return static_cast<float>(i) / static_cast<float>(side); };
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x) {
            put(std::uint8_t{77});
            put(double{at(x)});
            put(y * side + x == 4711 ? std::numeric_limits<float>::quiet_NaN() : at(y));
            put(0.4f + 0.3f * std::sin(9 * at(x) + 4 * at(y)));
        }
    for (int n = 0; n < 2 * side * side; ++n) {
        const int x = n / 2 % side, y = n / 2 / side, a = y * (side + 1) + x, b = a + side + 1;
        put(std::uint8_t{1});
        put(static_cast<std::uint8_t>(corners(n)));
        for (const int v : {n % 2 == 0 ? a : a + 1, n % 2 == 0 ? a + 1 : b + 1, b}) put(std::int32_t{v});
    }
}

TEST(Streamed, BinaryPly) {
    if (sanitized) return;
    const scratch_folder folder;
    write_ply(folder / "m.ply", 480);
    const auto voxelize = [&](const std::string& out, const std::vector<std::string>& how) {
        std::vector<std::string> arguments{
            folder / "m.ply", "-o", folder / out, "-r", "80", "-j", "2", "-t", "occupancy,count,normal,triangle,depth",
            "--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        return run(folder, arguments);
    };
    const outcome tight = voxelize("tight.npz", {"--max-memory", "90"});
    ASSERT_EQ(0, tight.code) << tight.err;
    EXPECT_NE(std::string::npos, tight.err.find("460800 triangles do not fit")) << tight.err;
    const json b = json::parse(tight.out);
    EXPECT_GE(90, static_cast<double>(b["peak_memory_bytes"].get<std::uint64_t>()) / (1 << 20));
#if VOXELPIPE_TOOL_HAS_ASSIMP
    const outcome free = voxelize("free.npz", {"--sparse"});
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_TRUE(read_file(folder / "free.npz") == read_file(folder / "tight.npz"));
    const json a = json::parse(free.out);
    for (const char* const name : {"triangles", "triangles_dropped", "fragments", "voxels"})
        EXPECT_EQ(a.value(name, -1), b.value(name, -1)) << name;
#endif
    // Solids by a rule, too; an open one is warned of as a whole.
    const std::vector<std::string> solid{"--solid", "nonzero", "--solid-extent", "centre"};
    std::vector<std::string> in_little = solid;
    in_little.insert(in_little.end(), {"--max-memory", "90"});
    const outcome filled = voxelize("filled.npz", in_little);
    ASSERT_EQ(0, filled.code) << filled.err;
    EXPECT_NE(std::string::npos, filled.err.find("460800 triangles do not fit")) << filled.err;
#if VOXELPIPE_TOOL_HAS_ASSIMP
    std::vector<std::string> in_much = solid;
    in_much.emplace_back("--sparse");
    const outcome whole = voxelize("whole.npz", in_much);
    ASSERT_EQ(0, whole.code) << whole.err;
    EXPECT_TRUE(read_file(folder / "filled.npz") == read_file(folder / "whole.npz"));
    EXPECT_EQ(json::parse(filled.out)["solid"], json::parse(whole.out)["solid"]);
#endif
    // Slab by slab, without holding the bricks of all.
    const outcome slabs = voxelize("slabs.zarr", {"--max-memory", "90", "--resume"});
    EXPECT_EQ(0, slabs.code) << slabs.err;
    EXPECT_EQ(json::parse(slabs.out).value("voxels", -1), b.value("voxels", -2));
    // A face that lies about its corners is found while it is read.
    write_ply(folder / "m.ply", 480, [](int n) { return n == 300'000 ? 4 : 3; });
    const outcome bad = voxelize("bad.npz", {"--max-memory", "90"});
    EXPECT_EQ(2, bad.code);
    EXPECT_NE(std::string::npos, bad.err.find("face 300000 is no triangle")) << bad.err;
}

// Two primitives, one of them without indices, under a node that turns, mirrors and stretches them.
TEST(Streamed, PlainGlb) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_sheet(file, 700);
    const int alone = file.accessor(std::vector<float>{0, 0, 0.1f, 1, 0, 0.2f, 0, 1, 0.3f}, "VEC3");
    file.root["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", alone}}}});
    file.append("nodes", {{"mesh", 0}, {"matrix", {0, 0, 2, 0, 1, 0, 0, 0, 0, -1.5, 0, 0, 7, 8, 9, 1}}});
    file.write_glb(folder / "m.glb");
    const auto voxelize = [&](const std::string& out, const std::vector<std::string>& how) {
        std::vector<std::string> arguments{folder / "m.glb",
                                           "-o",
                                           folder / out,
                                           "-r",
                                           "80",
                                           "-j",
                                           "2",
                                           "--scale",
                                           "0.5",
                                           "-t",
                                           "occupancy,count,normal,triangle,depth",
                                           "--stats=json"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        return run(folder, arguments);
    };
    const outcome tight = voxelize("tight.npz", {"--max-memory", "60"});
    ASSERT_EQ(0, tight.code) << tight.err;
    EXPECT_NE(std::string::npos, tight.err.find("980001 triangles do not fit")) << tight.err;
    const json b = json::parse(tight.out);
    EXPECT_GE(60, static_cast<double>(b["peak_memory_bytes"].get<std::uint64_t>()) / (1 << 20));
    const outcome free = voxelize("free.npz", {"--sparse", "--backend", "cpu"});
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_TRUE(read_file(folder / "free.npz") == read_file(folder / "tight.npz"));
    const json a = json::parse(free.out);
    for (const char* const name : {"triangles", "triangles_dropped", "fragments", "voxels"})
        EXPECT_EQ(a.value(name, -1), b.value(name, -1)) << name;
}

// Runs of one model with and without room for it.
struct two_ways {
    const scratch_folder& folder;
    std::string model;
    std::vector<std::string> how;

    [[nodiscard]] outcome draw(const std::string& out, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{model, "-o", folder / out,   "-r",        "140",
                                           "-j",  "2",  "--stats=json", "--backend", "cpu"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(folder, arguments);
    }
    void expect_equal(int mebibytes) const {
        std::string text;
        for (const std::string& word : how) text += word + ' ';
        SCOPED_TRACE(text);
        const outcome tight = draw("tight.npz", {"--max-memory", std::to_string(mebibytes)});
        ASSERT_EQ(0, tight.code) << tight.err;
        EXPECT_NE(std::string::npos, tight.err.find(" triangles do not fit")) << tight.err;
        const outcome free = draw("free.npz", {"--sparse"});
        ASSERT_EQ(0, free.code) << free.err;
        EXPECT_EQ(std::string::npos, free.err.find(" triangles do not fit")) << free.err;
        EXPECT_TRUE(read_file(folder / "free.npz") == read_file(folder / "tight.npz"));
        const json a = json::parse(free.out), b = json::parse(tight.out);
        if (!b.contains("solid")) { // whose lists are small blocks, which the budget counts late
            EXPECT_GE(1.02 * mebibytes, static_cast<double>(b["peak_memory_bytes"].get<std::uint64_t>()) / (1 << 20));
        }
        EXPECT_LT(1, b["slabs"].get<int>());
        for (const char* const name : {"triangles", "triangles_dropped", "fragments", "fragments_discarded", "voxels"})
            EXPECT_EQ(a.value(name, -1), b.value(name, -1)) << name;
        for (const char* const name : {"solid", "materials"})
            EXPECT_EQ(a.value(name, json()), b.value(name, json())) << name;
    }
};

// A file of several meshes, materials and colours, and nodes that move, turn, mirror and stretch them; one mesh is
// shown by three of them. SIDE: quads along a side of each sheet.
builder world_of_parts(int side) {
    builder file;
    gltf_test::add_sheet(file, side);
    const auto vertices = static_cast<std::size_t>(side + 1) * static_cast<std::size_t>(side + 1);
    const json plain = file.root["meshes"][0]["primitives"][0];
    std::vector<std::uint8_t> bytes;
    std::vector<std::uint16_t> words;
    std::vector<float> floats;
    for (std::size_t v = 0; v < vertices; ++v) {
        for (const std::size_t step : {3U, 5U, 7U, 1U}) bytes.push_back(static_cast<std::uint8_t>(v * step));
        for (const std::size_t step : {31U, 57U, 79U}) words.push_back(static_cast<std::uint16_t>(v * step));
        for (const std::size_t step : {11U, 13U, 17U, 23U})
            floats.push_back(static_cast<float>(v * step % 1009) / 900); // some beyond 1
    }
    const auto with = [&](int colors, int material) {
        json part = plain;
        if (colors >= 0) part["attributes"]["COLOR_0"] = colors;
        if (material >= 0) part["material"] = material;
        return part;
    };
    const int opaque = gltf_test::add_material(file, {0.9, 0.5, 0.2, 1}, {{"name", "opaque"}});
    const int blend = gltf_test::add_material(file, {0.2, 0.6, 0.9, 0.6}, {{"name", "glass"}, {"alphaMode", "BLEND"}});
    const int mask = gltf_test::add_material(file, {0.7, 0.8, 0.9, 1}, {{"name", "leaf"}, {"alphaMode", "MASK"}});
    file.root["meshes"][0]["primitives"] = {with(file.accessor(bytes, "VEC4", true), mask), with(-1, opaque),
                                            with(file.accessor(words, "VEC3", true), blend), with(-1, -1)};
    file.append("meshes", {{"primitives", {with(file.accessor(floats, "VEC4"), opaque)}}});
    // Upright, so that slabs share their triangles.
    file.append("nodes", {{"mesh", 0}, {"rotation", {0, 0.7, 0, 0.7}}, {"children", {1, 2}}});
    file.append("nodes", {{"mesh", 1}, {"scale", {1, -0.5, 1}}, {"rotation", {0.3, 0, 0, 0.9}}});
    file.append("nodes", {{"mesh", 0}, {"scale", {1, 0.6, 1}}, {"translation", {0, 0.4, 0.3}}});
    file.append("nodes", {{"mesh", 0}, {"matrix", {0, 0, 1, 0, 0.5, 0, 0, 0, 0, 1.5, 0, 0, 0.5, 0.3, -1, 1}}});
    file.root["scenes"] = {{{"nodes", {0, 3}}}};
    return file;
}

// In two runs, since a slab's values have to fit.
const std::vector<std::string> colors{"-t", "occupancy,color,color-max,material"};
const std::vector<std::string> last_and_sums{"-t", "count,color-replace,triangle,depth"};

TEST(Streamed, GltfOfManyParts) {
    if (sanitized) return;
    const scratch_folder folder;
    const builder file = world_of_parts(180);
    file.write_glb(folder / "m.glb");
    for (const std::vector<std::string>& how :
         {colors,
          last_and_sums,
          {"-t", "occupancy,count,triangle", "--scale", "0.25", "--padding", "3", "--coverage", "thin"}})
        two_ways{folder, folder / "m.glb", how}.expect_equal(52);
    // A body is a part.
    two_ways{
        folder, folder / "m.glb", {"--solid", "each_draw", "-t", "occupancy,count,color", "--fill-color", "#102030"}}
        .expect_equal(52);
    // The mean of the whole surface is not known slab by slab.
    EXPECT_EQ(3, (two_ways{folder, folder / "m.glb", {"--solid", "nonzero", "-t", "color", "--max-memory", "52"}})
                     .draw("mean.npz", {})
                     .code);
}

TEST(Streamed, GltfWithItsBuffersInFiles) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file = world_of_parts(180);
    fs::create_directories(folder.path() / "parts");
    std::ofstream(folder / "parts/a b.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(file.binary.data()), static_cast<std::streamsize>(file.binary.size()));
    file.root["buffers"] = {{{"byteLength", file.binary.size()}, {"uri", "parts/a%20b.bin"}}};
    std::ofstream(folder / "m.gltf") << file.root.dump();
    two_ways{folder, folder / "m.gltf", colors}.expect_equal(52);
    // A buffer outside of the folder is refused, as it is by the loader.
    file.root["buffers"][0]["uri"] = "../m.bin";
    std::ofstream(folder / "m.gltf") << file.root.dump();
    EXPECT_EQ(2, (two_ways{folder, folder / "m.gltf", colors}).draw("no.npz", {"--max-memory", "52"}).code);
}

// Textures are not streamed, but a model whose textures nobody asks for is.
TEST(Streamed, TexturesOnlyWhereNobodyAsks) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file = world_of_parts(180);
    const int material = gltf_test::add_textured_material(file, 1, 1, {10, 200, 30, 255});
    file.root["meshes"][1]["primitives"][0]["material"] = material;
    file.root["meshes"][1]["primitives"][0]["attributes"]["TEXCOORD_0"] =
        file.accessor(std::vector<float>(2 * 181 * 181), "VEC2");
    file.write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-t", "occupancy,count,normal,material"}}.expect_equal(52);
    EXPECT_EQ(3, (two_ways{folder, folder / "m.glb", colors}).draw("no.npz", {"--max-memory", "52"}).code);
}

#if VOXELPIPE_TOOL_HAS_ASSIMP
TEST(Streamed, ColorsOfPlyVertices) {
    if (sanitized) return;
    const scratch_folder folder;
    for (const bool has_bytes : {true, false}) {
        constexpr int side = 480;
        std::ofstream out(folder / "m.ply", std::ios::binary);
        const std::string type = has_bytes ? "uchar" : "float";
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << (side + 1) * (side + 1)
            << "\nproperty float x\nproperty float y\nproperty float z\n";
        for (const char* const name : {"red", "green", "blue"}) out << "property " << type << ' ' << name << '\n';
        if (has_bytes) out << "property uchar alpha\n";
        out << "element face " << 2 * side * side << "\nproperty list uchar uint vertex_indices\nend_header\n";
        const auto put = [&](const auto& value) { out.write(reinterpret_cast<const char*>(&value), sizeof(value)); };
        for (int n = 0; n < (side + 1) * (side + 1); ++n) {
            const int x = n % (side + 1), y = n / (side + 1);
            for (const float p :
                 {static_cast<float>(y) / side, 0.2F * static_cast<float>((x + y) % 3), static_cast<float>(x) / side})
                put(p);
            for (int c = 0; c < (has_bytes ? 4 : 3); ++c) {
                if (has_bytes)
                    put(static_cast<std::uint8_t>(n * (3 + 2 * c)));
                else
                    put(static_cast<float>(n * (3 + 2 * c) % 1009) / 900.0F);
            }
        }
        for (int n = 0; n < 2 * side * side; ++n) {
            const int x = n / 2 % side, y = n / 2 / side, a = y * (side + 1) + x, b = a + side + 1;
            put(std::uint8_t{3});
            for (const int v : {n % 2 == 0 ? a : a + 1, n % 2 == 0 ? a + 1 : b + 1, b}) put(std::uint32_t(v));
        }
        out.close();
        two_ways{folder, folder / "m.ply", {"-t", "occupancy,color,color-max,color-replace,material"}}.expect_equal(90);
    }
}
#endif

} // namespace
