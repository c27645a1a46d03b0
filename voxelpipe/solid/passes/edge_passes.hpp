// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The directed edges of triangles that no opposite edge cancels, between places and not between the mesh's vertices.
// Functors for Backend::for_each, the same on every backend.

#include <voxelpipe/core/fixed_point.hpp>
#include <voxelpipe/core/instances.hpp>
#include <voxelpipe/core/shared_counter.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core {

[[nodiscard]] VOXELPIPE_HD inline bool is_same_place(const snapped_position& a, const snapped_position& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

namespace passes {

// Some triangles of a body, in the backend's memory. Their indices begin at `least`, where that vertex is number
// `first` of the body's.
struct body_triangles {
    instanced_triangles triangles;
    std::uint32_t count;        // of all instances
    std::uint32_t num_vertices; // of these triangles; an index of another one is a bad one
    std::uint32_t least = 0, first = 0;
};

// Vertices get the names of their places first: edges are pairs of names then, and equal ones are found without a look
// at the vertices.

inline constexpr int place_key_bits = 39;
inline constexpr std::uint32_t no_place = ~std::uint32_t{0}; // of a vertex that cannot be drawn

struct hash_places {
    const snapped_position* positions;
    std::uint64_t* keys;
    std::uint32_t* order;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const snapped_position p = positions[i];
        std::uint64_t h = 0;
        const auto mix = [&](std::int64_t v) {
            h = (h ^ static_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15u;
            h ^= h >> 29;
        };
        mix(p.x);
        mix(p.y);
        mix(p.z);
        keys[i] = h * 0xbf58476d1ce4e5b9u >> (64 - place_key_bits);
        order[i] = static_cast<std::uint32_t>(i);
    }
};

// Names the vertices of each run of equal keys: after one vertex of those at the same place.
struct name_places {
    const snapped_position* positions;
    const std::uint64_t* keys;
    const std::uint32_t* order;
    std::uint64_t count;
    std::uint32_t* names;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i != 0 && keys[i] == keys[i - 1]) return;
        for (std::uint64_t at = i; at < count && keys[at] == keys[i]; ++at) {
            const std::uint32_t vertex = order[at];
            const snapped_position p = positions[vertex];
            names[vertex] = vertex;
            if (!is_drawable(p)) names[vertex] = no_place;
            for (std::uint64_t before = i; before < at && names[vertex] == vertex; ++before)
                if (names[order[before]] == order[before] && is_same_place(positions[order[before]], p))
                    names[vertex] = order[before];
        }
    }
};

// The key of edge i % 3 of triangle i / 3: the names of its ends, `bits` each, the lower one first; and 1 if the
// triangle runs from that one to the other.
struct key_edges {
    body_triangles in;
    const std::uint32_t* names;
    int bits; // 2^bits - 1 names no vertex
    std::uint64_t* keys;
    std::uint32_t* directions;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::uvec3 t = in.triangles[static_cast<std::uint32_t>(i / 3)];
        const std::uint32_t n[3] = {name(t.x), name(t.y), name(t.z)};
        const auto e = static_cast<int>(i % 3);
        const std::uint64_t from = n[e], to = n[e == 2 ? 0 : e + 1];
        const bool is_edge = n[0] != no_place && n[1] != no_place && n[2] != no_place && from != to;
        const std::uint64_t none = (std::uint64_t{1} << bits) - 1;
        const std::uint64_t low = !is_edge    ? none
                                  : from < to ? from
                                              : to,
                            high = !is_edge    ? none
                                   : from < to ? to
                                               : from;
        keys[i] = low << bits | high;
        directions[i] = from < to ? 1 : 0;
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t name(std::uint32_t index) const {
        const std::uint32_t vertex = index - in.least;
        return vertex < in.num_vertices ? names[in.first + vertex] : no_place;
    }
};

