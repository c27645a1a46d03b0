// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a mesh is, from its indices alone: nothing of the library.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace surface_tests {

struct verdict {
    std::uint64_t boundary_edges = 0;   // directed edges without an opposite one
    std::uint64_t bad_edges = 0;        // directed edges that occur more than once
    std::uint64_t bad_vertices = 0;     // whose faces are not one fan
    std::uint64_t degenerate_faces = 0; // with an index twice
    std::uint64_t bad_indices = 0;      // that name no vertex
    std::uint64_t unused_vertices = 0;  // of no face
    std::int64_t euler = 0;             // V - E + F
    std::uint64_t components = 0;       // by shared edges
    [[nodiscard]] bool is_closed_manifold() const {
        return boundary_edges == 0 && bad_edges == 0 && bad_vertices == 0 && degenerate_faces == 0 &&
               bad_indices == 0 && unused_vertices == 0;
    }
};

// Faces of N indices.
template <std::size_t N>
[[nodiscard]] verdict judge(const std::vector<std::array<std::uint32_t, N>>& faces, std::size_t vertices) {
    verdict v;
    struct half_edge {
        std::uint32_t from, to, face;
    };
    std::vector<half_edge> edges;
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (std::size_t i = 0; i < N; ++i) {
            const std::uint32_t a = faces[f][i], b = faces[f][(i + 1) % N];
            if (a >= vertices) {
                ++v.bad_indices;
                return v;
            }
            for (std::size_t j = i + 1; j < N; ++j) v.degenerate_faces += a == faces[f][j] ? 1 : 0;
            edges.push_back({a, b, static_cast<std::uint32_t>(f)});
        }
    std::sort(edges.begin(), edges.end(),
              [](const half_edge& a, const half_edge& b) { return a.from != b.from ? a.from < b.from : a.to < b.to; });
    const auto find = [&](std::uint32_t from, std::uint32_t to) {
        return std::lower_bound(
            edges.begin(), edges.end(), half_edge{from, to, 0},
            [](const half_edge& a, const half_edge& b) { return a.from != b.from ? a.from < b.from : a.to < b.to; });
    };
    std::vector<std::uint32_t> root(vertices);
    for (std::uint32_t i = 0; i < vertices; ++i) root[i] = i;
    const auto top = [&](std::uint32_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    std::uint64_t open = 0;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        if (i != 0 && edges[i].from == edges[i - 1].from && edges[i].to == edges[i - 1].to) ++v.bad_edges;
        const auto other = find(edges[i].to, edges[i].from);
        if (other == edges.end() || other->from != edges[i].to || other->to != edges[i].from) ++open;
        root[top(edges[i].from)] = top(edges[i].to);
    }
    v.boundary_edges = open;
    // Fans: around a vertex, faces are joined by the edges that two of them share. One fan has as many faces as one
    // walk from face to face meets.
    std::size_t used = 0;
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i;
        while (end < edges.size() && edges[end].from == edges[i].from) ++end;
        ++used;
        if (v.boundary_edges == 0 && v.bad_edges == 0) {
            std::size_t walked = 0;
            std::size_t at = i;
            do {
                // The face's edge that ends here, and the face beyond it.
                const auto& face = faces[edges[at].face];
                std::size_t k = 0;
                while (face[k] != edges[i].from) ++k;
                const std::uint32_t before = face[(k + N - 1) % N];
                at = static_cast<std::size_t>(find(edges[i].from, before) - edges.begin());
                ++walked;
            } while (at != i && walked <= end - i);
            if (walked != end - i) ++v.bad_vertices;
        }
        i = end;
    }
    v.unused_vertices = vertices - used;
    v.euler = static_cast<std::int64_t>(vertices) - static_cast<std::int64_t>((edges.size() + open) / 2) +
              static_cast<std::int64_t>(faces.size());
    for (std::uint32_t i = 0; i < vertices; ++i) v.components += top(i) == i ? 1 : 0;
    return v;
}

} // namespace surface_tests
