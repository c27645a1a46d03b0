// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A picture of triangles for the samples: a camera, a sun whose shadow has a soft edge, the sky's light, and a floor.

#include "picture.hpp"

#include <glm/glm.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace mesh_picture {

struct mesh {
    std::vector<glm::vec3> positions; // y points up
    std::vector<glm::uvec3> triangles;
    std::vector<glm::vec3> colors; // of the vertices, linear; what is seen from behind is dark blue

    void add(const mesh& m, const glm::vec3& shift) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (const glm::vec3& p : m.positions) positions.push_back(p + shift);
        for (const glm::uvec3& t : m.triangles) triangles.push_back(t + first);
        colors.insert(colors.end(), m.colors.begin(), m.colors.end());
    }
};

// The nearest triangle of each cell of a square; nearer is what has the greater depth.
class nearest_triangles {
public:
    explicit nearest_triangles(int side)
        : side_(side),
          depth_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), -std::numeric_limits<float>::max()),
          triangle_(depth_.size(), none) {}
    static constexpr std::uint32_t none = ~0u;

    // Corners within the square from 0 to 1 are drawn.
    void draw(std::uint32_t name, std::array<glm::vec3, 3> p) {
        for (glm::vec3& c : p) c.x *= static_cast<float>(side_), c.y *= static_cast<float>(side_);
        float area = cross(p[0], p[1], p[2].x, p[2].y);
        if (area < 0.0f) std::swap(p[1], p[2]), area = -area;
        if (!(area > 0.0f)) return;
        const auto low = [&](int a) { return std::max(0, static_cast<int>(std::min({p[0][a], p[1][a], p[2][a]}))); };
        const auto high = [&](int a) {
            return std::min(side_ - 1, static_cast<int>(std::max({p[0][a], p[1][a], p[2][a]})));
        };
        for (int j = low(1); j <= high(1); ++j)
            for (int i = low(0); i <= high(0); ++i) {
                const float x = static_cast<float>(i) + 0.5f, y = static_cast<float>(j) + 0.5f;
                const float u = cross(p[1], p[2], x, y), v = cross(p[2], p[0], x, y), w = cross(p[0], p[1], x, y);
                if (u < 0.0f || v < 0.0f || w < 0.0f) continue;
                const float depth = (u * p[0].z + v * p[1].z + w * p[2].z) / area;
                const std::size_t n = index(i, j);
                if (depth <= depth_[n]) continue;
                depth_[n] = depth;
                triangle_[n] = name;
            }
    }
    [[nodiscard]] std::uint32_t triangle(float x, float y) const { return triangle_[at(x, y)]; }
    [[nodiscard]] float depth(float x, float y) const { return depth_[at(x, y)]; }

private:
    static float cross(const glm::vec3& p, const glm::vec3& q, float x, float y) {
        return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(i);
    }
    [[nodiscard]] std::size_t at(float x, float y) const {
        const auto cell = [&](float a) {
            return std::clamp(static_cast<int>(a * static_cast<float>(side_)), 0, side_ - 1);
        };
        return index(cell(x), cell(y));
    }

    int side_;
    std::vector<float> depth_;
    std::vector<std::uint32_t> triangle_;
};

