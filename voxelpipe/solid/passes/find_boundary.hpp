// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The boundary of a body whose triangles lie in a backend's memory: as weld_edges(open_edges(body)), by sorts on the
// backend, so that the host gets the boundary alone.

#include <voxelpipe/mesh.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/passes/edge_passes.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// The same on the host.
[[nodiscard]] inline hole_boundary find_boundary_on_host(const snapped_position* positions,
                                                         std::span<const passes::body_triangles> parts) {
    std::vector<hole_part> body;
    for (const passes::body_triangles& p : parts)
        body.push_back({positions + p.first, p.num_vertices, p.triangles, p.count, p.least});
    return find_boundary(body);
}

// positions: of the body's vertices, in the backend's memory, which the parts have in order. Waits. Throws
// std::bad_alloc, std::length_error for 2^32 vertices or more, and what the backend's buffers throw.
template <class Backend>
[[nodiscard]] hole_boundary find_boundary(Backend& backend, const snapped_position* positions, std::uint64_t vertices,
                                          std::span<const passes::body_triangles> parts) {
    if constexpr (requires { Backend::runs_on_host; }) return find_boundary_on_host(positions, parts);
    using edges_buffer = typename Backend::template buffer<std::uint64_t>;
    using numbers = typename Backend::template buffer<std::uint32_t>;
    if (vertices >= std::numeric_limits<std::uint32_t>::max())
        throw std::length_error("voxelpipe: more vertices of a body than can be numbered");
    std::uint64_t edges = 0;
    for (const passes::body_triangles& p : parts) edges += std::uint64_t{3} * p.count;
    if (vertices == 0 || edges == 0) return {};

    numbers names(backend, vertices);
    {
        edges_buffer keys(backend, vertices);
        numbers order(backend, vertices);
        backend.for_each(vertices, passes::hash_places{positions, keys.data(), order.data()});
        backend.sort_by_key(keys, order, passes::place_key_bits);
        backend.for_each(vertices, passes::name_places{positions, keys.data(), order.data(), vertices, names.data()});
    }
    using count_buffer = typename Backend::template buffer<passes::left_counts>;
    const passes::left_counts none{};
    count_buffer counts(backend, array_view<const passes::left_counts>(&none, 1));
    typename Backend::template buffer<glm::uvec2> left(backend, 0);
    numbers listed(backend, 0);
    {
        const int bits = static_cast<int>(std::bit_width(vertices));
        edges_buffer keys(backend, edges);
        numbers directions(backend, edges);
        std::uint64_t first = 0;
        for (const passes::body_triangles& p : parts) {
            backend.for_each(std::uint64_t{3} * p.count,
                             passes::key_edges{p, names.data(), bits, keys.data() + first, directions.data() + first});
            first += std::uint64_t{3} * p.count;
        }
        backend.sort_by_key(keys, directions, 2 * bits);
        const passes::sorted_edges sorted{keys.data(), directions.data(), edges, bits};
        backend.for_each(edges, passes::count_left_edges{sorted, counts.data()});
        const std::uint64_t num_left = counts.to_host(backend)[0].edges;
        if (num_left == 0) return {};
        left = {backend, static_cast<std::size_t>(num_left)};
        listed = {backend, static_cast<std::size_t>(std::min(vertices, 2 * num_left))};
        backend.for_each(vertices, passes::fill_items<std::uint32_t>{names.data(), 0}); // they have served
        backend.for_each(edges,
                         passes::list_left_edges{sorted, counts.data(), left.data(), names.data(), listed.data()});
    }
    const auto num_vertices = static_cast<std::size_t>(counts.to_host(backend)[0].vertices);
    const std::size_t num_edges = left.size();
    typename Backend::template buffer<snapped_position> ordered(backend, num_vertices);
    {
        // Places differ, so that their order does not depend on that in which threads list them.
        numbers order(backend, num_vertices);
        edges_buffer keys(backend, num_vertices);
        backend.for_each(num_vertices, passes::copy_numbers{listed.data(), order.data()});
        for (int axis = 2; axis >= 0; --axis) {
            backend.for_each(num_vertices, passes::key_coordinates{positions, order.data(), axis, keys.data()});
            backend.sort_by_key(keys, order, passes::key_coordinates::bits);
        }
        backend.for_each(num_vertices, passes::rank_vertices{positions, order.data(), ordered.data(), names.data()});
    }
    const int bits = static_cast<int>(std::bit_width(std::uint64_t{num_vertices}));
    edges_buffer keys(backend, num_edges);
    numbers directions(backend, num_edges);
    backend.for_each(num_edges,
                     passes::key_left_edges{left.data(), names.data(), bits, keys.data(), directions.data()});
    backend.sort_by_key(keys, directions, 2 * bits);

    hole_boundary b;
    b.positions = ordered.to_host(backend);
    const std::vector<std::uint64_t> ends = keys.to_host(backend);
    const std::vector<std::uint32_t> upward = directions.to_host(backend);
    b.edges.reserve(num_edges);
    for (std::size_t i = 0; i < num_edges; ++i) {
        const std::uint64_t low = ends[i] >> bits, high = ends[i] & ((std::uint64_t{1} << bits) - 1);
        b.edges.push_back(upward[i] != 0 ? edge_chain::edge{low, high} : edge_chain::edge{high, low});
    }
    return b;
}

} // namespace voxelpipe::core
