// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "gltf_stream.hpp"

#include "read/assimp/file_name.hpp"
#include "read/gltf/resources.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

// At least the bytes of all buffers that a .gltf names: the sum of what its text says of lengths in bytes, which are
// those of buffers and of their views.
double claimed_bytes(const std::filesystem::path& file) {
    constexpr std::string_view key = "\"byteLength\"";
    const gltf::mapped_file mapped(file, UINT64_MAX);
    const std::string_view text{reinterpret_cast<const char*>(mapped.bytes().data()), mapped.bytes().size()};
    double sum = 0;
    for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at)) {
        at = std::min(text.find_first_not_of(" \t\r\n:", at + key.size()), text.size());
        double number = 0;
        for (; at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at) number = 10 * number + (text[at] - '0');
        sum += number;
    }
    return sum;
}

} // namespace

std::unique_ptr<gltf_stream> gltf_stream::open(const std::filesystem::path& path, const stream_room& room,
                                               const gltf_limits& limits, const gltf_options& options) {
    // A triangle has three bytes of indices at least, a vertex twelve of positions, and a mesh may be shown by several
    // nodes: what fits so is not looked at.
    constexpr double most_instances = 8;
    constexpr double most_bytes = most_instances * 36 * (1.0 / 3 + 1.0 / 12);
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return nullptr;
    const double bytes = assimp::lower_extension(path) == ".gltf"
                             ? claimed_bytes(path)
                             : static_cast<double>(std::filesystem::file_size(path, error));
    if (error || most_bytes * bytes <= room.loaded) return nullptr;
    std::optional<gltf_parts> parts = find_parts(path, limits, options);
    return parts ? std::make_unique<gltf_stream>(path, std::move(*parts), room.stream, limits, options) : nullptr;
}

gltf_stream::gltf_stream(const std::filesystem::path& path, gltf_parts&& parts, std::uint64_t room,
                         const gltf_limits& limits, const gltf_options& options)
    : path_(path), limits_(limits), options_(options), source_(std::move(parts)), room_(room) {
    for (const std::filesystem::path& file : source_.files) files_.emplace_back(file);
    materials_ = source_.materials;
    warnings_ = source_.warnings;
    std::uint64_t first = 0;
    for (const gltf_parts::part& p : source_.parts) {
        parts_.push_back({p.name, p.to_world, p.material, first, p.num_triangles, p.texcoords.has_value()});
        first += p.num_triangles;
        num_vertices_ += p.vertices.count;
        has_colors_ = has_colors_ || p.colors.has_value();
        value_bytes_ += static_cast<double>(
            p.vertices.count * ((p.colors ? sizeof(glm::vec4) : 0) + (p.texcoords ? sizeof(glm::vec2) : 0)));
    }
}

void gltf_stream::read_part(std::size_t part, const visitor& visit) {
    constexpr std::uint64_t block = 16384; // triangles
    const gltf_parts::part& p = source_.parts[part];
    const std::uint64_t room = room_ / (1 + (p.colors ? 1 : 0) + (p.texcoords ? 1 : 0));
    position_cache vertices(p.vertices, room);
    std::optional<color_cache> vertex_colors;
    if (p.colors) vertex_colors.emplace(*p.colors, room);
    std::optional<texcoord_cache> vertex_texcoords;
    if (p.texcoords) vertex_texcoords.emplace(*p.texcoords, room);
    std::vector<char> raw;
    std::vector<glm::vec3> corners;
    std::vector<glm::vec4> colors;
    std::vector<glm::vec2> texcoords;
    for (std::uint64_t first = 0; first < p.num_triangles; first += block) {
        const std::uint64_t count = std::min(block, p.num_triangles - first);
        raw.resize(static_cast<std::size_t>(3 * count * p.index_bytes));
        if (p.index_bytes != 0) files_[p.index_file].read(p.first_index + 3 * first * p.index_bytes, raw);
        corners.clear();
        colors.clear();
        texcoords.clear();
        for (std::uint64_t i = 0; i < 3 * count; ++i) {
            std::uint64_t index = p.index_bytes != 0 ? 0 : 3 * first + i;
            if (p.index_bytes != 0) std::memcpy(&index, raw.data() + i * p.index_bytes, p.index_bytes);
            corners.push_back(vertices.at(index, files_[p.vertex_file]));
            if (vertex_colors) colors.push_back(vertex_colors->at(index, files_[p.color_file]));
            if (vertex_texcoords) texcoords.push_back(vertex_texcoords->at(index, files_[p.texcoord_file]));
        }
        visit({part, parts_[part].first_number + first, corners, colors, texcoords});
    }
}

std::optional<std::uint64_t> gltf_stream::count_not_finite() {
    std::uint64_t count = 0;
    for (const gltf_parts::vertex_list& list : source_.vertices)
        count += voxelize::count_not_finite(list.layout, files_[list.file]);
    return count;
}

void gltf_stream::read_textures(const picture_hook& take) {
    if (!has_texcoords()) return;
    gltf_textures read = voxelize::read_textures(path_, limits_, options_, {{}, take});
    materials_ = std::move(read.materials);
    textures_ = std::move(read.textures);
    images_ = std::move(read.images);
    warnings_.insert(warnings_.end(), read.warnings.begin(), read.warnings.end());
}

} // namespace voxelize
