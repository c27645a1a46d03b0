// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract_slab: the part of a surface that lies in some layers of its grid. The arrays of the slabs, one after the
// other, are those of the whole, so that a grid that fits no memory gets its surface layer by layer. On any backend.

#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/passes/slab.hpp>

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace voxelpipe {

// Layers along z of a grid of samples. Besides its own a slab's samples have the neighbours' two layers below and two
// above, as far as the grid has them: whether a face flips depends on the cell behind it.
struct surface_slab {
    static constexpr int beyond = 2; // layers of the neighbours on each side

    int first = 0;                  // layer of the grid that is the slab's lowest own one
    int layers = 0;                 // of its own, 1 or more
    std::uint64_t first_vertex = 0; // vertices of the slabs below; then indices are those of the whole

    // Lowest layer of the samples that the slab needs, and the number of them; of a grid of this many layers.
    [[nodiscard]] int lowest() const { return first > beyond ? first - beyond : 0; }
    // As above.
    [[nodiscard]] int needed(int whole_layers) const {
        const int end = layers < whole_layers - first - beyond ? first + layers + beyond : whole_layers;
        return end - lowest();
    }
};

namespace core {

[[nodiscard]] inline status validate(const surface_slab& s, const extract_options& o, const glm::ivec3& extent,
                                     const grid& whole) {
    const bool is_within = s.first >= 0 && s.layers > 0 && s.layers <= whole.extent.z - s.first;
    if (!is_within || o.border != border::closed || o.min_component != 0 || o.embedded)
        return failure(status_code::bad_surface_options);
    if (extent != glm::ivec3(whole.extent.x, whole.extent.y, s.needed(whole.extent.z)))
        return failure(status_code::extent_mismatch);
    return {};
}

// The part of a surface that belongs to the slab's own layers. The cells below the grid belong to the lowest slab.
template <class Backend>
[[nodiscard]] status cut_slab(Backend& backend, const surface_cells<Backend>& cells, const edge_crossing* crossings,
                              const grid& whole, const surface_slab& slab, const extract_options& options,
                              surface<Backend>& out, status result) {
    using vertices = typename Backend::template buffer<surface_vertex>;
    using triangles = typename Backend::template buffer<glm::uvec3>;
    using quads = typename Backend::template buffer<glm::uvec4>;
    typename Backend::template buffer<passes::layer_begin> ends(backend, 2);
    // Layer l of cells has its lowest samples in layer l - 1.
    const int first = slab.first == 0 ? 0 : slab.first - slab.lowest() + 1,
              end = slab.first + slab.layers - slab.lowest() + 1;
    backend.for_each(2, passes::find_layers{cells.list(), cells.count(), first, end - first, ends.data()});
    const std::vector<passes::layer_begin> range = ends.to_host(backend);
    const std::uint64_t num_vertices = range[1].vertex - range[0].vertex, num_quads = range[1].edge - range[0].edge;
    if (slab.first_vertex + num_vertices > std::numeric_limits<std::uint32_t>::max())
        return too_many_vertices(slab.first_vertex + num_vertices);

    vertices all(backend, cells.num_vertices());
    quads all_quads(backend, cells.num_edges());
    backend.for_each(cells.count(), passes::place_vertices<passes::cell_list>{cells.list(), options.place, crossings,
                                                                              all.data(), nullptr, nullptr});
    backend.for_each(cells.count(), passes::list_quads<passes::cell_list>{cells.list(), all_quads.data()});
    surface<Backend> made(backend);
    made.samples = whole;
    made.vertices = vertices(backend, num_vertices);
    backend.for_each(num_vertices,
                     passes::move_slab_vertices{all.data(), range[0].vertex, slab.lowest(), made.vertices.data()});
    const auto shift = static_cast<std::uint32_t>(slab.first_vertex - range[0].vertex);
    if (options.quads) {
        made.quads = quads(backend, num_quads);
        backend.for_each(
            num_quads, passes::move_slab_faces<glm::uvec4>{all_quads.data(), range[0].edge, shift, made.quads.data()});
    } else {
        made.triangles = triangles(backend, 2 * num_quads);
        backend.for_each(num_quads, passes::cut_quads{all.data(), all_quads.data() + range[0].edge,
                                                      options.place == place::sharp, made.triangles.data()});
        backend.for_each(2 * num_quads,
                         passes::move_slab_faces<glm::uvec3>{made.triangles.data(), 0, shift, made.triangles.data()});
    }
    result.surface.vertices = num_vertices;
    result.surface.faces = options.quads ? num_quads : 2 * num_quads;
    out = std::move(made);
    return result;
}

} // namespace core

// Makes a slab's part of the surface that extract makes of the whole grid: `from` has layers slab.lowest() to
// slab.lowest() + slab.needed(...) - 1 of its samples, `whole` is its grid, and vertices have the cells of the whole.
// The arrays of slabs that share the layers among them, from the lowest one on, follow each other as the whole's do;
// faces may name vertices of the slab below. Components are not counted; nan_samples and made_crossings count in all
// of `from`. bad_surface_options: layers beyond the grid, border::open, min_component or embedded, which look at the
// whole. too_many_vertices: the indices of the whole do not fit. Otherwise as extract.
template <class Backend, class T, class Blend, class Layout>
[[nodiscard]] status extract_slab(Backend& backend, const target_view<target<T, Blend, Layout>>& from,
                                  const grid& whole, const surface_slab& slab, surface<Backend>& out,
                                  const extract_options& options = {}) {
    if (const status s = validate(whole); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (const status s = core::validate(slab, options, from.extent, whole); !s.ok()) return s;
    const auto finish = [&](const core::surface_cells<Backend>& cells, const core::edge_crossing* crossings,
                            const status& counted) {
        return core::cut_slab(backend, cells, crossings, whole, slab, options, out, counted);
    };
    return core::extract_cells(backend, from, options, finish);
}

} // namespace voxelpipe
