// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Small files of PLY, STL and OFF that tests write, and what the tool reads of them, loaded and streamed.

#include "read/model_file.hpp"
#include "read/triangle_stream.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace mesh_files {

namespace fs = std::filesystem;

// A folder that goes with the object.
class folder {
public:
    folder() {
        std::string name = (fs::temp_directory_path() / "voxelpipe_readers_XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        path_ = name;
    }
    ~folder() { fs::remove_all(path_); }
    folder(const folder&) = delete;
    folder& operator=(const folder&) = delete;
    [[nodiscard]] const fs::path& path() const { return path_; }
    [[nodiscard]] fs::path write(const std::string& name, const std::string& bytes) const {
        std::ofstream(path_ / name, std::ios::binary) << bytes;
        return path_ / name;
    }

private:
    fs::path path_;
};

// A value as a file has it, with the big end first where that is asked for.
template <class T>
std::string bytes_of(T value, bool is_big = false) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (is_big) std::reverse(bytes.begin(), bytes.end());
    return bytes;
}

// A triangle as it is drawn: corners in the world, linear colours of the corners.
struct triangle {
    std::array<glm::dvec3, 3> corners;
    std::array<glm::vec4, 3> colors;
};

struct model {
    std::vector<triangle> triangles;
    std::vector<std::array<glm::dvec3, 2>> lines;
    std::vector<std::string> warnings;
    std::uint64_t vertices = 0;
    bool is_refused_as_stream = false;
};

inline model loaded(const fs::path& file, const voxelize::load_options& options = {}) {
    const voxelize::scene scene = voxelize::load_model(file, options);
    model found;
    found.warnings = scene.warnings;
    found.vertices = scene.vertex_count();
    for (const voxelize::instance& shown : scene.instances) {
        const voxelize::primitive& part = scene.primitives.at(shown.primitive);
        const glm::vec4 base = scene.materials.at(part.material).base_color;
        for (const glm::uvec3& t : part.triangles) {
            triangle& made = found.triangles.emplace_back();
            for (int k = 0; k < 3; ++k) {
                made.corners[static_cast<std::size_t>(k)] = shown.to_world(part.positions.at(t[k]));
                made.colors[static_cast<std::size_t>(k)] = part.colors.empty() ? base : base * part.colors.at(t[k]);
            }
        }
        for (const glm::uvec2& l : part.lines)
            found.lines.push_back({shown.to_world(part.positions.at(l.x)), shown.to_world(part.positions.at(l.y))});
    }
    return found;
}

inline model streamed(const fs::path& file, const voxelize::load_options& options = {}) {
    const voxelize::opened_stream opened =
        voxelize::open_stream(file, {std::uint64_t{1} << 20, 0}, file.parent_path(), options);
    model found;
    if (!opened.stream) {
        EXPECT_NE("", opened.refusal);
        found.is_refused_as_stream = true;
        return found;
    }
    voxelize::triangle_stream& stream = *opened.stream;
    (void)stream.bounds();
    stream.read_textures({});
    stream.for_each_block([&](const voxelize::triangle_stream::block& b) {
        const voxelize::triangle_stream::part& part = stream.parts().at(b.part);
        const glm::vec4 base = stream.materials().at(part.material).base_color;
        for (std::size_t i = 0; i < b.corners.size(); i += 3) {
            triangle& made = found.triangles.emplace_back();
            for (std::size_t k = 0; k < 3; ++k) {
                made.corners[k] = part.to_world(b.corners[i + k]);
                made.colors[k] = b.colors.empty() ? base : base * b.colors[i + k];
            }
        }
    });
    found.warnings = stream.warnings();
    found.vertices = stream.num_vertices();
    return found;
}

// Loads the file, and expects a stream of it to be the same, bit for bit.
inline model read(const fs::path& file, const voxelize::load_options& options = {}) {
    const model whole = loaded(file, options);
    const model blocks = streamed(file, options);
    EXPECT_EQ(!whole.lines.empty(), blocks.is_refused_as_stream) << file;
    if (blocks.is_refused_as_stream) return whole;
    EXPECT_EQ(whole.warnings, blocks.warnings) << file;
    EXPECT_EQ(whole.vertices, blocks.vertices) << file;
    EXPECT_EQ(whole.triangles.size(), blocks.triangles.size()) << file;
    for (std::size_t i = 0; i < std::min(whole.triangles.size(), blocks.triangles.size()); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
            for (int a = 0; a < 3; ++a)
                EXPECT_TRUE(same(whole.triangles[i].corners[k][a], blocks.triangles[i].corners[k][a])) << file << i;
            EXPECT_EQ(whole.triangles[i].colors[k], blocks.triangles[i].colors[k]) << file << ' ' << i;
        }
    return whole;
}

inline std::string error_of(const fs::path& file, const voxelize::load_options& options = {}) {
    try {
        (void)loaded(file, options);
    } catch (const voxelize::model_error& error) {
        for (const char c : std::string(error.what())) EXPECT_TRUE(c >= ' ' && c <= '~') << error.what();
        return error.what();
    }
    return "no error";
}

// The sRGB bytes of a linear colour.
inline std::array<int, 3> shown_as(const glm::vec4& linear) {
    std::array<int, 3> bytes{};
    for (int i = 0; i < 3; ++i) {
        const double c = linear[i];
        bytes[static_cast<std::size_t>(i)] =
            static_cast<int>(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
    }
    return bytes;
}

// The area of all triangles.
inline double area_of(const model& m) {
    double sum = 0;
    for (const triangle& t : m.triangles) {
        const glm::dvec3 a = t.corners[1] - t.corners[0], b = t.corners[2] - t.corners[0];
        const glm::dvec3 n(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        sum += std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z) / 2;
    }
    return sum;
}

// The unit cube: 12 triangles of area 6, each colour the one that is given.
inline void expect_cube(const model& m, std::array<int, 3> color = {255, 255, 255}) {
    EXPECT_EQ(12U, m.triangles.size());
    EXPECT_NEAR(6, area_of(m), 1e-6);
    glm::dvec3 low(1e9), high(-1e9);
    for (const triangle& t : m.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            low = glm::min(low, t.corners[k]);
            high = glm::max(high, t.corners[k]);
            EXPECT_EQ(color, shown_as(t.colors[k]));
        }
    EXPECT_EQ(glm::dvec3(0), low);
    EXPECT_EQ(glm::dvec3(1), high);
}

inline const std::array<std::array<int, 4>, 6> cube_faces{
    {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
// Corner i of the cube along an axis.
inline int cube_corner(int i, int axis) { return i >> axis & 1; }

// Lines of the cube's vertices and faces as text, each followed by MORE.
inline std::string cube_vertices(const std::string& more = "", const std::string& end = "\n") {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += std::to_string(cube_corner(i, 0)) + ' ' + std::to_string(cube_corner(i, 1)) + ' ' +
                std::to_string(cube_corner(i, 2)) + more + end;
    return text;
}
inline std::string cube_polygons(const std::string& more = "", const std::string& end = "\n") {
    std::string text;
    for (const auto& face : cube_faces) {
        text += '4';
        for (const int v : face) text += ' ' + std::to_string(v);
        text += more + end;
    }
    return text;
}

} // namespace mesh_files
