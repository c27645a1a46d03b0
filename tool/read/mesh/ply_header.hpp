// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The header of a PLY file.

#include "text_scanner.hpp"

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

enum class ply_type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

[[nodiscard]] std::size_t bytes_of(ply_type type);
[[nodiscard]] inline bool is_float(ply_type type) { return type == ply_type::float32 || type == ply_type::float64; }

struct ply_property {
    std::string name;
    ply_type type = ply_type::float32;
    std::optional<ply_type> length; // of a list
};

struct ply_element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<ply_property> properties;

    [[nodiscard]] bool has_list() const;
    // Bytes of one without a list in a binary file; of one with lists that are empty else.
    [[nodiscard]] std::size_t bytes() const;
    // Bytes before a property of an element without a list.
    [[nodiscard]] std::size_t bytes_before(std::size_t property) const;
    // The first property with one of the names, a list or none.
    [[nodiscard]] std::optional<std::size_t> find(std::initializer_list<std::string_view> names,
                                                  bool is_list = false) const;
};

struct ply_header {
    enum class encoding : std::uint8_t { text, little_endian, big_endian };

    encoding format = encoding::text;
    std::vector<ply_element> elements;
    std::vector<std::string> textures; // of the comments "TextureFile"
    std::uint64_t data = 0, line = 1;  // the first byte behind the header, and its line
};

// Reads from the file's first byte on. Throws model_error.
[[nodiscard]] ply_header read_ply_header(text_scanner& file);

} // namespace voxelize
