// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells and voxelize_links on a GPU: run_module of core::cells_tag and core::links_tag, with the bytes of
// cpu_backend. Their kernels are compiled by programs that call them, and by no other.

#include <voxelpipe/cells/passes/cell_passes.hpp>
#include <voxelpipe/cells/passes/link_passes.hpp>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/scene/subset.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::core {

// Implements voxelize_cells into a framebuffer. Arguments are validated. Waits for each of its sums.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status
run_module(cells_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
           const framebuffer_view<Targets...>& fb, const cell_options& options, std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    return backend.guard([&] { return run_cells(backend, draws, g, fb, options, triangles_in); });
}

// Implements voxelize_links. Arguments are validated. Waits for each of its sums.
template <class Mesh, class VertexShader, class Shader>
[[nodiscard]] status run_module(links_tag, cuda_backend& backend,
                                std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                                link_list<cuda_backend>& out, const link_options& options, std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    return backend.guard([&] { return run_links(backend, draws, g, out, options, triangles_in); });
}

} // namespace voxelpipe::core
