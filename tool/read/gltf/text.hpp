// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Text from a file made fit for a one-line message: control characters gone, length bounded, quoted.

#include <string>
#include <string_view>

namespace voxelize::gltf {

// TEXT with control characters and bytes outside ASCII as '?', cut after MAX_CHARS.
[[nodiscard]] inline std::string printable(std::string_view text, std::size_t max_chars = 80) {
    std::string line;
    for (const char c : text.substr(0, max_chars)) line += c >= ' ' && c <= '~' ? c : '?';
    if (text.size() > max_chars) line += "...";
    return line;
}

[[nodiscard]] inline std::string in_quotes(std::string_view text) { return '"' + printable(text) + '"'; }

} // namespace voxelize::gltf
