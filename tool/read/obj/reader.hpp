// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// OBJ files -> mesh_reader. The text is read three times: for groups, materials and counts, for vertices, and for
// faces. Faces of one object, group and material are one part, in the order of the first of each.

#include "read/mesh/mesh_reader.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace voxelize {

// Polygons and lines of an OBJ file, as far as its lines can be read.
struct obj_counts {
    std::uint64_t vertices = 0, texcoords = 0;
    std::uint64_t faces = 0;    // statements "f" ("fo")
    std::uint64_t elements = 0; // those and "l" and "p"
    std::uint64_t corners = 0;  // of faces, lines and points
};

// Counts the statements of an OBJ file. Throws model_error where the file is no text.
[[nodiscard]] obj_counts count_obj(const std::filesystem::path& path);

// Opens an OBJ file and reads its groups and material libraries. Throws model_error where it cannot be read. Faces with
// indices of no vertex, and vertices without three numbers, are an error of read_vertices() and read_faces(), or with
// options.lenient a warning.
[[nodiscard]] std::unique_ptr<mesh_reader> open_obj(const std::filesystem::path& path, const gltf_options& options);

namespace obj {

// Calls visit(rest) with what follows "mtllib" in each such line of the file. Throws model_error.
void for_each_library_line(const std::filesystem::path& path, const std::function<void(std::string_view)>& visit);

} // namespace obj
} // namespace voxelize
