// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// From the bits of samples to a surface: cells, flips, vertices, quads, components, triangles. The same passes on every
// backend.

#include <voxelpipe/core/row_passes.hpp>
#include <voxelpipe/surfaces/passes/embed.hpp>
#include <voxelpipe/surfaces/passes/parts.hpp>
#include <voxelpipe/surfaces/passes/vertices.hpp>
#include <voxelpipe/voxelize.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// The table of cells, in the host's memory.
[[nodiscard]] inline const std::array<cell_sheets, 512>& cell_table() {
    static const std::array<cell_sheets, 512> table = make_cell_table();
    return table;
}

// Cells that a surface passes, with their sheets and crossed edges numbered. What lists them is derived from it.
template <class Backend>
class numbered_cells {
public:
    static constexpr bool makes_meshes = false; // passes make vertices and faces
    [[nodiscard]] bool are_too_many() const { return num_vertices_ > most; }
    [[nodiscard]] std::uint64_t count() const { return count_; }
    [[nodiscard]] std::uint64_t num_vertices() const { return num_vertices_; }
    [[nodiscard]] std::uint64_t num_edges() const { return num_edges_; } // crossed ones, which are the quads

protected:
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    static constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();

    explicit numbered_cells(Backend& backend)
        : table_(backend, array_view<const cell_sheets>(cell_table())), keys_(backend, 0), states_(backend, 0),
          first_vertices_(backend, 0), first_edges_(backend, 0) {}

    // Makes room for the keys and corners of cells; false: there are too many.
    [[nodiscard]] bool make_room(Backend& backend, std::uint64_t count) {
        count_ = count;
        if (count_ > most) { // a cell has a vertex at least
            num_vertices_ = count_;
            return false;
        }
        keys_ = buffer<std::uint64_t>(backend, count_);
        states_ = buffer<std::uint16_t>(backend, count_);
        return true;
    }
    // Decides the flips of the listed cells; samples.corners(x, y, z) are those of any cell.
    template <class Samples>
    void number(Backend& backend, const Samples& samples) {
        buffer<std::uint32_t> sheets(backend, count_ + 1), edges(backend, count_ + 1);
        first_vertices_ = buffer<std::uint64_t>(backend, count_ + 1);
        first_edges_ = buffer<std::uint64_t>(backend, count_ + 1);
        backend.for_each(count_ + 1, passes::flip_cells<Samples>{samples, table_.data(), keys_.data(), count_,
                                                                 states_.data(), sheets.data(), edges.data()});
        num_vertices_ = backend.sum(sheets, first_vertices_);
        num_edges_ = backend.sum(edges, first_edges_);
    }
    template <class Index>
    [[nodiscard]] passes::indexed_cells<Index> list_by(const Index& index) const {
        return {index, table_.data(), keys_.data(), states_.data(), first_vertices_.data(), first_edges_.data()};
    }

    buffer<cell_sheets> table_;
    buffer<std::uint64_t> keys_;
    buffer<std::uint16_t> states_;

private:
    buffer<std::uint64_t> first_vertices_, first_edges_;
    std::uint64_t count_ = 0, num_vertices_ = 0, num_edges_ = 0;
};

// The cells of a grid of bits. A backend may have a class of its own for them, with the same bytes.
template <class Backend>
class surface_cells : public numbered_cells<Backend> {
    using base = numbered_cells<Backend>;
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using list_type = passes::cell_list; // what passes take
    static constexpr bool is_sparse = false;

    // The samples are those of a grid of this extent; their memory outlives the object. Waits.
    surface_cells(Backend& backend, const std::uint32_t* samples, const glm::ivec3& extent)
        : base(backend), grid_{{samples, extent.x, extent.y, extent.z}},
          first_of_word_(backend, grid_.rows() * static_cast<std::uint64_t>(grid_.row_words())) {
        const std::uint64_t rows = grid_.rows();
        buffer<std::uint64_t> first_of_row(backend, rows + 1);
        std::uint64_t count = 0;
        {
            buffer<std::uint32_t> counts(backend, rows + 1);
            for_each_row(backend, rows + 1, passes::count_active_cells{grid_, counts.data()});
            count = backend.sum(counts, first_of_row);
        }
        if (!base::make_room(backend, count)) return;
        for_each_row(backend, rows,
                     passes::list_active_cells{grid_, first_of_row.data(), first_of_word_.data(), base::keys_.data(),
                                               base::states_.data()});
        base::number(backend, grid_.samples);
    }

    // Refers to the object.
    [[nodiscard]] list_type list() const { return base::list_by(passes::word_index{grid_, first_of_word_.data()}); }
    [[nodiscard]] const passes::cell_grid& grid() const { return grid_; }

private:
    passes::cell_grid grid_;
    buffer<std::uint32_t> first_of_word_;
};

