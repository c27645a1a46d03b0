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

} // namespace voxelize
