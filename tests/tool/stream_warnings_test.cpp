// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A streamed model gives the warnings and counts of a loaded one, in the same order.
#include "tool_test.hpp"

#include <read/model_file.hpp>
#include <read/triangle_stream.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

using namespace tool_test;

namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

template <class T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// PARTS: of its warnings, one after the other, that the model is written for.
void expect_same(const scratch_folder& folder, const std::string& name, const std::vector<std::string>& parts,
                 const voxelize::load_options& options = {}) {
    SCOPED_TRACE(name);
    const voxelize::opened_stream opened =
        voxelize::open_stream(folder / name, {std::uint64_t{1} << 20, 0}, folder.path(), options);
    ASSERT_TRUE(opened.stream) << opened.refusal;
    voxelize::triangle_stream& stream = *opened.stream;
    (void)stream.bounds();
    stream.read_textures({});
    ASSERT_EQ(parts.size(), stream.warnings().size()) << testing::PrintToString(stream.warnings());
    for (std::size_t i = 0; i < parts.size(); ++i)
        EXPECT_NE(std::string::npos, stream.warnings()[i].find(parts[i])) << i << ": " << stream.warnings()[i];
    const voxelize::scene whole = voxelize::load_model(folder / name, options);
    EXPECT_EQ(whole.warnings, stream.warnings());
    EXPECT_EQ(whole.triangle_count(), stream.num_triangles());
    EXPECT_EQ(whole.vertex_count(), stream.num_vertices());
}

// Primitives of one list of vertices, of which one is not finite: textured by a picture that is not there and without
// texture coordinates, with a rest, and with less than a triangle. A node shows them twice.
builder faulty_world() {
    builder file;
    const int positions = file.accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, nan, 0, 0}, "VEC3");
    const int texcoords = file.accessor(std::vector<float>{0, 0, 1, 0, 0, 1, 1, 1}, "VEC2");
    json& first = file.mesh({{"POSITION", positions}, {"TEXCOORD_0", texcoords}});
    first["indices"] = file.accessor(std::vector<std::uint8_t>{0, 1, 2, 0, 1, 3}, "SCALAR");
    file.append("images", {{"uri", "none.png"}});
    file.append("textures", {{"source", 0}});
    file.append("textures", json::object());
    for (const int texture : {0, 1})
        file.append("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
    first["material"] = 0;
    json &parts = file.root["meshes"][0]["primitives"], plain = {{"attributes", {{"POSITION", positions}}}};
    plain["indices"] = file.accessor(std::vector<std::uint8_t>{0, 1, 2, 3}, "SCALAR");
    plain["material"] = 0;
    parts.push_back(plain);
    plain["indices"] = file.accessor(std::vector<std::uint8_t>{0, 1}, "SCALAR");
    plain["material"] = 1;
    parts.push_back(plain);
    file.append("nodes", {{"mesh", 0}, {"translation", {1, 2, 3}}});
    return file;
}

TEST(StreamWarnings, Gltf) {
    const scratch_folder folder;
    builder file = faulty_world();
    file.write_glb(folder / "m.glb");
    const std::vector<std::string> all{
        "2 primitive(s) have indices left over", "primitive(s) without the texture coordinates",
        "3 vertices at positions that are not finite", "images[0] cannot be used", "textures[1] names no picture"};
    expect_same(folder, "m.glb", all);
    voxelize::load_options options;
    options.gltf.colors = false;
    expect_same(folder, "m.glb", {all[0], all[2]}, options);
    // Faults that --lenient puts right, and a scene that is passed over.
    options.gltf.colors = true;
    options.gltf.lenient = true;
    file.root["scenes"] = {{{"nodes", {0, 1, 1}}}, {{"nodes", {0}}}};
    file.write_glb(folder / "m.glb");
    std::vector<std::string> more{"the file has 2 scenes", "is in the scene twice"};
    more.insert(more.end(), all.begin(), all.end());
    expect_same(folder, "m.glb", more, options);
}

TEST(StreamWarnings, Stl) {
    const scratch_folder folder;
    std::string bytes(80, ' ');
    bytes += bytes_of(std::vector<std::uint32_t>{3});
    for (const float x : {0.0F, nan, 2.0F})
        bytes += bytes_of(std::vector<float>{0, 0, 1, x, 0, 0, 1, x, 0, 0, 1, 1}) + std::string(2, '\0');
    write(folder / "m.stl", bytes);
    expect_same(folder, "m.stl", {"2 vertices at positions that are not finite"});
}

TEST(StreamWarnings, Ply) {
    const scratch_folder folder;
    const std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    std::string bytes = header;
    // No face names the last.
    bytes += bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, nan, 1, nan, nan, nan});
    for (const int last : {2, 3}) bytes += '\3' + bytes_of(std::vector<std::int32_t>{0, 1, last});
    write(folder / "m.ply", bytes);
    expect_same(folder, "m.ply", {"2 vertices at positions that are not finite"});
}

TEST(StreamWarnings, Obj) {
    const scratch_folder folder;
    const std::string model = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1e39 0\nv 1e39 0 0\nvt 0 0\n"
                              "usemtl a\nf 1/1 2/1 3/1 4/1\nusemtl b\nf 1 2 3\nf 1/1 3/1 4/1\n";
    write(folder / "m.mtl", "newmtl a\nmap_Kd none.png\nnewmtl b\nmap_Kd bad.png\n");
    write(folder / "bad.png", "\x89PNG\r\n\x1a\n and no more");
    write(folder / "m.obj", model);
    expect_same(folder, "m.obj",
                {"2 vertices at positions that are not finite", "the texture \"none.png\" cannot be used: no such file",
                 "the texture \"bad.png\" cannot be used: the PNG is cut short"});
    voxelize::load_options options;
    options.gltf.colors = false;
    expect_same(folder, "m.obj", {"2 vertices at positions that are not finite"}, options);
    fs::remove(folder / "m.mtl");
    expect_same(folder, "m.obj", {"the material library \"m.mtl\" cannot be read", "2 vertices at positions"});
}

} // namespace
