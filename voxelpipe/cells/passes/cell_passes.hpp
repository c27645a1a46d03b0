// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells on any backend: list the terms of all triangles, sort them by row and voxel, sum and shade the rows.

#include <voxelpipe/cells/passes/cell_walk.hpp>
#include <voxelpipe/core/row_passes.hpp>
#include <voxelpipe/programs/passes/fragment_pool.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/surfaces/passes/mesh_rows.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// (along the rows, the two other axes) of (x, y, z).
[[nodiscard]] inline glm::ivec3 turn(const glm::ivec3& p, int axis) {
    return axis == 0 ? p : axis == 1 ? glm::ivec3(p.y, p.z, p.x) : glm::ivec3(p.z, p.x, p.y);
}

// Turns a position that can be drawn.
[[nodiscard]] VOXELPIPE_HD inline snapped_position turn(const snapped_position& p, int axis) {
    return axis == 0 ? p : axis == 1 ? snapped_position{p.y, p.z, p.x} : snapped_position{p.z, p.x, p.y};
}

// The areas of a voxel's faces, along the rows and the two other axes.
[[nodiscard]] inline cell_areas areas_of(const grid& g, int axis) {
    const double side = std::ldexp(1.0, std::ilogb(std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z})));
    cell_areas a{};
    a.side = side;
    for (int i = 0; i < 3; ++i)
        a.face[i] = exact::mul(g.voxel_size[(axis + i + 1) % 3] / side, g.voxel_size[(axis + i + 2) % 3] / side);
    return a;
}

// The triangles of a call, and what its passes count.
template <class Backend>
class cell_scene {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    static constexpr std::array<std::uint64_t, index_of(cell_count::size)> zeros{};

public:
    // Runs the vertex shaders. Triangles are at most 2^32 - 1. Waits.
    template <class Draw>
    cell_scene(Backend& backend, std::span<const Draw> draws, const grid& g, int axis)
        : backend_(backend), counts_(backend, array_view<const std::uint64_t>(zeros.data(), zeros.size())),
          positions_(backend, num_vertices(draws)), triangles_(backend, num_triangles(draws)),
          first_triangle_(backend, 0), fraction_(g.fraction()), extent_(turn(g.extent, axis)),
          areas_(areas_of(g, axis)), snap_(make_snap_transform(g)), axis_(axis) {
        std::uint64_t first_vertex = 0, first_triangle = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            begins_.push_back({first_vertex, first_triangle});
            const auto& mesh = draws[d].mesh;
            using mesh_type = std::remove_cvref_t<decltype(mesh)>;
            using shader_type = std::remove_cvref_t<decltype(draws[d].vertex_shader)>;
            const std::uint64_t vertices = mesh.positions.size() * mesh.copies.count;
            const std::uint64_t triangles = mesh.triangles.size() * mesh.copies.count;
            backend.for_each(vertices, passes::snap_vertices_of_cells<mesh_type, shader_type>{
                                           mesh, draws[d].vertex_shader, static_cast<std::uint32_t>(d), snap_, axis,
                                           positions_.data() + first_vertex});
            backend.for_each(triangles, passes::join_triangles{elements_of<mesh_type>::indices(mesh),
                                                               static_cast<std::uint32_t>(first_vertex),
                                                               triangles_.data() + first_triangle, counts_.data()});
            first_vertex += vertices;
            first_triangle += triangles;
        }
        begins_.push_back({first_vertex, first_triangle});
        set_parts();
    }

    [[nodiscard]] passes::cell_mesh mesh() const {
        return {positions_.data(),
                triangles_.data(),
                first_triangle_.data(),
                static_cast<std::uint32_t>(first_triangle_.size()),
                static_cast<std::uint32_t>(begins_.size() - 1),
                static_cast<std::uint32_t>(begins_.back().triangle),
                static_cast<std::uint32_t>(triangles_.size()),
                fraction_,
                extent_,
                areas_};
    }
    [[nodiscard]] std::uint64_t* counts() { return counts_.data(); }
    [[nodiscard]] std::vector<std::uint64_t> read_counts() const { return counts_.to_host(backend_); }
    [[nodiscard]] const glm::ivec3& extent() const { return extent_; } // turned

    // Vertices and triangles, cones included.
    [[nodiscard]] std::uint64_t num_vertices() const { return positions_.size(); }
    [[nodiscard]] std::uint64_t num_triangles() const { return triangles_.size(); }

    // Adds the cones that close the holes of each body, found on the host. Throws as core::close_holes.
    void close_holes(bodies each, std::uint64_t max_hole_edges, cell_counters& counts) {
        add_cones(find_cones(each, max_hole_edges), counts);
    }
    // The same with cones that are known, of this many bodies, in units of the whole grid.
    void close_holes(const hole_cones* known, std::size_t num_bodies, cell_counters& counts) {
        std::vector<hole_cones> cones;
        for (std::size_t b = 0; b < num_bodies; ++b) {
            cones.push_back(moved(known[b], snap_.offset));
            for (snapped_position& p : cones.back().positions) p = turn(p, axis_);
        }
        add_cones(std::move(cones), counts);
    }

    void count_open_edges() {
        const std::uint64_t edges = std::uint64_t{3} * triangles_.size();
        const std::uint64_t vertices = positions_.size();
        buffer<std::uint32_t> names(backend_, vertices);
        {
            buffer<std::uint64_t> keys(backend_, vertices);
            buffer<std::uint32_t> order(backend_, vertices);
            backend_.for_each(vertices, passes::hash_places{positions_.data(), keys.data(), order.data()});
            backend_.sort_by_key(keys, order, passes::place_key_bits);
            backend_.for_each(
                vertices, passes::name_places{positions_.data(), keys.data(), order.data(), vertices, names.data()});
        }
        const int bits = static_cast<int>(std::bit_width(vertices)); // vertices are fewer than 2^32
        buffer<std::uint64_t> keys(backend_, edges);
        buffer<std::uint32_t> directions(backend_, edges);
        backend_.for_each(edges,
                          passes::key_edges{triangles_.data(), names.data(), bits, keys.data(), directions.data()});
        backend_.sort_by_key(keys, directions, 2 * bits);
        backend_.for_each(edges,
                          passes::count_unmatched_edges{keys.data(), directions.data(), edges, bits, counts_.data()});
    }

    // The number of vertices through all draws and instances.
    template <class Draw>
    [[nodiscard]] static std::uint64_t num_vertices(std::span<const Draw> draws) {
        std::uint64_t n = 0;
        for (const auto& d : draws) n += d.mesh.positions.size() * d.mesh.copies.count;
        return n;
    }

