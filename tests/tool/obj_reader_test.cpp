// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The text of OBJ files as programs and people write it: the same cube in every layout, loaded and streamed alike, and
// what is wrong with a file is told by its line.
#include "obj_files.hpp"

#include "../test_scale.hpp"

#include <cmath>
#include <cstdio>
#include <random>

namespace {

using obj_test::expect_same;
using obj_test::files;
using obj_test::joined;

const std::string cube_vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n";
const std::string cube_faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

double area_of(const voxelize::scene& scene) {
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

TEST(ObjReader, EveryLayoutIsTheSameCube) {
    const std::string cube = cube_vertices + cube_faces;
    const std::vector<std::pair<std::string, std::string>> layouts{
        {"plain", cube},
        {"CR LF", replaced(cube, "\n", "\r\n")},
        {"CR", replaced(cube, "\n", "\r")},
        {"empty lines", replaced(cube, "\n", "\n\r\n \t\n")},
        {"byte order mark", "\xEF\xBB\xBF" + cube},
        {"byte order mark and vertices no face names", "\xEF\xBB\xBF" + cube_vertices + "v 5 5 5\n" + cube_faces},
        {"no last line end", cube.substr(0, cube.size() - 1)},
        {"leading blanks", replaced("\n" + cube, "\n", "\n \t ")},
        {"trailing blanks", replaced(cube, "\n", " \t \n")},
        {"tabs", replaced(cube, " ", "\t")},
        {"many blanks", replaced(cube, " ", "  \t ")},
        {"comments", replaced("\n" + cube, "\n", " # v 1 2 3 \\\n")},
        {"comments without a blank", cube_vertices + replaced(cube_faces, "\n", "#7\n")},
        {"comment lines", replaced(cube, "\n", "\n#f 1 2 3\n  # C:\\models\\\n")},
        {"continued lines", replaced(cube, " ", " \\\n ")},
        {"continued lines, CR LF and blanks", replaced(cube, " ", " \\ \r\n\t")},
        {"upper case", replaced(replaced(cube, "v ", "V "), "f ", "F ")},
        {"fo", replaced(cube, "f ", "fo ")},
        {"signs", replaced(cube, " 1 ", " +1 ")},
        {"exponents", replaced(cube_vertices, "1", "1.0e+0") + cube_faces},
        {"trailing dots", replaced(cube_vertices, "1", "1.") + cube_faces},
        {"many digits", replaced(cube_vertices, "1", "1.000000000000000000000000000000") + cube_faces},
        {"leading zeros", cube_vertices + replaced(cube_faces, " ", " 0")},
        {"weights", replaced(cube_vertices, "\n", " 2.0\n") + cube_faces},
        {"weights of 0", replaced(cube_vertices, "\n", " 0\n") + cube_faces},
        {"colours", replaced(cube_vertices, "\n", " 0.5 .25 1\n") + cube_faces},
        {"colours and alpha", replaced(cube_vertices, "\n", " 0.5 .25 1 .5\n") + cube_faces},
        {"parm", cube_vertices + "parm u 0 1\nlod 3\nbevel on\ns off\nmg 1 2\nctech cparm 1\n" + cube_faces},
        {"f 1//2", cube_vertices + "vn 0 0 1\n" +
                       "f 1//1 3//1 4//1 2//1\nf 5//1 6//1 8//1 7//1\nf 1//1 2//1 6//1 5//1\n"
                       "f 3//1 7//1 8//1 4//1\nf 1//1 5//1 7//1 3//1\nf 2//1 4//1 8//1 6//1\n"},
        {"f 1/ and 1//", cube_vertices + "f 1/ 3/ 4/ 2/\nf 5// 6// 8// 7//\n" + cube_faces.substr(20)},
        {"texture coordinates that are not there",
         cube_vertices + "f 1/9/9 3/9/9 4/9/9 2/9/9\nf 5/-9 6/-9 8/-9 7/-9\n" + cube_faces.substr(20)},
        {"negative indices", cube_vertices + "f -8 -6 -5 -7\nf -4 -3 -1 -2\n" + cube_faces.substr(20)},
        {"faces before their vertices", cube_faces + cube_vertices},
        {"groups",
         cube_vertices + replaced("\n" + cube_faces, "\nf", "\ng a b\no part 7\nusemtl blue paint\nf").substr(1)},
        {"no line feed at all", replaced("\xEF\xBB\xBF#\r" + cube, "\n", "\r")},
    };
    for (const auto& [name, text] : layouts) {
        SCOPED_TRACE(name);
        const files model(text);
        const voxelize::scene scene = model.load();
        EXPECT_EQ(12U, scene.triangle_count());
        EXPECT_DOUBLE_EQ(6, area_of(scene));
        EXPECT_EQ(0U, scene.line_count());
        EXPECT_EQ("", joined(scene.warnings));
        expect_same(model);
    }
}

TEST(ObjReader, NumbersAreReadAsTheyStand) {
    const voxelize::scene scene = files("v .5 -.5 +.5\nv 1e3 -2E-1 3.\nv 0 0x -0\nf 1 2 3\n").load([] {
        voxelize::load_options options;
        options.gltf.lenient = true;
        return options;
    }());
    const voxelize::primitive& part = scene.primitives.at(0);
    EXPECT_EQ(glm::vec3(0.5F, -0.5F, 0.5F), part.positions.at(0));
    EXPECT_EQ(glm::vec3(1000, -0.2F, 3), part.positions.at(1));
    EXPECT_TRUE(std::isnan(part.positions.at(2).y));
    EXPECT_EQ("line 3: 'v 0 0x -0' has a coordinate that is no number; 2 of the file's 3 vertices can be read\n"
              "1 vertices at positions that are not finite: their triangles will be dropped\n",
              joined(scene.warnings));
}

TEST(ObjReader, VerticesAreAsSharpFarAwayAsAtTheOrigin) {
    const auto text = [](double x, double y, double z) {
        std::string all;
        for (const auto& [dx, dy] : {std::pair{0.05, 0.0625}, {0.17, 1.0625}, {1.013, 0.5}}) {
            char line[120];
            std::snprintf(line, sizeof(line), "v %.6f %.6f %.6f\n", x + dx, y + dy, z + 0.03125);
            all += line;
        }
        return all + "f 1 2 3\n";
    };
    const voxelize::scene near = files(text(0, 0, 0)).load(), far = files(text(431234, 4649776, 100)).load();
    expect_same(files(text(431234, 4649776, 100)));
    for (std::size_t v = 0; v < 3; ++v) {
        const glm::dvec3 p = near.instances.at(0).to_world(near.primitives.at(0).positions.at(v));
        const glm::dvec3 q = far.instances.at(0).to_world(far.primitives.at(0).positions.at(v));
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(p[axis], q[axis] - glm::dvec3(431234, 4649776, 100)[axis], 2e-7);
    }
}

TEST(ObjReader, VertexColoursAreFractionsOrBytes) {
    const auto colors = [](const std::string& first) {
        const voxelize::scene scene = files("v 0 0 0" + first + "\nv 1 0 0 1 0 0\nv 0 1 0\nf 1 2 3\n").load();
        return scene.primitives.at(0).colors;
    };
    EXPECT_EQ((std::vector<glm::vec4>{{0, 1, 0, 1}, {1, 0, 0, 1}, {1, 1, 1, 1}}), colors(" 0 1 0"));
    EXPECT_EQ(glm::vec4(0, 1, 0, 0.5F), colors(" 0 1 0 .5").at(0));
    EXPECT_EQ(glm::vec4(0, 1, 0, 1), colors(" 0 255 0").at(0));
    EXPECT_EQ(glm::vec4(0, 1, 0, 1), colors(" 0 255 0 255").at(0));
    EXPECT_EQ(glm::vec4(0, 1, 0, 1), colors(" -1 1.5 0").at(0)) << "beyond what a screen shows";
    expect_same(files("v 0 0 0\nv 1 0 0 .1 .2 .3\nv 0 1 0\nf 1 2 3\n"));
}

TEST(ObjReader, LinesAndPointsComeBesideTriangles) {
    const files model("o body\nv 0 0 0\nv 1 0 0\nv 0 1 0\nl 1/1 2/1\nl 2 3 1\nf 1 2 3\ng dots\np 2 3\n");
    const voxelize::scene scene = model.load();
    EXPECT_EQ(1U, scene.triangle_count());
    EXPECT_EQ(5U, scene.line_count());
    EXPECT_EQ("", joined(scene.warnings));
    for (const voxelize::primitive& part : scene.primitives) EXPECT_TRUE(part.triangles.empty() || part.lines.empty());
    const voxelize::opened_stream opened = model.stream();
    EXPECT_FALSE(opened.stream);
    EXPECT_NE(std::string::npos, opened.refusal.find("lines or points, which are not streamed")) << opened.refusal;
}

TEST(ObjReader, VerticesAreThePointsOfAFileOfVerticesAlone) {
    const std::string vertices = "v 0 0 0\nv 1 1 1\n";
    for (const std::string before : {"", "o cloud\n", "g a\no b\nusemtl c\n", "# points\n\n"})
        EXPECT_EQ(2U, files(before + vertices).load().line_count()) << before;
    EXPECT_EQ(1U, files(vertices + "p 2\n").load().line_count());
    EXPECT_EQ(0U, files(vertices + "v 0 1 0\nf 1 2 3\n").load().line_count());
}

TEST(ObjReader, FreeFormGeometryAndOtherKeywordsAreNamed) {
    const std::string surface = "cstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nend\n";
    EXPECT_EQ("line 17: 'surf 0 1 0 1 1 2 3 4' is a free-form surface, which is not drawn: export it as polygons\n",
              joined(files(cube_vertices + cube_faces + surface).load().warnings));
    EXPECT_EQ("line 15: 'curv 0 1 1 2' is a free-form curve, which is not drawn: export it as a line (and 1 more)\n",
              joined(files(cube_vertices + cube_faces + "curv 0 1 1 2\ncurv 0 1 2 3\n").load().warnings));
    EXPECT_EQ("line 15: 'frob 1' is not known and passed over\n",
              joined(files(cube_vertices + cube_faces + "frob 1\n").load().warnings));
    expect_same(files(cube_vertices + cube_faces + surface + "frob\nfrob\n"));
}

TEST(ObjReader, WhatIsWrongIsToldByItsLine) {
    voxelize::load_options lenient;
    lenient.gltf.lenient = true;
    const std::string most = "; the file has 7 lines 'f', and 6 of them can be read";
    const std::pair<std::string, std::string> faces[] = {
        {"f 1//x 2 3", "line 15: 'f 1//x 2 3' has an invalid vertex index"},
        {"f 1 2 x", "line 15: 'f 1 2 x' has an invalid vertex index"},
        {"f 1 2 0", "line 15: 'f 1 2 0' has an invalid vertex index"},
        {"f 1 2 3.5", "line 15: 'f 1 2 3.5' has an invalid vertex index"},
        {"f 1/1/1/1 2 3", "line 15: 'f 1/1/1/1 2 3' has an invalid vertex index"},
        {"f 1 2 9", "line 15: 'f 1 2 9' has an invalid vertex index: there are 8 vertices"},
        {"f 1 2 -9", "line 15: 'f 1 2 -9' has an invalid vertex index: there are 8 vertices"},
        {"f 1 2 99999999999999999999", "line 15: 'f 1 2 99999999999999999999' has an invalid vertex index"},
        {"f 1 2", "line 15: 'f 1 2' names 2 vertices, and a face has 3 or more"},
        {"f", "line 15: 'f' names 0 vertices, and a face has 3 or more"},
        {"f 1 \\\n x 2", "line 15: 'f 1   x 2' has an invalid vertex index"},
        {"\tf 1 2 \x01", "line 15: 'f 1 2 ?' has an invalid vertex index"},
    };
    for (const auto& [line, what] : faces) {
        const files model(cube_vertices + cube_faces + line + "\n");
        EXPECT_EQ(what + most, model.error());
        const voxelize::scene scene = model.load(lenient);
        EXPECT_EQ(12U, scene.triangle_count());
        EXPECT_EQ(what + most + '\n', joined(scene.warnings));
        expect_same(model, lenient);
    }
    const std::pair<std::string, std::string> others[] = {
        {"v 1 2\n" + cube_vertices + cube_faces,
         "line 1: 'v 1 2' has 2 numbers, and a vertex has 3 or more; 8 of the file's 9 vertices can be read"},
        {"v 1 x 2\n" + cube_vertices,
         "line 1: 'v 1 x 2' has a coordinate that is no number; 8 of the file's 9 vertices can be read"},
        {cube_vertices + "l 1 99\nf 1 2 3\np 0\n", "line 9: 'l 1 99' has an invalid vertex index: there are 8 "
                                                   "vertices; the file has 3 lines 'f', 'l' and 'p', and "
                                                   "1 of them can be read"},
        {"# nothing\n", "there is no vertex (a line that begins with 'v'): it is no OBJ file"},
        {"", "the file is empty"},
        {std::string("\xFE\xFF\0v\0 ", 6), "the file is text in UTF-16, not UTF-8"},
        {std::string("\xFF\xFEv\0 \0", 6), "the file is text in UTF-16, not UTF-8"},
    };
    for (const auto& [text, what] : others) EXPECT_EQ(what, files(text).error());
}

TEST(ObjReader, LongLinesAreReadAndBounded) {
    std::string text = cube_vertices + cube_faces + "f";
    for (int i = 0; i < 200000; ++i) text += " 1 2 3";
    const voxelize::scene scene = files(text + '\n').load();
    EXPECT_EQ(12U + 600000U - 2U, scene.triangle_count());
    if (gltf_test::is_slow_build()) return;
    EXPECT_EQ("line 2 has more than 64 MiB: the file is no text", files("#\n" + std::string(65U << 20, 'v')).error());
}

// More faces than are cut, read or kept at once.
TEST(ObjReader, ManyFacesAreStreamedAsLoaded) {
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
    expect_same(files(text));
}

TEST(ObjReader, PartsAreObjectsGroupsAndMaterialsInTheOrderOfTheFirstFace) {
    const voxelize::scene scene = files(cube_vertices + "o a\nusemtl x\nf 1 2 3\nusemtl y\nf 1 2 4\nf 2 3 4\nusemtl x\n"
                                                        "f 1 2 5\no b\nf 1 2 6\no a\nf 1 2 7\ng lid\nf 1 2 8\n")
                                      .load();
    std::vector<std::pair<std::string, std::size_t>> parts;
    for (const voxelize::primitive& part : scene.primitives)
        parts.emplace_back(part.name + ' ' + scene.materials.at(part.material).name, part.triangles.size());
    EXPECT_EQ((std::vector<std::pair<std::string, std::size_t>>{{"a x", 3}, {"a y", 2}, {"b x", 1}, {"lid x", 1}}),
              parts);
}

// A number, in one of the ways in which programs write it.
std::string number(std::mt19937& random) {
    const auto pick = [&](unsigned n) { return random() % n; };
    const double value = (static_cast<double>(random()) / 4294967295.0 - 0.5) * std::pow(10.0, pick(5));
    static const std::vector<std::string> odd{"0",
                                              "-0",
                                              "1.",
                                              "+2.5",
                                              ".5",
                                              "-.25",
                                              "3e2",
                                              "-4E-3",
                                              "1e39",
                                              "00.5",
                                              "7.00000000001",
                                              "-123456789.987654321",
                                              "1e-46"};
    if (pick(12) == 0) return odd[pick(static_cast<unsigned>(odd.size()))];
    static const char* const forms[] = {"%.6f", "%g", "%.9g", "%.17g", "%e", "%.3E", "%.0f", "%+.5f"};
    char text[64];
    std::snprintf(text, sizeof(text), forms[pick(8)], value);
    return text;
}

// Objects, groups and materials that come again, polygons of all kinds, indices of all forms, every layout of lines.
std::string random_obj(unsigned seed) {
    std::mt19937 random(seed);
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const bool has_colors = pick(2) == 0, is_far = pick(3) == 0;
    std::string text = "# a test\nmtllib m.mtl\n";
    int vertices = 0;
    const auto end = [&] { text += pick(9) == 0 ? "  # 1 2 3\n" : pick(9) == 0 ? " \\\n\n" : "\n"; };
    const auto add_vertex = [&](const std::string& x, const std::string& y, const std::string& z) {
        text += (pick(9) == 0 ? "\tv  " : "v ") + x + (pick(9) == 0 ? "\t" : " ") + y + ' ' + z;
        if (has_colors && pick(9) != 0)
            for (int k = 0; k < 3; ++k) text += " 0." + std::to_string(pick(1000));
        end();
        ++vertices;
    };
    for (int i = 0; i < 30; ++i) add_vertex(number(random), number(random), number(random));
    for (int i = 0; i < 5; ++i) text += "vt 0." + std::to_string(i) + ' ' + number(random) + "\nvn 0 0 1\n";
    for (int n = 0; n < 60; ++n) {
        const int what = pick(12);
        const std::string name(1, static_cast<char>('a' + pick(4)));
        if (what == 0) text += "g " + name + (pick(3) == 0 ? " x y\n" : "\n");
        if (what == 1) text += "o " + name + '\n';
        if (what == 2 || what == 3) text += "usemtl " + name + '\n';
        if (what == 4) text += "s " + std::to_string(pick(3)) + '\n';
        if (what == 5) text += "# f 1 2 3\n\n";
        if (what == 6) add_vertex(number(random), number(random), number(random));
        if (what == 7) text += pick(2) == 0 ? "g\n" : "usemtl\n";
        if (what < 8) continue;
        const int corners = pick(2) == 0 ? 3 : 3 + pick(7), form = pick(5), first = pick(vertices);
        // Some polygons go round an axis and are simple; others cross themselves or name a vertex twice.
        const bool is_round = pick(3) != 0;
        for (int c = 0; is_round && c < corners; ++c) {
            const double angle = 6.28 * c / corners, radius = pick(3) == 0 ? 0.4 : 1.5, away = is_far ? 4e6 : 0;
            add_vertex(std::to_string(away + radius * std::cos(angle)), std::to_string(radius * std::sin(angle)),
                       std::to_string(0.1 * pick(3) + n));
        }
        text += "f";
        for (int c = 0; c < corners; ++c) {
            const int v = is_round ? vertices - corners + c : (first + c * (1 + pick(3))) % vertices;
            text += (pick(9) == 0 ? " \\\n " : " ") + std::to_string(pick(2) == 0 ? v + 1 : v - vertices);
            if (form == 1) text += "/" + std::to_string(1 + pick(5));
            if (form == 2) text += "//" + std::to_string(1 + pick(5));
            if (form == 3) text += "/" + std::to_string(-1 - pick(2)) + "/" + std::to_string(1 + pick(5));
            if (form == 4 && pick(2) == 0) text += "/" + std::to_string(pick(40) == 0 ? 99 : 1 + pick(2));
        }
        end();
    }
    text += "f 1 " + std::to_string(vertices + 1) + " 2\n"; // a vertex that follows
    add_vertex("1", "2", "3");
    text += "f 1 2 3";
    return pick(3) == 0 ? replaced(text, "\n", "\r\n") : pick(3) == 0 ? replaced(text, "\n", "\r") : text;
}

TEST(ObjReader, RandomFilesAreStreamedAsLoaded) {
    const std::vector<std::pair<std::string, std::string>> others{
        {"m.mtl", "newmtl a\nKd 0.2 0.5 1\nmap_Kd -s 2 3 1 -o 0.1 0.2 0.3 -blendu off one.png\n"
                  "newmtl b\nKd 1 0 0\nd 0.5\nmap_Kd -clamp on two.png\nnewmtl c\nTr 0.25\nKd 0.1 0.1 0.1\n"
                  "newmtl d\nKd 0 0 0\nmap_Kd one.png\nmap_Bump none.png\nmap_d none.png\n"},
        {"one.png", obj_test::png(2, 2, std::vector<std::uint8_t>(16, 77))},
        {"two.png", obj_test::png(1, 3, std::vector<std::uint8_t>(12, 99))}};
    const unsigned count = gltf_test::is_slow_build() ? 4 : 60;
    for (unsigned seed = 1; seed <= count && !testing::Test::HasFailure(); ++seed) {
        const std::string text = random_obj(seed);
        SCOPED_TRACE(text);
        const files model(text, others);
        expect_same(model);
        voxelize::load_options options;
        options.gltf.colors = false;
        expect_same(model, options);
    }
}

} // namespace
