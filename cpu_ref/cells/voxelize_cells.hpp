// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells and voxelize_links on CPU threads: run_module of core::cells_tag and core::links_tag.

#include <cpu_ref/cpu_backend.hpp>
#include <voxelpipe/cells/passes/cell_lists.hpp>
#include <voxelpipe/cells/passes/cell_passes.hpp>
#include <voxelpipe/cells/passes/link_passes.hpp>

#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize_cells. Arguments are validated. Exceptions of a user's shader pass through.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status
run_module(cells_tag, cpu_backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
           const framebuffer_view<Targets...>& fb, const cell_options& options, std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        how.enter(stage::coarse_raster);
        return run_cells(backend, draws, g, fb, options, triangles_in);
    });
}

template <class Mesh, class VertexShader, class CellShader, class Payload>
[[nodiscard]] status
run_module(cells_tag, cpu_backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
           abuffer<cpu_backend, Payload>& lists, const cell_options& options, std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        how.enter(stage::coarse_raster);
        return run_cells(backend, draws, g, lists, options, triangles_in);
    });
}

// Implements voxelize_links. Arguments are validated. Exceptions of a user's shader pass through.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] status run_module(links_tag, cpu_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                                link_list<cpu_backend>& out, const link_options& options, std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        how.enter(stage::coarse_raster);
        return run_links(backend, draws, g, out, options, triangles_in);
    });
}

} // namespace voxelpipe::core
