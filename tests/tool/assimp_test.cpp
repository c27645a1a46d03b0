// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// OBJ/MTL, small files written by the test; and files that are wrong.
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

// A square of side 2 in z = 5 that faces +z, with texture coordinates and a material.
constexpr const char* square_obj = "mtllib square.mtl\n"
                                   "v 0 0 5\nv 2 0 5\nv 2 2 5\nv 0 2 5\n"
                                   "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                                   "usemtl paint\nf 1/1 2/2 3/3 4/4\n";

TEST(Obj, PolygonsBecomeTrianglesInTheFilesUnits) {
    const scene scene = load("square.obj", square_obj);
    EXPECT_EQ(2U, scene.triangle_count());
    EXPECT_DOUBLE_EQ(4, area_of(scene));
    EXPECT_EQ(glm::dvec3(0, 0, 5), bounds_of(scene).low);
    EXPECT_EQ(glm::dvec3(2, 2, 5), bounds_of(scene).high);
    const voxelize::primitive& part = scene.primitives.at(0);
    for (const glm::uvec3& t : part.triangles) {
        const auto& p = part.positions;
        EXPECT_LT(0, glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z); // the winding stays
    }
}

TEST(Obj, ConcavePolygonsKeepTheirShape) {
    // An L of area 3: as a fan around its first corner it would cover more.
    const scene scene = load("l.obj", "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n");
    EXPECT_EQ(4U, scene.triangle_count());
    EXPECT_NEAR(3, area_of(scene), 1e-6);
}

TEST(Obj, MaterialsShowTheColoursThatTheFileSays) {
    const files others{{"square.mtl", bytes_of("newmtl other\nKd 1 0 0\nnewmtl paint\nKd 0.5 0.25 0.75\nd 0.5\n")}};
    const scene scene = load("square.obj", square_obj, others);
    EXPECT_EQ("", text_of(scene.warnings));
    const voxelize::material& paint = scene.materials.at(scene.primitives.at(0).material);
    EXPECT_EQ("paint", paint.name);
    EXPECT_EQ(glm::ivec3(128, 64, 191), shown_as(paint.base_color));
    EXPECT_EQ(0.5F, paint.base_color.a);
    EXPECT_EQ(voxelize::alpha_mode::blend, paint.alpha);
    EXPECT_EQ(voxelize::material::no_texture, paint.texture);
    EXPECT_TRUE(scene.primitives[0].texcoords.empty());
}

TEST(Obj, WithoutItsMaterialsASurfaceIsWhite) {
    const scene scene = load("square.obj", square_obj);
    EXPECT_EQ(glm::vec4(1), scene.materials.at(scene.primitives.at(0).material).base_color);
    EXPECT_EQ("the material library \"square.mtl\" cannot be read: surfaces are white\n", text_of(scene.warnings));
}

// The colour at the top left of the square, of a picture whose top row is red, green.
TEST(Obj, TexturesStandUpright) {
    const std::vector<std::uint8_t> pixels{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 255};
    const std::vector<std::byte> picture = gltf_test::png(2, 2, pixels);
    for (const char* name : {"maps/wood.png", "maps\\wood.png", ".\\maps\\wood.png"}) {
        const files others{{"square.mtl", bytes_of("newmtl paint\nKd 1 1 1\nmap_Kd " + std::string(name) + "\n")},
                           {"maps/wood.png", picture}};
        const scene scene = load("square.obj", square_obj, others);
        ASSERT_EQ("", text_of(scene.warnings)) << name;
        const voxelize::primitive& part = scene.primitives.at(0);
        const voxelize::material& paint = scene.materials.at(part.material);
        ASSERT_EQ(0, paint.texture);
        EXPECT_EQ(pixels, scene.images.at(scene.textures.at(0).image).rgba);
        EXPECT_EQ(voxelize::wrap_mode::repeat, scene.textures[0].wrap_s);
        ASSERT_EQ(part.positions.size(), part.texcoords.size());
        for (std::size_t i = 0; i < part.positions.size(); ++i) // v runs down: (0, 0) is the top left, at (0, 2)
            EXPECT_EQ(glm::vec2(part.positions[i].x / 2, 1 - part.positions[i].y / 2), part.texcoords[i]);
    }
}

