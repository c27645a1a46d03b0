// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What --remesh makes: a closed mesh whose vertices lie in the cells of a grid of samples.

#include <voxelpipe/surfaces/surface.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelize {

struct surface_mesh {
    std::array<int, 3> extent{};        // of the samples
    std::array<double, 3> origin{};     // the world's position of the grid's lowest corner
    std::array<double, 3> voxel_size{}; // the distances of neighbouring samples
    std::vector<voxelpipe::surface_vertex> vertices;
    std::vector<glm::uvec3> triangles; // counter-clockwise seen from outside; empty where there are quads
    std::vector<glm::uvec4> quads;
    std::vector<std::uint32_t>
        sources;                    // number of a triangle of the model that each vertex comes from; UINT32_MAX: none
    std::vector<glm::vec3> normals; // of the vertices: unit, outward
    std::vector<glm::vec3> colors;  // of the vertices: linear, 0 to 1; empty: there are none
    voxelpipe::surface_counters counts;

    [[nodiscard]] std::size_t num_faces() const { return triangles.size() + quads.size(); }
    // V - E + F of a closed mesh.
    [[nodiscard]] std::int64_t euler() const {
        const std::size_t edges = 3 * triangles.size() / 2 + 2 * quads.size();
        return static_cast<std::int64_t>(vertices.size() + num_faces()) - static_cast<std::int64_t>(edges);
    }
};

} // namespace voxelize
