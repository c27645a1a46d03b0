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

// The cones over the boundary of a set of triangles. `unwelded`: edges that are left once some opposite ones have
// cancelled; position(v): where their vertex v is. Throws as close_holes().
template <class Position>
[[nodiscard]] hole_cones close_boundary(const std::vector<edge_chain::edge>& unwelded, const Position& position,
                                        std::uint64_t max_hole_edges) {
    // The vertices of what is left, welded by position: their numbers are their ranks.
    struct vertex {
        snapped_position p;
        std::uint64_t number;
    };
    const auto same = [](const snapped_position& a, const snapped_position& b) {
        return a.x == b.x && a.y == b.y && a.z == b.z;
    };
    std::vector<std::uint64_t> used;
    for (const auto& e : unwelded) used.insert(used.end(), {e.from, e.to});
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::vector<vertex> sorted;
    sorted.reserve(used.size());
    for (std::size_t i = 0; i < used.size(); ++i) sorted.push_back({position(used[i]), i});
    std::sort(sorted.begin(), sorted.end(), [](const vertex& a, const vertex& b) {
        return a.p.x != b.p.x ? a.p.x < b.p.x : a.p.y != b.p.y ? a.p.y < b.p.y : a.p.z < b.p.z;
    });
    std::vector<std::uint64_t> rank(used.size());
    std::vector<snapped_position> welded;
    for (const vertex& v : sorted) {
        if (welded.empty() || !same(welded.back(), v.p)) welded.push_back(v.p);
        rank[v.number] = welded.size() - 1;
    }
    const auto number = [&](std::uint64_t v) {
        return rank[static_cast<std::size_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin())];
    };
    edge_chain chain(welded.size());
    for (const auto& e : unwelded) chain.count(number(e.from), number(e.to));
    chain.start();
    for (const auto& e : unwelded) chain.add(number(e.from), number(e.to));
    const std::vector<edge_chain::edge> boundary = chain.boundary();

    // Components, each with its least vertex as its root.
    std::vector<std::uint64_t> parent(welded.size());
    std::iota(parent.begin(), parent.end(), std::uint64_t{0});
    const auto root = [&](std::uint64_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto& e : boundary) {
        const std::uint64_t a = root(e.from), b = root(e.to);
        parent[std::max(a, b)] = std::min(a, b);
    }
    struct component {
        std::uint64_t edges = 0;
        std::uint64_t vertices = 0; // distinct ones
        int128 sum[3] = {0, 0, 0};
        std::uint32_t apex = 0;
    };
    std::vector<component> components(welded.size()); // at their roots
    std::vector<bool> on_boundary(welded.size());
    for (const auto& e : boundary) {
        ++components[root(e.from)].edges;
        on_boundary[e.from] = on_boundary[e.to] = true;
    }
    for (std::size_t v = 0; v < welded.size(); ++v) {
        if (!on_boundary[v]) continue;
        component& c = components[root(v)];
        ++c.vertices;
        c.sum[0] += welded[v].x;
        c.sum[1] += welded[v].y;
        c.sum[2] += welded[v].z;
    }
    hole_cones out;
    out.edges = boundary.size();
    out.positions = welded;
    for (component& c : components) {
        if (c.edges == 0) continue;
        ++out.holes;
        if (c.edges > max_hole_edges) continue;
        ++out.cones;
        // The mean of the vertices, to the nearest unit: floor((2 s + m) / (2 m)).
        const int128 m = c.vertices;
        const auto mean = [&](int128 s) {
            return static_cast<std::int64_t>(exact::floor_div<int128>(2 * s + m, 2 * m));
        };
        if (out.positions.size() > std::numeric_limits<std::uint32_t>::max())
            throw std::length_error("voxelpipe: more boundary vertices than triangles can name");
        c.apex = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back({mean(c.sum[0]), mean(c.sum[1]), mean(c.sum[2])});
    }
    for (const auto& e : boundary) {
        const component& c = components[root(e.from)];
        if (c.edges <= max_hole_edges)
            out.triangles.push_back({static_cast<std::uint32_t>(e.to), static_cast<std::uint32_t>(e.from), c.apex});
    }
    return out;
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
                const glm::uvec3 t = p.triangles[static_cast<std::uint32_t>(i)];
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

// The cones of one body. Throws std::bad_alloc, or std::length_error for more than 2^32 boundary vertices.
[[nodiscard]] inline hole_cones close_holes(const std::vector<hole_part>& body, std::uint64_t max_hole_edges) {
    std::vector<std::uint64_t> ends; // of each part's vertices
    ends.reserve(body.size());
    std::uint64_t num_vertices = 0;
    for (const hole_part& p : body) ends.push_back(num_vertices += p.num_vertices);
    const auto position = [&](std::uint64_t v) {
        const auto part = static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), v) - ends.begin());
        return body[part].positions[v - (ends[part] - body[part].num_vertices)];
    };
    return close_boundary(open_edges(body), position, max_hole_edges);
}

// The same cones as a part of the whole grid sees them, whose first voxel is `offset` units (snap_transform) from its
// own.
[[nodiscard]] inline hole_cones moved(hole_cones cones, const std::int64_t (&offset)[3]) {
    for (snapped_position& p : cones.positions) p = {p.x - offset[0], p.y - offset[1], p.z - offset[2]};
    return cones;
}

} // namespace voxelpipe::core
