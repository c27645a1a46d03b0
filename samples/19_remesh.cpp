// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A closed mesh out of triangle soup: a bracket of parts that cross each other, one of them open, becomes
// one closed surface that keeps its creases (remesh.ppm; right of it the same with rounded ones). Checks that
// every edge has two faces, and prints what was made.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

namespace vp = voxelpipe;

struct soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    // A prism over a polygon of n corners in the plane of two axes, with `caps` of its two ends.
    template <class Place>
    void add_prism(unsigned n, unsigned caps, const Place& place) {
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned end = 0; end < 2; ++end) {
            for (unsigned i = 0; i < n; ++i)
                positions.push_back(place(6.2831853f * (static_cast<float>(i) + 0.5f) / static_cast<float>(n), end));
            glm::vec3 middle(0.0f);
            for (unsigned i = 0; i < n; ++i) middle += positions[first + end * (n + 1) + i] / static_cast<float>(n);
            positions.push_back(middle);
        }
        const auto add = [&](unsigned a, unsigned b, unsigned c) {
            triangles.emplace_back(first + a, first + b, first + c);
        };
        for (unsigned i = 0; i < n; ++i) {
            const unsigned j = (i + 1) % n, up = n + 1;
            add(i, j, i + up);
            add(j, j + up, i + up);
            if (caps > 0) add(j, i, n);
            if (caps > 1) add(i + up, j + up, n + up);
        }
    }
};

// The triangles of a surface, lit, as seen from a corner.
class shot {
public:
    shot(const vp::surface<vp::cpu_backend>& s, vp::cpu_backend& backend, int side, const glm::vec3& middle, float size)
        : side_(side),
          depth_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), -std::numeric_limits<float>::max()),
          light_(depth_.size()) {
        const glm::vec3 look = glm::normalize(glm::vec3(0.62f, 0.48f, 0.75f));
        const glm::vec3 right = glm::normalize(glm::cross(glm::vec3(0, 1, 0), look)), up = glm::cross(look, right);
        std::vector<glm::vec3> seen;
        for (const vp::surface_vertex& v : s.vertices.to_host(backend)) {
            const glm::vec3 p = (glm::vec3(vp::position(s.samples, v)) - middle) / size;
            seen.emplace_back(glm::dot(p, right), glm::dot(p, up), glm::dot(p, look));
        }
        for (const glm::uvec3& t : s.triangles.to_host(backend)) draw(seen[t.x], seen[t.y], seen[t.z]);
    }
    // Light at a place of the picture; below 0: nothing is there.
    [[nodiscard]] float at(float x, float y) const {
        const int i = static_cast<int>(x * static_cast<float>(side_)),
                  j = static_cast<int>(y * static_cast<float>(side_));
        if (i < 0 || j < 0 || i >= side_ || j >= side_ || depth_[index(i, j)] == -std::numeric_limits<float>::max())
            return -1.0f;
        return light_[index(i, j)];
    }

private:
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(i);
    }
    void draw(glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        const glm::vec3 n = glm::normalize(glm::cross(b - a, c - a));
        if (!(n.z > 0.0f)) return;
        const float light = 0.25f + 0.75f * std::max(0.0f, glm::dot(n, glm::normalize(glm::vec3(-0.5f, 0.7f, 0.6f))));
        for (glm::vec3* const p : {&a, &b, &c}) {
            p->x = (0.5f + 0.5f * p->x) * static_cast<float>(side_);
            p->y = (0.5f + 0.5f * p->y) * static_cast<float>(side_);
        }
        const auto cross = [](const glm::vec3& p, const glm::vec3& q, float x, float y) {
            return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        };
        const float area = cross(a, b, c.x, c.y);
        if (!(area > 0.0f)) return;
        for (int j = static_cast<int>(std::min({a.y, b.y, c.y})); j <= static_cast<int>(std::max({a.y, b.y, c.y})); ++j)
            for (int i = static_cast<int>(std::min({a.x, b.x, c.x})); i <= static_cast<int>(std::max({a.x, b.x, c.x}));
                 ++i) {
                if (i < 0 || j < 0 || i >= side_ || j >= side_) continue;
                const float x = static_cast<float>(i) + 0.5f, y = static_cast<float>(j) + 0.5f;
                const float u = cross(b, c, x, y), v = cross(c, a, x, y), w = cross(a, b, x, y);
                if (u < 0.0f || v < 0.0f || w < 0.0f) continue;
                const float depth = (u * a.z + v * b.z + w * c.z) / area;
                if (depth <= depth_[index(i, j)]) continue;
                depth_[index(i, j)] = depth;
                light_[index(i, j)] = light;
            }
    }

    int side_;
    std::vector<float> depth_, light_;
};

