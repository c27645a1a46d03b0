// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells and voxelize_links on a GPU: run_module of core::cells_tag and core::links_tag, with the bytes of
// cpu_backend. Their kernels are compiled by programs that call them, and by no other.

#include <voxelpipe/cells/device/cell_list_kernels.cuh>
#include <voxelpipe/cells/device/cell_rows_kernels.cuh>
#include <voxelpipe/cells/passes/cell_lists.hpp>
#include <voxelpipe/cells/passes/cell_passes.hpp>
#include <voxelpipe/cells/passes/link_passes.hpp>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/scene/subset.cuh>

#include <algorithm>
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

// Stores the terms of all pixels. num_pixels: about how many there are; error: as above.
template <class Terms>
void list_cells(const list_cell_pixels<Terms>& pass, std::uint64_t num_pixels, const unsigned* error,
                cudaStream_t stream) {
    const auto blocks = static_cast<unsigned>(std::min<std::uint64_t>(num_pixels / cell_list_threads + 1, 1u << 20));
    launch_behind(list_cell_pixels_kernel<std::int64_t, Terms>, blocks, cell_list_threads, stream, stage::coarse_raster,
                  pass, error);
    launch_behind(list_cell_pixels_kernel<int128, Terms>, blocks, cell_list_threads, stream, stage::coarse_raster, pass,
                  error);
}

} // namespace voxelpipe::device

namespace voxelpipe::core {

template <>
inline constexpr bool lists_by_pixel<cuda_backend> = true;

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
// Lists the terms of all triangles; returns how many there are, or 2^32 where they cannot be numbered. Waits.
template <class Terms>
[[nodiscard]] std::uint64_t list_terms_by_pixel(cuda_backend& backend, const cell_mesh& mesh, const cell_keys& keys_of,
                                                std::uint64_t* counts, const term_room<cuda_backend, Terms>& room) {
    constexpr std::uint64_t most = std::uint64_t{1} << 32;
    const std::uint64_t triangles = mesh.num_triangles;
    cuda_backend::buffer<std::uint64_t> first_pixel(backend, triangles + 1);
    const device::cell_list_state none{};
    cuda_backend::buffer<device::cell_list_state> state(backend, array_view<const device::cell_list_state>(&none, 1));
    std::uint64_t pixels = 0;
    {
        cuda_backend::buffer<std::uint32_t> num_pixels(backend, triangles + 1);
        backend.for_each(triangles + 1,
                         device::count_cell_pixels<Terms>{mesh, num_pixels.data(), counts, state.data()});
        pixels = backend.sum(num_pixels, first_pixel);
    }
    if (pixels >= most) return most;
    std::uint64_t terms = 2 * pixels; // more than there are of most meshes
    while (true) {
        room.keys = cuda_backend::buffer<std::uint64_t>(backend, terms);
        room.order = cuda_backend::buffer<std::uint32_t>(backend, terms);
        room.terms = cuda_backend::buffer<Terms>(backend, terms);
        device::with_runtime_errors([&] {
            device::list_cells(device::list_cell_pixels<Terms>{mesh, keys_of, first_pixel.data(), state.data(), terms,
                                                               room.keys.data(), room.order.data(), room.terms.data()},
                               pixels, nullptr, backend.stream);
        });
        const std::uint64_t found = state.to_host(backend)[0].num_terms;
        if (found <= terms || found >= most) return found < most ? found : most;
        terms = found;
        state =
            cuda_backend::buffer<device::cell_list_state>(backend, array_view<const device::cell_list_state>(&none, 1));
    }
}
} // namespace passes

// Implements voxelize_cells. Arguments are validated. Waits for each of its sums.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status
run_module(cells_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
           const framebuffer_view<Targets...>& fb, const cell_options& options, std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    return backend.guard([&] { return run_cells(backend, draws, g, fb, options, triangles_in); });
}

template <class Mesh, class VertexShader, class CellShader, class Payload>
[[nodiscard]] status
run_module(cells_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
           abuffer<cuda_backend, Payload>& lists, const cell_options& options, std::uint64_t triangles_in) {
    if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
    return backend.guard([&] { return run_cells(backend, draws, g, lists, options, triangles_in); });
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
