// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene of 11_rays.cpp: a knot and three balls, and where a ray meets one of their triangles.

#include <glm/glm.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

struct model {
    std::vector<glm::vec3> positions, normals, colors; // colours of triangles
    std::vector<glm::uvec3> triangles;

    // A surface over 0 to 1 by 0 to 1 that closes in both directions; its normals from differences.
    template <class F>
    void add(unsigned n, unsigned m, const glm::vec3& color, const F& at) {
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned i = 0; i < n; ++i)
            for (unsigned k = 0; k < m; ++k) {
                const float u = static_cast<float>(i) / static_cast<float>(n),
                            v = (static_cast<float>(k) + 0.5f) / static_cast<float>(m);
                positions.push_back(at(u, v));
                normals.push_back(glm::normalize(
                    glm::cross(at(u, v + 1e-3f) - at(u, v - 1e-3f), at(u + 1e-3f, v) - at(u - 1e-3f, v))));
                const auto p = [&](unsigned a, unsigned b) { return first + a % n * m + b % m; };
                triangles.emplace_back(p(i, k), p(i, k + 1), p(i + 1, k));
                triangles.emplace_back(p(i + 1, k), p(i, k + 1), p(i + 1, k + 1));
                colors.insert(colors.end(), 2, color);
            }
    }
};

struct ray_hit {
    float t = 1e30f;
    glm::vec2 weights{0.0f}; // of the triangle's second and third vertex
    std::uint32_t triangle = 0;
};

inline void intersect(const model& m, std::uint32_t triangle, const glm::vec3& from, const glm::vec3& along,
                      ray_hit& best) {
    const glm::uvec3& t = m.triangles[triangle];
    const glm::vec3 a = m.positions[t.x], u = m.positions[t.y] - a, v = m.positions[t.z] - a;
    const glm::vec3 p = glm::cross(along, v), s = from - a, q = glm::cross(s, u);
    const float d = glm::dot(u, p);
    const glm::vec2 w = glm::vec2(glm::dot(s, p), glm::dot(along, q)) / d;
    const float at = glm::dot(v, q) / d;
    if (w.x >= 0.0f && w.y >= 0.0f && w.x + w.y <= 1.0f && at > 1e-2f && at < best.t) best = {at, w, triangle};
}

inline model mirrors() {
    model m;
    constexpr float turn = 6.2831853f;
    m.add(600, 24, {0.90f, 0.58f, 0.22f}, [](float u, float v) { // a tube round a (2, 3) torus knot
        const auto knot = [](float a) {
            const float r = 15.0f * (2.0f + std::cos(3 * a)) * 0.72f;
            return glm::vec3(64 + r * std::cos(2 * a), 47 + 16.0f * std::sin(3 * a), 64 + r * std::sin(2 * a));
        };
        const glm::vec3 t = glm::normalize(knot(turn * u + 1e-2f) - knot(turn * u - 1e-2f));
        const glm::vec3 x = glm::normalize(glm::cross(t, glm::vec3(0, 1, 0.1f))), y = glm::cross(t, x);
        return knot(turn * u) + 5.0f * (std::cos(turn * v) * x + std::sin(turn * v) * y);
    });
    const auto ball = [&](const glm::vec3& at, float r, const glm::vec3& color) {
        m.add(96, 48, color, [&](float u, float v) {
            const float e = turn * 0.5f * (v - 0.5f);
            return at + r * glm::vec3(std::cos(e) * std::cos(turn * u), std::sin(e), std::cos(e) * std::sin(turn * u));
        });
    };
    ball({64, 45, 64}, 13, {0.85f, 0.88f, 0.92f});
    ball({24, 17, 96}, 12, {0.30f, 0.55f, 0.80f});
    ball({104, 14, 100}, 9, {0.80f, 0.25f, 0.30f});
    return m;
}