TEST(Obj, ATextureIsFoundBesideTheModelWhateverItsPath) {
    const std::vector<std::byte> picture = gltf_test::png(1, 1, {1, 2, 3, 255});
    for (const char* name : {"C:\\work\\wood.png", "/home/me/wood.png", "../maps/wood.png", "maps/wood.png"}) {
        const files others{{"square.mtl", bytes_of("newmtl paint\nKd 0 0 0\nmap_Kd " + std::string(name) + "\n")},
                           {"wood.png", picture}};
        const scene scene = load("square.obj", square_obj, others);
        EXPECT_EQ("", text_of(scene.warnings)) << name;
        EXPECT_EQ(1U, scene.images.size()) << name;
        // Black beside a texture is what exporters leave there.
        EXPECT_EQ(glm::vec4(1), scene.materials.at(scene.primitives.at(0).material).base_color);
    }
}

TEST(Obj, ATextureThatCannotBeHadIsAWarning) {
    const auto with = [](const files& more) {
        files others{{"square.mtl", bytes_of("newmtl paint\nKd 0.5 0.5 0.5\nmap_Kd wood.tga\n")}};
        others.insert(more.begin(), more.end());
        const scene scene = load("square.obj", square_obj, others);
        EXPECT_EQ(2U, scene.triangle_count());
        EXPECT_TRUE(scene.primitives.at(0).texcoords.empty());
        return text_of(scene.warnings);
    };
    EXPECT_EQ("the texture \"wood.tga\" cannot be used: no such file; the material's colour is used alone\n", with({}));
    EXPECT_EQ(
        "the texture \"wood.tga\" cannot be used: it is neither PNG, JPEG nor WebP; the material's colour is used "
        "alone\n",
        with({{"wood.tga", bytes_of("\x01\x02")}}));
}

// A square of two materials, A and B, behind LIBRARIES.
std::string two_materials(const std::string& libraries) {
    return libraries + "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
}

glm::vec4 color_of(const scene& scene, const std::string& name) {
    for (const voxelize::material& entry : scene.materials)
        if (entry.name == name) return entry.base_color;
    ADD_FAILURE() << "no material " << name;
    return {};
}

TEST(Obj, SeveralLibrariesAreRead) {
    const glm::vec4 red(1, 0, 0, 1), green(0, 1, 0, 1);
    const files others{{"red.mtl", bytes_of("newmtl a\nKd 1 0 0")},
                       {"my greens.MTL", bytes_of("newmtl b\nKd 0 1 0\n")},
                       {"plain", bytes_of("newmtl b\nKd 0 1 0\n")}};
    for (const char* const libraries : {"mtllib red.mtl my greens.MTL\n", "mtllib my greens.MTL  red.mtl\r\n",
                                        "mtllib red.mtl\nmtllib my greens.MTL\n", "mtllib red.mtl\nmtllib plain\n"}) {
        const scene scene = load("m.obj", two_materials(libraries), others);
        EXPECT_EQ("", text_of(scene.warnings)) << libraries;
        EXPECT_EQ(red, color_of(scene, "a")) << libraries;
        EXPECT_EQ(green, color_of(scene, "b")) << libraries;
    }
}

