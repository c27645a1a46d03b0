// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// OBJ files block by block: what comes of them is what assimp makes of the whole file, bit by bit, or they are refused
// with a reason.
#include "two_ways.hpp"

#if VOXELPIPE_TOOL_HAS_ASSIMP
#include <read/assimp/obj_text.hpp>
#include <read/assimp_scene.hpp>
#include <read/obj_file.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

using namespace tool_test;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// SIDE x SIDE texels.
void write_picture(const fs::path& file, std::uint32_t side) {
    std::vector<std::uint8_t> texels;
    for (std::uint32_t i = 0; i < 4 * side * side; ++i) texels.push_back(static_cast<std::uint8_t>(50 * side + 9 * i));
    const std::vector<std::byte> bytes = gltf_test::png(side, side, texels);
    write(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// The bits of all values, so that NaN is equal to itself and 0 is not -0.
template <class T>
std::string bits_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// One call for each corner of a triangle and its values.
struct flat_model {
    std::vector<std::string> names;
    std::vector<std::uint64_t> materials, triangles; // by part
    std::vector<glm::vec3> positions;
    std::vector<glm::vec4> colors;
    std::vector<glm::vec2> texcoords;
};

flat_model flat(const voxelize::scene& whole) {
    flat_model model;
    for (const voxelize::instance& one : whole.instances) {
        const voxelize::primitive& part = whole.primitives[one.primitive];
        if (part.triangles.empty()) continue;
        model.names.push_back(part.name);
        model.materials.push_back(part.material);
        model.triangles.push_back(part.triangles.size());
        for (const glm::uvec3& t : part.triangles)
            for (const std::uint32_t v : {t.x, t.y, t.z}) {
                model.positions.push_back(part.positions[v]);
                if (!part.colors.empty()) model.colors.push_back(part.colors[v]);
                model.texcoords.push_back(part.texcoords.empty() ? glm::vec2(-7) : part.texcoords[v]);
            }
    }
    return model;
}

flat_model flat(voxelize::obj_file& stream) {
    flat_model model;
    std::uint64_t next = 0;
    for (const auto& part : stream.parts()) {
        EXPECT_EQ(next, part.first_number);
        next += part.num_triangles;
        model.names.push_back(part.name);
        model.materials.push_back(part.material);
        model.triangles.push_back(part.num_triangles);
    }
    next = 0;
    stream.for_each_block([&](const voxelize::triangle_stream::block& block) {
        EXPECT_EQ(next, block.first_number);
        EXPECT_LE(stream.parts()[block.part].first_number, next);
        next += block.corners.size() / 3;
        EXPECT_GE(stream.parts()[block.part].first_number + stream.parts()[block.part].num_triangles, next);
        model.positions.insert(model.positions.end(), block.corners.begin(), block.corners.end());
        model.colors.insert(model.colors.end(), block.colors.begin(), block.colors.end());
        if (!stream.parts()[block.part].has_texcoords)
            model.texcoords.resize(model.texcoords.size() + block.corners.size(), glm::vec2(-7));
        model.texcoords.insert(model.texcoords.end(), block.texcoords.begin(), block.texcoords.end());
    });
    EXPECT_EQ(next, stream.num_triangles());
    return model;
}

// How a material's texture is sampled, and its picture.
std::string texture_of(const voxelize::material& shown, const std::vector<voxelize::texture>& textures,
                       const std::vector<voxelize::picture>& images) {
    if (shown.texture == voxelize::material::no_texture) return "none";
    const voxelize::texture& t = textures[static_cast<std::size_t>(shown.texture)];
    const voxelize::picture& p = images[t.image];
    return p.name + ' ' + std::to_string(p.width) + 'x' + std::to_string(p.height) + ' ' +
           std::to_string(static_cast<int>(t.wrap_s)) + ' ' + std::to_string(static_cast<int>(t.wrap_t)) + ' ' +
           std::to_string(static_cast<int>(t.filter)) + ' ' + std::string(p.rgba.begin(), p.rgba.end());
}

// COLORS: as a run that shows them asks for.
void expect_same(const fs::path& file, const fs::path& folder, bool colors = true) {
    SCOPED_TRACE(file);
    voxelize::gltf_options options;
    options.colors = colors;
    voxelize::obj_file stream(file, 1 << 20, folder, {}, options);
    stream.read_textures({});
    const voxelize::scene whole = voxelize::load_by_assimp(file, {}, options);
    const flat_model a = flat(whole), b = flat(stream);
    EXPECT_EQ(a.names, b.names);
    EXPECT_EQ(a.materials, b.materials);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_TRUE(bits_of(a.positions) == bits_of(b.positions));
    EXPECT_TRUE(!colors || bits_of(a.colors) == bits_of(b.colors));
    EXPECT_TRUE(bits_of(a.texcoords) == bits_of(b.texcoords));
    EXPECT_EQ(whole.vertex_count(), stream.num_vertices());
    ASSERT_EQ(whole.materials.size(), stream.materials().size());
    for (std::size_t i = 0; i < whole.materials.size(); ++i) {
        const voxelize::material &m = whole.materials[i], &n = stream.materials()[i];
        EXPECT_EQ(m.name, n.name);
        EXPECT_EQ(m.base_color, n.base_color) << m.name;
        EXPECT_EQ(m.alpha, n.alpha) << m.name;
        EXPECT_EQ(m.double_sided, n.double_sided) << m.name;
        EXPECT_EQ(texture_of(m, whole.textures, whole.images), texture_of(n, stream.textures(), stream.images()))
            << m.name;
    }
}

// A number, in one of the ways in which programs write it.
std::string number(std::mt19937& random) {
    const auto pick = [&](unsigned n) { return random() % n; };
    const double value = (static_cast<double>(random()) / 4294967295.0 - 0.5) * std::pow(10.0, pick(5));
    static const std::vector<std::string> odd{"0",
                                              "-0",
                                              "1.",
                                              "+2.5",
                                              "3e2",
                                              "-4E-3",
                                              "1e39",
                                              "00.5",
                                              "7.00000000001",
                                              "0.1234567890123456789012",
                                              "-123456789.987654321",
                                              "16777217.5",
                                              "1e-46"};
    if (pick(12) == 0) return odd[pick(static_cast<unsigned>(odd.size()))];
    static const char* const forms[] = {"%.6f", "%g", "%.9g", "%.17g", "%e", "%.3E", "%.0f", "%+.5f"};
    char text[64];
    std::snprintf(text, sizeof(text), forms[pick(8)], value);
    return text;
}

// Objects, groups and materials that come again, polygons of all kinds, indices of all forms.
std::string random_obj(unsigned seed) {
    std::mt19937 random(seed);
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const std::string end = pick(2) == 0 ? "\n" : "\r\n";
    const bool has_colors = pick(2) == 0, is_later = pick(3) == 0;
    std::string text = "# a test" + end, later;
    if (pick(3) != 0) text += "mtllib m.mtl" + end;
    int vertices = 0;
    const auto add_vertices = [&](int count, std::string& to) {
        for (int i = 0; i < count; ++i, ++vertices) {
            to += pick(9) == 0 ? "v  " : "v ";
            for (int k = 0; k < 3; ++k) to += number(random) + (k < 2 ? (pick(9) == 0 ? "\t" : " ") : "");
            if (has_colors)
                for (int k = 0; k < 3; ++k) to += " 0." + std::to_string(pick(1000));
            else if (pick(5) == 0)
                to += " " + std::to_string(1 + pick(7)) + ".5";
            to += end;
        }
    };
    add_vertices(30, text);
    const bool normals_first = pick(3) == 0;
    for (int i = 0; i < 5; ++i) {
        if (!normals_first || i > 2) text += "vt 0." + std::to_string(i) + " " + number(random) + end;
        text += "vn 0 0 1" + end;
    }
    for (int n = 0; n < 60; ++n) {
        const int what = pick(12);
        const std::string name(1, static_cast<char>('a' + pick(4)));
        if (what == 0) text += "g " + name + (pick(3) == 0 ? " x y" : "") + end;
        if (what == 1) text += "o " + name + end;
        if (what == 2 || what == 3) text += "usemtl " + name + end;
        if (what == 4) text += "s " + std::to_string(pick(3)) + end;
        if (what == 5) text += "# f 1 2 3" + end + end;
        if (what == 6) add_vertices(3, text);
        if (what == 7) text += pick(2) == 0 ? "g" + end : "usemtl" + end;
        if (what == 6) text += "vt " + number(random) + "  " + number(random) + (pick(3) == 0 ? " 0.5" : "") + end;
        if (what < 8) continue;
        const int corners = pick(2) == 0 ? 3 : 3 + pick(7), form = pick(5), first = pick(vertices);
        // Some polygons go round an axis and are simple; others cross themselves or name a vertex twice.
        const bool is_round = pick(3) != 0;
        if (is_round)
            for (int c = 0; c < corners; ++c, ++vertices) {
                char line[96];
                const double angle = 6.28 * c / corners, radius = pick(3) == 0 ? 0.4 : 1.5;
                std::snprintf(line, sizeof(line), "v %.6f %.6f %.6f", radius * std::cos(angle),
                              radius * std::sin(angle), 0.1 * pick(3) + n);
                text += line + std::string(has_colors ? " 0.1 0.5 1.5" : "") + end;
            }
        text += "f";
        for (int c = 0; c < corners; ++c) {
            const int v = is_round ? vertices - corners + c : (first + c * (1 + pick(3))) % vertices;
            text += (pick(9) == 0 ? "  " : " ") + std::to_string(pick(2) == 0 ? v + 1 : v - vertices);
            if (form == 1) text += "/" + std::to_string(1 + pick(5));
            if (form == 2) text += "//" + std::to_string(1 + pick(5));
            if (form == 3) text += "/" + std::to_string(-1 - pick(2)) + "/" + std::to_string(1 + pick(5));
            if (form == 4 && pick(2) == 0) text += "/" + std::to_string(pick(40) == 0 ? 99 : 1 + pick(2));
        }
        text += end;
    }
    if (is_later) { // behind the faces that name them
        text += "f 1 " + std::to_string(vertices + 1) + " " + std::to_string(vertices + 2) + end;
        add_vertices(2, text);
    }
    return text + "f 1 2 3" + end;
}

TEST(ObjFile, TrianglesAndMaterialsAreThoseOfTheWholeFile) {
    const scratch_folder folder;
    write(folder / "m.mtl", "newmtl a\nKd 0.2 0.5 1\nmap_Kd -s 2 3 1 -o 0.1 0.2 0.3 -blendu off one.png\n"
                            "newmtl b\nKd 1 0 0\nd 0.5\nmap_Kd -clamp on two.png\nnewmtl c\nTr 0.25\nKd 0.1 0.1 0.1\n"
                            "newmtl d\nKd 0 0 0\nmap_Kd one.png\nmap_Bump none.png\nmap_d none.png\n");
    write_picture(folder / "one.png", 2);
    write_picture(folder / "two.png", 3);
    const int count = sanitized ? 4 : 60;
    int refused = 0; // since a part has nothing but polygons without area
    for (int seed = 1; seed <= count && !testing::Test::HasFailure(); ++seed) {
        const std::string text = random_obj(static_cast<unsigned>(seed));
        write(folder / "m.obj", text);
        SCOPED_TRACE(text);
        try {
            expect_same(folder / "m.obj", folder.path());
        } catch (const voxelize::assimp::obj_refusal& refusal) {
            EXPECT_NE(std::string::npos, std::string(refusal.what()).find("has an area")) << refusal.what();
            ++refused;
        }
    }
    EXPECT_GE(count / 10, refused);
    EXPECT_EQ(4, std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()))
        << "m.obj, m.mtl, one.png, two.png";
}

// More faces than are cut, read or kept at once.
TEST(ObjFile, ManyFaces) {
    const scratch_folder folder;
    constexpr int side = 150;
    std::string text;
    for (int y = 0; y <= side; ++y)
        for (int x = 0; x <= side; ++x)
            text +=
                "v " + std::to_string(x) + ' ' + std::to_string(y) + ' ' + std::to_string(std::sin(0.1 * x * y)) + '\n';
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const int a = y * (side + 1) + x + 1, b = a + side + 1;
            if (x == 0 && y % 40 == 0) text += "g " + std::to_string(y % 3) + '\n';
            text += "f " + std::to_string(a) + ' ' + std::to_string(a + 1) + ' ' + std::to_string(b + 1) + ' ' +
                    std::to_string(b) + '\n';
        }
    write(folder / "m.obj", text);
    expect_same(folder / "m.obj", folder.path());
}

