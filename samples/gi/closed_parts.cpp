// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "closed_parts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace gi {
namespace {

// For each vertex the first one that stands at the same place.
std::vector<std::uint32_t> weld(const std::vector<glm::vec3>& positions) {
    std::vector<std::uint32_t> order(positions.size()), first(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t i) { // bits, which have an order even where they are no numbers; -0 is 0
        const glm::vec3 p = positions[i] + 0.0f;
        return std::bit_cast<std::array<std::uint32_t, 3>>(p);
    };
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i != 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    return first;
}

std::uint32_t root(std::vector<std::uint32_t>& parents, std::uint32_t i) {
    while (parents[i] != i) {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    return i;
}

struct half_edge {
    std::uint32_t low, high, part;
    int forward; // 1 from low to high, -1 back
};

} // namespace

std::vector<bool> find_closed(const std::vector<glm::vec3>& positions, const std::vector<glm::uvec3>& triangles) {
    const std::vector<std::uint32_t> welded = weld(positions);
    std::vector<std::uint32_t> parents(positions.size());
    std::iota(parents.begin(), parents.end(), 0u);
    for (const glm::uvec3& t : triangles)
        for (int c = 1; c < 3; ++c) parents[root(parents, welded[t[c]])] = root(parents, welded[t[0]]);

    std::vector<half_edge> edges;
    edges.reserve(3 * triangles.size());
    std::vector<double> volumes(positions.size()), areas(positions.size()); // 6 and 2 times, by the part's root
    for (const glm::uvec3& t : triangles) {
        const std::uint32_t part = root(parents, welded[t.x]);
        const glm::dvec3 from(positions[part]); // near the part, so that little cancels
        const glm::dvec3 a = glm::dvec3(positions[t.x]) - from, b = glm::dvec3(positions[t.y]) - from,
                         c = glm::dvec3(positions[t.z]) - from;
        volumes[part] += glm::dot(a, glm::cross(b, c));
        areas[part] += glm::length(glm::cross(b - a, c - a));
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t v = welded[t[k]], w = welded[t[(k + 1) % 3]];
            if (v != w) edges.push_back({std::min(v, w), std::max(v, w), part, v < w ? 1 : -1});
        }
    }
    std::sort(edges.begin(), edges.end(),
              [](const half_edge& a, const half_edge& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
    std::vector<bool> closed(positions.size(), true); // by the part's root
    for (std::size_t i = 0; i < edges.size();) {
        int sum = 0;
        std::size_t end = i;
        for (; end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high; ++end)
            sum += edges[end].forward;
        if (sum != 0) closed[edges[i].part] = false;
        i = end;
    }
    // Two sheets back to back are no body. A plate of 1000 times its thickness is one.
    std::vector<bool> of_triangles;
    of_triangles.reserve(triangles.size());
    for (const glm::uvec3& t : triangles) {
        const std::uint32_t part = root(parents, welded[t.x]);
        of_triangles.push_back(closed[part] && std::abs(volumes[part]) > 1e-4 * std::pow(areas[part], 1.5));
    }
    return of_triangles;
}

} // namespace gi
