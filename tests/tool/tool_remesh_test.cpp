// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --remesh: closed meshes in every format, where their vertices lie, what is reported, and what is refused.
#include "../surfaces/mesh_judge.hpp"
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/glm.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

using namespace tool_test;

namespace {

// Two boxes that cross each other; the second one is without a face.
void write_crossing_boxes(const std::string& path) {
    builder file;
    for (const float shift : {0.0F, 2.0F}) {
        std::vector<float> positions;
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis) positions.push_back((corner >> axis & 1) != 0 ? 3.1F + shift : shift);
        std::vector<std::uint8_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                          2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
        if (shift != 0) indices.resize(indices.size() - 6);
        const int index_accessor = file.accessor(indices, "SCALAR");
        file.mesh({{"POSITION", file.accessor(positions, "VEC3")}})["indices"] = index_accessor;
    }
    file.write_glb(path);
}

struct read_surface {
    std::vector<glm::dvec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> faces;
    [[nodiscard]] bool is_closed() const { return surface_tests::judge(faces, vertices.size()).is_closed_manifold(); }
    // Greatest distance of a vertex from the nearest plane of the boxes' faces.
    [[nodiscard]] double from_planes() const {
        double worst = 0;
        for (const glm::dvec3& p : vertices) {
            double nearest = 1e9;
            for (int a = 0; a < 3; ++a)
                for (const float plane : {0.0F, 3.1F, 2.0F, 5.1F}) nearest = std::min(nearest, std::abs(p[a] - plane));
            worst = std::max(worst, nearest);
        }
        return worst;
    }
};

template <class T>
T value_at(const std::string& bytes, std::size_t at) {
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

read_surface read_surface_ply(const std::string& path) {
    const std::string bytes = read_file(path);
    const auto number_after = [&](const char* text) {
        return std::stoul(bytes.substr(bytes.find(text) + std::strlen(text)));
    };
    read_surface s;
    std::size_t at = bytes.find("end_header\n") + 11;
    s.vertices.resize(number_after("element vertex "));
    for (auto& v : s.vertices)
        for (int a = 0; a < 3; ++a, at += 8) v[a] = value_at<double>(bytes, at);
    s.faces.resize(number_after("element face "));
    for (auto& f : s.faces) {
        EXPECT_EQ(3, bytes[at++]);
        for (auto& i : f) {
            i = value_at<std::uint32_t>(bytes, at);
            at += 4;
        }
    }
    EXPECT_EQ(bytes.size(), at);
    return s;
}

read_surface read_surface_obj(const std::string& path) {
    std::istringstream text(read_file(path));
    read_surface s;
    for (std::string line; std::getline(text, line);) {
        std::istringstream words(line.substr(line.empty() ? 0 : 1));
        if (line[0] == 'v') {
            auto& v = s.vertices.emplace_back();
            words >> v.x >> v.y >> v.z;
        } else if (line[0] == 'f') {
            auto& f = s.faces.emplace_back();
            for (auto& i : f) {
                words >> i;
                --i;
            }
        }
    }
    return s;
}

// Vertices joined by position, as readers of .stl do.
read_surface read_surface_stl(const std::string& path) {
    const std::string bytes = read_file(path);
    read_surface s;
    std::map<std::array<float, 3>, std::uint32_t> numbers;
    const auto count = value_at<std::uint32_t>(bytes, 80);
    EXPECT_EQ(84 + 50 * std::size_t{count}, bytes.size());
    for (std::size_t t = 0; t < count; ++t) {
        auto& f = s.faces.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            std::array<float, 3> p{};
            for (std::size_t a = 0; a < 3; ++a) p[a] = value_at<float>(bytes, 84 + 50 * t + 12 + 12 * c + 4 * a);
            const auto [found, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(numbers.size()));
            if (is_new) s.vertices.emplace_back(p[0], p[1], p[2]);
            f[c] = found->second;
        }
    }
    return s;
}

read_surface read_surface_glb(const std::string& path) {
    const std::string bytes = read_file(path);
    const auto length = value_at<std::uint32_t>(bytes, 12);
    EXPECT_EQ(bytes.size(), value_at<std::uint32_t>(bytes, 8));
    const json root = json::parse(bytes.substr(20, length));
    const std::size_t bin = 28 + length;
    read_surface s;
    s.vertices.resize(root["accessors"][0]["count"]);
    s.faces.resize(root["accessors"][1]["count"].get<std::size_t>() / 3);
    for (std::size_t n = 0; n < s.vertices.size(); ++n)
        for (int a = 0; a < 3; ++a)
            s.vertices[n][a] = value_at<float>(bytes, bin + 12 * n + 4 * static_cast<std::size_t>(a)) +
                               root["nodes"][0]["translation"][static_cast<std::size_t>(a)].get<double>();
    for (std::size_t n = 0; n < s.faces.size(); ++n)
        for (std::size_t c = 0; c < 3; ++c)
            s.faces[n][c] = value_at<std::uint32_t>(bytes, bin + 12 * s.vertices.size() + 12 * n + 4 * c);
    return s;
}

