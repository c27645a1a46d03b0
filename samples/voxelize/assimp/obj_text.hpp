// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The lines of an OBJ file, read as assimp reads them: the same numbers from the same digits. Lines that it reads in a
// way of its own (continued lines, odd line ends, free-form surfaces) are refused, never guessed at.

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

// What keeps an OBJ file from being read block by block, in one line.
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
    nothing, // blank, a comment, or what changes no voxel: vt, vn, s, mg
    vertex,
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

// Appends the vertices of a line that states a face, numbered from 0; `before` of them stand before the line. Throws
// obj_refusal where it has fewer than three corners or is no list of indices, and model_error for one before the first
// vertex. Indices behind the last are the caller's to find.
void add_face(std::string_view line, std::uint64_t before, std::vector<std::uint32_t>& corners);

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
