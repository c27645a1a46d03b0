// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "stl_file.hpp"

#include "model_error.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <system_error>
#include <vector>

namespace voxelize {
namespace {

constexpr std::uint64_t stl_head = 84, stl_triangle = 50; // bytes

} // namespace

std::unique_ptr<stl_file> stl_file::open(const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (error || bytes < stl_head) return nullptr;
    auto result = std::make_unique<stl_file>();
    result->file_.open(path, std::ios::binary);
    std::uint32_t count = 0;
    result->file_.seekg(stl_head - sizeof(count));
    if (!result->file_.read(reinterpret_cast<char*>(&count), sizeof(count))) return nullptr;
    if (bytes != stl_head + stl_triangle * count) return nullptr;
    result->num_triangles_ = count;
    return result;
}

void stl_file::for_each_block(const visitor& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    std::vector<char> raw;
    std::vector<glm::vec3> corners;
    file_.clear();
    file_.seekg(stl_head);
    for (std::uint64_t first = 0; first < num_triangles_; first += block) {
        const auto count = static_cast<std::size_t>(std::min(block, num_triangles_ - first));
        raw.resize(count * stl_triangle);
        corners.resize(3 * count);
        if (!file_.read(raw.data(), static_cast<std::streamsize>(raw.size())))
            throw model_error("the file ends before its " + std::to_string(num_triangles_) + " triangles do");
        for (std::size_t i = 0; i < count; ++i) // behind the normal
            std::memcpy(corners.data() + 3 * i, raw.data() + i * stl_triangle + sizeof(glm::vec3),
                        3 * sizeof(glm::vec3));
        visit(corners, first);
    }
}

} // namespace voxelize
