// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Minecraft's NBT, a tree of named tags, as bytes; numbers lie big end first.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace voxelize {

class nbt {
public:
    enum tag : std::uint8_t {
        end = 0,
        short_int = 2,
        int32 = 3,
        int64 = 4,
        byte_array = 7,
        text = 8,
        list = 9,
        compound = 10,
        int_array = 11,
        long_array = 12
    };

    // Opens a tag; its content follows, and for a compound `end`.
    void begin(tag kind, std::string_view name) {
        number(kind, 1);
        add(name);
    }
    // A list of `count` elements, whose content follows.
    void begin_list(std::string_view name, tag of, std::int64_t count) {
        begin(list, name);
        number(of, 1);
        number(count, 4);
    }
    void finish() { number(end, 1); }
    void number(std::int64_t value, int bytes) {
        while (bytes-- > 0) bytes_.push_back(static_cast<char>(value >> (8 * bytes)));
    }
    // Text without a tag: its length and itself.
    void add(std::string_view value) {
        number(static_cast<std::int64_t>(value.size()), 2);
        bytes_.append(value);
    }
    void named(std::string_view name, std::int64_t value, tag kind = int32) {
        begin(kind, name);
        number(value, kind == short_int ? 2 : kind == int64 ? 8 : 4);
    }
    void named(std::string_view name, std::string_view value) {
        begin(text, name);
        add(value);
    }
    [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span{bytes_}); }

private:
    std::string bytes_;
};

} // namespace voxelize
