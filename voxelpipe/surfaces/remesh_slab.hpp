// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// remesh_slab: the part of a remesh that lies in some layers of its grid. The arrays of the slabs, one after the other,
// are those of remesh, so that no samples of the whole grid are held. On any backend.

#include <voxelpipe/surfaces/extract_slab.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <cstdint>
#include <span>

namespace voxelpipe {

namespace core {

// Samples are those that a slab needs: its own layers and the neighbours'.
struct remesh_in_slab {
    surface_slab slab;

    // Level 0: the sign of the samples, then the rest.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] status run(Backend& backend, std::span<const draw<Mesh, VertexShader, constant_output<bool>>> draws,
                             const grid& g, const remesh_options& options, surface<Backend>& out,
                             const Shade& shade) const {
        const grid samples = sample_grid(part_of(g, options.sample), options.sample);
        framebuffer<Backend, target<bit, blend::replace>> inside(backend, samples.extent);
        const status drawn = voxelize_solid(backend, draws, samples, inside, sign_options(options));
        if (!drawn.ok()) return drawn;
        const surface_cells<Backend> cells(backend, get<0>(inside.view().targets).elements, samples.extent);
        const auto finish = [this](Backend& on, const surface_cells<Backend>& of, const grid& where,
                                   const edge_crossing* crossings, const std::uint32_t* primitives,
                                   const extract_options& how, surface<Backend>& to, const status& counted) {
            return cut_slab(on, of, where, crossings, primitives, slab, how, to, counted);
        };
        const status result =
            remesh_cells(backend, draws, samples, options, cells, out, shade, drawn, own_layers(slab).cells(), finish);
        if (result.ok()) raise_slab(backend, sample_grid(g, options.sample), slab, out);
        return result;
    }
    // Another level: of the distance.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] status run(Backend& backend, std::span<const draw<Mesh, VertexShader, distance>> draws, const grid& g,
                             const remesh_options& options, surface<Backend>& out, const Shade& shade) const {
        const grid part = part_of(g, options.sample), samples = sample_grid(part, options.sample);
        framebuffer<Backend, target<float, blend::replace>> field(backend, samples.extent);
        const status drawn = voxelize_distance(backend, draws, part, field, level_options(options, g));
        const auto extract_part = [&](const grid& of, surface<Backend>& to, const extract_options& how) {
            const auto finish = [&](const surface_cells<Backend>& cells, const edge_crossing* crossings,
                                    const status& counted) {
                return cut_slab(backend, cells, of, crossings, nullptr, slab, how, to, counted);
            };
            return extract_cells(backend, get<0>(field.view().targets), how, finish, own_layers(slab));
        };
        const status result = remesh_field(backend, draws, samples, options, out, shade, drawn, extract_part);
        if (result.ok()) raise_slab(backend, sample_grid(g, options.sample), slab, out);
        return result;
    }

private:
    // The part of the grid whose samples the slab needs.
    [[nodiscard]] grid part_of(const grid& g, sample where) const {
        const int beyond = where == sample::corner ? 1 : 0; // layers of corners beyond those of voxels
        const int layers = slab.needed(g.extent.z + beyond) - beyond;
        return g.crop({0, 0, slab.lowest()}, {g.extent.x, g.extent.y, layers});
    }
};

} // namespace core

// Makes a slab's part of the surface that remesh makes: `slab` has layers of the grid's samples (extent.z + 1 of them
// with sample::corner), and vertices have the cells of the whole. The arrays of slabs that share the layers among them,
// from the lowest one on, follow each other as those of remesh do, sources and values included; faces may name vertices
// of the slab below. Held are the triangles, the samples of the slab and of four layers more, and the crossings of the
// triangles with the rows of these samples, along z with all samples below, too. Components are not counted, the other
// counts of status::surface of all slabs add up to those of remesh, and `counts` and `solid` are of the samples that
// the slab needs. bad_surface_options: layers beyond the grid, border::open, min_component or embedded, which look at
// the whole. crop_without_whole: repair::exterior, which floods it. too_many_vertices: the indices of the whole do not
// fit. Otherwise as remesh.
template <class Backend, class Mesh, class VertexShader, class Shader, class... Values>
[[nodiscard]] status remesh_slab(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                 const grid& g, const surface_slab& slab, surface<Backend, Values...>& out,
                                 const remesh_options& options = {}) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = core::validate(options, g); !s.ok()) return s;
    const status fits = core::validate(slab, core::extract_options_of(options), core::sample_grid(g, options.sample));
    if (!fits.ok()) return fits;
    return core::run_remesh(backend, draws, g, out, options, core::remesh_in_slab{slab});
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class... Values>
[[nodiscard]] status remesh_slab(Backend& backend, const Draws& draws, const grid& g, const surface_slab& slab,
                                 surface<Backend, Values...>& out, const remesh_options& options = {}) {
    return remesh_slab(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, slab, out,
                       options);
}

// One mesh.
template <class Backend, class... Attributes, class VertexShader>
[[nodiscard]] status remesh_slab(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                 const VertexShader& vertex_shader, const surface_slab& slab, surface<Backend>& out,
                                 const remesh_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, none>;
    const draw_type d{m.view(), vertex_shader, {}};
    return remesh_slab(backend, std::span<const draw_type>(&d, 1), g, slab, out, options);
}

} // namespace voxelpipe
