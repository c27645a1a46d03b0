// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Closes the holes of a snapped mesh: a cone over the boundary of each (docs/design.md, "Solids"). Exact and
// deterministic: a function of the multiset of snapped triangles, whatever their order or their vertices' numbers. On
// the host.
//
// The boundary of a set of triangles is the sum of their directed edges, where opposite ones cancel. It is a cycle: at
// every vertex as many edges begin as end, in each connected component of it. A cone, one triangle (b, a, apex) for
// each edge a -> b, has exactly the opposite boundary: its other edges cancel, because the component is a cycle. So
// mesh and cones together have no boundary, and along every row the crossings sum to 0.

#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/instances.hpp>
#include <voxelpipe/core/radix_order.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// Some triangles of a body, in host memory. Triangles with a vertex that cannot be drawn or does not exist are left
// out.
struct hole_part {
    const snapped_position* positions;
    std::size_t num_vertices;
    instanced_triangles triangles;
    std::size_t num_triangles; // of all instances
    std::uint32_t least = 0;   // index of the first vertex
};

struct hole_cones {
    std::vector<snapped_position> positions;
    std::vector<glm::uvec3> triangles;
    std::uint64_t edges = 0; // of the boundary, with their multiplicity
    std::uint64_t holes = 0; // connected components of it
    std::uint64_t cones = 0; // holes of no more than the greatest number of edges
};

// Edges by their lower vertex, then sorted: opposite ones meet, and cancel.
class edge_chain {
public:
    explicit edge_chain(std::size_t num_vertices) : first_(num_vertices + 1) {}

    struct edge {
        std::uint64_t from, to;
    };

    // Two passes over the same edges: count all, then start(), then add all. An edge from a vertex to itself does not
    // count.
    void count(std::uint64_t from, std::uint64_t to) {
        if (from != to) ++first_[std::min(from, to) + 1];
    }
    void start() {
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        next_.assign(first_.begin(), first_.end() - 1);
        ends_.resize(first_.back());
    }
    void add(std::uint64_t from, std::uint64_t to) {
        if (from != to) ends_[next_[std::min(from, to)]++] = std::max(from, to) << 1 | (from < to ? 0u : 1u);
    }

    // The edges left after cancelling, each as often as it is left.
    [[nodiscard]] std::vector<edge> boundary() {
        std::vector<edge> left;
        for (std::size_t v = 0; v + 1 < first_.size(); ++v) {
            const auto begin = ends_.begin() + static_cast<std::ptrdiff_t>(first_[v]),
                       end = ends_.begin() + static_cast<std::ptrdiff_t>(first_[v + 1]);
            std::sort(begin, end);
            for (auto i = begin; i != end;) {
                const std::uint64_t other = *i >> 1;
                std::int64_t sum = 0; // of edges that go up
                for (; i != end && *i >> 1 == other; ++i) sum += (*i & 1) == 0 ? 1 : -1;
                for (; sum > 0; --sum) left.push_back({v, other});
                for (; sum < 0; ++sum) left.push_back({other, v});
            }
        }
        return left;
    }

private:
    std::vector<std::uint64_t> first_, next_; // of each vertex's edges
    std::vector<std::uint64_t> ends_;         // the higher vertex, and whether the edge comes down from it
};

// The boundary of a set of triangles, welded by position: vertices in order of x, then y, then z, no two at the same
// place, and edges by their lower vertex, then the higher one, each as often as it is left.
struct hole_boundary {
    std::vector<snapped_position> positions;
    std::vector<edge_chain::edge> edges;
};

// Leaves out vertices that have no edge, because all of theirs have cancelled.
inline void drop_unused(hole_boundary& b) {
    std::vector<std::uint32_t> name(b.positions.size());
    for (const auto& e : b.edges) name[e.from] = name[e.to] = 1;
    std::size_t kept = 0;
    for (std::size_t v = 0; v < name.size(); ++v) {
        if (name[v] == 0) continue;
        b.positions[kept] = b.positions[v];
        name[v] = static_cast<std::uint32_t>(kept++);
    }
    if (kept == name.size()) return;
    b.positions.resize(kept);
    for (auto& e : b.edges) e = {name[e.from], name[e.to]};
}

