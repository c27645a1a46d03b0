// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary STL file, read block by block: for models that do not fit into memory. Colours, which some programs put into
// it, are not read.

#include "triangle_stream.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>

namespace voxelize {

class stl_file : public triangle_stream {
public:
    // The file at PATH, if it is one: 84 bytes, the last four of which count the triangles of 50 bytes that follow.
    [[nodiscard]] static std::unique_ptr<stl_file> open(const std::filesystem::path& path);

    [[nodiscard]] std::uint64_t num_triangles() const override { return num_triangles_; }
    void for_each_block(const visitor& visit) override;

private:
    std::ifstream file_;
    std::uint64_t num_triangles_ = 0;
};

} // namespace voxelize