// Calls use(number, axis, low, goes_out) for crossed edges of all cells, along Axis or all of them: as
// passes::edges_of_cell.
template <int Axis, class Backend, class Cells, class Use>
void for_each_edge(Backend& backend, const Cells& cells, const Use& use) {
    if constexpr (Cells::makes_meshes)
        cells.template for_each_edge<Axis>(use);
    else
        backend.for_each(cells.count(), passes::edges_of_cell<Axis, typename Cells::list_type, Use>{cells.list(), use});
}

// True if a surface may have parts that the options leave out.
[[nodiscard]] inline bool leaves_parts_out(const extract_options& o) {
    return o.border == border::open || o.min_component != 0;
}

// The number of components of a surface of which nothing is left out: each vertex is used by a quad. Waits.
template <class Backend>
[[nodiscard]] std::uint64_t count_components(Backend& backend, const surface<Backend>& of) {
    typename Backend::template buffer<std::uint32_t> parents(backend, of.vertices.size());
    typename Backend::template buffer<std::uint64_t> found(backend, 1);
    backend.for_each(of.vertices.size(), passes::start_sets{parents.data()});
    backend.for_each(1, passes::clear_counts{found.data()});
    backend.for_each(of.quads.size(), passes::join_all_quads{of.quads.data(), {parents.data()}});
    backend.for_each(of.vertices.size(), passes::count_sets{parents.data(), found.data()});
    return found.to_host(backend)[0];
}

// Leaves out what the options ask for, and counts components.
template <class Backend>
void choose_parts(Backend& backend, const extract_options& options, surface<Backend>& out, surface_counters& counts) {
    using words = typename Backend::template buffer<std::uint32_t>;
    using numbers = typename Backend::template buffer<std::uint64_t>;
    const std::uint64_t vertices = out.vertices.size(), quads = out.quads.size();
    words parents(backend, vertices), kept(backend, vertices + 1), kept_quads(backend, quads + 1);
    numbers sizes(backend, vertices), found(backend, static_cast<std::size_t>(passes::part_count::count));
    const passes::vertex_sets sets{parents.data()};
    backend.for_each(vertices, passes::start_vertices{parents.data(), kept.data()});
    backend.for_each(vertices, passes::clear_counts{sizes.data()});
    backend.for_each(found.size(), passes::clear_counts{found.data()});
    backend.for_each(quads, passes::join_quads{out.quads.data(), out.vertices.data(), out.samples.extent,
                                               options.border == border::open, sets, kept.data(), kept_quads.data()});
    backend.for_each(vertices, passes::count_members{sets, kept.data(), sizes.data()});
    const std::uint64_t least = options.min_component;
    backend.for_each(vertices, passes::choose_components{sets, sizes.data(), least, found.data()});
    const std::vector<std::uint64_t> host = found.to_host(backend);
    counts.components_left_out = host[static_cast<std::size_t>(passes::part_count::left_out)];
    counts.components = host[static_cast<std::size_t>(passes::part_count::found)] - counts.components_left_out;
    if (options.border == border::closed && counts.components_left_out == 0) return;

    numbers places(backend, vertices + 1), quad_places(backend, quads + 1);
    backend.for_each(vertices + 1, passes::drop_vertices{sets, sizes.data(), least, vertices, kept.data()});
    backend.for_each(quads + 1, passes::drop_quads{out.quads.data(), kept.data(), quads, kept_quads.data()});
    const std::uint64_t vertices_left = backend.sum(kept, places), quads_left = backend.sum(kept_quads, quad_places);
    typename Backend::template buffer<surface_vertex> moved(backend, vertices_left);
    typename Backend::template buffer<glm::uvec4> moved_quads(backend, quads_left);
    const bool has_sources = out.sources.size() != 0;
    words sources(backend, has_sources ? vertices_left : 0);
    backend.for_each(vertices,
                     passes::move_vertices{kept.data(), places.data(), out.vertices.data(),
                                           has_sources ? out.sources.data() : nullptr, moved.data(), sources.data()});
    backend.for_each(quads, passes::move_quads{kept_quads.data(), quad_places.data(), places.data(), out.quads.data(),
                                               moved_quads.data()});
    out.vertices = std::move(moved);
    out.quads = std::move(moved_quads);
    out.sources = std::move(sources);
}

