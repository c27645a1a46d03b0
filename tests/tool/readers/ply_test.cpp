// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Kinds of PLY files that people have, loaded and streamed.
#include "mesh_files.hpp"

#include <gtest/gtest.h>

using namespace mesh_files;

namespace {

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string list = "property list uchar int vertex_indices\n";

std::string text_header(const std::string& elements) { return "ply\nformat ascii 1.0\n" + elements + "end_header\n"; }
std::string cube(const std::string& of_vertex = "", const std::string& of_face = "") {
    return text_header("element vertex 8\n" + xyz + of_vertex + "element face 6\n" + list + of_face);
}

TEST(PlyReader, ElementsStandInAnyOrder) {
    const folder files;
    const std::string camera = "element camera 1\nproperty float focal\nproperty list uchar float lens\n";
    const std::string vertex = "element vertex 8\n" + xyz, face = "element face 6\n" + list;
    const std::string camera_data = "1.5 3 7 8 9\n";
    const std::array<std::array<std::string, 2>, 3> all{
        {{camera, camera_data}, {vertex, cube_vertices()}, {face, cube_polygons()}}};
    std::array<std::size_t, 3> order{0, 1, 2};
    do {
        std::string header, data;
        for (const std::size_t i : order) {
            header += all[i][0];
            data += all[i][1];
        }
        expect_cube(read(files.write("a.ply", text_header(header) + data)));
    } while (std::next_permutation(order.begin(), order.end()));
}

// Faces before vertices, in both byte orders, with an element of lists before them.
TEST(PlyReader, BinaryElementsStandInAnyOrder) {
    const folder files;
    for (const bool is_big : {false, true})
        for (const bool faces_first : {false, true}) {
            std::string vertices, faces;
            for (int i = 0; i < 8; ++i)
                for (int a = 0; a < 3; ++a) vertices += bytes_of(static_cast<double>(cube_corner(i, a)), is_big);
            for (const auto& f : cube_faces) {
                faces += bytes_of<std::uint16_t>(4, is_big);
                for (const int v : f) faces += bytes_of(static_cast<std::int16_t>(v), is_big);
                faces += bytes_of(1.5F, is_big);
            }
            const std::string rest = bytes_of<std::uint8_t>(2) + bytes_of(1.0F, is_big) + bytes_of(2.0F, is_big);
            const std::string vertex = "element vertex 8\nproperty double x\nproperty double y\nproperty double z\n";
            const std::string face =
                "element face 6\nproperty list ushort short vertex_index\nproperty float quality\n";
            const std::string format = is_big ? "big" : "little";
            expect_cube(read(files.write("a.ply", "ply\nformat binary_" + format +
                                                      "_endian 1.0\nelement rest 1\nproperty list uchar float r\n" +
                                                      (faces_first ? face + vertex : vertex + face) + "end_header\n" +
                                                      rest + (faces_first ? faces + vertices : vertices + faces))));
        }
}

TEST(PlyReader, TheFirstByteOfTheDataMayBeALineEnd) {
    const folder files;
    for (const std::string end : {"\n", "\r\n", "\r"})
        for (const char first : {'\n', '\r', ' ', 'e'}) {
            std::string header;
            for (const char* line : {"ply", "format binary_little_endian 1.0", "comment ", "element vertex 3",
                                     "property float x", "property float y", "property float z", "element face 1",
                                     "property list uchar uchar vertex_indices", "end_header"})
                header += line + end;
            std::string x = bytes_of(1.0F);
            x[0] = first;
            const std::string data = x + bytes_of(0.0F) + bytes_of(0.0F) + bytes_of(2.0F) + bytes_of(0.0F) +
                                     bytes_of(0.0F) + bytes_of(2.0F) + bytes_of(1.0F) + bytes_of(0.0F) +
                                     std::string("\3\0\1\2", 4);
            // A file of CR alone cannot be told from one of CR LF where its data begins with LF: the first line tells.
            const model m = read(files.write("a.ply", header + data));
            ASSERT_EQ(1U, m.triangles.size());
            EXPECT_NEAR(1, m.triangles[0].corners[0].x, 1e-3);
            EXPECT_EQ(glm::dvec3(2, 1, 0), m.triangles[0].corners[2]);
        }
}

TEST(PlyReader, TextMayHaveAnyLines) {
    const folder files;
    std::string one_line = cube_vertices("", " ") + cube_polygons("", "\t");
    std::string a_line_each = one_line;
    std::replace(a_line_each.begin(), a_line_each.end(), ' ', '\n');
    std::string with_crs = cube_vertices("", "\r") + cube_polygons("", "\r");
    for (const std::string& data : {one_line, a_line_each, with_crs, cube_vertices("", "\n\n  ") + cube_polygons()})
        expect_cube(read(files.write("a.ply", cube() + data)));
}

TEST(PlyReader, CommentsAndInfoMayStandAnywhereInTheHeader) {
    const folder files;
    expect_cube(read(files.write("a.ply", "ply\r\ncomment a\r\nformat ascii 1.0\r\nobj_info num_cols 5\r\n\r\n"
                                          "element vertex 8\r\ncomment element face 9\r\nproperty float x\r\n"
                                          "obj_info\r\nproperty float y\r\nproperty float z\r\nelement face 6\r\n"
                                          "comment\r\nproperty list uchar int vertex_indices\r\nend_header\r\n" +
                                              cube_vertices() + cube_polygons())));
}

// A comment without its word; the property of faces that are not there behind those of the vertices.
TEST(PlyReader, HeadersOfBlenderAreRead) {
    const folder files;
    std::string text = cube() + cube_vertices() + cube_polygons();
    text.insert(text.find("element"), "Created by Blender3D 247 - www.blender.org, source file: \n");
    expect_cube(read(files.write("a.ply", text)));
    EXPECT_EQ(
        8U, read(files.write("b.ply", text_header("element vertex 8\n" + xyz + list) + cube_vertices())).lines.size());
}

TEST(PlyReader, StripsAreCutAtMinusOne) {
    const folder files;
    const std::string strips = "29 0 2 1 3 -1 4 5 6 7 -1 0 1 4 5 -1 2 6 3 7 -1 0 4 2 6 -1 1 3 5 7\n";
    expect_cube(read(files.write("a.ply", text_header("element vertex 8\n" + xyz +
                                                      "element tristrips 1\nproperty list int int vertex_indices\n") +
                                              cube_vertices() + strips)));
    // Triangles of a strip have one side outside, though every second is written the other way round; a vertex twice
    // joins strips.
    const model m =
        read(files.write("b.ply", text_header("element vertex 4\n" + xyz +
                                              "element tristrips 1\nproperty list int int vertex_indices\n") +
                                      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n7 0 1 2 3 3 3 3\n"));
    ASSERT_EQ(2U, m.triangles.size());
    for (const triangle& t : m.triangles)
        EXPECT_GT((t.corners[1].x - t.corners[0].x) * (t.corners[2].y - t.corners[0].y) -
                      (t.corners[1].y - t.corners[0].y) * (t.corners[2].x - t.corners[0].x),
                  0);
}

TEST(PlyReader, ColoursOfVerticesAndFacesHaveAnyTypeAndName) {
    const folder files;
    struct kind {
        const char* type;
        const char* numbers;
    };
    for (const kind& k : {kind{"uchar", " 255 128 0"}, kind{"uint8", " 255 128 0"}, kind{"ushort", " 65535 32896 0"},
                          kind{"ushort", " 255 128 0"}, kind{"int", " 255 128 0"}, kind{"uint", " 255 128 0"},
                          kind{"short", " 255 128 0"}, kind{"float", " 1 0.50196 0"}, kind{"double", " 1 0.50196 0"}})
        for (const std::array<const char*, 3>& names :
             {std::array{"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}}) {
            SCOPED_TRACE(std::string(k.type) + ' ' + names[0] + k.numbers);
            std::string properties;
            for (const char* name : names) properties += std::string("property ") + k.type + ' ' + name + '\n';
            expect_cube(read(files.write("a.ply", cube(properties) + cube_vertices(k.numbers) + cube_polygons())),
                        {255, 128, 0});
            expect_cube(read(files.write("b.ply", cube("", properties) + cube_vertices() + cube_polygons(k.numbers))),
                        {255, 128, 0});
        }
}

TEST(PlyReader, AlphaIsRead) {
    const folder files;
    const std::string properties =
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    const model m = read(files.write("a.ply", cube(properties) + cube_vertices(" 255 0 0 51") + cube_polygons()));
    EXPECT_FLOAT_EQ(0.2F, m.triangles.at(0).colors[0].a);
}

// What is not known is passed over, lists too, in any place.
TEST(PlyReader, UnknownPropertiesArePassedOver) {
    const folder files;
    expect_cube(read(files.write(
        "a.ply",
        text_header(
            "element vertex 8\nproperty list uchar int parents\n" + xyz + "property double curvature\n" +
            "element face 6\nproperty list uchar float texcoord\n" + list + "property int texnumber\n" +
            "property list short double weights\nelement edge 2\nproperty int vertex1\nproperty int vertex2\n") +
            [] {
                std::string text;
                for (int i = 0; i < 8; ++i)
                    text += "2 7 7 " + std::to_string(cube_corner(i, 0)) + ' ' + std::to_string(cube_corner(i, 1)) +
                            ' ' + std::to_string(cube_corner(i, 2)) + " 0.5\n";
                for (const auto& f : cube_faces) {
                    text += "8 0 0 1 0 1 1 0 1 4";
                    for (const int v : f) text += ' ' + std::to_string(v);
                    text += " 0 1 2.5\n";
                }
                return text + "0 1\n1 2\n";
            }())));
}

TEST(PlyReader, WhatTheHeaderPromisesIsCounted) {
    const folder files;
    const std::string three = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n";
    const fs::path faces = files.write("a.ply", cube() + cube_vertices() + three);
    EXPECT_EQ("the header promises 6 faces, and the file has 3 (it ends in line 21)", error_of(faces));
    const fs::path vertices = files.write("b.ply", cube() + "0 0 0\n1 0 0\n");
    EXPECT_EQ("the header promises 8 vertices, and the file has 2 (it ends in line 12)", error_of(vertices));
    voxelize::load_options lenient;
    lenient.gltf.lenient = true;
    const model m = read(faces, lenient);
    EXPECT_EQ(6U, m.triangles.size());
    ASSERT_EQ(1U, m.warnings.size());
    EXPECT_EQ("the header promises 6 faces, and the file has 3 (it ends in line 21); what is there is read",
              m.warnings[0]);
    // A binary file, cut within a face; and one whose header promises more than memory holds.
    std::string binary =
        "ply\nformat binary_little_endian 1.0\nelement vertex 8\n" + xyz + "element face 6\n" + list + "end_header\n";
    for (int i = 0; i < 8; ++i)
        for (int a = 0; a < 3; ++a) binary += bytes_of(static_cast<float>(cube_corner(i, a)));
    binary += bytes_of<std::uint8_t>(4) + bytes_of(0) + bytes_of(2) + bytes_of(3) + bytes_of(1) + '\4' + bytes_of(4);
    const std::string size = std::to_string(binary.size());
    EXPECT_EQ("the header promises 6 faces, and the file has 1 (it ends at byte " + size + ")",
              error_of(files.write("c.ply", binary)));
    EXPECT_EQ(2U, read(files.path() / "c.ply", lenient).triangles.size());
    std::string huge = cube();
    huge.replace(huge.find("face 6"), 6, "face 4000000000000");
    EXPECT_EQ("the header promises 4000000000000 faces, and the file has 6 (it ends in line 24)",
              error_of(files.write("d.ply", huge + cube_vertices() + cube_polygons())));
}

TEST(PlyReader, VerticesArePointsOnlyWhereThereIsNoFace) {
    const folder files;
    const model points = read(files.write("a.ply", text_header("element vertex 8\n" + xyz) + cube_vertices()));
    EXPECT_EQ(8U, points.lines.size());
    EXPECT_TRUE(points.triangles.empty());
    // One face names three of eight vertices.
    const model m = read(files.write("b.ply", text_header("element vertex 8\n" + xyz + "element face 1\n" + list) +
                                                  cube_vertices() + "3 0 1 2\n"));
    EXPECT_EQ(1U, m.triangles.size());
    EXPECT_TRUE(m.lines.empty());
    // A file whose faces are all left out has faces.
    voxelize::load_options lenient;
    lenient.gltf.lenient = true;
    EXPECT_TRUE(read(files.write("c.ply", cube() + cube_vertices()), lenient).lines.empty());
}

TEST(PlyReader, MessagesSayWhatWasExpectedAndWhere) {
    const folder files;
    const auto error = [&](const std::string& bytes) { return error_of(files.write("a.ply", bytes)); };
    EXPECT_EQ("line 1: \"plx\" is found where \"ply\" was expected", error("plx\n"));
    EXPECT_EQ("the PLY header has no end_header", error("ply\nformat ascii 1.0\n"));
    EXPECT_EQ("line 2: the format is \"binary\", and ascii, binary_little_endian or binary_big_endian was expected",
              error("ply\nformat binary 1.0\n"));
    EXPECT_EQ("line 4: \"flaot\" is found where a property's type was expected",
              error("ply\nformat ascii 1.0\nelement vertex 3\nproperty flaot x\n"));
    EXPECT_EQ("line 11: \"oops\" is found where a number of the property \"y\" was expected",
              error(cube() + "0 0 0\n0 oops 0\n"));
    EXPECT_EQ("line 19: face 0 names a vertex 8, and 0 to 7 were expected",
              error(cube() + cube_vertices() + "\n4 0 1 8 2\n"));
    EXPECT_EQ("line 18: face 0 names a vertex -1, and 0 to 7 were expected",
              error(cube() + cube_vertices() + "4 0 1 -1 2\n"));
    EXPECT_EQ("the PLY header has no element vertex with properties x, y and z",
              error(text_header("element vertex 1\nproperty float x\n") + "1\n"));
}

TEST(PlyReader, DoublesAreSharpFarFromTheOrigin) {
    const folder files;
    const std::string doubles = "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n";
    const model m = read(files.write("a.ply", text_header(doubles + "element face 1\n" + list) +
                                                  "431234.05 4649776.0625 100.03\n431234.17 4649776.0625 100.03\n"
                                                  "431234.05 4649777.0625 101.03\n3 0 1 2\n"));
    EXPECT_NEAR(431234.05, m.triangles.at(0).corners[0].x, 1e-8);
    EXPECT_NEAR(431234.17, m.triangles.at(0).corners[1].x, 1e-8);
    EXPECT_NEAR(4649777.0625, m.triangles.at(0).corners[2].y, 1e-8);
    // Near the origin positions are floats as they always were.
    const model near = read(files.write("b.ply", text_header(doubles + "element face 1\n" + list) +
                                                     "0.05 0.1 0\n0.17 0 0.3\n0.05 1.1 1\n3 0 1 2\n"));
    EXPECT_EQ(static_cast<double>(0.05F), near.triangles.at(0).corners[0].x);
    EXPECT_EQ(static_cast<double>(1.1F), near.triangles.at(0).corners[2].y);
}

// A texture that a comment names is shown by coordinates of vertices or, as MeshLab writes them, of corners.
TEST(PlyReader, TexturesAreNamedByComments) {
    const folder files;
    std::string texture = "comment TextureFile not there.png\n";
    const std::string uv = "property float s\nproperty float t\n";
    for (const bool of_corners : {false, true}) {
        const std::string elements = "element vertex 8\n" + xyz + (of_corners ? "" : uv) + "element face 6\n" + list +
                                     (of_corners ? "property list uchar float texcoord\n" : "");
        const model m =
            read(files.write("a.ply", text_header(texture + elements) + cube_vertices(of_corners ? "" : " 0.5 0.25") +
                                          cube_polygons(of_corners ? " 8 0 0 1 0 1 1 0 1" : "")));
        EXPECT_EQ(12U, m.triangles.size());
        const voxelize::scene scene = voxelize::load_model(files.path() / "a.ply");
        ASSERT_EQ(1U, scene.warnings.size());
        EXPECT_EQ("the texture \"not there.png\" cannot be used: no such file; the material's colour is used alone",
                  scene.warnings[0]);
    }
}

} // namespace