TEST(Obj, AMessageNamesTheLibraryThatCannotBeRead) {
    const auto warnings = [](const std::string& libraries, const files& others) {
        return text_of(load("m.obj", two_materials(libraries), others).warnings);
    };
    const std::vector<std::byte> a = bytes_of("newmtl a\nKd 1 0 0\n");
    const std::string start = "the material library ";
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: surfaces of its materials are white\n",
              warnings("mtllib red.mtl gone.mtl\n", {{"red.mtl", a}}));
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: surfaces of its materials are white\n",
              warnings("mtllib gone.mtl\nmtllib red.mtl\n", {{"red.mtl", a}}));
    EXPECT_EQ(start + "\"one.mtl\" cannot be read: surfaces are white\n" + start +
                  "\"two.mtl\" cannot be read: surfaces are white\n",
              warnings("mtllib one.mtl two.mtl\n", {}));
    EXPECT_EQ(start + "\"m.mtl\" cannot be read: surfaces are white\n", warnings("mtllib m.mtl\n", {}));
    // assimp's choice where nothing that is named is there.
    EXPECT_EQ(start + "\"gone.mtl\" cannot be read: \"m.mtl\" is read in its place\n",
              warnings("mtllib gone.mtl\n", {{"m.mtl", a}}));
    const scene scene = load("m.obj", two_materials("mtllib red.mtl gone.mtl\n"), {{"red.mtl", a}});
    EXPECT_EQ(glm::vec4(1, 0, 0, 1), color_of(scene, "a"));
    EXPECT_EQ(glm::vec4(1), color_of(scene, "b"));
}

TEST(Obj, FilesOutsideTheFolderAreNotRead) {
    std::vector<std::string> asked;
    const auto reader = [&](const std::filesystem::path& path, std::uint64_t) -> std::vector<std::byte> {
        EXPECT_TRUE(path.is_relative()) << path;
        EXPECT_NE("..", path.begin()->string()) << path;
        throw voxelize::gltf_error("no such file");
    };
    for (const char* library : {"../../secret.mtl", "/etc/passwd", "C:\\secret.mtl", "a/../../../b.mtl"}) {
        const std::string text = "mtllib " + std::string(library) + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        EXPECT_EQ(1U, voxelize::load_by_assimp(bytes_of(text), "m.obj", reader).triangle_count());
    }
}

TEST(Obj, Utf16IsNamed) {
    std::vector<std::byte> bytes{std::byte{0xFE}, std::byte{0xFF}};
    for (const char c : std::string_view("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
        bytes.insert(bytes.end(), {std::byte{0}, static_cast<std::byte>(c)});
    EXPECT_EQ("assimp: the file is text in UTF-16, not UTF-8", error_of("wide.obj", bytes));
}

// assimp by itself drops it in files of more than 16 MiB, which it reads in blocks.
TEST(Obj, TheLastLineNeedsNoEnd) {
    const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", last = "f 3 2 1";
    std::string comments;
    for (int i = 0; i < 17; ++i) comments += "# " + std::string((1 << 20) - 3, ' ') + '\n';
    EXPECT_EQ(2U, load("short.obj", text + last).triangle_count());
    EXPECT_EQ(2U, load("long.obj", text + comments + last).triangle_count());
    EXPECT_EQ(2U, load("long.obj", text + comments + last + '\n').triangle_count());
}

TEST(Obj, LinesAndPointsComeBesideTriangles) {
    const scene scene = load("mixed.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\nf 1 2 3\np 2\n");
    EXPECT_EQ(1U, scene.triangle_count());
    EXPECT_EQ(3U, scene.line_count());
    EXPECT_EQ("", text_of(scene.warnings));
    for (const voxelize::primitive& part : scene.primitives) EXPECT_TRUE(part.triangles.empty() || part.lines.empty());
}

// ---- Files that are wrong
// --------------------------------------------------------------------------------------------

struct sample {
    const char* name;
    std::vector<std::byte> bytes;
};

std::vector<sample> samples() { return {{"square.obj", bytes_of(square_obj)}}; }

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

TEST(AssimpMalformed, IndicesThatPointNowhereAreRefused) {
    EXPECT_NE("no error", error_of("m.obj", bytes_of("v 0 0 0\nv 1 0 0\nf 1 2 9\n")));
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
    EXPECT_TRUE(voxelize::is_for_assimp(".obj"));
    for (const char* own : {".stl", ".ply", ".off"}) EXPECT_FALSE(voxelize::is_for_assimp(own)) << own;
    EXPECT_FALSE(voxelize::is_for_assimp(".glb"));
    EXPECT_FALSE(voxelize::is_for_assimp(".gltf"));
    EXPECT_FALSE(voxelize::is_for_assimp(".txt"));
    EXPECT_FALSE(voxelize::is_for_assimp(""));
}

} // namespace
