// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Looks at an uploaded scene before it is drawn into bricks: what its surface comes to.

#include "brick_need.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

namespace voxelize {

// The surface in the request's part of the grid, which the scene was uploaded for.
template <class Uploaded>
[[nodiscard]] surface_layers surface_of(const Uploaded& scene) {
    const voxelpipe::grid part = scene.relative_grid();
    surface_layers surface(part);
    const glm::dvec3 corner = part.origin / part.voxel_size + glm::dvec3(part.offset);
    const auto in_voxels = [&](const glm::vec3& p) { return glm::dvec3(p) / part.voxel_size - corner; };
    for (const auto& d : scene.bits_draws())
        for (std::uint64_t copy = 0; copy < d.mesh.copies.count; ++copy) {
            const auto at = [&](unsigned i) { return in_voxels(d.vertex_shader.places[copy](d.mesh.positions[i])); };
            for (const glm::uvec3& t : d.mesh.triangles) surface.add_triangle(at(t.x), at(t.y), at(t.z));
        }
    for (const auto& d : scene.line_draws())
        for (std::uint64_t copy = 0; copy < d.mesh.copies.count; ++copy) {
            const auto at = [&](std::size_t i) {
                return in_voxels(d.vertex_shader.place.places[copy](d.mesh.positions[d.mesh.indices[i]]));
            };
            for (std::size_t i = 0; i + 1 < d.mesh.indices.size(); i += 2) surface.add_line(at(i), at(i + 1));
        }
    return surface;
}

// What the triangles touch of a grid, counted without keeping it; none if that did not work. Framebuffer: a sparse one
// whose first target is a bit.
template <class Framebuffer, class Backend, class Uploaded>
[[nodiscard]] std::optional<brick_counts> count_touched(Backend& backend, const Uploaded& scene,
                                                        const voxelpipe::grid& g, voxelpipe::coverage rule) {
    std::bitset<2> enabled;
    enabled[0] = true;
    Framebuffer framebuffer(backend, g.extent, enabled);
    framebuffer.limit({0, 0});
    const auto times = std::exchange(backend.times, nullptr);
    const auto& draws = scene.bits_draws();
    const voxelpipe::status status =
        voxelpipe::voxelize(backend, std::span(draws), g, framebuffer, voxelpipe::voxelize_options{rule});
    backend.times = times;
    if (status.ok()) return brick_counts{};
    if (status.code != voxelpipe::status_code::capacity_exceeded) return std::nullopt;
    return brick_counts{static_cast<double>(status.required.bricks), static_cast<double>(status.required.voxels)};
}

} // namespace voxelize
