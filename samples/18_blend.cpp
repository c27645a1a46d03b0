// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A blend of two shapes with their colours: a shader is called with the nearest triangle of each sample, so colours
// reach into the inside and the air around, and mix where the two distances do (blend.ppm).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct shape {
    std::vector<glm::vec3> positions, colors;
    std::vector<glm::uvec3> triangles;

    // A closed surface over the torus of n x m vertices: `at` places (u, v), from 0 to 1, `color` colours it.
    template <class Place, class Color>
    shape(unsigned n, unsigned m, const Place& at, const Color& color) {
        for (unsigned i = 0; i < n; ++i)
            for (unsigned j = 0; j < m; ++j) {
                const float u = static_cast<float>(i) / static_cast<float>(n),
                            v = static_cast<float>(j) / static_cast<float>(m);
                positions.push_back(at(6.2831853f * u, 6.2831853f * v));
                colors.push_back(color(u, v));
                const auto p = [&](unsigned a, unsigned b) { return a % n * m + b % m; };
                triangles.emplace_back(p(i, j), p(i + 1, j), p(i, j + 1));
                triangles.emplace_back(p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
            }
    }
};

// snippet: shader
struct paint {
    glm::vec3 color;
};
struct with_color {
    VOXELPIPE_HD vp::vertex_output<paint> operator()(const vp::vertex<glm::vec3>& v) const {
        return {v.position, {vp::get<0>(v)}};
    }
};
struct distance_and_color {
    VOXELPIPE_HD auto operator()(const vp::distance_fragment<paint>& f) const {
        return vp::outputs(f.distance, f.varyings.color);
    }
};
// end snippet

int main() {
    const shape ring(
        96, 48,
        [](float u, float v) {
            const float r = 48.0f + 11.0f * std::cos(v);
            return glm::vec3(62.0f + r * std::cos(u), 64.0f + 11.0f * std::sin(v), 72.0f + r * std::sin(u));
        },
        [](float u, float) {
            return std::fmod(12.0f * u, 1.0f) < 0.5f ? glm::vec3(0.93f, 0.55f, 0.14f) : glm::vec3(0.98f, 0.82f, 0.50f);
        });
    const shape drop(
        96, 48,
        [](float u, float v) {
            const float r = 14.0f + 11.0f * std::cos(v);
            return glm::vec3(112.0f + 11.0f * std::sin(v), 66.0f + 2.1f * r * std::cos(u),
                             72.0f + 1.1f * r * std::sin(u));
        },
        [](float, float v) { return v < 0.5f ? glm::vec3(0.13f, 0.42f, 0.66f) : glm::vec3(0.36f, 0.70f, 0.78f); });

    vp::cpu_backend backend;
    vp::grid grid;
    grid.voxel_size = glm::dvec3(1.5);
    grid.extent = {102, 88, 96};
    constexpr float reach = 16.0f; // of the blend: samples nearer to both
    using field = vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>,
                                  vp::target<glm::vec3, vp::blend::replace>>;
    const auto draw = [&](const shape& s, field& into) {
        const vp::mesh<vp::cpu_backend, glm::vec3> mesh{backend, s.positions, s.triangles, s.colors};
        return vp::voxelize_distance(backend, mesh, grid, with_color{}, distance_and_color{}, into, {.band = 14})
            .or_throw();
    };
    field a{backend, grid.extent}, b{backend, grid.extent};
    const std::uint64_t open_rows = draw(ring, a).solid.open_rows + draw(drop, b).solid.open_rows;
    const auto distance_a = vp::get<0>(a).to_host_target(backend), distance_b = vp::get<0>(b).to_host_target(backend);
    const auto color_a = vp::get<1>(a).to_host_target(backend), color_b = vp::get<1>(b).to_host_target(backend);

    std::uint64_t both = 0, blended = 0, lost = 0;
    const auto color = [&](int x, int y, int z) {
        const float da = distance_a(x, y, z), db = distance_b(x, y, z);
        const float share = glm::clamp(0.5f + 0.5f * (db - da) / reach, 0.0f, 1.0f); // of the ring
        const float d = glm::mix(db, da, share) - reach * share * (1.0f - share);
        const bool was_in = da <= 0.0f || db <= 0.0f;
        both += was_in ? 1 : 0;
        blended += d <= 0.0f ? 1 : 0;
        lost += was_in && d > 0.0f ? 1 : 0;
        return d <= 0.0f ? glm::mix(color_b(x, y, z), color_a(x, y, z), share) : glm::vec3(-1.0f);
    };
    picture::write("blend.ppm", grid.extent, color, {.along = {-0.7f, -0.75f, -1.0f}, .zoom = 1.25f});
    std::printf("%llu voxels in either shape, %llu in their blend; %llu lost, %llu open rows\n",
                static_cast<unsigned long long>(both), static_cast<unsigned long long>(blended),
                static_cast<unsigned long long>(lost), static_cast<unsigned long long>(open_rows));
    return open_rows == 0 && lost == 0 && blended > both + 300 ? 0 : 1;
}
