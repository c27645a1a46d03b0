// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a call with cut cells on any backend: of all draws, turned so that rows run along x, with the cones
// that close their holes, and their open edges.

#include <voxelpipe/cells/passes/cell_source.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/passes/find_boundary.hpp>
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

    // Adds the cones that close the holes of each body. Throws as find_boundary() and close_boundary().
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
        const auto all = triangles_of(0, triangles_.size(), 0, vertices);
        backend_.for_each(edges, passes::key_edges{all, names.data(), bits, keys.data(), directions.data()});
        backend_.sort_by_key(keys, directions, 2 * bits);
        backend_.for_each(edges,
                          passes::count_unmatched_edges{{keys.data(), directions.data(), edges, bits}, counts_.data()});
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
        std::vector<hole_cones> cones;
        const auto close = [&](std::size_t first, std::size_t last) {
            const part_begin from = begins_[first], to = begins_[last];
            // Bad indices are those of vertex 0, and no vertex of the draws then, or three times the same one.
            const passes::body_triangles body = triangles_of(from.triangle, to.triangle, from.vertex, to.vertex);
            cones.push_back(core::close_boundary(
                find_boundary(backend_, positions_.data() + from.vertex, to.vertex - from.vertex, {&body, 1}),
                max_hole_edges));
        };
        const std::size_t draws = begins_.size() - 1;
        if (each == bodies::draw)
            for (std::size_t d = 0; d < draws; ++d) close(d, d + 1);
        else
            close(0, draws);
        return cones;
    }
    // Triangles whose vertices are numbered through all draws: [first, last), of these vertices.
    [[nodiscard]] passes::body_triangles triangles_of(std::uint64_t first, std::uint64_t last,
                                                      std::uint64_t first_vertex, std::uint64_t last_vertex) const {
        const auto count = static_cast<std::uint32_t>(last - first);
        return {{triangles_.data() + first, count, 0},
                count,
                static_cast<std::uint32_t>(last_vertex - first_vertex),
                static_cast<std::uint32_t>(first_vertex)};
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

} // namespace voxelpipe::core