// The cones over a boundary. Throws std::bad_alloc, or std::length_error for more than 2^32 boundary vertices.
[[nodiscard]] inline hole_cones close_boundary(hole_boundary&& boundary, std::uint64_t max_hole_edges) {
    const auto too_many = [] { throw std::length_error("voxelpipe: more boundary vertices than triangles can name"); };
    if (boundary.positions.size() > std::numeric_limits<std::uint32_t>::max()) too_many();
    // Components, each with its least vertex as its root.
    std::vector<std::uint32_t> parent(boundary.positions.size());
    std::iota(parent.begin(), parent.end(), std::uint32_t{0});
    const auto root = [&](std::uint64_t of) {
        auto v = static_cast<std::uint32_t>(of);
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto& e : boundary.edges) {
        const std::uint32_t a = root(e.from), b = root(e.to);
        parent[std::max(a, b)] = std::min(a, b);
    }
    struct component {
        std::uint64_t edges = 0;
        std::uint64_t vertices = 0;
        int128 sum[3] = {0, 0, 0};
        std::uint32_t apex = 0;
    };
    std::vector<component> components;
    // A vertex's root is not above it, and has its component's number already.
    std::vector<std::uint32_t> number(parent.size());
    for (std::uint32_t v = 0; v < parent.size(); ++v) {
        const std::uint32_t r = root(v);
        if (r == v) {
            number[v] = static_cast<std::uint32_t>(components.size());
            components.emplace_back();
        }
        number[v] = number[r];
        component& c = components[number[v]];
        ++c.vertices;
        c.sum[0] += boundary.positions[v].x;
        c.sum[1] += boundary.positions[v].y;
        c.sum[2] += boundary.positions[v].z;
    }
    for (const auto& e : boundary.edges) ++components[number[e.from]].edges;
    hole_cones out;
    out.edges = boundary.edges.size();
    out.holes = components.size();
    out.positions = std::move(boundary.positions);
    for (component& c : components) {
        if (c.edges > max_hole_edges) continue;
        ++out.cones;
        // The mean of the vertices, to the nearest unit: floor((2 s + m) / (2 m)).
        const int128 m = c.vertices;
        const auto mean = [&](int128 s) {
            return static_cast<std::int64_t>(exact::floor_div<int128>(2 * s + m, 2 * m));
        };
        if (out.positions.size() > std::numeric_limits<std::uint32_t>::max()) too_many();
        c.apex = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back({mean(c.sum[0]), mean(c.sum[1]), mean(c.sum[2])});
    }
    out.triangles.reserve(boundary.edges.size());
    for (const auto& e : boundary.edges) {
        const component& c = components[number[e.from]];
        if (c.edges <= max_hole_edges)
            out.triangles.push_back({static_cast<std::uint32_t>(e.to), static_cast<std::uint32_t>(e.from), c.apex});
    }
    return out;
}