private:
    [[nodiscard]] std::vector<hole_cones> find_cones(bodies each, std::uint64_t max_hole_edges) {
        const std::vector<snapped_position> positions = positions_.to_host(backend_);
        std::vector<glm::uvec3> triangles = triangles_.to_host(backend_);
        std::vector<hole_part> parts;
        for (std::size_t d = 0; d + 1 < begins_.size(); ++d) {
            const part_begin from = begins_[d], to = begins_[d + 1];
            const auto vertices = static_cast<std::size_t>(to.vertex - from.vertex),
                       count = static_cast<std::size_t>(to.triangle - from.triangle);
            // Bad indices are those of vertex 0, and no vertex of the draw then, or three times the same one.
            for (std::uint64_t i = from.triangle; i < to.triangle; ++i)
                triangles[i] -= glm::uvec3(static_cast<std::uint32_t>(from.vertex));
            parts.push_back({positions.data() + from.vertex, vertices,
                             instanced_triangles{triangles.data() + from.triangle, static_cast<std::uint32_t>(count),
                                                 static_cast<std::uint32_t>(vertices)},
                             count});
        }
        std::vector<hole_cones> cones;
        if (each == bodies::draw) {
            for (const hole_part& p : parts) cones.push_back(core::close_holes({p}, max_hole_edges));
        } else {
            cones.push_back(core::close_holes(parts, max_hole_edges));
        }
        return cones;
    }
    void add_cones(std::vector<hole_cones>&& cones, cell_counters& counts) {
        std::uint64_t vertices = positions_.size(), count = triangles_.size();
        for (const hole_cones& c : cones) {
            counts.hole_edges += c.edges;
            counts.holes += c.holes;
            counts.cones += c.cones;
            vertices += c.positions.size();
            count += c.triangles.size();
        }
        if (counts.cones == 0) return;
        if (vertices > std::numeric_limits<std::uint32_t>::max() || count > std::numeric_limits<std::uint32_t>::max())
            throw std::length_error("voxelpipe: more vertices or triangles than 32 bits number");
        buffer<snapped_position> more_positions(backend_, vertices);
        buffer<glm::uvec3> more_triangles(backend_, count);
        const auto copy = [&](const auto& from, auto* to) {
            using item = std::remove_pointer_t<decltype(to)>;
            backend_.for_each(from.size(), passes::copy_items<item>{from.data(), to});
        };
        copy(positions_, more_positions.data());
        copy(triangles_, more_triangles.data());
        std::uint64_t first_vertex = positions_.size(), first_triangle = triangles_.size();
        for (hole_cones& c : cones) {
            first_cones_.push_back(first_triangle);
            for (glm::uvec3& t : c.triangles) t += glm::uvec3(static_cast<std::uint32_t>(first_vertex));
            const buffer<snapped_position> p(backend_, array_view<const snapped_position>(c.positions));
            const buffer<glm::uvec3> t(backend_, array_view<const glm::uvec3>(c.triangles));
            copy(p, more_positions.data() + first_vertex);
            copy(t, more_triangles.data() + first_triangle);
            first_vertex += c.positions.size();
            first_triangle += c.triangles.size();
        }
        positions_ = std::move(more_positions);
        triangles_ = std::move(more_triangles);
        set_parts();
    }

    template <class Draw>
    [[nodiscard]] static std::uint64_t num_triangles(std::span<const Draw> draws) {
        std::uint64_t n = 0;
        for (const auto& d : draws) n += d.mesh.triangles.size() * d.mesh.copies.count;
        return n;
    }
    void set_parts() {
        std::vector<std::uint64_t> first;
        for (std::size_t d = 0; d + 1 < begins_.size(); ++d) first.push_back(begins_[d].triangle);
        first.insert(first.end(), first_cones_.begin(), first_cones_.end());
        first_triangle_ = buffer<std::uint64_t>(backend_, array_view<const std::uint64_t>(first.data(), first.size()));
    }
    struct part_begin {
        std::uint64_t vertex, triangle;
    };

    Backend& backend_;
    buffer<std::uint64_t> counts_;
    buffer<snapped_position> positions_;
    buffer<glm::uvec3> triangles_;
    std::vector<part_begin> begins_;         // of each draw, and the end
    std::vector<std::uint64_t> first_cones_; // of each body
    buffer<std::uint64_t> first_triangle_;
    int fraction_;
    glm::ivec3 extent_;
    cell_areas areas_;
    snap_transform snap_;
    int axis_;
};