TEST(Remeshing, FilesHoldOneClosedMeshWithItsCreases) {
    const scratch_folder folder;
    write_crossing_boxes(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "--remesh", "--close-holes", "-r", "24", "-o",
                                        folder / "o.ply", "-o", folder / "o.obj", "-o", folder / "o.stl", "-o",
                                        folder / "o.glb", "-o", folder / "o.3mf", "-o", folder / "o.npz", "--report"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.out.find("1 component, Euler characteristic 2, 0 made crossings"))
        << result.out;
    const read_surface ply = read_surface_ply(folder / "o.ply"), obj = read_surface_obj(folder / "o.obj"),
                       stl = read_surface_stl(folder / "o.stl"), glb = read_surface_glb(folder / "o.glb");
    for (const read_surface* s : {&ply, &obj, &stl, &glb}) {
        EXPECT_TRUE(s->is_closed());
        EXPECT_EQ(ply.faces.size(), s->faces.size());
        EXPECT_LT(s->from_planes(), 0.002 * 5.1 / 24);
    }
    EXPECT_EQ(ply.vertices, obj.vertices); // shortest decimals of the same doubles
    EXPECT_EQ(ply.faces, obj.faces);
    EXPECT_EQ(ply.faces, glb.faces);
    EXPECT_EQ(ply.vertices.size(), stl.vertices.size()); // no two at one place
    for (const char* file : {"o.3mf", "o.npz"}) EXPECT_EQ("PK", read_file(folder / file).substr(0, 2));
}

TEST(Remeshing, PlacesAndQuads) {
    const scratch_folder folder;
    write_crossing_boxes(folder / "m.glb");
    const auto make = [&](std::vector<std::string> more, const std::string& output) {
        more.insert(more.begin(), {folder / "m.glb", "--remesh", "--solid", "exterior", "--closing", "2", "-r", "20",
                                   "-o", folder / output});
        const outcome result = run(folder, more);
        EXPECT_EQ(0, result.code) << result.err;
    };
    make({"--place", "corner"}, "corner.stl"); // coinciding sheets stand apart
    make({"--place", "mean"}, "mean.ply");
    make({"--quads"}, "quads.obj");
    EXPECT_TRUE(read_surface_stl(folder / "corner.stl").is_closed());
    EXPECT_TRUE(read_surface_ply(folder / "mean.ply").is_closed());
    const std::string quads = read_file(folder / "quads.obj");
    const std::string face = quads.substr(quads.find("\nf ") + 1, quads.find('\n', quads.find("\nf ") + 1));
    EXPECT_EQ(4, std::count(face.begin(), std::find(face.begin(), face.end(), '\n'), ' '));
}

TEST(Remeshing, LevelsGrowTheModel) {
    const scratch_folder folder;
    write_crossing_boxes(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "--remesh", "--close-holes", "--iso", "0.5", "-r", "24",
                                        "--padding", "4", "-o", folder / "o.ply"});
    ASSERT_EQ(0, result.code) << result.err;
    const read_surface s = read_surface_ply(folder / "o.ply");
    EXPECT_TRUE(s.is_closed());
    double least = 1e9;
    for (const glm::dvec3& p : s.vertices) least = std::min({least, p.x, p.y, p.z});
    EXPECT_NEAR(-0.5, least, 1e-3);
}

TEST(Remeshing, NothingInsideIsAnEmptyMeshAndAWarning) {
    const scratch_folder folder;
    builder file;
    file.mesh({{"POSITION", file.accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")}});
    file.write_glb(folder / "m.glb");
    const outcome result = run(folder, {folder / "m.glb", "--remesh", "-r", "8", "-o", folder / "o.glb", "-o",
                                        folder / "o.ply", "-o", folder / "o.3mf", "--stats", "json"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("nothing lies inside")) << result.err;
    const json stats = json::parse(result.out);
    EXPECT_EQ(0, stats["remesh"]["vertices"]);
    EXPECT_EQ("nonzero", stats["remesh"]["sign"]);
    EXPECT_TRUE(read_surface_ply(folder / "o.ply").faces.empty());
}

TEST(Remeshing, WhatDoesNotGoTogetherIsRefused) {
    const scratch_folder folder;
    write_crossing_boxes(folder / "m.glb");
    const auto is_refused = [&](std::vector<std::string> arguments, const std::string& why, int code = 1,
                                const std::string& output = "o.ply") {
        arguments.insert(arguments.begin(), {folder / "m.glb", "-o", folder / output, "-r", "8"});
        const outcome result = run(folder, arguments);
        EXPECT_EQ(code, result.code) << why << ": " << result.err;
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
    };
    is_refused({"--place", "mean"}, "--place goes with --remesh");
    is_refused({"--quads"}, "--quads goes with --remesh");
    is_refused({"--report"}, "--report goes with --remesh");
    is_refused({"--iso", "1"}, "--iso goes with --distance or --remesh");
    is_refused({"--remesh", "--place", "middle"}, "--place takes");
    is_refused({"--remesh"}, "--remesh makes a mesh", 1, "o.npy");
    is_refused({"--remesh", "--distance"}, "--distance does not go with --remesh");
    is_refused({"--remesh", "--coverage", "thin"}, "--coverage does not go with --remesh");
    is_refused({"--remesh", "--solid-extent", "outer"}, "--solid-extent does not go with --remesh");
    is_refused({"--remesh", "--fill", "mean"}, "--fill does not go with --remesh");
    is_refused({"--remesh", "-t", "color"}, "--target does not go with --remesh");
    is_refused({"--remesh", "--merge"}, "--merge does not go with --remesh");
    is_refused({"--remesh", "--points"}, "--points does not go with --remesh");
    is_refused({"--remesh", "--sparse"}, "--sparse does not go with --remesh");
    is_refused({"--remesh", "--iso", "inf"}, "--iso takes a finite distance");
    is_refused({"--remesh", "--backend", "cuda"}, "on the CPU alone", 5);
}

} // namespace