// Welds edges that are left once some opposite ones have cancelled. position(v): where their vertex v is. Throws as
// close_boundary().
template <class Position>
[[nodiscard]] hole_boundary weld_edges(const std::vector<edge_chain::edge>& edges, const Position& position) {
    // End 2 i is where edge i begins, and the next one where it ends.
    if (edges.size() > std::numeric_limits<std::uint32_t>::max() / 2)
        throw std::length_error("voxelpipe: more boundary vertices than triangles can name");
    const auto vertex_of = [&](std::uint32_t end) { return end % 2 == 0 ? edges[end / 2].from : edges[end / 2].to; };
    radix_order ends(2 * edges.size());
    ends.sort(vertex_of);
    // Vertices, each once.
    std::vector<std::uint32_t> used(2 * edges.size()); // by end
    std::vector<snapped_position> places;
    for (std::size_t i = 0; i < ends.items().size(); ++i) {
        const std::uint32_t end = ends.items()[i];
        if (i == 0 || vertex_of(end) != vertex_of(ends.items()[i - 1])) places.push_back(position(vertex_of(end)));
        used[end] = static_cast<std::uint32_t>(places.size() - 1);
    }
    radix_order sorted(places.size());
    sorted.sort([&](std::uint32_t v) { return places[v].z; });
    sorted.sort([&](std::uint32_t v) { return places[v].y; });
    sorted.sort([&](std::uint32_t v) { return places[v].x; });
    // Names of places, in their order.
    std::vector<std::uint32_t> name(places.size());
    hole_boundary welded;
    for (const std::uint32_t v : sorted.items()) {
        const snapped_position& p = places[v];
        if (welded.positions.empty() || welded.positions.back().x != p.x || welded.positions.back().y != p.y ||
            welded.positions.back().z != p.z)
            welded.positions.push_back(p);
        name[v] = static_cast<std::uint32_t>(welded.positions.size() - 1);
    }
    edge_chain chain(welded.positions.size());
    const auto for_each_edge = [&](auto&& visit) {
        for (std::size_t i = 0; i < edges.size(); ++i) visit(name[used[2 * i]], name[used[2 * i + 1]]);
    };
    for_each_edge([&](std::uint64_t a, std::uint64_t b) { chain.count(a, b); });
    chain.start();
    for_each_edge([&](std::uint64_t a, std::uint64_t b) { chain.add(a, b); });
    welded.edges = chain.boundary();
    drop_unused(welded);
    return welded;
}

// The edges of one body that are left when opposite ones of the same two vertices have cancelled: all its triangles, in
// whatever parts, whose vertices are numbered through. Throws std::bad_alloc.
[[nodiscard]] inline std::vector<edge_chain::edge> open_edges(const std::vector<hole_part>& body) {
    // Most edges cancel between the vertices as the mesh numbers them; a sum of chains may be taken in any order.
    std::uint64_t num_vertices = 0;
    for (const hole_part& p : body) num_vertices += p.num_vertices;
    edge_chain all(num_vertices);
    const auto for_each_edge = [&](auto&& visit) {
        std::uint64_t first = 0;
        for (const hole_part& p : body) {
            for (std::size_t i = 0; i < p.num_triangles; ++i) {
                glm::uvec3 t = p.triangles[static_cast<std::uint32_t>(i)];
                t -= glm::uvec3(p.least);
                if (t.x >= p.num_vertices || t.y >= p.num_vertices || t.z >= p.num_vertices) continue;
                if (!is_drawable(p.positions[t.x]) || !is_drawable(p.positions[t.y]) || !is_drawable(p.positions[t.z]))
                    continue;
                visit(first + t.x, first + t.y);
                visit(first + t.y, first + t.z);
                visit(first + t.z, first + t.x);
            }
            first += p.num_vertices;
        }
    };
    for_each_edge([&](std::uint64_t a, std::uint64_t b) { all.count(a, b); });
    all.start();
    for_each_edge([&](std::uint64_t a, std::uint64_t b) { all.add(a, b); });
    return all.boundary();
}

// The boundary of one body. Throws as close_boundary().
[[nodiscard]] inline hole_boundary find_boundary(const std::vector<hole_part>& body) {
    std::vector<std::uint64_t> ends; // of each part's vertices
    ends.reserve(body.size());
    std::uint64_t num_vertices = 0;
    for (const hole_part& p : body) ends.push_back(num_vertices += p.num_vertices);
    const auto position = [&](std::uint64_t v) {
        const auto part = static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), v) - ends.begin());
        return body[part].positions[v - (ends[part] - body[part].num_vertices)];
    };
    return weld_edges(open_edges(body), position);
}

// The cones of one body. Throws as close_boundary().
[[nodiscard]] inline hole_cones close_holes(const std::vector<hole_part>& body, std::uint64_t max_hole_edges) {
    return close_boundary(find_boundary(body), max_hole_edges);
}

// The same cones as a part of the whole grid sees them, whose first voxel is `offset` units (snap_transform) from its
// own.
[[nodiscard]] inline hole_cones moved(hole_cones cones, const std::int64_t (&offset)[3]) {
    for (snapped_position& p : cones.positions) p = {p.x - offset[0], p.y - offset[1], p.z - offset[2]};
    return cones;
}

} // namespace voxelpipe::core