// The status of a call that has succeeded, or what failed.
[[nodiscard]] inline status make_cell_status(const std::vector<std::uint64_t>& counts, const cell_options& options,
                                             std::uint64_t triangles_in, std::uint64_t records) {
    const auto of = [&](cell_count c) { return counts[index_of(c)]; };
    status s;
    if (of(cell_count::bad_index) != 0)
        s = failure(status_code::index_out_of_range, stage::coarse_raster);
    else if (of(cell_count::too_large) != 0)
        s = failure(status_code::winding_too_large, stage::fine_raster);
    s.counts.triangles_in = triangles_in;
    if (!s.ok()) return s;
    s.counts.triangles_nonfinite = of(cell_count::nonfinite);
    s.counts.triangles_too_far = of(cell_count::too_far);
    s.counts.triangles_outside = of(cell_count::outside);
    s.counts.triangles_drawn = triangles_in - s.counts.triangles_dropped() - s.counts.triangles_outside;
    s.counts.fragments = of(cell_count::fragments);
    s.counts.fragments_discarded = of(cell_count::discarded);
    s.counts.voxels = options.count_voxels ? of(cell_count::voxels) : 0;
    s.cells.open_rows = of(cell_count::open_rows);
    s.cells.open_edges = of(cell_count::open_edges);
    s.cells.cut_voxels = of(cell_count::cut_voxels);
    s.cells.below_zero = of(cell_count::below_zero);
    s.cells.above_one = of(cell_count::above_one);
    s.cells.cell_records = records;
    s.cells.lost_centroids = of(cell_count::lost_centroids);
    uint128 volume = static_cast<uint128>(of(cell_count::volume_high)) << 64;
    volume += static_cast<uint128>(of(cell_count::volume_middle)) << 32;
    volume += of(cell_count::volume_low);
    s.cells.volume_low = static_cast<std::uint64_t>(volume);
    s.cells.volume_high = static_cast<std::int64_t>(volume >> 64);
    return s;
}

// A backend whose threads can keep items before their number is known.
template <class Backend>
inline constexpr bool has_collect = requires(Backend& b) {
    b.template collect<int>(std::uint64_t{0}, [](std::uint64_t, const auto&) {});
};

// True of a backend that lists terms in its own way, by passes::list_terms_by_pixel(backend, mesh of the scene, keys,
// counts, term_room).
template <class Backend>
inline constexpr bool lists_by_pixel = false;

