// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Kinds of STL and OFF files that people have, loaded and streamed; and the given files of shared/cases/formats.
#include "mesh_files.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <map>

using namespace mesh_files;

namespace {

// ---- STL

// The cube as text, with words as they are given.
std::string text_stl(const std::string& normal = "0 0 0", const std::string& start = "solid x\n",
                     const std::string& end = "endsolid x\n", const std::string& blank = " ",
                     const std::string& line = "\n") {
    std::string text = start;
    for (const auto& f : cube_faces)
        for (int half = 0; half < 2; ++half) {
            text += "facet normal " + normal + line + "outer loop" + line;
            for (const int v : {f[0], f[static_cast<std::size_t>(1 + half)], f[static_cast<std::size_t>(2 + half)]}) {
                text += "vertex";
                for (int a = 0; a < 3; ++a) text += blank + std::to_string(cube_corner(v, a));
                text += line;
            }
            text += "endloop" + line + "endfacet" + line;
        }
    return text + end;
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

// The cube in binary, with an attribute for each facet.
std::string binary_stl(std::string header, const std::vector<std::uint16_t>& attributes = {},
                       std::uint32_t count = 12) {
    header.resize(80, ' ');
    std::string bytes = header + bytes_of(count);
    std::size_t facet = 0;
    for (const auto& f : cube_faces)
        for (int half = 0; half < 2; ++half) {
            for (int a = 0; a < 3; ++a) bytes += bytes_of(0.0F);
            for (const int v : {f[0], f[static_cast<std::size_t>(1 + half)], f[static_cast<std::size_t>(2 + half)]})
                for (int a = 0; a < 3; ++a) bytes += bytes_of(static_cast<float>(cube_corner(v, a)));
            bytes += bytes_of<std::uint16_t>(attributes.empty() ? 0 : attributes[facet++ % attributes.size()]);
        }
    return bytes;
}

TEST(StlReader, TextMayBeWrittenInManyWays) {
    const folder files;
    for (const std::string& text :
         {text_stl(), upper(text_stl()), "  \t\n " + text_stl(), "\xEF\xBB\xBF" + text_stl(),
          text_stl("-1.#IND -1.#IND -1.#IND"), text_stl("nan NaN -nan(ind)"), text_stl("1,5 0 0"),
          text_stl("0 0 0", "solid\n", "endsolid\n"), text_stl("0 0 0", "solid x\n", "endsolid x\n", "\t  "),
          text_stl("0 0 0", "solid x\r", "endsolid x\r", " ", "\r"), text_stl("0 0 0", "solid a facet of x\r\n"),
          text_stl("0 0 0", "solid x ", "endsolid x", " ", " "), text_stl() + "\n\n# made by hand\n",
          text_stl("0 0 0", "solid vertex\n", "endsolid vertex\n")})
        expect_cube(read(files.write("a.stl", text)));
}

TEST(StlReader, SolidsAreParts) {
    const folder files;
    const std::string facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                              "endfacet\n";
    const fs::path file =
        files.write("a.stl", "solid one\n" + facet + "endsolid one\nsolid two\n" + facet + facet + "endsolid two\n");
    EXPECT_EQ(3U, read(file).triangles.size());
    const voxelize::scene scene = voxelize::load_model(file);
    ASSERT_EQ(2U, scene.primitives.size());
    EXPECT_EQ("one", scene.primitives[0].name);
    EXPECT_EQ("two", scene.primitives[1].name);
}

TEST(StlReader, BinaryMayBeginWithSolidAndEndLate) {
    const folder files;
    expect_cube(read(files.write("a.stl", binary_stl("solid of a CAD"))));
    for (const char* header : {"solid of a CAD", "any"})
        for (const std::string& rest :
             {std::string("\0", 1), std::string("made by a program"), std::string(77, '\1')}) {
            const model m = read(files.write("b.stl", binary_stl(header) + rest));
            expect_cube(m);
            ASSERT_EQ(1U, m.warnings.size());
            EXPECT_EQ(std::to_string(rest.size()) +
                          " bytes follow the 12 facets that the header promises: they are passed over",
                      m.warnings[0]);
        }
}

TEST(StlReader, ColoursAreThoseOfMagicsAndVisCam) {
    const folder files;
    const std::string magics = std::string("COLOR=") + "\xFF\x80" + std::string(1, '\0') + "\xFF";
    // Red in the low bits, and bit 15 for the object's colour.
    const std::uint16_t own = 31U | 16U << 5U, of_object = 0x8000U;
    expect_cube(read(files.write("a.stl", binary_stl(magics, {of_object}))), {255, 128, 0});
    expect_cube(read(files.write("b.stl", binary_stl(magics))), {255, 128, 0}); // of writers that leave 0
    expect_cube(read(files.write("c.stl", binary_stl(magics, {own}))), {255, 132, 0});
    expect_cube(read(files.write("d.stl", binary_stl("magics " + magics, {of_object}))), {255, 128, 0});
    // Red in the high bits, and bit 15 for a colour.
    expect_cube(read(files.write("e.stl", binary_stl("VisCAM", {0xFE00U}))), {255, 132, 0});
    expect_cube(read(files.write("f.stl", binary_stl("VisCAM", {0x7E00U}))), {255, 255, 255});
    const model mixed = read(files.write("g.stl", binary_stl(magics, {own, of_object})));
    EXPECT_EQ((std::array<int, 3>{255, 132, 0}), shown_as(mixed.triangles.at(0).colors[0]));
    EXPECT_EQ((std::array<int, 3>{255, 128, 0}), shown_as(mixed.triangles.at(1).colors[0]));
}

TEST(StlReader, WhatIsPromisedIsCounted) {
    const folder files;
    const std::string whole = binary_stl("any");
    const fs::path cut = files.write("a.stl", whole.substr(0, 84 + 5 * 50 + 7));
    EXPECT_EQ("the header promises 12 facets, and the file has 5 (which ends at byte 341)", error_of(cut));
    EXPECT_EQ("the header promises 4294967295 facets, and the file has 12 (which ends at byte 684)",
              error_of(files.write("b.stl", binary_stl("any", {}, 0xFFFFFFFFU))));
    const std::string text = text_stl();
    EXPECT_EQ("the file ends within its facet 3 (line 22)",
              error_of(files.write("c.stl", text.substr(0, text.find("endfacet", 250)))));
    EXPECT_EQ(
        "line 2: the facet has 2 vertices, and 3 were expected",
        error_of(files.write("d.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n"
                                      "endfacet\nendsolid\n")));
    EXPECT_EQ("line 3: \"y\" is found where the y of a vertex was expected",
              error_of(files.write("e.stl", "solid\nfacet normal 0 0 1\nvertex 0 y 0\n")));
    EXPECT_EQ(
        "the file has 7 bytes, and a binary STL has 84 before its facets; it does not begin with \"solid\" either",
        error_of(files.write("f.stl", "nothing")));
    voxelize::load_options lenient;
    lenient.gltf.lenient = true;
    EXPECT_EQ(5U, read(cut, lenient).triangles.size());
    EXPECT_EQ(2U, read(files.path() / "c.stl", lenient).triangles.size());
}

TEST(StlReader, TextIsSharpFarFromTheOrigin) {
    const folder files;
    const model m = read(files.write("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 431234.05 4649776.0625 1\n"
                                              "vertex 431235.013 4649776.0625 1\nvertex 431234.05 4649777.0625 1\n"
                                              "endloop\nendfacet\nendsolid\n"));
    EXPECT_NEAR(431234.05, m.triangles.at(0).corners[0].x, 1e-7);
    EXPECT_NEAR(431235.013, m.triangles.at(0).corners[1].x, 1e-7);
}

// ---- OFF

TEST(OffReader, HeadersAndCommentsStandAnywhere) {
    const folder files;
    for (const std::string& start :
         {std::string("OFF\n8 6 12\n"), std::string("OFF 8 6 0\n"), std::string("off\n8 6\n"), std::string("8 6 0\n"),
          std::string("# a\nOFF # b\n\n# c\n8 6 0 # d\n"), std::string("OFF\n8\n6\n0\n"), std::string("OFF\n8 6\n12\n"),
          std::string("\xEF\xBB\xBFOFF\r\n8 6 0\r\n")})
        for (const std::string end : {"\n", "\r\n", "\r", " # c\n", "\n\n# 1 2 3\n"})
            expect_cube(read(files.write("a.off", start + cube_vertices("", end) + cube_polygons("", end))));
    expect_cube(read(files.write("a.off", "nOFF\n3\n8 6 0\n" + cube_vertices() + cube_polygons())));
    EXPECT_EQ("the vertices of this nOFF have 4 dimensions, and 3 were expected",
              error_of(files.write("a.off", "nOFF\n4\n8 6 0\n")));
}

TEST(OffReader, NumbersMayRunOverLines) {
    const folder files;
    std::string vertices = cube_vertices(), polygons = cube_polygons();
    std::replace(vertices.begin(), vertices.end(), ' ', '\n');
    std::replace(polygons.begin(), polygons.end(), ' ', '\n');
    expect_cube(read(files.write("a.off", "OFF\n8 6 0\n" + vertices + polygons)));
}

TEST(OffReader, PrefixesSayWhatAVertexHas) {
    const folder files;
    struct kind {
        const char* word;
        const char* numbers;
        std::array<int, 3> color;
    };
    constexpr std::array<int, 3> orange{255, 128, 0}, white{255, 255, 255};
    for (const kind& k : {kind{"COFF", " 255 128 0 255", orange},
                          {"COFF", " 255 128 0", orange},
                          {"COFF", " 1.0 0.50196 0 1", orange},
                          {"NOFF", " 0 0 1", white},
                          {"STOFF", " 0.5 0.5", white},
                          {"STNOFF", " 0 0 1 .5 .5", white},
                          {"STCNOFF", " 0 0 1 255 128 0 255 .5 .5", orange},
                          {"CNOFF", " 0 0 1 255 128 0 255", orange},
                          {"NCOFF", " 0 0 1 255 128 0 255", orange},
                          {"OFF", " 255 128 0", orange},
                          {"4OFF", " 1", white},
                          {"C4OFF", " 1 255 128 0 255", orange}}) {
        SCOPED_TRACE(std::string(k.word) + k.numbers);
        expect_cube(
            read(files.write("a.off", std::string(k.word) + "\n8 6 0\n" + cube_vertices(k.numbers) + cube_polygons())),
            k.color);
    }
    // The fourth number divides.
    std::string text = "4OFF\n3 1 0\n0 0 0 2\n4 0 0 2\n0 6 0 2\n3 0 1 2\n";
    EXPECT_NEAR(3, area_of(read(files.write("b.off", text))), 1e-9);
}

TEST(OffReader, FacesHaveColours) {
    const folder files;
    const std::string start = "OFF\n8 6 0\n" + cube_vertices();
    for (const char* color :
         {" 255 128 0", " 255 128 0 255", " 1.0 0.50196 0.0", " 1 .50196 0 1", "  255\t128 0 # orange"})
        expect_cube(read(files.write("a.off", start + cube_polygons(color))), {255, 128, 0});
    const model m = read(files.write("a.off", start + cube_polygons(" 7")));
    expect_cube(m);
    ASSERT_EQ(1U, m.warnings.size());
    EXPECT_EQ("6 faces have a colour by its number in a map, which the file does not have: they are white",
              m.warnings[0]);
    // Some faces without.
    const model some = read(files.write("b.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0 0 255\n3 2 1 0\n"));
    EXPECT_EQ((std::array<int, 3>{0, 0, 255}), shown_as(some.triangles.at(0).colors[0]));
    EXPECT_EQ((std::array<int, 3>{255, 255, 255}), shown_as(some.triangles.at(1).colors[0]));
}

TEST(OffReader, BinaryIsRead) {
    const folder files;
    std::string data =
        bytes_of<std::int32_t>(8, true) + bytes_of<std::int32_t>(6, true) + bytes_of<std::int32_t>(0, true);
    for (int i = 0; i < 8; ++i) {
        for (int a = 0; a < 3; ++a) data += bytes_of(static_cast<float>(cube_corner(i, a)), true);
        for (const float c : {1.0F, 0.50196F, 0.0F, 1.0F}) data += bytes_of(c, true);
    }
    for (const auto& f : cube_faces) {
        data += bytes_of<std::int32_t>(4, true);
        for (const int v : f) data += bytes_of<std::int32_t>(v, true);
        data += bytes_of<std::int32_t>(0, true);
    }
    expect_cube(read(files.write("a.off", "COFF BINARY\n" + data)), {255, 128, 0});
    EXPECT_EQ("the header promises 6 faces, and the file has 5 (it ends at byte " +
                  std::to_string(12 + data.size() - 6) + ")",
              error_of(files.write("a.off", "COFF BINARY\n" + data.substr(0, data.size() - 6))));
}

TEST(OffReader, WhatTheHeaderPromisesIsCounted) {
    const folder files;
    const std::string three = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n";
    const fs::path file = files.write("a.off", "OFF\n8 6 0\n" + cube_vertices() + three);
    EXPECT_EQ("the header promises 6 faces, and the file has 3 (it ends in line 14)", error_of(file));
    EXPECT_EQ("the header promises 9 vertices, and the file has 8 (it ends in line 11)",
              error_of(files.write("b.off", "OFF\n9 0 0\n" + cube_vertices())));
    EXPECT_EQ("line 5: face 0 names a vertex 3, and 0 to 2 were expected",
              error_of(files.write("d.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")));
    EXPECT_EQ("line 3: \"x\" is found where a number was expected",
              error_of(files.write("e.off", "OFF 3 1 0\n0 0 0\n1 x 0\n")));
    EXPECT_EQ("line 1: \"OFX\" is found where the numbers of vertices and faces were expected",
              error_of(files.write("f.off", "OFX 3 1 0\n")));
    voxelize::load_options lenient;
    lenient.gltf.lenient = true;
    EXPECT_EQ(6U, read(file, lenient).triangles.size());
    // Vertices are points only where the header promises no face.
    EXPECT_EQ(8U, read(files.write("g.off", "OFF\n8 0 0\n" + cube_vertices())).lines.size());
    EXPECT_TRUE(read(files.write("h.off", "OFF\n8 6 0\n" + cube_vertices()), lenient).lines.empty());
}

TEST(OffReader, CoordinatesAreSharpFarFromTheOrigin) {
    const folder files;
    const model m = read(files.write("a.off", "OFF 3 1 0\n431234.05 4649776.0625 1\n431235.013 4649776.0625 1\n"
                                              "431234.05 4649777.0625 1\n3 0 1 2\n"));
    EXPECT_NEAR(431234.05, m.triangles.at(0).corners[0].x, 1e-7);
    EXPECT_NEAR(431235.013, m.triangles.at(0).corners[1].x, 1e-7);
}

// ---- All

TEST(MeshReaders, ConcavePolygonsKeepTheirShape) {
    const folder files;
    // An L of area 3, from each of its corners on: as a fan it would cover more.
    const std::array<std::array<int, 2>, 6> l{{{2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 0}}};
    for (std::size_t first = 0; first < l.size(); ++first) {
        std::string text = "OFF 6 1 0\n", face = "6";
        for (std::size_t i = 0; i < l.size(); ++i) {
            text += std::to_string(l[i][0]) + " 5 " + std::to_string(l[i][1]) + '\n';
            face += ' ' + std::to_string((first + i) % l.size());
        }
        const model m = read(files.write("a.off", text + face + '\n'));
        EXPECT_EQ(4U, m.triangles.size());
        EXPECT_NEAR(3, area_of(m), 1e-9);
    }
    // Arrows of four corners.
    for (const char* face : {"4 0 1 2 3", "4 1 2 3 0", "4 2 3 0 1", "4 3 0 1 2"})
        EXPECT_NEAR(
            1,
            area_of(read(files.write("b.off", std::string("OFF 4 1 0\n0 0 0\n2 1 0\n0 2 0\n1 1 0\n") + face + '\n'))),
            1e-9);
}

// The files of shared/cases/formats, where that folder is: what is right is in its README.
TEST(MeshReaders, GivenFilesAreRight) {
    const fs::path cases = VOXELPIPE_CASES_DIR;
    if (cases.empty() || !fs::is_directory(cases / "formats")) GTEST_SKIP() << "no folder VOXELPIPE_CASES_DIR/formats";
    const auto file = [&](const char* name) { return cases / "formats" / name; };
    for (const char* name : {"f03_tristrips.ply", "f05_element_between_binary.ply", "f05_element_first.ply",
                             "f05_element_last_control.ply", "f05_element_last_control_binary.ply",
                             "f23_ind_normal.stl", "f23_upper_case.stl"}) {
        SCOPED_TRACE(name);
        expect_cube(loaded(file(name)));
    }
    for (const char* name : {"f09_coff.off", "f09_face_colours.off", "f10_magics_object.stl", "f13_face_colours.ply"}) {
        SCOPED_TRACE(name);
        expect_cube(loaded(file(name)), {255, 128, 0});
    }
    EXPECT_EQ("the header promises 6 faces, and the file has 3 (it ends in line 21)",
              error_of(file("f07_truncated.ply")));
    EXPECT_EQ(loaded(file("f02_control_points.ply")).lines.size(), loaded(file("f02_newline_points.ply")).lines.size());
}

// The models of Debian's package assimp-testmodels, where it is installed: each loads, or is refused in one line.
TEST(MeshReaders, TestModelsLoadOrSayWhyNot) {
    const fs::path folder = "/usr/share/assimp/models";
    if (!fs::is_directory(folder)) GTEST_SKIP() << "no " << folder;
    std::map<std::string, std::size_t> triangles;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        std::string extension = entry.path().extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        if (extension != ".stl" && extension != ".ply" && extension != ".off") continue;
        const std::string name = entry.path().lexically_relative(folder).generic_string();
        const std::string error = error_of(entry.path());
        if (error == "no error") triangles[name] = loaded(entry.path()).triangles.size();
    }
    for (const char* same : {"OFF/Wuson.off", "PLY/Wuson.ply", "STL/Wuson.stl"})
        EXPECT_EQ(triangles.at("OFF/Wuson.off"), triangles.at(same)) << same;
    for (const char* cube : {"OFF/Cube.off", "PLY/cube.ply", "PLY/cube_binary.ply"})
        EXPECT_EQ(12U, triangles.at(cube)) << cube;
}

} // namespace
