// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The lines of an OBJ file, read as assimp reads them: the same numbers from the same digits. Lines that it reads in a
// way of its own (continued lines, odd line ends, free-form surfaces) are refused, never guessed at.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::assimp {

// The reason why an OBJ file cannot be read block by block, in one line.
struct obj_refusal : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// A file's lines, a block of which is held at a time.
class obj_lines {
public:
    explicit obj_lines(const std::filesystem::path& file);

    // The next line without its end, which stands behind it until the next call. False behind the last. Throws
    // obj_refusal for a line of more than a megabyte, one that the next one continues, and for bytes that end a line
    // for assimp alone.
    [[nodiscard]] bool next(std::string_view& line);
    [[nodiscard]] std::uint64_t number() const { return number_; } // of the last line, from 1

private:
    bool read_more();

    std::ifstream file_;
    std::vector<char> buffer_;
    std::size_t at_ = 0, end_ = 0; // of what is not a line yet, in the buffer
    std::uint64_t number_ = 0;
};

enum class obj_statement : std::uint8_t {
    nothing, // blank, a comment, or what changes no voxel: s, mg
    vertex,
    texcoord,
    normal,
    face,
    structure // g, o, usemtl, mtllib
};

// Throws obj_refusal for all others.
[[nodiscard]] obj_statement statement_of(std::string_view line);

struct obj_vertex {
    glm::vec3 position{0};
    glm::vec3 color{0}; // as the file has it
    bool has_color = false;
};

// A line that states a vertex, of obj_lines. Throws obj_refusal unless it has 3, 4 (homogeneous) or 6 numbers.
[[nodiscard]] obj_vertex vertex_of(std::string_view line);

// A line that states texture coordinates; v runs downwards, as in texture. A value that is not finite is 0, a third one
// is passed over. Throws obj_refusal unless it has 2 or 3 numbers.
[[nodiscard]] glm::vec2 texcoord_of(std::string_view line);
// Those of corners that name none.
inline constexpr glm::vec2 no_texcoord_value{0, 1};

// Lines of each kind that stand before another line.
struct obj_counts {
    std::uint64_t vertices = 0, texcoords = 0, normals = 0;

    void add(obj_statement statement) {
        if (statement == obj_statement::vertex) ++vertices;
        if (statement == obj_statement::texcoord) ++texcoords;
        if (statement == obj_statement::normal) ++normals;
    }
};

// Both are numbered from 0.
struct obj_corner {
    static constexpr std::uint32_t none = UINT32_MAX;             // no texture coordinates
    static constexpr std::uint32_t out_of_range = UINT32_MAX - 1; // some before the first

    std::uint32_t vertex = 0, texcoord = none;
};

// Appends the corners of a line that states a face. Throws obj_refusal where it has fewer than three corners or is no
// list of indices, and model_error for a vertex before the first. Indices behind the last are the caller's to find.
void add_face(std::string_view line, const obj_counts& before, std::vector<obj_corner>& corners);

// Calls visit(line) with all lines. An obj_refusal tells the line.
template <class Visit>
void for_each_obj_line(const std::filesystem::path& file, const Visit& visit) {
    obj_lines lines(file);
    try {
        for (std::string_view line; lines.next(line);) visit(line);
    } catch (const obj_refusal& refusal) {
        throw obj_refusal("line " + std::to_string(lines.number()) + ": " + refusal.what());
    }
}

} // namespace voxelize::assimp