// The arrays of a call's terms, which are as long as they have to be, or longer.
template <class Backend, class Terms>
struct term_room {
    typename Backend::template buffer<std::uint64_t>& keys;
    typename Backend::template buffer<std::uint32_t>& order;
    typename Backend::template buffer<Terms>& terms;
};

// The terms of a call's triangles by row and voxel, and what shades them.
template <class Backend, class CellShader>
class listed_cells {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using walk_type = passes::cell_walk<CellShader>;
    using terms_type = typename walk_type::terms_type;

    // Runs the vertex shaders, unless list() is to fail for want of numbers.
    template <class Draw>
    listed_cells(Backend& backend, std::span<const Draw> draws, const grid& g, const cell_options& options,
                 std::uint64_t triangles_in)
        : backend_(backend), options_(options), triangles_in_(triangles_in), num_draws_(draws.size()),
          offset_(g.offset), scene_(backend, draws, g, options.axis), keys_(backend, 0), order_(backend, 0),
          sizes_(backend, 0), terms_(backend, 0), shaders_(backend, 0), cursors_(backend, 0) {
        std::vector<CellShader> shaders;
        for (const auto& d : draws) shaders.push_back(d.fragment_shader);
        shaders_ = buffer<CellShader>(backend, array_view<const CellShader>(shaders.data(), shaders.size()));
    }

    // Closes holes, then lists and sorts. Throws what the backend's buffers throw.
    [[nodiscard]] status list() {
        if (scene_.num_vertices() == 0) return result(); // bad indices, of which none is a vertex's
        if (options_.repair == repair::close_holes) {
            if (options_.cones != nullptr)
                scene_.close_holes(options_.cones, options_.bodies == bodies::call ? 1 : num_draws_, holes_);
            else
                scene_.close_holes(options_.bodies, options_.max_hole_edges, holes_);
        }
        const std::uint64_t triangles = scene_.num_triangles();
        const bool finds_edges = options_.count_open_edges;
        if (finds_edges && 3 * triangles >= most) return fail(status_code::out_of_memory);
        const glm::ivec3 extent = scene_.extent();
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        keys_of_ = {wide(extent.x) + 2, wide(extent.y), options_.bodies == bodies::call ? 1 : num_draws_};
        const uint128 num_keys = static_cast<uint128>(num_rows()) * keys_of_.bodies * keys_of_.slots;
        if (num_keys >> 63 != 0) return fail(status_code::size_overflow);

        if (finds_edges) scene_.count_open_edges();
        if (!list_terms(triangles)) return fail(status_code::out_of_memory);
        const int bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(num_keys)));
        if constexpr (lists_by_pixel<Backend>)
            backend_.sort_by_key(keys_, order_, bits, num_records_);
        else
            backend_.sort_by_key(keys_, order_, bits);
        return {};
    }
    // Looks at the sums of the rows of the grid, or of `count` listed ones.
    [[nodiscard]] status measure(std::uint64_t count, const std::uint64_t* rows = nullptr) {
        for_each_row(backend_, count * keys_of_.bodies,
                     passes::measure_rows<terms_type>{terms(), checks_size(), counts(), rows,
                                                      sizes_.size() == 0 ? nullptr : sizes_.data()});
        return result();
    }
    // What goes along rows, of which there are `places` at a time.
    [[nodiscard]] walk_type walk(std::uint64_t places) {
        using cursor = typename walk_type::cursor;
        if (keys_of_.bodies != 1) cursors_ = buffer<cursor>(backend_, places * keys_of_.bodies);
        return {terms(), scene_.mesh(), shaders_.data(),  keys_of_.bodies == 1 ? nullptr : cursors_.data(),
                offset_, options_.axis, scene_.extent().x};
    }

    // The status so far: of a call that has succeeded, or what failed.
    [[nodiscard]] status result() const {
        status s = make_cell_status(scene_.read_counts(), options_, triangles_in_, num_records_);
        s.cells.hole_edges = s.ok() ? holes_.hole_edges : 0;
        s.cells.holes = s.ok() ? holes_.holes : 0;
        s.cells.cones = s.ok() ? holes_.cones : 0;
        return s;
    }
    [[nodiscard]] std::uint64_t num_rows() const {
        return static_cast<std::uint64_t>(scene_.extent().y) * static_cast<std::uint64_t>(scene_.extent().z);
    }
    [[nodiscard]] std::uint64_t* counts() { return scene_.counts(); }
    [[nodiscard]] passes::record_list<terms_type> terms() {
        return {keys_of_, keys_.data(), order_.data(), terms_.data(),
                lists_by_pixel<Backend> ? num_records_ : terms_.size()};
    }
    [[nodiscard]] status fail(status_code code) const {
        status s = failure(code, stage::coarse_raster);
        s.counts.triangles_in = triangles_in_;
        return s;
    }

    static constexpr std::uint64_t most = std::uint64_t{1} << 32; // vertices, edges and terms are numbered in 32 bits

