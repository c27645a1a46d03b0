// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Models that do not fit --max-memory go through temporary files, and give the same voxels, values and counts as a run
// that holds them.
#include "two_ways.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
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
    write_stl(folder / "m.stl", 320);
    const two_ways values{
        folder,
        folder / "m.stl",
        {"-r", "100", "-t", "occupancy,count,normal,triangle,depth", "--scale", "3", "--padding", "3"}};
    values.expect_equal(56);
    // Nothing is left of the temporary files.
    EXPECT_EQ(5, std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()))
        << "m.stl, tight.npz, free.npz, streams";
    fs::rename(folder / "tight.npz", folder / "first.npz");
    EXPECT_EQ(0, values.draw_streamed(52, std::uint64_t{400} << 20).code);
    EXPECT_TRUE(read_file(folder / "first.npz") == read_file(folder / "tight.npz"));
    // White, without a colour in the file; and with one of a facet.
    const two_ways colors{folder, folder / "m.stl", {"-r", "100", "-t", "color,material"}};
    colors.expect_equal(56);
    write_stl(folder / "m.stl", 320, true);
    colors.expect_equal(60);
}

// The same relief with shared vertices, and others that no face names, whose colours and whose faces' flags are passed
// over. corners(n): what face n says that it has.
void write_ply(
    const fs::path& file, int side, const std::function<int(int)>& corners = [](int) { return 3; }) {
    std::ofstream out(file, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\ncomment of a test\nelement vertex "
        << (side + 1) * (side + 1) + spare_vertices
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
    out << std::string(17 * spare_vertices, '\0');
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
    constexpr int side = 320, memory = 60;
    write_ply(folder / "m.ply", side);
    const two_ways values{folder, folder / "m.ply", {"-r", "60", "-t", "occupancy,count,normal,triangle,depth"}};
    values.expect_equal(memory);
    // Solids by a rule, too; an open one is warned of as a whole.
    two_ways{folder, folder / "m.ply", {"-r", "60", "--solid", "nonzero", "--solid-extent", "centre"}}.expect_equal(
        memory);
    // Lids on holes: one that all slabs share, and with a greatest number of edges only those around what is dropped.
    two_ways{folder, folder / "m.ply", {"-r", "60", "--solid", "nonzero", "--close-holes"}}.expect_equal(memory);
    two_ways{folder, folder / "m.ply", {"-r", "60", "--solid", "even_odd", "--close-holes=9", "-t", "occupancy,normal"}}
        .expect_equal(memory);
    // Slab by slab, without holding the bricks of all.
    const std::vector<std::string> little{"--max-memory", std::to_string(memory)};
    const two_ways counts{folder, folder / "m.ply", {"-r", "60"}};
    const outcome slabs = counts.draw("slabs.zarr", {little[0], little[1], "--resume"}),
                  whole = counts.draw("whole.npz", little);
    ASSERT_EQ(0, slabs.code) << slabs.err;
    ASSERT_EQ(0, whole.code) << whole.err;
    EXPECT_EQ(json::parse(slabs.out).value("voxels", -1), json::parse(whole.out).value("voxels", -2));
    // A face that lies about its corners is found while it is read.
    write_ply(folder / "m.ply", side, [](int n) { return n == 100'000 ? 4 : 3; });
    const outcome bad = counts.draw("bad.npz", little);
    EXPECT_EQ(2, bad.code);
    EXPECT_NE(std::string::npos, bad.err.find("face 100000 names a vertex ")) << bad.err;
}

TEST(Streamed, PlainGlb) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_two_parts(file, 580);
    file.write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-r", "80", "--scale", "0.5", "-t", "occupancy,count,normal,triangle,depth"}}
        .expect_equal(42);
}

// A file of several meshes, materials and colours, and nodes that move, turn, mirror and stretch them; one mesh is
// shown by three of them. SIDE: quads along a side of each sheet.
builder world_of_parts(int side) {
    builder file;
    gltf_test::add_sheet(file, side, 0.01F);
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
    // High, so that slabs are thin: one has eight layers at least, whose triangles have to fit.
    file.append("nodes", {{"scale", {0.25, 0.25, 1}}, {"children", {0, 3}}});
    file.root["scenes"] = {{{"nodes", {4}}}};
    return file;
}

constexpr int world_side = 120, world_memory = 29;
const std::vector<std::string> colors{"-r", "128", "-t", "occupancy,color,material"};

TEST(Streamed, GltfOfManyParts) {
    if (sanitized) return;
    const scratch_folder folder;
    world_of_parts(world_side).write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", colors}.expect_equal(world_memory);
    two_ways{
        folder,
        folder / "m.glb",
        {"-r", "128", "-t", "count,color-replace,triangle", "--scale", "0.25", "--padding", "3", "--coverage", "thin"}}
        .expect_equal(world_memory);
    // A body is a part.
    two_ways{folder, folder / "m.glb", {"-r", "128", "--solid", "each_draw", "-t", "occupancy,count"}}.expect_equal(
        world_memory);
    // Each with its own lids, which reach slabs that it has no triangle in; parts that mirror turn their corners. The
    // edges of holes are held beside a slab: 40 MiB are needed, and the model as a whole takes 48.
    world_of_parts(160).write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-r", "48", "--solid", "each_draw", "--close-holes", "-t", "count"}}
        .expect_equal(44);
}

TEST(Streamed, GltfWithItsBuffersInFiles) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file = world_of_parts(world_side);
    fs::create_directories(folder.path() / "parts");
    std::ofstream(folder / "parts/a b.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(file.binary.data()), static_cast<std::streamsize>(file.binary.size()));
    file.root["buffers"] = {{{"byteLength", file.binary.size()}, {"uri", "parts/a%20b.bin"}}};
    std::ofstream(folder / "m.gltf") << file.root.dump();
    const two_ways values{folder, folder / "m.gltf", {"-r", "128", "-t", "occupancy,count,color"}};
    values.expect_equal(world_memory);
    // A buffer outside of the folder is refused, as it is by the loader.
    file.root["buffers"][0]["uri"] = "../m.bin";
    std::ofstream(folder / "m.gltf") << file.root.dump();
    EXPECT_EQ(2, values.draw("no.npz", {"--max-memory", std::to_string(world_memory)}).code);
}

// Gives the same model textures: one of SIDE texels that is reduced, moved by its transform, and shown by opaque parts
// and by some that blend; a small one by a mask, whose coordinates are bytes; and parts whose material has a texture
// that they have no coordinates for.
void add_textures(builder& file, std::uint32_t side) {
    const auto vertices = static_cast<std::size_t>(world_side + 1) * static_cast<std::size_t>(world_side + 1);
    std::vector<float> floats;
    std::vector<std::uint8_t> bytes, texels;
    for (std::size_t v = 0; v < vertices; ++v) {
        const auto x = static_cast<float>(v % (world_side + 1)), y = static_cast<float>(v / (world_side + 1));
        floats.insert(floats.end(), {x / world_side, 1.5F * y / world_side - 0.25F}); // some repeat
        for (const std::size_t step : {7U, 3U}) bytes.push_back(static_cast<std::uint8_t>(v * step));
    }
    for (std::uint32_t t = 0; t < side * side; ++t)
        for (const std::uint32_t step : {1U, 3U, 7U, 5U}) texels.push_back(static_cast<std::uint8_t>(t * step >> 4));
    const int large = gltf_test::add_textured_material(file, side, side, texels, {{"name", "wide"}});
    json& texture = file.root["materials"][static_cast<std::size_t>(large)]["pbrMetallicRoughness"]["baseColorTexture"];
    texture["extensions"]["KHR_texture_transform"] = {{"offset", {0.1, 0.2}}, {"rotation", 0.3}, {"scale", {0.3, 0.5}}};
    json blend = file.root["materials"][static_cast<std::size_t>(large)];
    blend["alphaMode"] = "BLEND";
    const int of_blend = file.append("materials", blend);
    const std::vector<std::uint8_t> leaf{255, 255, 0, 255, 255, 255, 255, 0, 255, 255, 255, 0, 0, 255, 255, 255};
    const int mask = gltf_test::add_textured_material(file, 2, 2, leaf, {{"name", "leaf"}, {"alphaMode", "MASK"}});
    const int texcoords = file.accessor(floats, "VEC2"), of_mask = file.accessor(bytes, "VEC2", true);
    const auto set = [&](json& part, int material, int coordinates) {
        part["material"] = material;
        if (coordinates >= 0) part["attributes"]["TEXCOORD_0"] = coordinates;
    };
    json &first = file.root["meshes"][0]["primitives"], &second = file.root["meshes"][1]["primitives"];
    set(first[0], mask, of_mask);
    set(first[1], large, texcoords);
    set(first[2], of_blend, texcoords);
    set(first[3], large, -1);
    set(second[0], large, texcoords);
}

constexpr int textured_memory = 35;

TEST(Streamed, Textures) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file = world_of_parts(world_side);
    add_textures(file, 600);
    file.write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-r", "128", "-t", "occupancy,color,color-max,color-replace,color-outer"}}
        .expect_equal(textured_memory);
    // Those of the nearest triangles, each draw with a sign of its own.
    two_ways{folder,
             folder / "m.glb",
             {"-r", "64", "--distance", "--solid", "each_draw", "-t", "distance,nearest,color,material"}}
        .expect_equal(textured_memory, {});
    // Nobody asks for colours, but the mask cuts fragments off.
    two_ways{folder, folder / "m.glb", {"-r", "128", "-t", "count,material"}}.expect_equal(world_memory);
    // Another format, dense against slab by slab.
    const two_ways values{folder, folder / "m.glb", {"-r", "128", "-t", "occupancy,color"}};
    const outcome tight = values.draw("tight.vti", {"--max-memory", std::to_string(textured_memory)}),
                  free = values.draw("free.vti", {"--dense"});
    ASSERT_EQ(0, tight.code) << tight.err;
    ASSERT_EQ(0, free.code) << free.err;
    EXPECT_NE(std::string::npos, tight.err.find(" triangles do not fit")) << tight.err;
    EXPECT_TRUE(read_file(folder / "tight.vti") == read_file(folder / "free.vti"));
}

TEST(Streamed, TexturesInFilesAndThoseThatDoNotFit) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file = world_of_parts(world_side);
    add_textures(file, 16);
    constexpr std::uint32_t picture_side = 2048; // of which 16 MiB are decoded, and as many encoded
    const std::vector<std::uint8_t> texels(std::size_t{4} * picture_side * picture_side, 200);
    const std::vector<std::byte> encoded = gltf_test::png(picture_side, picture_side, texels);
    std::ofstream(folder / "wall 1.png", std::ios::binary)
        .write(reinterpret_cast<const char*>(encoded.data()), static_cast<std::streamsize>(encoded.size()));
    file.root["images"][0] = {{"uri", "wall%201.png"}};
    file.write_glb(folder / "m.glb");
    const two_ways values{folder, folder / "m.glb", {"-r", "120", "-t", "color"}};
    const outcome tight = values.draw("no.npz", {"--max-memory", std::to_string(world_memory)});
    EXPECT_EQ(3, tight.code) << tight.err;
    EXPECT_NE(std::string::npos, tight.err.find(" MiB are needed")) << tight.err;
    EXPECT_NE(std::string::npos, tight.err.find("the picture images[0] \"wall%201.png\"")) << tight.err;
    // One that cannot be read is a warning, and the factor is used alone.
    fs::remove(folder / "wall 1.png");
    const outcome without = values.draw("without.npz", {"--max-memory", std::to_string(textured_memory)});
    EXPECT_EQ(0, without.code) << without.err;
    EXPECT_NE(std::string::npos, without.err.find("images[0] cannot be used: \"wall%201.png\"")) << without.err;
}

