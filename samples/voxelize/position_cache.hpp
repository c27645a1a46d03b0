// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Positions that stay in their file: blocks of them are read where they are asked for, and some blocks are kept. A mesh
// whose faces name vertices that lie near each other in the file is read about once.

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

namespace voxelize {

// Where positions lie in a file.
struct position_layout {
    std::uint64_t first = 0; // byte of the first vertex
    std::uint64_t count = 0; // vertices
    std::size_t stride = 0;  // bytes from one to the next
    std::size_t place[3]{};  // bytes of x, y and z from there
    bool is_double[3]{};     // otherwise float
};

// A file whose parts are read where they lie. Throws model_error where it ends before them.
class model_bytes {
public:
    explicit model_bytes(const std::filesystem::path& path) : file_(path, std::ios::binary) {}
    void read(std::uint64_t offset, std::span<char> bytes);

private:
    std::ifstream file_;
};

class position_cache {
public:
    // room: bytes of the blocks that are kept; at least eight of 4096 vertices are.
    position_cache(const position_layout& layout, std::uint64_t room);

    // Throws model_error for an index that names no vertex.
    [[nodiscard]] const glm::vec3& at(std::uint64_t i, model_bytes& file);

private:
    struct block {
        std::uint64_t number = ~std::uint64_t{0};
        std::vector<glm::vec3> positions;
    };
    position_layout layout_;
    std::vector<block> blocks_; // block b at b % size
    std::vector<char> raw_;
};

} // namespace voxelize
