// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// STL, PLY, OFF and OBJ as assimp reads them, small files written by the test; and files that are wrong.
#include "gltf_builder.hpp"

#include <read/assimp_scene.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

using voxelize::scene;

namespace {

using files = std::map<std::string, std::vector<std::byte>>;

std::vector<std::byte> bytes_of(std::string_view text) { return gltf_test::bytes_of(text); }

scene load(const std::string& name, const std::vector<std::byte>& bytes, const files& others = {},
           const voxelize::gltf_limits& limits = {}) {
    const auto reader = [&](const std::filesystem::path& path, std::uint64_t) {
        const auto found = others.find(path.generic_string());
        if (found == others.end()) throw voxelize::gltf_error("no such file");
        return found->second;
    };
    return voxelize::load_by_assimp(bytes, name, reader, limits);
}

scene load(const std::string& name, std::string_view text, const files& others = {}) {
    return load(name, bytes_of(text), others);
}

std::string error_of(const std::string& name, const std::vector<std::byte>& bytes,
                     const voxelize::gltf_limits& limits = {}) {
    try {
        (void)load(name, bytes, {}, limits);
    } catch (const voxelize::model_error& error) {
        const std::string line = error.what();
        for (const char c : line) EXPECT_TRUE(c >= ' ' && c <= '~') << line;
        EXPECT_FALSE(line.empty());
        return line;
    }
    return "no error";
}

std::string text_of(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    return text;
}

// Twice the area of all triangles in the world.
double area_of(const scene& scene) {
    double sum = 0;
    for (const voxelize::instance& shown : scene.instances) {
        const voxelize::primitive& part = scene.primitives.at(shown.primitive);
        for (const glm::uvec3& t : part.triangles) {
            const glm::dvec3 a = shown.to_world(part.positions.at(t.x));
            sum += glm::length(
                glm::cross(shown.to_world(part.positions.at(t.y)) - a, shown.to_world(part.positions.at(t.z)) - a));
        }
    }
    return sum / 2;
}

struct box {
    glm::dvec3 low{1e300};
    glm::dvec3 high{-1e300};
};

box bounds_of(const scene& scene) {
    box result;
    for (const voxelize::instance& shown : scene.instances)
        for (const glm::vec3& p : scene.primitives.at(shown.primitive).positions) {
            result.low = glm::min(result.low, shown.to_world(p));
            result.high = glm::max(result.high, shown.to_world(p));
        }
    return result;
}

// sRGB bytes that a linear colour shows as.
glm::ivec3 shown_as(const glm::vec3& linear) {
    glm::ivec3 bytes;
    for (int i = 0; i < 3; ++i) {
        const double c = linear[i];
        bytes[i] =
            static_cast<int>(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
    }
    return bytes;
}

constexpr const char* square_obj = "v 0 0 5\nv 2 0 5\nv 2 2 5\nv 0 2 5\nf 1 2 3 4\n";

TEST(Ply, VerticesWithoutFacesArePoints) {
    const scene scene =
        load("cloud.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nproperty uchar red\nproperty uchar green\n"
                          "property uchar blue\nend_header\n0 0 0 255 0 0\n1 2 3 0 255 0\n4 5 6 0 0 255\n");
    EXPECT_EQ(0U, scene.triangle_count());
    EXPECT_EQ(3U, scene.line_count());
    ASSERT_EQ(1U, scene.primitives.size());
    EXPECT_EQ((std::vector<glm::uvec2>{{0, 0}, {1, 1}, {2, 2}}), scene.primitives[0].lines);
    ASSERT_EQ(3U, scene.primitives[0].colors.size());
    EXPECT_EQ(glm::vec4(0, 1, 0, 1), scene.primitives[0].colors[1]);
}

constexpr const char* triangle_stl = "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 7\nvertex 3 0 7\n"
                                     "vertex 0 4 7\nendloop\nendfacet\nendsolid one\n";

std::vector<std::byte> binary_stl(std::uint32_t count_says) {
    std::vector<std::byte> bytes(84 + 50);
    std::memcpy(bytes.data() + 80, &count_says, 4);
    const float corners[] = {0, 0, 1, 0, 0, 7, 3, 0, 7, 0, 4, 7};
    std::memcpy(bytes.data() + 84, corners, sizeof(corners));
    return bytes;
}

TEST(Stl, TextAndBinaryAreTheSameWhiteTriangle) {
    for (const scene& scene : {load("one.stl", triangle_stl), load("ONE.STL", binary_stl(1))}) {
        EXPECT_EQ(1U, scene.triangle_count());
        EXPECT_DOUBLE_EQ(6, area_of(scene));
        EXPECT_EQ(glm::dvec3(3, 4, 7), bounds_of(scene).high);
        EXPECT_EQ(glm::vec4(1), scene.materials.at(scene.primitives.at(0).material).base_color);
    }
}

TEST(Ply, VertexColoursAreShownAsTheyAre) {
    const scene scene =
        load("c.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                      "0 0 0 128 0 255\n1 0 0 64 200 1\n0 1 0 0 17 33\n3 0 1 2\n");
    ASSERT_EQ(1U, scene.triangle_count());
    const voxelize::primitive& part = scene.primitives.at(0);
    EXPECT_EQ(glm::vec4(1), scene.materials.at(part.material).base_color);
    ASSERT_EQ(3U, part.colors.size());
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::ivec3 expected = part.positions[i].x == 1   ? glm::ivec3(64, 200, 1)
                                    : part.positions[i].y == 1 ? glm::ivec3(0, 17, 33)
                                                               : glm::ivec3(128, 0, 255);
        EXPECT_EQ(expected, shown_as(part.colors[i])) << i;
        EXPECT_EQ(1, part.colors[i].a);
    }
}

std::vector<std::byte> binary_ply(const std::string& vertices) {
    std::vector<std::byte> bytes = bytes_of("ply\nformat binary_little_endian 1.0\nelement vertex " + vertices +
                                            "\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                                            "property list uchar int vertex_indices\nend_header\n");
    const float corners[] = {0, 0, 7, 3, 0, 7, 0, 4, 7};
    const std::int32_t indices[] = {0, 1, 2};
    const auto put = [&bytes](const auto& list) {
        const auto* const at = reinterpret_cast<const std::byte*>(&list);
        bytes.insert(bytes.end(), at, at + sizeof(list));
    };
    put(corners);
    bytes.push_back(std::byte{3});
    put(indices);
    return bytes;
}

TEST(Ply, BinaryIsRead) {
    const scene scene = load("b.ply", binary_ply("3"));
    EXPECT_DOUBLE_EQ(6, area_of(scene));
    EXPECT_EQ(glm::dvec3(3, 4, 7), bounds_of(scene).high);
}

constexpr const char* tetrahedron_off = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
                                        "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST(Off, FacesAreRead) {
    const scene scene = load("t.off", tetrahedron_off);
    EXPECT_EQ(4U, scene.triangle_count());
    EXPECT_NEAR(1.5 + std::sqrt(3) / 2, area_of(scene), 1e-6);
}

// ---- Files that are wrong
// --------------------------------------------------------------------------------------------

struct sample {
    const char* name;
    std::vector<std::byte> bytes;
};

std::vector<sample> samples() {
    return {{"square.obj", bytes_of(square_obj)},
            {"one.stl", bytes_of(triangle_stl)},
            {"b.stl", binary_stl(1)},
            {"b.ply", binary_ply("3")},
            {"t.off", bytes_of(tetrahedron_off)}};
}

// Any outcome but an end of this process, and errors are one line (error_of).
TEST(AssimpMalformed, FilesMayEndAnywhere) {
    voxelize::gltf_limits limits;
    limits.import_seconds = 1;
    for (const sample& file : samples()) {
        for (std::size_t size = 0; size < file.bytes.size(); size += gltf_test::is_slow_build() ? 29 : 7)
            (void)error_of(file.name, {file.bytes.begin(), file.bytes.begin() + static_cast<std::ptrdiff_t>(size)},
                           limits);
        EXPECT_EQ("no error", error_of(file.name, file.bytes));
        EXPECT_EQ("the file is empty", error_of(file.name, {}));
    }
}

TEST(AssimpMalformed, BytesMayBeWrong) {
    voxelize::gltf_limits limits;
    limits.import_seconds = 1;
    for (const sample& file : samples()) {
        for (std::size_t at = 0; at < file.bytes.size(); at += gltf_test::is_slow_build() ? 31 : 5) {
            for (const int value : {0x00, 0x2D, 0xFF}) {
                std::vector<std::byte> bytes = file.bytes;
                bytes[at] = static_cast<std::byte>(value);
                (void)error_of(file.name, bytes, limits);
            }
        }
    }
}

TEST(AssimpMalformed, CountsWithoutDataBehindThemAreRefused) {
    const std::string line = error_of("m.off", bytes_of("OFF\n4294967295 1 1\n0 0 0\n"));
    EXPECT_EQ(0U, line.find("assimp")) << line;
    EXPECT_NE("no error", error_of("m.stl", binary_stl(0xFFFFFFFF)));
    (void)error_of("m.ply", binary_ply("4000000000"));
}

TEST(AssimpMalformed, APlyHeaderWithoutEndIsRefused) {
    EXPECT_EQ("assimp: the PLY header has no end_header", error_of("m.ply", bytes_of("ply\nformat ascii 1.0\n")));
}

TEST(AssimpMalformed, IndicesThatPointNowhereAreRefused) {
    EXPECT_NE("no error", error_of("m.obj", bytes_of("v 0 0 0\nv 1 0 0\nf 1 2 9\n")));
    // Whatever assimp makes of these, no index leaves its list (from_bytes sees to that).
    for (const char* text :
         {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 77\n", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"})
        (void)error_of("m.off", bytes_of(text));
}

TEST(AssimpMalformed, MemoryIsBoundedByTheFilesSize) {
    voxelize::gltf_limits limits;
    limits.base_memory = std::uint64_t{1} << 20;
    limits.memory_per_input_byte = 1;
    std::string text;
    for (int i = 0; i < 20000; ++i) text += "v 1 2 3\nf 1 1 1\n";
    if (gltf_test::is_slow_build()) GTEST_SKIP() << "sanitizers reserve memory: there is no bound on it";
    const std::string line = error_of("m.obj", bytes_of(text), limits);
    EXPECT_NE(std::string::npos, line.find("MiB")) << line;
    // The run's own limit is another matter: the file is not to blame.
    voxelize::gltf_limits narrow;
    narrow.room = std::uint64_t{1} << 20;
    EXPECT_THROW((void)load("m.obj", bytes_of(text), {}, narrow), std::bad_alloc);
}

TEST(AssimpMalformed, TheExtensionChoosesTheReader) {
    EXPECT_TRUE(voxelize::is_for_assimp(".dae"));
    EXPECT_FALSE(voxelize::is_for_assimp(".obj")) << "it has a reader of its own";
    EXPECT_TRUE(voxelize::is_for_assimp(".stl"));
    EXPECT_TRUE(voxelize::is_for_assimp(".ply"));
    EXPECT_TRUE(voxelize::is_for_assimp(".off"));
    EXPECT_FALSE(voxelize::is_for_assimp(".glb"));
    EXPECT_FALSE(voxelize::is_for_assimp(".gltf"));
    EXPECT_FALSE(voxelize::is_for_assimp(".txt"));
    EXPECT_FALSE(voxelize::is_for_assimp(""));
}

// The models of Debian's package assimp-testmodels, where it is installed: each loads, or is refused in one line.
TEST(AssimpModels, EachLoadsOrSaysWhyNot) {
    const std::filesystem::path folder = "/usr/share/assimp/models";
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no " << folder;
    std::map<std::string, std::uint64_t> triangles;
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        std::string extension = entry.path().extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
        if (extension != ".obj" && extension != ".stl" && extension != ".ply" && extension != ".off") continue;
        ++count;
        const std::string name = entry.path().lexically_relative(folder).generic_string();
        try {
            triangles[name] = voxelize::load_by_assimp(entry.path()).triangle_count();
        } catch (const voxelize::model_error& error) {
            const std::string line = error.what();
            EXPECT_FALSE(line.empty()) << name;
            for (const char c : line) EXPECT_TRUE(c >= ' ' && c <= '~') << name << ": " << line;
        }
    }
    EXPECT_GE(count, 40U);
    EXPECT_GE(triangles.size(), 35U);
    for (const char* same : {"OBJ/WusonOBJ.obj", "OFF/Wuson.off", "PLY/Wuson.ply", "STL/Wuson.stl"})
        EXPECT_EQ(triangles.at("OFF/Wuson.off"), triangles.at(same)) << same;
    for (const char* cube : {"OBJ/box.obj", "OFF/Cube.off", "PLY/cube.ply", "PLY/cube_binary.ply"})
        EXPECT_EQ(12U, triangles.at(cube)) << cube;
}

} // namespace
