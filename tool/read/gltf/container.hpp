// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The outermost layer: a .glb is split into its JSON text and binary chunk, a .gltf is JSON text as it stands. Which of
// the two a file is, its first four bytes say, not its name.

#include "leniency.hpp"

#include <cstddef>
#include <span>
#include <string_view>

namespace voxelize::gltf {

// Views into the bytes given to split_container.
struct container {
    std::string_view json;
    std::span<const std::byte> binary; // of the BIN chunk; empty for a file without one
    bool has_binary = false;
};

// Every length is checked against the bytes that are there. Throws gltf_error; what is harmless becomes a warning.
[[nodiscard]] container split_container(std::span<const std::byte> bytes, leniency& tolerance);

// Refuses text that no sane file holds before a parser sees it: longer than limits.max_json_bytes, or nested deeper
// than 128 levels.
void check_json_text(std::string_view json, const gltf_limits& limits);

} // namespace voxelize::gltf