private:
    // Lists the terms of all triangles. False if they cannot be numbered.
    [[nodiscard]] bool list_terms(std::uint64_t triangles) {
        if constexpr (has_collect<Backend>) {
            using record = passes::cell_record<terms_type>;
            auto records = backend_.template collect<record>(
                triangles, passes::collect_cells<terms_type>{scene_.mesh(), keys_of_, scene_.counts()});
            if (!make_room(records.size())) return false;
            if (checks_size()) sizes_ = buffer<std::uint32_t>(backend_, records.size());
            num_records_ = records.num_added();
            backend_.take(std::move(records),
                          passes::store_record<terms_type>{keys_.data(), order_.data(),
                                                           checks_size() ? sizes_.data() : nullptr, terms_.data()});
        } else if constexpr (lists_by_pixel<Backend>) {
            num_records_ = list_terms_by_pixel(backend_, scene_.mesh(), keys_of_, scene_.counts(),
                                               term_room<Backend, terms_type>{keys_, order_, terms_});
            return num_records_ < most;
        } else {
            buffer<std::uint64_t> first_term(backend_, triangles + 1);
            std::uint64_t count = 0;
            {
                buffer<std::uint32_t> num_terms(backend_, triangles + 1);
                backend_.for_each(triangles + 1,
                                  passes::count_cells<terms_type>{scene_.mesh(), num_terms.data(), scene_.counts()});
                count = backend_.sum(num_terms, first_term);
            }
            if (!make_room(count)) return false;
            backend_.for_each(triangles, passes::list_cells<terms_type>{scene_.mesh(), keys_of_, first_term.data(),
                                                                        keys_.data(), order_.data(), terms_.data()});
        }
        return true;
    }
    [[nodiscard]] bool checks_size() const {
        constexpr std::uint64_t safe = std::uint64_t{1} << 19; // triangles whose covers cannot wrap
        return scene_.num_triangles() >= safe;
    }
    [[nodiscard]] bool make_room(std::uint64_t count) {
        if (count >= most) return false;
        num_records_ = count;
        keys_ = buffer<std::uint64_t>(backend_, count);
        order_ = buffer<std::uint32_t>(backend_, count);
        terms_ = buffer<terms_type>(backend_, count);
        return true;
    }

    Backend& backend_;
    cell_options options_;
    std::uint64_t triangles_in_, num_draws_;
    glm::ivec3 offset_;
    cell_scene<Backend> scene_;
    cell_counters holes_;
    passes::cell_keys keys_of_{};
    buffer<std::uint64_t> keys_;
    buffer<std::uint32_t> order_, sizes_; // sizes: of terms that stand for several
    buffer<terms_type> terms_;
    std::uint64_t num_records_ = 0; // pairs of a triangle and a voxel
    buffer<CellShader> shaders_;    // of the bodies
    buffer<typename walk_type::cursor> cursors_;
};

// True if vertices are too many to be numbered; `failed` says so then.
template <class Backend, class Draw>
[[nodiscard]] bool has_too_many_vertices(std::span<const Draw> draws, std::uint64_t triangles_in, status& failed) {
    if (cell_scene<Backend>::num_vertices(draws) >> 32 == 0) return false;
    failed = failure(status_code::out_of_memory, stage::coarse_raster);
    failed.counts.triangles_in = triangles_in;
    return true;
}

// Implements voxelize_cells on any backend. Arguments are validated. Throws what the backend's buffers throw.
template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status run_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                               const grid& g, const framebuffer_view<Targets...>& fb, const cell_options& options,
                               std::uint64_t triangles_in) {
    status failed;
    if (has_too_many_vertices<Backend>(draws, triangles_in, failed)) return failed;
    listed_cells<Backend, CellShader> cells(backend, draws, g, options, triangles_in);
    if (const status s = cells.list(); !s.ok()) return s;
    if (const status s = cells.measure(cells.num_rows()); !s.ok()) return s;
    if (const status begun = begin_fold(backend, fb); !begun.ok()) return begun;
    for_each_row(backend, cells.num_rows(),
                 passes::shade_cells<CellShader, Targets...>{cells.walk(cells.num_rows()), fb, cells.counts()});
    return cells.result();
}

} // namespace voxelpipe::core
