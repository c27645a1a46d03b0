// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells into sparse framebuffers on a GPU: run_module of core::sparse_cells_tag, with the bytes of
// cpu_backend.

#include <voxelpipe/cells/device/cells.cuh>
#include <voxelpipe/cells/passes/sparse_cell_passes.hpp>
#include <voxelpipe/sparse/device/sparse.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize_cells. Arguments are validated. Waits for each of its sums.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status run_module(sparse_cells_tag, cuda_backend& backend,
                                std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
                                sparse_framebuffer<cuda_backend, Targets...>& fb, const cell_options& options,
                                std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    return backend.guard([&] { return run_sparse_cells(backend, draws, g, fb, options, triangles_in); });
}

} // namespace voxelpipe::core
