// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "vertex_cache.hpp"

#include "read/assimp/linear_color.hpp"

#include <cstring>

namespace voxelize {
namespace {

template <class T>
T load(const char* from) {
    T value;
    std::memcpy(&value, from, sizeof(value));
    return value;
}

std::size_t bytes_of(vertex_component type) {
    return type == vertex_component::byte ? 1 : type == vertex_component::word ? 2 : 4;
}

} // namespace

void model_bytes::read(std::uint64_t offset, std::span<char> bytes) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw model_error("the file ends before its triangles do");
}

std::size_t position_layout::bytes() const {
    std::size_t last = 0;
    for (std::size_t a = 0; a < 3; ++a) last = std::max(last, place[a] + (is_double[a] ? 8 : 4));
    return last;
}

glm::vec3 position_layout::value(const char* vertex) const {
    glm::vec3 p;
    for (std::size_t a = 0; a < 3; ++a)
        p[static_cast<glm::length_t>(a)] =
            is_double[a] ? static_cast<float>(load<double>(vertex + place[a]) - origin[static_cast<glm::length_t>(a)])
                         : load<float>(vertex + place[a]);
    return p;
}

std::size_t color_layout::bytes() const {
    return *std::max_element(place, place + (has_alpha ? 4 : 3)) + bytes_of(type);
}

glm::vec4 color_layout::value(const char* vertex) const {
    const auto component_at = [&](std::size_t c) {
        const char* const from = vertex + place[c];
        switch (type) {
        case vertex_component::byte: // as the loaders round
            return is_encoded ? static_cast<float>(load<std::uint8_t>(from)) / 255.0F
                              : static_cast<float>(load<std::uint8_t>(from) / 255.0);
        case vertex_component::word:
            return is_encoded ? static_cast<float>(load<std::uint16_t>(from)) / 65535.0F
                              : static_cast<float>(load<std::uint16_t>(from) / 65535.0);
        case vertex_component::float32:
            break;
        }
        return load<float>(from);
    };
    glm::vec4 color(component_at(0), component_at(1), component_at(2), has_alpha ? component_at(3) : 1.0F);
    if (!is_encoded) return color;
    for (glm::length_t c = 0; c < 3; ++c) color[c] = assimp::linear_of(color[c]);
    if (!(color.a >= 0 && color.a <= 1)) color.a = 1;
    return color;
}

std::size_t texcoord_layout::bytes() const { return 2 * bytes_of(type); }

glm::vec2 texcoord_layout::value(const char* vertex) const {
    const auto component_at = [&](std::size_t c) -> double {
        const char* const from = vertex + c * bytes_of(type);
        switch (type) {
        case vertex_component::byte:
            return load<std::uint8_t>(from) / 255.0;
        case vertex_component::word:
            return load<std::uint16_t>(from) / 65535.0;
        case vertex_component::float32:
            break;
        }
        return static_cast<double>(load<float>(from));
    };
    return transformed(transform, component_at(0), component_at(1));
}

} // namespace voxelize
