// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "glb_file.hpp"

#include "memory.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <system_error>

namespace voxelize {

std::unique_ptr<glb_file> glb_file::open(const std::filesystem::path& path, std::uint64_t room,
                                         const gltf_limits& limits, const gltf_options& options) {
    // A triangle has three bytes of indices at least, a vertex twelve of positions: what fits so is not looked at.
    constexpr double most_bytes = 36 * (1.0 / 3 + 1.0 / 12);
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (error || most_bytes * static_cast<double>(bytes) <= static_cast<double>(memory::room())) return nullptr;
    const std::optional<gltf_parts> parts = find_parts(path, limits, options);
    return parts ? std::make_unique<glb_file>(path, *parts, room) : nullptr;
}

glb_file::glb_file(const std::filesystem::path& path, const gltf_parts& parts, std::uint64_t room)
    : parts_(parts), file_(path), room_(room) {
    for (const gltf_parts::part& p : parts_.parts) {
        num_triangles_ += p.num_triangles;
        num_vertices_ += p.vertices.count;
    }
}

void glb_file::for_each_block(const visitor& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    std::vector<char> raw;
    std::vector<glm::vec3> corners;
    std::uint64_t before = 0;
    for (const gltf_parts::part& p : parts_.parts) {
        position_cache vertices(p.vertices, room_);
        for (std::uint64_t first = 0; first < p.num_triangles; first += block) {
            const std::uint64_t count = std::min(block, p.num_triangles - first);
            raw.resize(static_cast<std::size_t>(3 * count * p.index_bytes));
            if (p.index_bytes != 0) file_.read(p.first_index + 3 * first * p.index_bytes, raw);
            corners.clear();
            for (std::uint64_t i = 0; i < 3 * count; ++i) {
                std::uint64_t index = p.index_bytes != 0 ? 0 : 3 * first + i;
                if (p.index_bytes != 0) std::memcpy(&index, raw.data() + i * p.index_bytes, p.index_bytes);
                corners.push_back(vertices.at(index, file_));
            }
            visit(corners, before + first);
        }
        before += p.num_triangles;
    }
}

} // namespace voxelize