TEST(ObjFile, TheLastLineNeedsNoEnd) {
    const scratch_folder folder;
    const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", last = "f 3 2 1";
    std::string comments;
    for (int i = 0; i < 17; ++i) comments += "# " + std::string((1 << 20) - 3, ' ') + '\n';
    for (const std::string& between : {std::string(), comments}) {
        write(folder / "m.obj", text + between + last);
        expect_same(folder / "m.obj", folder.path());
    }
}

TEST(ObjFile, TexturesMatterOnlyWhereColoursDo) {
    const scratch_folder folder;
    write(folder / "m.mtl", "newmtl a\nKd 0 0 0\nmap_Kd none.png\nd 0.5\nnewmtl b\nmap_Kd one.png\nnewmtl c\n");
    write_picture(folder / "one.png", 4);
    write(folder / "m.obj",
          "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1e39 -1e39 7\nusemtl a\nf 1/1 2/1 3/1\n"
          "usemtl b\nf 1/1 2/2 3/1\nusemtl c\nf 1/2 3/2 2/1\n");
    expect_same(folder / "m.obj", folder.path(), true);
    expect_same(folder / "m.obj", folder.path(), false);
    voxelize::gltf_options options;
    const auto textures = [&] {
        voxelize::obj_file stream(folder / "m.obj", 1 << 20, folder.path(), {}, options);
        stream.read_textures({});
        return std::pair{stream.textures().size(), stream.warnings().size()};
    };
    EXPECT_EQ(std::pair(std::size_t{1}, std::size_t{1}), textures()) << "none.png is not there";
    options.colors = false;
    EXPECT_EQ(std::pair(std::size_t{0}, std::size_t{0}), textures());
    options.blend_cuts = true;
    EXPECT_EQ(std::pair(std::size_t{0}, std::size_t{1}), textures()) << "a is a mask then";
    // Without its library a material is white, and there is a warning.
    fs::remove(folder / "m.mtl");
    expect_same(folder / "m.obj", folder.path());
    EXPECT_EQ(1U, voxelize::obj_file(folder / "m.obj", 1 << 20, folder.path(), {}, {}).warnings().size());
}