// The picture does not fit beside the loaded model, as it is decoded. It is that of a mask, which is kept whole.
TEST(Streamed, ModelsThatFitOnlyWithoutTheirPictures) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    constexpr int side = 350;
    constexpr std::uint32_t picture_side = 2000;
    gltf_test::add_sheet(file, side);
    std::vector<float> texcoords;
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x)
            texcoords.insert(texcoords.end(), {static_cast<float>(x) / side, static_cast<float>(y) / side});
    std::vector<std::uint8_t> texels(std::size_t{4} * picture_side * picture_side);
    for (std::size_t i = 0; i < texels.size(); ++i)
        texels[i] = static_cast<std::uint8_t>(i % 4 == 3 ? 255 : i * i >> 9);
    const int leaf = gltf_test::add_textured_material(file, 1, 1, {0, 0, 0, 0}, {{"alphaMode", "MASK"}});
    const std::vector<std::byte> encoded = gltf_test::png(picture_side, picture_side, texels);
    std::ofstream(folder / "leaf.png", std::ios::binary)
        .write(reinterpret_cast<const char*>(encoded.data()), static_cast<std::streamsize>(encoded.size()));
    file.root["images"][0] = {{"uri", "leaf.png"}};
    const int of_vertices = file.accessor(texcoords, "VEC2");
    json& sheet = file.root["meshes"][0]["primitives"][0];
    sheet["material"] = leaf;
    sheet["attributes"]["TEXCOORD_0"] = of_vertices;
    file.append("nodes", {{"mesh", 0}, {"rotation", {0.7, 0, 0, 0.7}}}); // upright, so that slabs share it
    file.write_glb(folder / "m.glb");
    const two_ways values{folder, folder / "m.glb", {"-r", "60", "-t", "color"}};
    values.expect_equal(62);
}

