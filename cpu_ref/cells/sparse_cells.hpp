// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells into sparse framebuffers on CPU threads: run_module of core::sparse_cells_tag.

#include <cpu_ref/cells/voxelize_cells.hpp>
#include <cpu_ref/sparse/voxelize_sparse.hpp>
#include <voxelpipe/cells/passes/sparse_cell_passes.hpp>

#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize_cells. Arguments are validated. Exceptions of a user's shader pass through.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status run_module(sparse_cells_tag, cpu_backend& backend,
                                std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
                                sparse_framebuffer<cpu_backend, Targets...>& fb, const cell_options& options,
                                std::uint64_t triangles_in) {
    if (!cpu::are_numbered(draws)) return failure(status_code::bad_subset);
    return backend.guarded(triangles_in, [&](const cpu::execution& how) {
        how.enter(stage::coarse_raster);
        return run_sparse_cells(backend, draws, g, fb, options, triangles_in);
    });
}

} // namespace voxelpipe::core
