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

[[nodiscard]] inline status validate(const surface_slab& s, const extract_options& o, const grid& whole) {
    const bool is_within = s.first >= 0 && s.layers > 0 && s.layers <= whole.extent.z - s.first;
    const bool is_local = o.border == border::closed && o.min_component == 0 && !o.embedded;
    return is_within && is_local ? status{} : failure(status_code::bad_surface_options);
}

// The slab's own layers, counted from its lowest one.
[[nodiscard]] inline passes::counted_layers own_layers(const surface_slab& s) {
    const int first = s.first - s.lowest();
    return {first, first + s.layers};
}

// The part of a surface that belongs to the slab's own layers, with the indices of the whole. Its vertices have the
// cells of the samples that the slab needs, until raise_slab. The cells below the grid belong to the lowest slab.
// primitives: as of finish_surface.
template <class Backend>
[[nodiscard]] status cut_slab(Backend& backend, const surface_cells<Backend>& cells, const grid& samples,
                              const edge_crossing* crossings, const std::uint32_t* primitives, const surface_slab& slab,
                              const extract_options& options, surface<Backend>& out, status result) {
    using words = typename Backend::template buffer<std::uint32_t>;
    using vertices = typename Backend::template buffer<surface_vertex>;
    using triangles = typename Backend::template buffer<glm::uvec3>;
    using quads = typename Backend::template buffer<glm::uvec4>;
    typename Backend::template buffer<passes::layer_begin> ends(backend, 2);
    const passes::counted_layers own = own_layers(slab).cells();
    using list_type = typename surface_cells<Backend>::list_type;
    backend.for_each(2, passes::find_layers<list_type>{cells.list(), cells.count(), cells.grid(), own.first,
                                                       own.end - own.first, ends.data()});
    const std::vector<passes::layer_begin> range = ends.to_host(backend);
    const std::uint64_t num_vertices = range[1].vertex - range[0].vertex, num_quads = range[1].edge - range[0].edge;
    if (slab.first_vertex + num_vertices > std::numeric_limits<std::uint32_t>::max())
        return too_many_vertices(slab.first_vertex + num_vertices);

    const bool has_sources = primitives != nullptr;
    vertices all(backend, cells.num_vertices());
    quads all_quads(backend, cells.num_edges());
    words all_sources(backend, has_sources ? cells.num_vertices() : 0);
    backend.for_each(cells.count(),
                     passes::place_vertices<list_type>{cells.list(), options.place, crossings, all.data(), primitives,
                                                       has_sources ? all_sources.data() : nullptr});
    backend.for_each(cells.count(), passes::list_quads<list_type>{cells.list(), all_quads.data()});
    surface<Backend> made(backend);
    made.samples = samples;
    made.vertices = vertices(backend, num_vertices);
    made.sources = words(backend, has_sources ? num_vertices : 0);
    backend.for_each(num_vertices,
                     passes::copy_part<surface_vertex>{all.data(), range[0].vertex, made.vertices.data()});
    backend.for_each(made.sources.size(),
                     passes::copy_part<std::uint32_t>{all_sources.data(), range[0].vertex, made.sources.data()});
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

// The vertices get the cells of the whole.
template <class Backend>
void raise_slab(Backend& backend, const grid& whole, const surface_slab& slab, surface<Backend>& out) {
    backend.for_each(out.vertices.size(), passes::raise_vertices{out.vertices.data(), slab.lowest()});
    out.samples = whole;
}

} // namespace core

// Makes a slab's part of the surface that extract makes of the whole grid: `from` has layers slab.lowest() to
// slab.lowest() + slab.needed(...) - 1 of its samples, `whole` is its grid, and vertices have the cells of the whole.
// The arrays of slabs that share the layers among them, from the lowest one on, follow each other as the whole's do;
// faces may name vertices of the slab below. Components are not counted; the other counts of all slabs add up to the
// whole's. bad_surface_options: layers beyond the grid, border::open, min_component or embedded, which look at the
// whole. too_many_vertices: the indices of the whole do not fit. Otherwise as extract.
template <class Backend, class T, class Blend, class Layout>
[[nodiscard]] status extract_slab(Backend& backend, const target_view<target<T, Blend, Layout>>& from,
                                  const grid& whole, const surface_slab& slab, surface<Backend>& out,
                                  const extract_options& options = {}) {
    if (const status s = validate(whole); !s.ok()) return s;
    if (const status s = core::validate(options); !s.ok()) return s;
    if (const status s = core::validate(slab, options, whole); !s.ok()) return s;
    if (from.extent != glm::ivec3(whole.extent.x, whole.extent.y, slab.needed(whole.extent.z)))
        return core::failure(status_code::extent_mismatch);
    const auto finish = [&](const core::surface_cells<Backend>& cells, const core::edge_crossing* crossings,
                            const status& counted) {
        const status s = core::cut_slab(backend, cells, whole, crossings, nullptr, slab, options, out, counted);
        if (s.ok()) core::raise_slab(backend, whole, slab, out);
        return s;
    };
    return core::extract_cells(backend, from, options, finish, core::own_layers(slab));
}

} // namespace voxelpipe
