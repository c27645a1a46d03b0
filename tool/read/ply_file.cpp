// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "ply_file.hpp"

#include "model/model_error.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace voxelize {
namespace {

constexpr std::size_t block_faces = 16384;

// Bytes of a scalar type; 0 for a name that is none.
std::size_t bytes_of(const std::string& type) {
    if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
    if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
    if (type == "int" || type == "uint" || type == "int32" || type == "uint32" || type == "float" || type == "float32")
        return 4;
    return type == "double" || type == "float64" ? 8 : 0;
}

// The vertex properties that are colours for a loader, by their names there. Only the first four are read here.
constexpr std::string_view color_names[] = {"red", "green", "blue", "alpha"};
constexpr std::string_view other_color_names[] = {"r", "g", "b", "diffuse_red", "diffuse_green", "diffuse_blue"};

// A number without sign, or one that is not negative.
std::uint64_t number_at(const char* from, std::size_t bytes) {
    std::uint64_t value = 0;
    std::memcpy(&value, from, bytes);
    return value;
}

} // namespace

std::unique_ptr<ply_file> ply_file::open(const std::filesystem::path& path, std::uint64_t room, bool colors) {
    constexpr std::uint64_t longest_header = 1 << 16;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (error) return nullptr;
    layout f;
    std::ifstream file(path, std::ios::binary);
    std::string line, element;
    bool is_ply = false, is_binary = false, has_axis[3]{}, has_list = false, has_color[4]{};
    std::string color_type;
    color_layout found_colors;
    while (file.good() && static_cast<std::uint64_t>(file.tellg()) < longest_header && std::getline(file, line)) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        std::istringstream words(line);
        std::string key, type, name;
        words >> key;
        if (!is_ply && line != "ply") return nullptr;
        is_ply = true;
        if (key == "end_header") break;
        if (key == "format") {
            words >> type;
            is_binary = type == "binary_little_endian";
        } else if (key == "comment") {
            words >> type;
            if (colors && type == "TextureFile") return nullptr;
        } else if (key == "element") {
            std::uint64_t count = 0;
            words >> name >> count;
            const bool is_vertex = name == "vertex" && element.empty(), is_face = name == "face" && element == "vertex";
            if (!words || (!is_vertex && !is_face)) return nullptr;
            element = name;
            (is_vertex ? f.vertices.count : f.num_faces) = count;
        } else if (key == "property") {
            words >> type;
            if (type == "list") {
                std::string length, index;
                words >> length >> index >> name;
                if (element != "face" || has_list || bytes_of(length) == 0 || bytes_of(index) == 0 ||
                    length.starts_with("f") || index.starts_with("f") || index.starts_with("d") ||
                    (name != "vertex_indices" && name != "vertex_index"))
                    return nullptr;
                has_list = true;
                f.list = f.face_bytes;
                f.length_bytes = bytes_of(length);
                f.index_bytes = bytes_of(index);
                f.face_bytes += f.length_bytes + 3 * f.index_bytes;
                continue;
            }
            words >> name;
            const std::size_t size = bytes_of(type);
            if (size == 0 || element.empty()) return nullptr;
            for (std::size_t a = 0; element == "vertex" && a < 3; ++a)
                if (name == std::string(1, static_cast<char>('x' + a))) {
                    if (!type.starts_with("float") && !type.starts_with("double")) return nullptr;
                    has_axis[a] = true;
                    f.vertices.place[a] = f.vertices.stride;
                    f.vertices.is_double[a] = size == 8;
                }
            if (element == "vertex" && colors) {
                for (std::size_t c = 0; c < 4; ++c) {
                    if (name != color_names[c]) continue;
                    if (has_color[c] || (!color_type.empty() && type != color_type)) return nullptr;
                    color_type = type;
                    has_color[c] = true;
                    found_colors.place[c] = f.vertices.stride;
                }
                if (std::find(std::begin(other_color_names), std::end(other_color_names), name) !=
                    std::end(other_color_names))
                    return nullptr;
            }
            (element == "vertex" ? f.vertices.stride : f.face_bytes) += size;
        }
    }
    if (!is_binary || line != "end_header" || !has_axis[0] || !has_axis[1] || !has_axis[2] || !has_list) return nullptr;
    f.vertices.first = static_cast<std::uint64_t>(file.tellg());
    // With another number of corners in any face the file has another length.
    if (f.vertices.count > bytes || f.num_faces > bytes) return nullptr;
    f.first_face = f.vertices.first + f.vertices.count * f.vertices.stride;
    if (bytes != f.first_face + f.num_faces * f.face_bytes) return nullptr;
    if (!color_type.empty()) {
        const bool is_byte = color_type == "uchar" || color_type == "uint8";
        if (!has_color[0] || !has_color[1] || !has_color[2] ||
            (!is_byte && color_type != "float" && color_type != "float32"))
            return nullptr;
        found_colors.first = f.vertices.first;
        found_colors.count = f.vertices.count;
        found_colors.stride = f.vertices.stride;
        found_colors.has_alpha = has_color[3];
        found_colors.is_encoded = true;
        found_colors.type = is_byte ? vertex_component::byte : vertex_component::float32;
        f.colors = found_colors;
    }
    return std::make_unique<ply_file>(path, f, room);
}

ply_file::ply_file(const std::filesystem::path& path, const layout& header, std::uint64_t room)
    : header_(header), file_(path), vertices_(header.vertices, header.colors ? room / 2 : room) {
    add_only_part(path, header.num_faces);
    materials_[0].double_sided = true; // as its loader has it
    if (header.colors) colors_.emplace(*header.colors, room / 2);
}

void ply_file::read_part(std::size_t, const visitor& visit) {
    std::vector<char> faces;
    std::vector<glm::vec3> corners;
    std::vector<glm::vec4> colors;
    for (std::uint64_t first = 0; first < header_.num_faces; first += block_faces) {
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_faces, header_.num_faces - first));
        faces.resize(count * header_.face_bytes);
        corners.clear();
        colors.clear();
        file_.read(header_.first_face + first * header_.face_bytes, faces);
        for (std::size_t i = 0; i < count; ++i) {
            const char* const list = faces.data() + i * header_.face_bytes + header_.list;
            if (number_at(list, header_.length_bytes) != 3)
                throw model_error("face " + std::to_string(first + i) + " is no triangle: polygons are not streamed");
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint64_t index =
                    number_at(list + header_.length_bytes + k * header_.index_bytes, header_.index_bytes);
                corners.push_back(vertices_.at(index, file_));
                if (colors_) colors.push_back(colors_->at(index, file_));
            }
        }
        visit({0, first, corners, colors});
    }
}

} // namespace voxelize
