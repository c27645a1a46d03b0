// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Statements of OBJ files and the indices in them.

#include <cstdint>
#include <optional>
#include <string_view>

namespace voxelize::obj {

enum class statement : std::uint8_t {
    nothing, // blank, a comment, or what changes no voxel
    vertex,
    texcoord,
    face,
    line,
    point,
    object,
    group,
    material,
    library,
    surface, // free-form
    curve,   // free-form
    call,    // of another file
    unknown
};

// The statement of a line, whose key is cut off it.
[[nodiscard]] statement statement_of(std::string_view& line);

// Number `index` of a file, from 1 or backwards from -1, of COUNT things so far -> from 0. Nothing for an index of no
// such thing.
[[nodiscard]] std::optional<std::uint64_t> resolve(std::int64_t index, std::uint64_t count);

// The indices of a corner, as in "7", "7/1", "7/1/3" and "7//3"; 0 where one is left out. Nothing where WORD is none.
struct corner_indices {
    std::int64_t vertex = 0, texcoord = 0;
};
[[nodiscard]] std::optional<corner_indices> corner_in(std::string_view word);

} // namespace voxelize::obj