TEST(ObjFile, WhatIsNotStreamedIsNamed) {
    const scratch_folder folder;
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const auto why = [&](const std::string& text) -> std::string {
        write(folder / "m.obj", text);
        try {
            const voxelize::obj_file stream(folder / "m.obj", 1 << 20, folder.path(), {}, {});
            return "nothing";
        } catch (const voxelize::assimp::obj_refusal& refusal) {
            return refusal.what();
        } catch (const voxelize::model_error& error) {
            return std::string("damaged: ") + error.what();
        }
    };
    EXPECT_EQ("nothing", why(vertices + "f 1 2 3\n"));
    const std::pair<std::string, std::string> cases[] = {
        {"l 1 2\nf 1 2 3\n", "line 4: lines and points"},
        {"p 1\nf 1 2 3\n", "lines and points"},
        {"vp 1 2\nf 1 2 3\n", "line 4: \"vp\" is not streamed"},
        {"curv2 1 2\nf 1 2 3\n", "\"curv2\""},
        {"", "vertices without faces"},
        {"f 1 2\n", "fewer than three"},
        {"f 1 2 \\\n3\n", "line 4: continued"},
        {" f 1 2 3\n", "blanks before"},
        {"f 1 2 3 # a face\n", "no index"},
        {"f 1 2 0\n", "no index"},
        {"f 1 2 03\n", "no index"},
        {"f 1/1/1/1 2 3\n", "no index"},
        {"f 1 2 3000000000\n", "too large"},
        {"f 1 2 4\n", "damaged: an index is out of range"},
        {"f 1 2 -4\n", "damaged: an index is out of range"},
        {"v 1 2\nf 1 2 3\n", "line 4: a vertex has 2 numbers"},
        {"v 1 2 3 4 5\nf 1 2 3\n", "a vertex has 5 numbers"},
        {"v 1 2 x\nf 1 2 3\n", "no number"},
        {"v 1 2 3e\nf 1 2 3\n", "no number"},
        {"v 1 2 .5\nf 1 2 3\n", "no number"},
        {"v 1 2 3 0\nf 1 2 3\n", "weight 0"},
        {"vn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n", "line 5: a face names texture coordinates before the first"},
        {"v 1 2 3 1 1 1\nf 1 2 3\n", "some vertices have colours"},
        {"f 1 2 3\rf 1 2 3\n", "line end within"},
        {std::string("# \0\nf 1 2 3\n", 12), "ends a line for assimp"},
        {"f 1 2 3" + std::string(1 << 20, ' ') + "\n", "megabyte"},
    };
    for (const auto& [text, part] : cases) {
        const std::string found = why(vertices + text);
        EXPECT_NE(std::string::npos, found.find(part)) << text.substr(0, 40) << ": " << found;
    }
}

// The models of Debian's package assimp-testmodels, where it is installed.
TEST(ObjFile, ModelsAreEqualOrRefused) {
    const fs::path models = "/usr/share/assimp/models/OBJ";
    if (!fs::is_directory(models)) GTEST_SKIP() << "no " << models;
    const scratch_folder folder;
    int equal = 0;
    for (const auto& entry : fs::directory_iterator(models)) {
        if (entry.path().extension() != ".obj") continue;
        try {
            expect_same(entry.path(), folder.path(), false);
            ++equal;
        } catch (const voxelize::assimp::obj_refusal& refusal) {
            std::cout << entry.path().filename() << ": " << refusal.what() << '\n';
        } catch (const voxelize::model_error& error) { // the whole file cannot be read either
            EXPECT_THROW((void)voxelize::load_by_assimp(entry.path()), voxelize::model_error) << entry.path();
        }
    }
    EXPECT_GE(equal, 12);
}

} // namespace
#endif
