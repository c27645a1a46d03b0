// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells and voxelize_links on a GPU: run_module of core::cells_tag and core::links_tag, with the bytes of
// cpu_backend. Their kernels are compiled by programs that call them, and by no other.

#include <voxelpipe/cells/device/cell_rows_kernels.cuh>
#include <voxelpipe/cells/passes/cell_passes.hpp>
#include <voxelpipe/cells/passes/link_passes.hpp>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/scene/subset.cuh>

#include <cstdint>
#include <span>

namespace voxelpipe::device {

// Rows by warps. error: null, or a word of the device that is not 0 where nothing is to be done.
template <class Terms>
void measure_cell_rows(const core::passes::measure_rows<Terms>& pass, std::uint64_t num_rows, cudaStream_t stream) {
    if (num_rows == 0) return;
    launch_behind(measure_cell_rows_kernel<Terms>, cell_row_blocks(num_rows), 32 * cell_row_warps, stream,
                  stage::fine_raster, pass, num_rows);
}
template <class CellShader, class... Targets>
void shade_cell_rows(const core::passes::shade_cells<CellShader, Targets...>& pass, std::uint64_t num_rows,
                     const unsigned* error, cudaStream_t stream) {
    if (num_rows == 0) return;
    launch_behind(shade_cell_rows_kernel<CellShader, Targets...>, cell_row_blocks(num_rows), 32 * cell_row_warps,
                  stream, stage::fine_raster, pass, num_rows, error);
}

} // namespace voxelpipe::device

namespace voxelpipe::core {

// In place of Backend::for_each.
namespace passes {
template <class Terms>
void for_each_row(const cuda_backend& backend, std::uint64_t num_rows, const measure_rows<Terms>& pass) {
    device::with_runtime_errors([&] { device::measure_cell_rows(pass, num_rows, backend.stream); });
}
template <class CellShader, class... Targets>
void for_each_row(const cuda_backend& backend, std::uint64_t num_rows,
                  const shade_cells<CellShader, Targets...>& pass) {
    device::with_runtime_errors([&] { device::shade_cell_rows(pass, num_rows, nullptr, backend.stream); });
}
} // namespace passes

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
