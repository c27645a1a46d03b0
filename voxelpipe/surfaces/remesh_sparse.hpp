// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// remesh_sparse: as remesh, with samples in bricks, so that a grid whose bits fit no memory gets its surface. On any
// backend.

#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/surfaces/extract_sparse.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <span>
#include <vector>

namespace voxelpipe {

namespace core {

// Samples are those of sparse framebuffers.
struct remesh_in_bricks {
    template <class Backend>
    using bit_bricks = sparse_framebuffer<Backend, target<bit, blend::replace>>;

    // Level 0: the sign of the samples, then the rest.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] static status
    run(Backend& backend, std::span<const draw<Mesh, VertexShader, constant_output<bool>>> draws, const grid& g,
        const remesh_options& options, surface<Backend>& out, const Shade& shade) {
        const grid samples = sample_grid(g, options.sample);
        bit_bricks<Backend> inside(backend, samples.extent);
        const status result = voxelize_solid(backend, draws, samples, inside, sign_options(options));
        if (!result.ok()) return result;
        const sparse_cells<Backend> cells = cells_of(backend, inside);
        return remesh_cells(backend, draws, samples, options, cells, out, shade, result);
    }
    // Another level: of the distance, and of the inside where that has no sample.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] static status run(Backend& backend, std::span<const draw<Mesh, VertexShader, distance>> draws,
                                    const grid& g, const remesh_options& options, surface<Backend>& out,
                                    const Shade& shade) {
        const grid samples = sample_grid(g, options.sample);
        bit_bricks<Backend> inside(backend, samples.extent);
        std::vector<draw<Mesh, VertexShader, constant_output<bool>>> filled;
        for (const auto& d : draws) filled.push_back({d.mesh, d.vertex_shader, constant(true)});
        const status signs =
            voxelize_solid(backend, std::span<const draw<Mesh, VertexShader, constant_output<bool>>>(filled), samples,
                           inside, sign_options(options));
        if (!signs.ok()) return signs;
        sparse_framebuffer<Backend, target<float, blend::replace>> field(backend, samples.extent);
        const distance_options of_level = level_options(options, g);
        voxelpipe::get<0>(field).clear(band_distance(of_level.band, g));
        const status drawn = voxelize_distance(backend, draws, g, field, of_level);
        const auto extract_field = [&](const grid& of, surface<Backend>& to, const extract_options& how) {
            return extract(backend, field, inside, of, to, how);
        };
        return remesh_field(backend, draws, samples, options, out, shade, drawn, extract_field);
    }

private:
    template <class Backend>
    [[nodiscard]] static sparse_cells<Backend> cells_of(Backend& backend, const bit_bricks<Backend>& inside) {
        const sparse_samples<Backend> read(backend, inside);
        return sparse_cells<Backend>(backend, read.view());
    }
};

} // namespace core

// As remesh, with the same bytes and counts (at a level counters::fragments are those of the band), in memory in
// proportion to the triangles, the surface and the crossings of the mesh with the rows of samples along each axis;
// bits, or a field, of the whole grid are not held. It takes longer where these fit. repair::exterior floods the whole
// grid, with a byte or less a sample.
template <class Backend, class Mesh, class VertexShader, class Shader, class... Values>
[[nodiscard]] status remesh_sparse(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                   const grid& g, surface<Backend, Values...>& out,
                                   const remesh_options& options = {}) {
    return core::run_remesh<core::remesh_in_bricks>(backend, draws, g, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class... Values>
[[nodiscard]] status remesh_sparse(Backend& backend, const Draws& draws, const grid& g,
                                   surface<Backend, Values...>& out, const remesh_options& options = {}) {
    return remesh_sparse(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out,
                         options);
}

// One mesh.
template <class Backend, class... Attributes, class VertexShader>
[[nodiscard]] status remesh_sparse(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                   const VertexShader& vertex_shader, surface<Backend>& out,
                                   const remesh_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, none>;
    const draw_type d{m.view(), vertex_shader, {}};
    return remesh_sparse(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