// A model without pictures that is loaded, since its estimate fits, and runs out of memory while it is drawn.
TEST(Streamed, ModelsThatDoNotFitWhileTheyAreDrawn) {
    if (sanitized) return;
    const scratch_folder folder;
    builder file;
    gltf_test::add_relief(file, 300); // 36 bytes a triangle and vertex: 25 MiB
    file.write_glb(folder / "m.glb");
    two_ways{folder, folder / "m.glb", {"-r", "80", "-t", "count,normal,triangle,depth"}}.expect_equal(48);
    // A model that is little of what does not fit is not drawn twice.
    gltf_test::small_world().write_glb(folder / "m.glb");
    const outcome tight = two_ways{folder, folder / "m.glb", {"-r", "2000"}}.draw("no.npz", {"--max-memory", "40"});
    EXPECT_EQ(3, tight.code) << tight.err;
    EXPECT_EQ(std::string::npos, tight.err.find(" triangles do not fit")) << tight.err;
}

TEST(Streamed, ColorsOfPlyVertices) {
    if (sanitized) return;
    const scratch_folder folder;
    for (const bool has_bytes : {true, false}) {
        constexpr int side = 320;
        std::ofstream out(folder / "m.ply", std::ios::binary);
        const std::string type = has_bytes ? "uchar" : "float";
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << (side + 1) * (side + 1) + spare_vertices
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
        out << std::string(static_cast<std::size_t>(has_bytes ? 16 : 24) * spare_vertices, '\0');
        for (int n = 0; n < 2 * side * side; ++n) {
            const int x = n / 2 % side, y = n / 2 / side, a = y * (side + 1) + x, b = a + side + 1;
            put(std::uint8_t{3});
            for (const int v : {n % 2 == 0 ? a : a + 1, n % 2 == 0 ? a + 1 : b + 1, b}) put(std::uint32_t(v));
        }
        out.close();
        two_ways{folder, folder / "m.ply", {"-r", "60", "-t", "occupancy,color,color-max,color-replace,material"}}
            .expect_equal(60);
    }
}

} // namespace