class scene {
public:
    // along: the camera's direction; zoom: 1 shows a ball around the mesh.
    scene(const mesh& m, const glm::vec3& along, float zoom, float aspect)
        : mesh_(m), low_(m.positions.front()), aspect_(aspect), seen_(4 * picture::width()),
          from_sun_(picture::is_fine() ? 3000 : 500) {
        glm::vec3 high = low_;
        for (const glm::vec3& p : m.positions) low_ = glm::min(low_, p), high = glm::max(high, p);
        middle_ = 0.5f * (low_ + high);
        size_ = glm::length(high - low_);
        forward_ = glm::normalize(along);
        right_ = glm::normalize(glm::cross(forward_, glm::vec3(0, 1, 0)));
        up_ = glm::cross(right_, forward_);
        scale_ = 0.36f / zoom;
        eye_ = middle_ - 1.5f * size_ * forward_;
        sun_right_ = glm::normalize(glm::cross(sun_, glm::vec3(0, 1, 0)));
        sun_up_ = glm::cross(sun_right_, sun_);
        for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
            std::array<glm::vec3, 3> screen{}, map{};
            for (int c = 0; c < 3; ++c) {
                const glm::vec3 p = m.positions[m.triangles[t][c]], q = p - eye_;
                const float far = glm::dot(q, forward_) * scale_;
                screen[static_cast<std::size_t>(c)] = {0.5f + 0.5f * glm::dot(q, right_) / far,
                                                       0.5f - 0.5f * glm::dot(q, up_) / far, 1.0f / far};
                map[static_cast<std::size_t>(c)] = sun_map(p);
            }
            seen_.draw(t, screen);
            from_sun_.draw(t, map);
        }
    }

    // The colour at a place of the picture, from 0 to 1 from the upper left.
    [[nodiscard]] glm::vec3 look(float x, float y, const glm::vec2& noise) const {
        y = 0.5f + (y - 0.5f) / aspect_;
        const glm::vec3 ray = forward_ + scale_ * ((2.0f * x - 1.0f) * right_ + (1.0f - 2.0f * y) * up_);
        const glm::vec3 paper(0.86f, 0.87f, 0.88f);
        const std::uint32_t t = seen_.triangle(x, y);
        if (t == nearest_triangles::none) {
            const float down = (low_.y - eye_.y) / ray.y;
            if (!(down > 0.0f)) return paper;
            const glm::vec3 at = eye_ + down * ray;
            const float far = glm::length(at - middle_) / size_;
            return glm::mix(0.78f * light(at, glm::vec3(0, 1, 0), noise), paper, glm::smoothstep(0.45f, 1.1f, far));
        }
        const glm::uvec3 corner = mesh_.triangles[t];
        const glm::vec3 a = mesh_.positions[corner.x], b = mesh_.positions[corner.y], c = mesh_.positions[corner.z];
        glm::vec3 normal = glm::cross(b - a, c - a);
        const float along = glm::dot(normal, ray);
        const glm::vec3 at = eye_ + glm::dot(normal, a - eye_) / along * ray;
        const float all = glm::dot(normal, normal), v = glm::dot(glm::cross(at - a, c - a), normal) / all,
                    w = glm::dot(glm::cross(b - a, at - a), normal) / all;
        glm::vec3 color =
            (1.0f - v - w) * mesh_.colors[corner.x] + v * mesh_.colors[corner.y] + w * mesh_.colors[corner.z];
        normal = glm::normalize(normal);
        if (along > 0.0f) normal = -normal, color = glm::vec3(0.05f, 0.08f, 0.14f);
        return color * light(at, normal, noise);
    }

private:
    [[nodiscard]] glm::vec3 sun_map(const glm::vec3& p) const {
        const glm::vec3 q = (p - middle_) / size_;
        return {0.5f + 0.9f * glm::dot(q, sun_right_), 0.5f + 0.9f * glm::dot(q, sun_up_), glm::dot(q, sun_)};
    }
    [[nodiscard]] glm::vec3 light(const glm::vec3& at, const glm::vec3& normal, const glm::vec2& noise) const {
        const glm::vec3 map = sun_map(at + 0.004f * size_ * normal);
        const float turn = 6.2831853f * noise.x, far = 0.006f * std::sqrt(noise.y);
        const float blocker = from_sun_.depth(map.x + far * std::cos(turn), map.y + far * std::sin(turn));
        const float facing = blocker > map.z + 0.004f ? 0.0f : std::max(0.0f, glm::dot(normal, sun_));
        const glm::vec3 sky =
            glm::mix(glm::vec3(0.20f, 0.19f, 0.18f), glm::vec3(0.40f, 0.46f, 0.54f), 0.5f + 0.5f * normal.y);
        return sky + facing * glm::vec3(0.98f, 0.90f, 0.78f);
    }

    const mesh& mesh_;
    glm::vec3 low_, middle_{}, forward_{}, right_{}, up_{}, eye_{}, sun_right_{}, sun_up_{};
    glm::vec3 sun_ = glm::normalize(glm::vec3(-0.55f, 1.0f, 0.55f)); // towards it
    float size_ = 0.0f, scale_ = 0.0f, aspect_;
    nearest_triangles seen_, from_sun_;
};

// True if every edge has one face on either side.
inline bool is_closed(const std::vector<glm::uvec3>& triangles) {
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

} // namespace mesh_picture
