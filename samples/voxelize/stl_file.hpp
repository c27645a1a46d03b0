// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary STL file, read block by block: for models that do not fit into memory. Colours, which some programs put into
// it, are not read.

#include "placement.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <span>

namespace voxelize {

class stl_file {
public:
    // The file at PATH, if it is one: 84 bytes, the last four of which count the triangles of 50 bytes that follow.
    [[nodiscard]] static std::optional<stl_file> open(const std::filesystem::path& path);

    [[nodiscard]] std::uint64_t num_triangles() const { return num_triangles_; }
    // Calls visit(corners, number of the first triangle) with all triangles in order, three corners each, some
    // thousands at a time. Throws model_error where the file ends before them.
    void for_each_block(const std::function<void(std::span<const glm::vec3> corners, std::uint64_t first)>& visit);
    // The box around all finite corners.
    [[nodiscard]] bounding_box bounds();

private:
    std::ifstream file_;
    std::uint64_t num_triangles_ = 0;
};

} // namespace voxelize
