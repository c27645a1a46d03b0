// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of all languages: the parts of a mesh, each a draw of its own.

#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace voxelpipe::bindings {

// One draw for each part of the triangles: part i ends where part i + 1 begins. Throws std::invalid_argument, which is
// a ValueError, where they are out of order.
template <class Draw, class Shader>
[[nodiscard]] std::vector<Draw>
draws_of_parts(const mesh_view<>& all, const std::vector<std::uint64_t>& first_triangles, const Shader& shader) {
    std::vector<Draw> draws;
    for (std::size_t i = 0; i < first_triangles.size(); ++i) {
        const std::uint64_t first = first_triangles[i],
                            end = i + 1 < first_triangles.size() ? first_triangles[i + 1] : all.triangles.size();
        if (first > end || end > all.triangles.size())
            throw std::invalid_argument("the parts' triangles are out of order");
        draws.push_back(
            {{all.positions, array_view<const glm::uvec3>(all.triangles.data() + first, end - first)}, {}, shader});
    }
    return draws;
}

} // namespace voxelpipe::bindings