// Sorted edges, equal ones next to each other.
struct sorted_edges {
    const std::uint64_t* keys;
    const std::uint32_t* directions;
    std::uint64_t count;
    int bits;

    // The sum of the directions of edges that equal edge i, if that is the first of them; 0 otherwise.
    [[nodiscard]] VOXELPIPE_HD std::int64_t sum_from(std::uint64_t i) const {
        const std::uint64_t key = keys[i];
        if (key >> bits == (std::uint64_t{1} << bits) - 1 || (i != 0 && keys[i - 1] == key)) return 0;
        std::int64_t sum = 0;
        for (std::uint64_t at = i; at < count && keys[at] == key; ++at) sum += directions[at] != 0 ? 1 : -1;
        return sum;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t lower(std::uint64_t i) const {
        return static_cast<std::uint32_t>(keys[i] >> bits);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t higher(std::uint64_t i) const {
        return static_cast<std::uint32_t>(keys[i] & ((std::uint64_t{1} << bits) - 1));
    }
};

// ---- what is left ---------------------------------------------------------------------------------------------------

template <class T>
struct fill_items {
    T* items;
    T value;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { items[i] = value; }
};

struct copy_numbers {
    const std::uint32_t* from;
    std::uint32_t* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { to[i] = from[i]; }
};

struct left_counts {
    std::uint64_t edges, listed_edges, vertices;
};
struct count_left_edges {
    sorted_edges in;
    left_counts* counts;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::int64_t sum = in.sum_from(i);
        if (sum != 0) add_shared(counts->edges, static_cast<std::uint64_t>(sum < 0 ? -sum : sum));
    }
};
// Lists edges that are left, from x to y, and their vertices, in any order.
struct list_left_edges {
    sorted_edges in;
    left_counts* counts;
    glm::uvec2* edges;
    std::uint32_t* is_listed; // by vertex; 0 before
    std::uint32_t* vertices;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::int64_t sum = in.sum_from(i);
        if (sum == 0) return;
        const auto n = static_cast<std::uint64_t>(sum < 0 ? -sum : sum);
        const std::uint32_t low = in.lower(i), high = in.higher(i);
        const std::uint64_t first = fetch_add_shared(counts->listed_edges, n);
        for (std::uint64_t k = 0; k < n; ++k)
            edges[first + k] = sum > 0 ? glm::uvec2(low, high) : glm::uvec2(high, low);
        list(low);
        list(high);
    }

private:
    VOXELPIPE_HD void list(std::uint32_t vertex) const {
        if (exchange_shared(is_listed[vertex], 1) == 0) vertices[fetch_add_shared(counts->vertices, 1)] = vertex;
    }
};

// A key for each listed vertex, by one of its coordinates.
struct key_coordinates {
    const snapped_position* positions;
    const std::uint32_t* vertices;
    int axis;
    std::uint64_t* keys;

    static constexpr int bits = 48;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const snapped_position& p = positions[vertices[i]];
        const std::int64_t at = axis == 0 ? p.x : axis == 1 ? p.y : p.z;
        keys[i] = static_cast<std::uint64_t>(at + (std::int64_t{1} << (bits - 1)));
    }
};
struct rank_vertices {
    const snapped_position* positions;
    const std::uint32_t* vertices; // in order
    snapped_position* ordered;
    std::uint32_t* ranks; // by vertex
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        ordered[i] = positions[vertices[i]];
        ranks[vertices[i]] = static_cast<std::uint32_t>(i);
    }
};
// Keys as key_edges, of ranks.
struct key_left_edges {
    const glm::uvec2* edges;
    const std::uint32_t* ranks;
    int bits;
    std::uint64_t* keys;
    std::uint32_t* directions;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t from = ranks[edges[i].x], to = ranks[edges[i].y];
        keys[i] = from < to ? from << bits | to : to << bits | from;
        directions[i] = from < to ? 1 : 0;
    }
};

} // namespace passes
} // namespace voxelpipe::core
