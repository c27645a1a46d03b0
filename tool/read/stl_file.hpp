// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A binary STL file, read block by block: for models that do not fit into memory. The colours that some programs put
// into it are not read.

#include "triangle_stream.hpp"

#include <filesystem>
#include <fstream>
#include <memory>

namespace voxelize {

class stl_file : public triangle_stream {
public:
    // The file at PATH, if it is one: 84 bytes, the last four of which count the triangles of 50 bytes that follow.
    // With `colors`, the whole file is searched first, and one that has colours is refused.
    [[nodiscard]] static std::unique_ptr<stl_file> open(const std::filesystem::path& path, bool colors);

    void read_part(std::size_t part, const visitor& visit) override;

private:
    // Calls visit(number of the first, bytes) for the facets in order, some thousands at a time.
    template <class Visit>
    void for_each_raw_block(const Visit& visit);
    [[nodiscard]] bool is_colored();

    std::ifstream file_;
};

} // namespace voxelize
