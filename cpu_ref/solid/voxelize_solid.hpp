// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid on CPU threads, into framebuffers and A-buffers.

#include <cpu_ref/cpu_backend.hpp>
#include <cpu_ref/solid/solid.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// Implement voxelize_solid. Arguments are validated. Exceptions of a user's shader pass through.
template <class Draw, class... Targets>
[[nodiscard]] status run_module(solid_tag, cpu_backend& backend, std::span<const Draw> draws, const grid& g,
                                const framebuffer_view<Targets...>& fb, const solid_options& options,
                                std::uint64_t triangles_in) {
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        return cpu::run_solid(how, draws, g, glm::ivec3(0), options, [&](const auto& sweep, const status& result) {
            return cpu::draw_solid(how, sweep, draws, g, options, fb, result);
        });
    });
}
template <class Draw, class Payload>
[[nodiscard]] status run_module(solid_tag, cpu_backend& backend, std::span<const Draw> draws, const grid& g,
                                abuffer<cpu_backend, Payload>& lists, const solid_options& options,
                                std::uint64_t triangles_in) {
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        return cpu::run_solid(how, draws, g, glm::ivec3(0), options, [&](const auto& sweep, const status& result) {
            return cpu::list_solid(how, backend, sweep, draws, g, lists, result);
        });
    });
}

// Implements diagnose_repair, with validated arguments: lids on the holes of each body, of at most max_hole_edges
// edges. Throws std::bad_alloc, or std::length_error for more boundary vertices than triangles can name.
template <class Draw>
[[nodiscard]] std::vector<hole_cones> run_module(find_holes_tag, const cpu_backend& backend,
                                                 std::span<const Draw> draws, const grid& g, bodies each,
                                                 std::uint64_t max_hole_edges = ~std::uint64_t{0}) {
    solid_options options;
    options.bodies = each;
    options.max_hole_edges = max_hole_edges;
    solid_counters counts;
    cpu::solid_geometry s = cpu::make_solid_geometry(backend.execution(), draws, g, glm::ivec3(0), options);
    (void)cpu::add_cones(s, options, counts); // more lids than can be drawn may still be measured
    return std::move(s.cones);
}

} // namespace voxelpipe::core
