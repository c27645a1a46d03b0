// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Links: where a mesh cuts the segments from the centres of voxels to those of their neighbours, as lattice Boltzmann
// solvers want it for walls between their nodes (docs/design.md, "Links"). On any backend, with the same bytes.

#include <voxelpipe/cells/core/link_crossing.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe {

// Written {.neighbours = 26}.
struct link_options {
    int neighbours = 18; // 18, through faces and edges, as for D3Q19; or 26, corners too, as for D3Q27
};

// The primitive and the draw of a link that nothing crosses.
inline constexpr std::uint32_t no_crossing = ~std::uint32_t{0};

// The links of voxels, in a backend's memory: a record for each voxel of which a link is crossed, ordered by z, then y,
// then x. Link k of record i, which goes along link_direction(k), is element i * neighbours + k of the three arrays.
template <class Backend>
struct link_list {
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    int neighbours = 18;              // links of a voxel
    buffer<glm::ivec3> voxels;        // of each record, (x, y, z) in the computed part of the grid
    buffer<float> q;                  // part of the link before its first crossing, above 0 to 1; -1 without a crossing
    buffer<std::uint32_t> primitives; // which primitive is crossed there, counted through all draws; or no_crossing
    buffer<std::uint32_t> draws;      // which draw it belongs to; or no_crossing

    // Empty.
    explicit link_list(Backend& backend)
        : voxels(backend, 0), q(backend, 0), primitives(backend, 0), draws(backend, 0) {}
    // Number of records.
    [[nodiscard]] std::size_t size() const { return voxels.size(); }
};

namespace core {

// Names the call of this module. A backend implements voxelize_links as run_module(links_tag, backend, draws, grid,
// link_list, options, number of triangles).
struct links_tag {};

[[nodiscard]] inline status validate(const link_options& o) {
    return o.neighbours == 18 || o.neighbours == 26 ? status{} : failure(status_code::bad_cell_options);
}

} // namespace core

// Lists the links that triangles of the draws cross. A link goes from a voxel's centre to that of a neighbour, which
// may lie beyond the grid; both centres are moved by an offset of no length, as those of solids are, so that none lies
// on a triangle and a link beside an edge crosses one triangle of it, both or none. On a closed mesh the number of
// crossings of a link is odd iff exactly one of its ends is inside by vp::voxelize_solid with extent::centre and
// even_odd.
//
// q is the exact position of the first crossing, a fraction of integers, rounded once to float. Positions are compared
// as fractions, before the rounding; of those that are equal the lowest primitive counts. A crossing that only the
// offset parts from the centre where the link begins has the position 0, and q = 2^-126.
//
// The draws share one type of mesh and vertex shader; draw::fragment_shader is ignored. Fills status::counts: triangles
// (outside: those whose box misses all links of the grid's voxels), `voxels`, the records, and `fragments`, the links
// that are crossed. Triangles that are parallel to a link do not cross it. A crop has the records of the whole. Returns
// after the work is done. A call that fails leaves `out` as it is.
template <class Backend, class Mesh, class VertexShader, class Shader>
[[nodiscard]] status voxelize_links(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                    const grid& g, link_list<Backend>& out, const link_options& options = {}) {
    if constexpr (core::check_vertex_shader<Mesh, VertexShader>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) {
            out = link_list<Backend>(backend);
            out.neighbours = options.neighbours;
            return s;
        }
        return core::name_bad_triangle(
            backend, draws, run_module(core::links_tag{}, backend, draws, g, out, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh.
template <class Backend, class... Attributes, class VertexShader>
[[nodiscard]] status voxelize_links(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                    const VertexShader& vertex_shader, link_list<Backend>& out,
                                    const link_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, none>;
    const draw_type d{mesh, vertex_shader, {}};
    return voxelize_links(backend, std::span<const draw_type>(&d, 1), g, out, options);
}
template <class Backend, class... Attributes, class VertexShader>
[[nodiscard]] status voxelize_links(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                    const VertexShader& vertex_shader, link_list<Backend>& out,
                                    const link_options& options = {}) {
    return voxelize_links(backend, m.view(), g, vertex_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws>
[[nodiscard]] status voxelize_links(Backend& backend, const Draws& draws, const grid& g, link_list<Backend>& out,
                                    const link_options& options = {}) {
    return voxelize_links(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out,
                          options);
}

} // namespace voxelpipe
