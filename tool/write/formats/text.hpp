// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers as text: the shortest form that reads back to the same double, whatever the locale.

#include <array>
#include <charconv>
#include <string>

namespace voxelize {

[[nodiscard]] inline std::string number(double value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    return {text.data(), end};
}

// Decimal text with this many digits behind the point.
[[nodiscard]] inline std::string decimal(double value, int digits) {
    std::array<char, 64> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, digits).ptr;
    return {text.data(), end};
}
// The text of byte / 255, short but exact enough to give the byte back.
[[nodiscard]] inline std::string fraction_text(int byte) { return decimal(byte / 255.0, 4); }

} // namespace voxelize