// Moves vertices of triangles that intersect to the mean, round by round.
template <class Backend, class Cells>
void embed(Backend& backend, const Cells& cells, const edge_crossing* crossings, place where, surface<Backend>& out,
           surface_counters& counts) {
    using numbers = typename Backend::template buffer<std::uint64_t>;
    using list_type = typename Cells::list_type;
    typename Backend::template buffer<glm::uvec3> triangles(backend, 2 * out.quads.size());
    typename Backend::template buffer<std::uint32_t> marks(backend, out.vertices.size());
    numbers found(backend, static_cast<std::size_t>(passes::embed_count::count));
    std::uint64_t* const pairs = found.data() + static_cast<std::size_t>(passes::embed_count::pairs);
    std::uint64_t* const moved = found.data() + static_cast<std::size_t>(passes::embed_count::moved);
    backend.for_each(marks.size(), passes::start_marks{marks.data(), where == place::mean});
    for (;;) {
        backend.for_each(found.size(), passes::clear_counts{found.data()});
        backend.for_each(out.quads.size(), passes::cut_quads{out.vertices.data(), out.quads.data(),
                                                             where == place::sharp, triangles.data()});
        backend.for_each(cells.count(), passes::find_pairs<list_type>{cells.list(), out.vertices.data(),
                                                                      triangles.data(), marks.data(), pairs});
        const passes::place_vertices<list_type> means{cells.list(),        place::mean, crossings,
                                                      out.vertices.data(), nullptr,     nullptr};
        backend.for_each(cells.count(), passes::move_to_mean<list_type>{means, marks.data(), moved});
        const std::vector<std::uint64_t> host = found.to_host(backend);
        counts.intersecting_pairs = host[static_cast<std::size_t>(passes::embed_count::pairs)];
        const std::uint64_t moved_now = host[static_cast<std::size_t>(passes::embed_count::moved)];
        if (moved_now == 0) return;
        counts.moved_vertices += moved_now;
        ++counts.embed_rounds;
    }
}

// The vertices of all cells, and their sources where primitives are given.
template <class Backend, class Cells>
void place_all(const Cells& cells, place where, const edge_crossing* crossings, const std::uint32_t* primitives,
               surface<Backend>& made, Backend& backend) {
    if constexpr (Cells::makes_meshes) {
        if (crossings == nullptr) {
            cells.place_middles(where, made.vertices.data());
            return;
        }
    }
    backend.for_each(cells.count(), passes::place_vertices<typename Cells::list_type>{cells.list(), where, crossings,
                                                                                      made.vertices.data(), primitives,
                                                                                      made.sources.data()});
}

// The surface of cells whose crossings are known; null: all in the middle of their edges. primitives: of the crossings'
// triangles; null: vertices have no sources. Returns what the call returns, `result` with the surface's counts.
template <class Backend, class Cells>
[[nodiscard]] status finish_surface(Backend& backend, const Cells& cells, const grid& samples,
                                    const edge_crossing* crossings, const std::uint32_t* primitives,
                                    const extract_options& options, surface<Backend>& out, status result) {
    using list_type = typename Cells::list_type;
    const bool has_sources = primitives != nullptr;
    surface<Backend> made(backend);
    made.samples = samples;
    made.vertices = typename Backend::template buffer<surface_vertex>(backend, cells.num_vertices());
    if (has_sources) made.sources = typename Backend::template buffer<std::uint32_t>(backend, cells.num_vertices());
    place_all(cells, options.place, crossings, primitives, made, backend);
    const bool folds = options.place == place::sharp, parts = leaves_parts_out(options);
    const auto make_triangles = [&] {
        result.surface.faces = 2 * result.surface.faces;
        made.triangles = typename Backend::template buffer<glm::uvec3>(backend, result.surface.faces);
    };
    if constexpr (Cells::makes_meshes) {
        if (!options.quads && !options.embedded && !parts) { // there are no quads between
            result.surface.vertices = cells.num_vertices();
            result.surface.faces = cells.num_edges();
            make_triangles();
            cells.list_triangles(made.vertices.data(), folds, made.triangles.data());
            result.surface.components = cells.count_components();
            out = std::move(made);
            return result;
        }
    }
    made.quads = typename Backend::template buffer<glm::uvec4>(backend, cells.num_edges());
    if constexpr (Cells::makes_meshes)
        cells.list_quads(made.quads.data());
    else
        backend.for_each(cells.count(), passes::list_quads<list_type>{cells.list(), made.quads.data()});
    if (options.embedded) embed(backend, cells, crossings, options.place, made, result.surface);
    if (parts)
        choose_parts(backend, options, made, result.surface);
    else if constexpr (Cells::makes_meshes)
        result.surface.components = cells.count_components();
    else
        result.surface.components = count_components(backend, made);
    result.surface.vertices = made.vertices.size();
    result.surface.faces = made.quads.size();
    if (!options.quads) {
        make_triangles();
        backend.for_each(made.quads.size(),
                         passes::cut_quads{made.vertices.data(), made.quads.data(), folds, made.triangles.data()});
        made.quads = typename Backend::template buffer<glm::uvec4>(backend, 0);
    }
    out = std::move(made);
    return result;
}

[[nodiscard]] inline status too_many_vertices(std::uint64_t number) {
    status s = failure(status_code::too_many_vertices, stage::coarse_raster);
    s.surface.vertices = number;
    return s;
}

} // namespace voxelpipe::core
