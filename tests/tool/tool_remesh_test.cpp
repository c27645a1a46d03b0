// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --remesh: closed meshes in every format, where their vertices lie, what is reported, and what is refused.
#include "../surfaces/mesh_judge.hpp"
#include "../surfaces/surface_support.hpp"
#include "tool_scenes.hpp"
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/glm.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
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

void write_obj(const std::string& path, const surface_tests::host_mesh& m) {
    std::ofstream file(path);
    for (const glm::vec3& p : m.positions) file << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (const glm::uvec3& t : m.triangles) file << "f " << t.x + 1 << ' ' << t.y + 1 << ' ' << t.z + 1 << '\n';
}

struct read_surface {
    std::vector<glm::dvec3> vertices;
    std::vector<glm::vec3> normals;
    std::vector<glm::ivec3> colors; // sRGB bytes
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
    const bool is_colored = bytes.find("property uchar blue\n") < at;
    s.vertices.resize(number_after("element vertex "));
    for (auto& v : s.vertices) {
        for (int a = 0; a < 3; ++a, at += 8) v[a] = value_at<double>(bytes, at);
        glm::vec3& n = s.normals.emplace_back();
        for (int a = 0; a < 3; ++a, at += 4) n[a] = value_at<float>(bytes, at);
        if (!is_colored) continue;
        glm::ivec3& c = s.colors.emplace_back();
        for (int a = 0; a < 3; ++a, ++at) c[a] = static_cast<std::uint8_t>(bytes[at]);
    }
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
        std::istringstream words(line);
        std::string what;
        words >> what;
        if (what == "v") {
            auto& v = s.vertices.emplace_back();
            words >> v.x >> v.y >> v.z;
            glm::dvec3 c;
            if (words >> c.x >> c.y >> c.z)
                s.colors.emplace_back(std::lround(255 * c.x), std::lround(255 * c.y), std::lround(255 * c.z));
        } else if (what == "vn") {
            auto& n = s.normals.emplace_back();
            words >> n.x >> n.y >> n.z;
        } else if (what == "f") {
            auto& f = s.faces.emplace_back();
            for (auto& i : f) {
                std::string corner;
                words >> corner;
                i = static_cast<std::uint32_t>(std::stoul(corner)) - 1;
                EXPECT_EQ(std::to_string(i + 1) + "//" + std::to_string(i + 1), corner);
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
    const json& attributes = root["meshes"][0]["primitives"][0]["attributes"];
    const auto offset_of = [&](const char* name) {
        const json& accessor = root["accessors"][attributes[name].get<std::size_t>()];
        EXPECT_EQ(s.vertices.size(), accessor["count"].get<std::size_t>());
        return bin + root["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>();
    };
    const std::size_t normals = offset_of("NORMAL");
    for (std::size_t n = 0; n < s.vertices.size(); ++n)
        for (int a = 0; a < 3; ++a) {
            if (a == 0) s.normals.emplace_back();
            s.normals[n][a] = value_at<float>(bytes, normals + 12 * n + 4 * static_cast<std::size_t>(a));
        }
    if (!attributes.contains("COLOR_0")) return s;
    const std::size_t colors = offset_of("COLOR_0");
    for (std::size_t n = 0; n < s.vertices.size(); ++n) {
        glm::ivec3& c = s.colors.emplace_back();
        for (int a = 0; a < 3; ++a) {
            const double linear =
                value_at<std::uint16_t>(bytes, colors + 8 * n + 2 * static_cast<std::size_t>(a)) / 65535.0;
            c[a] = static_cast<int>(
                std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
        }
        EXPECT_EQ(65535, value_at<std::uint16_t>(bytes, colors + 8 * n + 6));
    }
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

// A ball with a picture around it, whose colours run smoothly, and a base colour.
void write_painted_ball(const std::string& path) {
    builder file;
    std::vector<float> positions, texcoords;
    std::vector<std::uint32_t> indices;
    constexpr std::uint32_t columns = 48, rows = 24;
    for (std::uint32_t r = 0; r <= rows; ++r)
        for (std::uint32_t c = 0; c <= columns; ++c) {
            const double around = 6.283185307179586 * c / columns, down = 3.141592653589793 * r / rows;
            positions.insert(positions.end(), {static_cast<float>(std::sin(down) * std::cos(around)),
                                               static_cast<float>(std::sin(down) * std::sin(around)),
                                               static_cast<float>(std::cos(down))});
            texcoords.insert(texcoords.end(),
                             {static_cast<float>(c) / columns, static_cast<float>(r) / static_cast<float>(rows)});
            const std::uint32_t at = r * (columns + 1) + c, below = at + columns + 1;
            if (r < rows && c < columns) indices.insert(indices.end(), {at, below, at + 1, at + 1, below, below + 1});
        }
    std::vector<std::uint8_t> rgba;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const int wave = 2 * std::abs(x - 32) * 3; // meets itself where the picture does
            rgba.insert(rgba.end(),
                        {static_cast<std::uint8_t>(30 + wave), static_cast<std::uint8_t>(40 + 3 * y), 128, 255});
        }
    json more;
    more["pbrMetallicRoughness"]["baseColorFactor"] = {1.0, 0.5, 1.0, 1.0};
    const int material = add_textured_material(file, 64, 64, rgba, more);
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive =
        file.mesh({{"POSITION", file.accessor(positions, "VEC3")}, {"TEXCOORD_0", file.accessor(texcoords, "VEC2")}});
    primitive["indices"] = index_accessor;
    primitive["material"] = material;
    file.write_glb(path);
}

// The colours are those of the voxels that the surface touches, where the vertices lie.
TEST(Remeshing, TexturesBecomeColoursOfVertices) {
    const scratch_folder folder;
    write_painted_ball(folder / "m.glb");
    const outcome result =
        run(folder, {folder / "m.glb", "--remesh", "-r", "40", "-o", folder / "o.ply", "-o", folder / "o.obj", "-o",
                     folder / "o.glb", "-o", folder / "o.3mf", "-o", folder / "o.npz", "--compression", "0"});
    ASSERT_EQ(0, result.code) << result.err;
    const outcome drawn = run(folder, {folder / "m.glb", "-r", "40", "-t", "color", "-o", folder / "v.npy"});
    ASSERT_EQ(0, drawn.code) << drawn.err;
    const array voxels = read_npy(folder / "v.npy");
    const read_surface ply = read_surface_ply(folder / "o.ply"), obj = read_surface_obj(folder / "o.obj"),
                       glb = read_surface_glb(folder / "o.glb");
    EXPECT_TRUE(ply.is_closed());
    ASSERT_EQ(ply.vertices.size(), ply.colors.size());
    EXPECT_EQ(ply.colors, obj.colors);
    ASSERT_EQ(ply.colors.size(), glb.colors.size());
    for (std::size_t v = 0; v < ply.colors.size(); ++v) // of 16 bits in linear light
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(ply.colors[v][c], glb.colors[v][c], 1);
    ASSERT_EQ(std::size_t{40} * 40 * 40, voxels.voxels());
    const double size = 2.0 * 1.0002 / 40;
    int seen = 0, least = 255, most = 0;
    for (std::size_t v = 0; v < ply.vertices.size(); ++v) {
        std::size_t at = 0;
        for (int a = 2; a >= 0; --a)
            at = 40 * at + static_cast<std::size_t>(std::clamp(ply.vertices[v][a] / size + 20, 0.0, 39.0));
        const auto voxel = [&](std::size_t c) { return voxels.at<std::uint8_t>(4 * at + c); };
        if (voxel(3) == 0 || std::abs(ply.vertices[v].z) > 0.9) continue; // at the poles the picture is drawn together
        ++seen;
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(voxel(static_cast<std::size_t>(c)), ply.colors[v][c], 12) << ply.vertices[v].z;
        least = std::min(least, ply.colors[v].x);
        most = std::max(most, ply.colors[v].x);
    }
    EXPECT_GT(seen, 2000);
    EXPECT_LT(least, 50);
    EXPECT_GT(most, 200);
    for (std::size_t v = 0; v < ply.vertices.size(); ++v) { // a ball's
        EXPECT_GT(glm::dot(glm::dvec3(ply.normals[v]), ply.vertices[v]), 0.98);
        EXPECT_NEAR(1, glm::length(ply.normals[v]), 1e-6);
        ASSERT_EQ(ply.normals[v], glb.normals[v]);
        ASSERT_LT(glm::length(ply.normals[v] - obj.normals[v]), 2e-5);
    }
    // Every colour once, and three of them a triangle.
    const std::string text = read_file(folder / "o.3mf");
    const auto count = [&](const std::string& what) {
        std::size_t n = 0;
        for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
        return n;
    };
    std::set<std::array<int, 3>> different;
    for (const glm::ivec3& c : ply.colors) different.insert({c.x, c.y, c.z});
    EXPECT_EQ(different.size(), count("<m:color "));
    EXPECT_EQ(ply.faces.size(), count("pid=\"2\" p1="));
    const glm::ivec3 first = ply.colors[ply.faces[0][0]];
    std::array<char, 32> color{};
    std::snprintf(color.data(), color.size(), "#%02X%02X%02X", static_cast<unsigned>(first.x),
                  static_cast<unsigned>(first.y), static_cast<unsigned>(first.z));
    const std::size_t found = text.find(color.data()), triangle = text.find(" p1=\"");
    ASSERT_NE(std::string::npos, found);
    const auto number = std::count(text.begin() + static_cast<std::ptrdiff_t>(text.find("<m:colorgroup")),
                                   text.begin() + static_cast<std::ptrdiff_t>(found), '#');
    EXPECT_EQ(std::to_string(number), text.substr(triangle + 5, text.find('"', triangle + 5) - triangle - 5));
}

TEST(Remeshing, ColoursOfMaterialsAndNoColours) {
    const scratch_folder folder;
    write_painted_ball(folder / "m.glb");
    const auto make = [&](const std::string& model, std::vector<std::string> more) {
        more.insert(more.begin(), {folder / model, "--remesh", "-r", "12", "-o", folder / "o.ply"});
        const outcome result = run(folder, more);
        EXPECT_EQ(0, result.code) << result.err;
        return read_surface_ply(folder / "o.ply");
    };
    EXPECT_FALSE(make("m.glb", {}).colors.empty());
    EXPECT_TRUE(make("m.glb", {"--no-color"}).colors.empty());
    EXPECT_EQ(make("m.glb", {}).faces, make("m.glb", {"--no-color"}).faces);
    write_crossing_boxes(folder / "plain.glb");
    EXPECT_TRUE(make("plain.glb", {"--close-holes"}).colors.empty()); // it has none
    EXPECT_FALSE(make("m.glb", {"--iso", "0.1", "--padding", "3"}).colors.empty());
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

// Sharp vertices of thin crossing parts lie on the wrong sides of each other.
TEST(Remeshing, EmbeddedMeshesDoNotIntersectThemselves) {
    const scratch_folder folder;
    write_obj(folder / "m.obj", surface_tests::needles(0));
    const std::vector<std::string> arguments{
        folder / "m.obj", "--remesh", "-r", "13", "--report", "--stats", "json", "-o", folder / "o.ply"};
    const outcome plain = run(folder, arguments);
    ASSERT_EQ(0, plain.code) << plain.err;
    EXPECT_EQ(std::string::npos, plain.err.find("intersect"));
    EXPECT_FALSE(json::parse(plain.out)["remesh"].contains("embedded"));
    const read_surface before = read_surface_ply(folder / "o.ply");
    std::vector<std::string> more = arguments;
    more.emplace_back("--embedded");
    const outcome result = run(folder, more);
    ASSERT_EQ(0, result.code) << result.err;
    const json counts = json::parse(result.out)["remesh"]["embedded"];
    EXPECT_EQ(0, counts["intersecting_pairs"]);
    EXPECT_LT(0, counts["moved_vertices"]);
    EXPECT_LT(0, counts["rounds"]);
    const std::string line = "0 pairs of triangles intersect; " + counts["moved_vertices"].dump() +
                             " vertices were moved in " + counts["rounds"].dump() + " rounds\n";
    EXPECT_NE(std::string::npos, result.err.find(line)) << result.err;
    const read_surface after = read_surface_ply(folder / "o.ply");
    EXPECT_TRUE(after.is_closed());
    ASSERT_EQ(before.vertices.size(), after.vertices.size());
    std::uint64_t moved = 0;
    for (std::size_t v = 0; v < after.vertices.size(); ++v)
        if (after.vertices[v] != before.vertices[v]) ++moved;
    EXPECT_LT(0U, moved);
    EXPECT_LE(moved, counts["moved_vertices"].get<std::uint64_t>());
}

// Bits of this grid alone are 3.1 GiB: samples lie in bricks, and what is needed follows the model.
TEST(Remeshing, LargeGridsTakeMemoryByTheSurface) {
    const scratch_folder folder;
    surface_tests::host_mesh model = surface_tests::octahedron(glm::vec3(0.0F), 0.01F);
    model.add(surface_tests::octahedron(glm::vec3(1.0F), 0.01F));
    write_obj(folder / "m.obj", model);
    const outcome result = run(folder, {folder / "m.obj", "--remesh", "-r", "3000", "--max-memory", "300", "--stats",
                                        "json", "-o", folder / "o.ply"});
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_EQ(2, json::parse(result.out)["remesh"]["components"]);
    EXPECT_TRUE(read_surface_ply(folder / "o.ply").is_closed());
    const outcome refused = run(folder, {folder / "m.obj", "--remesh", "-r", "3000", "--max-memory", "300", "--iso",
                                         "0.2", "--embedded", "-o", folder / "o.ply"});
    EXPECT_NE(0, refused.code);
    EXPECT_NE(std::string::npos, refused.err.find("MiB are needed")) << refused.err;
}

// The bytes of a run that holds the mesh, and its counts and warnings.
TEST(Remeshing, MeshesThatDoNotFitAreMadeInSlabs) {
    if (sanitized) return; // which takes memory of its own
    const scratch_folder folder;
    write_painted_ball(folder / "m.glb");
    surface_tests::host_mesh open = surface_tests::ball(glm::vec3(0.5F), 0.4F, 4);
    open.add(surface_tests::box(glm::vec3(0.1F), glm::vec3(0.7F, 0.3F, 0.9F)));
    open.triangles.erase(open.triangles.begin() + 100);
    write_obj(folder / "open.obj", open);
    struct way {
        std::string model, output;
        std::vector<std::string> more;
    };
    for (const way& w :
         {way{"m.glb", "glb", {"-r", "300"}}, way{"m.glb", "npz", {"-r", "240", "--quads", "--place", "mean"}},
          way{"open.obj", "stl", {"-r", "300", "--close-holes", "--place", "corner"}},
          way{"open.obj", "ply", {"-r", "200", "--iso", "0.01", "--padding", "4"}}}) {
        const auto make = [&](const std::string& name, const std::vector<std::string>& limit) {
            std::vector<std::string> all{folder / w.model, "--remesh", "--stats", "json",
                                         "--compression",  "0",        "-o",      folder / name + "." + w.output};
            all.insert(all.end(), w.more.begin(), w.more.end());
            all.insert(all.end(), limit.begin(), limit.end());
            return run(folder, all);
        };
        const outcome whole = make("whole", {});
        ASSERT_EQ(0, whole.code) << whole.err;
        const json a = json::parse(whole.out);
        const std::uint64_t limit = a["peak_memory_bytes"].get<std::uint64_t>() * 2 / 3 >> 20;
        const outcome tight = make("tight", {"--max-memory", std::to_string(limit)});
        ASSERT_EQ(0, tight.code) << w.output << ": " << tight.err;
        const json b = json::parse(tight.out);
        EXPECT_LE(b["peak_memory_bytes"], limit << 20) << w.output;
        EXPECT_EQ(1, a["slabs"]);
        EXPECT_GT(b["slabs"], 1) << w.output;
        EXPECT_EQ(a["remesh"], b["remesh"]) << w.output;
        EXPECT_EQ(a["warnings"], b["warnings"]) << w.output;
        EXPECT_TRUE(read_file(folder / "whole." + w.output) == read_file(folder / "tight." + w.output)) << w.output;
        for (const char* name : {"whole.", "tight."}) fs::remove(folder / name + w.output);
    }
    // What looks at the whole grid is not.
    const outcome refused = run(folder, {folder / "m.glb", "--remesh", "-r", "300", "--embedded", "--max-memory", "40",
                                         "-o", folder / "o.ply"});
    EXPECT_EQ(3, refused.code) << refused.err;
    EXPECT_NE(std::string::npos, refused.err.find("MiB are needed")) << refused.err;
    std::set<std::string> files; // no temporary ones
    for (const fs::directory_entry& entry : fs::directory_iterator(folder.path()))
        files.insert(entry.path().filename().string());
    EXPECT_EQ((std::set<std::string>{"m.glb", "open.obj", "stderr.txt", "stdout.txt"}), files);
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

// A sheet of 4 by 2, whose box is flat: the grid holds the plate that it becomes, without --padding.
TEST(Remeshing, GridsGrowWithTheLevel) {
    const scratch_folder folder;
    builder file;
    file.mesh({{"POSITION",
                file.accessor(std::vector<float>{0, 0, 1, 4, 0, 1, 4, 2, 1, 0, 0, 1, 4, 2, 1, 0, 2, 1}, "VEC3")}});
    file.write_glb(folder / "m.glb");
    const auto remesh = [&](std::vector<std::string> more) {
        more.insert(more.begin(),
                    {folder / "m.glb", "--remesh", "--iso", "0.25", "--place", "mean", "-o", folder / "o.ply"});
        return run(folder, more);
    };
    const outcome result = remesh({"-r", "40"});
    ASSERT_EQ(0, result.code) << result.err;
    const read_surface s = read_surface_ply(folder / "o.ply");
    EXPECT_TRUE(s.is_closed());
    glm::dvec3 low(1e9), high(-1e9);
    double volume = 0;
    for (const glm::dvec3& p : s.vertices) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    for (const auto& f : s.faces)
        volume += glm::dot(s.vertices[f[0]], glm::cross(s.vertices[f[1]], s.vertices[f[2]])) / 6;
    for (const double off : {low.x + 0.25, low.y + 0.25, low.z - 0.75, high.x - 4.25, high.y - 2.25, high.z - 1.25})
        EXPECT_NEAR(0, off, 0.02); // means of a tube's crossings lie within it
    // The sheet, half a tube along its edges, quarters of a ball at its corners.
    constexpr double pi = 3.14159265358979;
    EXPECT_NEAR(8 * 0.5 + 12 * pi * 0.0625 / 2 + pi * 4 / 3 * 0.015625, volume, 0.12);
    // In a grid of its own the mesh ends where the grid does, and that is said.
    const outcome cut = remesh({"--origin", "0,0,0", "--extent", "10,10,10", "-s", "0.2"});
    ASSERT_EQ(0, cut.code) << cut.err;
    EXPECT_NE(std::string::npos, cut.err.find("the surface of --iso leaves the grid")) << cut.err;
    const outcome held = remesh({"--origin", "-1,-1,0", "--extent", "30,20,10", "-s", "0.2"});
    EXPECT_EQ(std::string::npos, held.err.find("leaves the grid")) << held.err;
}

// Far from 0, where floats are whole numbers and voxels are halves.
TEST(Remeshing, StlSaysThatItsFloatsMergeVertices) {
    const scratch_folder folder;
    surface_tests::host_mesh box = surface_tests::box(glm::vec3(16777216.0F), glm::vec3(16777316.0F));
    std::ofstream file(folder / "m.obj");
    file.precision(9);
    for (const glm::vec3& p : box.positions) file << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (const glm::uvec3& t : box.triangles) file << "f " << t.x + 1 << ' ' << t.y + 1 << ' ' << t.z + 1 << '\n';
    file.close();
    const auto remesh = [&](const std::string& name) {
        const outcome result = run(folder, {folder / "m.obj", "--remesh", "-r", "200", "--padding", "2", "--place",
                                            "mean", "-o", folder / name});
        EXPECT_EQ(0, result.code) << result.err;
        return result.err;
    };
    const std::string warning = "the floats of .stl merge vertices of this mesh";
    EXPECT_NE(std::string::npos, remesh("o.stl").find(warning));
    EXPECT_EQ(std::string::npos, remesh("o.ply").find(warning));
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
    is_refused({"--embedded"}, "--embedded goes with --remesh");
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
    is_refused({"--remesh", "--rank", "0", "--world-size", "2"}, "--remesh is one piece of work: no --resume");
    is_refused({"--remesh"}, "{z} is the number of a layer, and a mesh is one file", 1, "l{z}.ply");
    is_refused({"--remesh", "--backend", "cuda", "--devices", "2"}, "one GPU remeshes", 5);
}

} // namespace
