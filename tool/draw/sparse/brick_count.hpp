// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Looks at an uploaded scene before it is drawn into bricks: what its surface comes to.

#include "brick_need.hpp"
#include "draw/surface.hpp"
#include "model/parallel.hpp"
#include "model/scene.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelize {

// Adds triangles, whose corner i lies at(i) in voxels of the part. Sums are of blocks, so no number of threads shows.
template <class Triangles, class At>
void add_triangles(surface_layers& to, const voxelpipe::grid& part, const Triangles& triangles, const At& at,
                   int threads) {
    constexpr std::size_t block = 1 << 16;
    const std::size_t count = triangles.size();
    std::vector<surface_layers> sums((count + block - 1) / block, surface_layers(part));
    parallel_for(sums.size(), threads, [&](std::size_t b) {
        for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) {
            const glm::uvec3 t = triangles[i];
            sums[b].add_triangle(at(t.x), at(t.y), at(t.z));
        }
    });
    for (const surface_layers& sum : sums) to.add(sum);
}

// The surface in the request's part of the grid, which the scene was uploaded for, into memory that the host reads.
template <class Uploaded>
[[nodiscard]] surface_layers surface_of(const Uploaded& scene, int threads) {
    const voxelpipe::grid part = scene.relative_grid();
    surface_layers surface(part);
    const glm::dvec3 corner = part.origin / part.voxel_size + glm::dvec3(part.offset);
    const auto in_voxels = [&](const glm::vec3& p) { return glm::dvec3(p) / part.voxel_size - corner; };
    for (const auto& d : scene.bits_draws())
        for (std::uint64_t copy = 0; copy < d.mesh.copies.count; ++copy)
            add_triangles(
                surface, part, d.mesh.triangles,
                [&](unsigned i) { return in_voxels(d.vertex_shader.places[copy](d.mesh.positions[i])); }, threads);
    for (const auto& d : scene.line_draws())
        for (std::uint64_t copy = 0; copy < d.mesh.copies.count; ++copy) {
            const auto at = [&](std::size_t i) {
                return in_voxels(d.vertex_shader.place.places[copy](d.mesh.positions[d.mesh.indices[i]]));
            };
            for (std::size_t i = 0; i + 1 < d.mesh.indices.size(); i += 2) surface.add_line(at(i), at(i + 1));
        }
    return surface;
}

// The surface of a scene in PART, a grid that is relative to `reference`; its lines too, with `with_lines`.
[[nodiscard]] inline surface_layers surface_of(const scene& model, const voxelpipe::grid& part,
                                               const glm::dvec3& reference, bool with_lines, int threads) {
    surface_layers surface(part);
    const glm::dvec3 corner = part.origin / part.voxel_size + glm::dvec3(part.offset);
    for (const instance& shown : model.instances) {
        const primitive& of = model.primitives[shown.primitive];
        const placed_vertex_shader place(shown.to_world, reference);
        const auto at = [&](std::uint32_t i) { return glm::dvec3(place(of.positions[i])) / part.voxel_size - corner; };
        add_triangles(surface, part, of.triangles, at, threads);
        if (!with_lines) continue;
        for (const glm::uvec2& l : of.lines) surface.add_line(at(l.x), at(l.y));
    }
    return surface;
}

} // namespace voxelize