// True if every edge has one face on either side.
bool is_closed(const std::vector<glm::uvec3>& triangles) {
    std::vector<std::pair<unsigned, unsigned>> edges;
    for (const glm::uvec3& t : triangles)
        for (const auto& [a, b] : {std::pair(t.x, t.y), std::pair(t.y, t.z), std::pair(t.z, t.x)})
            edges.emplace_back(a, b);
    std::sort(edges.begin(), edges.end());
    if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
    return std::all_of(edges.begin(), edges.end(), [&](const auto& e) {
        return std::binary_search(edges.begin(), edges.end(), std::pair(e.second, e.first));
    });
}

int main() {
    soup part;
    const auto square = [](float angle) { // of the unit square, from a circle
        return glm::vec2(std::cos(angle) > 0 ? 1.0f : -1.0f, std::sin(angle) > 0 ? 1.0f : -1.0f);
    };
    part.add_prism(4, 2, [&](float a, unsigned end) { // the foot
        return glm::vec3(34.0f * square(a).y, end == 0 ? -21.0f : -13.0f, 21.0f * square(a).x);
    });
    part.add_prism(4, 2, [&](float a, unsigned end) { // the wall
        return glm::vec3(end == 0 ? -34.3f : -25.2f, 3.0f + 24.0f * square(a).x, 15.4f * square(a).y);
    });
    part.add_prism(6, 2, [](float a, unsigned end) { // a nut
        return glm::vec3(12.0f + 11.0f * std::sin(a), end == 0 ? -15.0f : 1.5f, 11.0f * std::cos(a));
    });
    part.add_prism(48, 1, [](float a, unsigned end) { // a pin, open at the end that lies in the wall
        return glm::vec3(end == 0 ? 21.0f : -29.0f, 14.0f + 6.5f * std::sin(a), 6.5f * std::cos(a));
    });

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, part.positions, part.triangles};
    const vp::grid grid = vp::fit(part.positions, glm::ivec3(72), 0.05);
    // snippet: remesh
    vp::surface<vp::cpu_backend> sharp(backend), mean(backend);
    const vp::status status =
        vp::remesh(backend, mesh, grid, vp::passthrough{}, sharp, {.repair = vp::repair::close_holes}).or_throw();
    vp::remesh(backend, mesh, grid, vp::passthrough{}, mean,
               {.place = vp::place::mean, .repair = vp::repair::close_holes})
        .or_throw();
    std::printf("%llu vertices, %llu triangles, %llu parts\n", static_cast<unsigned long long>(status.surface.vertices),
                static_cast<unsigned long long>(status.surface.faces),
                static_cast<unsigned long long>(status.surface.components));
    // end snippet
    const std::vector<glm::uvec3> triangles = sharp.triangles.to_host(backend);
    const bool closed = is_closed(triangles) && is_closed(mean.triangles.to_host(backend));
    std::printf("closed: %s, crossings on closed holes: %llu, made up: %llu\n", closed ? "yes" : "no",
                static_cast<unsigned long long>(status.surface.cone_crossings),
                static_cast<unsigned long long>(status.surface.made_crossings));

    const shot left(sharp, backend, 1200, glm::vec3(0, -1, 0), 41.0f),
        right(mean, backend, 1200, glm::vec3(0, -1, 0), 41.0f);
    picture::write_pixels("remesh.ppm", 2.0f, [&](float x, float y, const glm::vec2&) {
        const float light = x < 0.5f ? left.at(2.0f * x, 1.0f - y) : right.at(2.0f * x - 1.0f, 1.0f - y);
        return light < 0.0f ? glm::vec3(0.93f) : light * glm::vec3(0.93f, 0.68f, 0.36f);
    });
    return closed && status.surface.components == 1 && status.surface.made_crossings == 0 ? 0 : 1;
}
