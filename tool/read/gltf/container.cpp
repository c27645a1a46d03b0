// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "container.hpp"

#include "text.hpp"

#include <cstdint>

namespace voxelize::gltf {

namespace {

constexpr std::uint32_t glb_magic = 0x46546C67;  // "glTF"
constexpr std::uint32_t chunk_json = 0x4E4F534A; // "JSON"
constexpr std::uint32_t chunk_bin = 0x004E4942;  // "BIN"
constexpr std::size_t header_bytes = 12;
constexpr std::size_t chunk_header_bytes = 8;

std::uint32_t little_endian_u32(std::span<const std::byte> bytes, std::size_t offset) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[offset + i]);
    return value;
}

container split_glb(std::span<const std::byte> bytes, leniency& tolerance) {
    if (bytes.size() < header_bytes) throw gltf_error("the GLB header is cut short");
    const std::uint32_t version = little_endian_u32(bytes, 4);
    if (version != 2) throw gltf_error("GLB version " + std::to_string(version) + " is not supported, only 2");
    const std::uint32_t length = little_endian_u32(bytes, 8);
    if (length > bytes.size())
        throw gltf_error("the GLB header says " + std::to_string(length) + " bytes, the file has " +
                         std::to_string(bytes.size()));
    if (length < header_bytes) throw gltf_error("the GLB header says a length of " + std::to_string(length));
    if (length < bytes.size())
        tolerance.warnings().push_back(std::to_string(bytes.size() - length) +
                                       " bytes after the end of the GLB are ignored");
    bytes = bytes.first(length);

    container parts;
    bool has_json = false;
    std::size_t offset = header_bytes;
    for (std::size_t number = 0; offset < bytes.size(); ++number) {
        const std::string name = "GLB chunk " + std::to_string(number);
        if (bytes.size() - offset < chunk_header_bytes) throw gltf_error(name + ": its header is cut short");
        const std::uint32_t chunk_length = little_endian_u32(bytes, offset);
        const std::uint32_t type = little_endian_u32(bytes, offset + 4);
        offset += chunk_header_bytes;
        if (chunk_length > bytes.size() - offset)
            throw gltf_error(name + ": says " + std::to_string(chunk_length) + " bytes, " +
                             std::to_string(bytes.size() - offset) + " are left");
        if (chunk_length % 4 != 0)
            tolerance.accept(name + ": its length is not a multiple of 4", "the next chunk follows at once");
        const std::span<const std::byte> data = bytes.subspan(offset, chunk_length);
        offset += chunk_length;

        if ((number == 0) != (type == chunk_json))
            throw gltf_error(number == 0 ? "the first GLB chunk is not JSON" : name + ": a second JSON chunk");
        if (type == chunk_json) {
            parts.json = {reinterpret_cast<const char*>(data.data()), data.size()};
            has_json = true;
        } else if (type == chunk_bin) {
            if (number != 1) throw gltf_error(name + ": a BIN chunk may only be the second chunk");
            parts.binary = data;
            parts.has_binary = true;
        } else {
            tolerance.warnings().push_back(name + " is of an unknown type and ignored");
        }
    }
    if (!has_json) throw gltf_error("the GLB has no JSON chunk");
    return parts;
}

} // namespace

container split_container(std::span<const std::byte> bytes, leniency& tolerance) {
    if (bytes.empty()) throw gltf_error("the file is empty");
    if (bytes.size() >= 4 && little_endian_u32(bytes, 0) == glb_magic) return split_glb(bytes, tolerance);
    container parts;
    parts.json = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    const std::size_t start = parts.json.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    if (start == std::string_view::npos || parts.json[start] != '{')
        throw gltf_error("neither a GLB (no \"glTF\" at its start) nor glTF JSON (no '{' at its start)");
    return parts;
}

void check_json_text(std::string_view json, const gltf_limits& limits) {
    constexpr int max_depth = 128;
    if (json.size() > limits.max_json_bytes)
        throw gltf_error("the JSON text has " + std::to_string(json.size()) + " bytes, more than the " +
                         std::to_string(limits.max_json_bytes) + " allowed");
    int depth = 0;
    for (std::size_t i = 0; i < json.size(); ++i) {
        switch (json[i]) {
        case '"':
            for (++i; i < json.size() && json[i] != '"'; ++i)
                if (json[i] == '\\') ++i;
            break;
        case '{':
        case '[':
            if (++depth > max_depth)
                throw gltf_error("the JSON text is nested deeper than " + std::to_string(max_depth) + " levels");
            break;
        case '}':
        case ']':
            --depth;
            break;
        default:
            break;
        }
    }
}

} // namespace voxelize::gltf
