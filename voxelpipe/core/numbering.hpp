// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The numbers of triangles that shaders and lists see, where a draw has some triangles of a larger mesh
// (mesh_view::part). Inside a call, triangles are numbered as they are drawn, in the same order.

#include <voxelpipe/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe::core {

// fragment::triangle and fragment::primitive.
struct visible_numbers {
    std::uint32_t triangle, primitive;
};

// Primitive numbers of one draw of a call with a subset.
struct numbering {
    const std::uint32_t* numbers = nullptr; // of the triangles in the whole mesh; null: the draw is no subset
    std::uint32_t whole = 0;                // triangles of the whole mesh; 0: no draw of the call is a subset
    std::uint32_t first = 0;                // primitive of the whole mesh's first triangle

    // triangle: among those that are drawn.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE visible_numbers of(std::uint32_t triangle,
                                                                   std::uint32_t instance) const {
        const std::uint32_t number = numbers != nullptr ? numbers[triangle] : triangle;
        return {number, first + instance * whole + number};
    }
};

template <class Draw>
[[nodiscard]] bool has_subset(std::span<const Draw> draws) {
    return std::any_of(draws.begin(), draws.end(), [](const Draw& d) { return d.mesh.part.whole != 0; });
}

// True if a call has to read numbers before it draws.
template <class Draw>
[[nodiscard]] bool has_unchecked_subset(std::span<const Draw> draws) {
    return std::any_of(draws.begin(), draws.end(),
                       [](const Draw& d) { return d.mesh.part.whole != 0 && d.mesh.part.checked == 0; });
}

// One a draw; empty if no draw is a subset. The draws are valid.
template <class Draw>
[[nodiscard]] std::vector<numbering> make_numberings(std::span<const Draw> draws) {
    std::vector<numbering> of;
    if (!has_subset(draws)) return of;
    std::uint32_t first = 0;
    for (const Draw& d : draws) {
        const auto& part = d.mesh.part;
        const std::uint64_t whole = part.whole != 0 ? part.whole : d.mesh.triangles.size();
        of.push_back({part.whole != 0 ? part.numbers.data() : nullptr, static_cast<std::uint32_t>(whole), first});
        first += static_cast<std::uint32_t>(d.mesh.num_primitives());
    }
    return of;
}

} // namespace voxelpipe::core
