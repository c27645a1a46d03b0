// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "stl_file.hpp"

#include "model/model_error.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

namespace voxelize {
namespace {

constexpr std::uint64_t stl_head = 84, stl_triangle = 50; // bytes

} // namespace

std::unique_ptr<stl_file> stl_file::open(const std::filesystem::path& path, bool colors) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (error || bytes < stl_head) return nullptr;
    auto result = std::make_unique<stl_file>();
    result->file_.open(path, std::ios::binary);
    std::uint32_t count = 0;
    result->file_.seekg(stl_head - sizeof(count));
    if (!result->file_.read(reinterpret_cast<char*>(&count), sizeof(count))) return nullptr;
    if (bytes != stl_head + stl_triangle * count) return nullptr;
    result->add_only_part(path, count);
    result->materials_[0].name = "DefaultMaterial"; // as its loader has it
    if (colors && result->is_colored()) return nullptr;
    return result;
}

template <class Visit>
void stl_file::for_each_raw_block(const Visit& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    std::vector<char> raw;
    file_.clear();
    file_.seekg(stl_head);
    for (std::uint64_t first = 0; first < num_triangles(); first += block) {
        const auto count = static_cast<std::size_t>(std::min(block, num_triangles() - first));
        raw.resize(count * stl_triangle);
        if (!file_.read(raw.data(), static_cast<std::streamsize>(raw.size())))
            throw model_error("the file ends before its " + std::to_string(num_triangles()) + " triangles do");
        visit(first, raw);
    }
}

// A header that gives a colour, or a facet whose last two bytes say that they are one.
bool stl_file::is_colored() {
    std::string header(stl_head, ' ');
    file_.clear();
    file_.seekg(0);
    file_.read(header.data(), static_cast<std::streamsize>(header.size()));
    bool found = header.find("COLOR=") != std::string::npos;
    for_each_raw_block([&](std::uint64_t, const std::vector<char>& facets) {
        for (std::size_t end = stl_triangle; end <= facets.size(); end += stl_triangle)
            found = found || (static_cast<unsigned char>(facets[end - 1]) & 0x80U) != 0;
    });
    return found;
}

void stl_file::read_part(std::size_t, const visitor& visit) {
    std::vector<glm::vec3> corners;
    for_each_raw_block([&](std::uint64_t first, const std::vector<char>& facets) {
        corners.resize(3 * facets.size() / stl_triangle);
        for (std::size_t i = 0; 3 * i < corners.size(); ++i) // behind the normal
            std::memcpy(corners.data() + 3 * i, facets.data() + i * stl_triangle + sizeof(glm::vec3),
                        3 * sizeof(glm::vec3));
        visit({0, first, corners, {}});
    });
}

} // namespace voxelize
