// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A coarse sphere, tessellated to a voxel a side and displaced by a texture: stones (displaced.ppm). Levels and points
// of an edge come from that edge alone, so the surface stays closed: the solid has no open row.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct surface {
    glm::vec3 normal;
};
using vertex = vp::vertex_output<surface>;

struct unit_sphere { // normals of a sphere at the origin; scaled to the grid
    VOXELPIPE_HD vertex operator()(const vp::vertex<>& v) const {
        return {glm::vec3(64.0f) + 44.0f * v.position, surface{v.position}};
    }
};

// snippet: tessellation
struct stones { // a tessellation program
    static constexpr int max_level = 64;
    vp::field3d<float> height;
    float amount, voxel;

    VOXELPIPE_HD int edge_level(const vertex& a, const vertex& b) const {
        return vp::level_by_length(a.position, b.position, voxel, max_level);
    }
    VOXELPIPE_HD vertex operator()(const vp::patch_point<surface>& p) const {
        const glm::vec3 n = glm::normalize(p.mix(&surface::normal));
        const glm::vec3 on_sphere = glm::vec3(64.0f) + 44.0f * n;
        return {vp::exact::along(on_sphere, n, amount * height(0.9f * n)), surface{n}};
    }
};
// end snippet

struct paint {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface>& f) const {
        const float light = 0.8f + 0.2f * glm::dot(f.normal, glm::normalize(glm::vec3(0.4f, 0.8f, 0.6f)));
        return vp::outputs(light * glm::vec3(0.86f, 0.78f, 0.66f));
    }
};

int main() {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    constexpr unsigned rings = 10, sides = 16; // 320 triangles
    for (unsigned i = 0; i <= rings; ++i)
        for (unsigned s = 0; s < sides; ++s) {
            const float a = 3.14159265f * static_cast<float>(i) / rings,
                        b = 6.28318531f * static_cast<float>(s) / sides;
            const float r = i == 0 || i == rings ? 0.0f : std::sin(a);
            positions.emplace_back(r * std::cos(b), std::cos(a), r * std::sin(b));
            if (i == rings) continue;
            const unsigned p = i * sides + s, q = i * sides + (s + 1) % sides;
            triangles.emplace_back(p, q, p + sides);
            triangles.emplace_back(q, q + sides, p + sides);
        }
    // Distances to random points: rounded stones with joints between them.
    constexpr int n = 32;
    std::vector<float> texels;
    std::vector<glm::vec3> seeds;
    for (unsigned i = 0, r = 1; i < 60; ++i) {
        glm::vec3 p;
        for (int k = 0; k < 3; ++k) p[k] = static_cast<float>((r = r * 1664525u + 1013904223u) >> 8) * 0x1p-24f;
        seeds.push_back(p);
    }
    for (int i = 0; i < n * n * n; ++i) {
        const glm::vec3 at = (glm::vec3(i % n, i / n % n, i / (n * n)) + 0.5f) / static_cast<float>(n);
        float nearest = 9.0f, second = 9.0f;
        for (const glm::vec3& s : seeds) {
            const float d = glm::length(glm::abs(glm::fract(at - s + 0.5f) - 0.5f));
            second = std::min(std::max(d, nearest), second);
            nearest = std::min(d, nearest);
        }
        texels.push_back(std::min(1.0f, 8.0f * (second - nearest)));
    }

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    vp::grid grid;
    grid.extent = {128, 128, 128};
    const vp::tessellate program{stones{{texels.data(), n, n, n}, 9.0f, 0.7f}};
    vp::framebuffer<vp::cpu_backend, vp::target<glm::vec3, vp::blend::max>> colors{backend, grid.extent};
    vp::get<0>(colors).clear(glm::vec3(-1.0f));
    const vp::status s =
        vp::voxelize(backend, mesh, grid, unit_sphere{}, program, paint{}, colors, vp::coverage::conservative)
            .or_throw();
    const auto host = vp::get<0>(colors).to_host_target(backend);
    // Moss grows in the joints, the more the higher they lie.
    picture::write("displaced.ppm", grid.extent,
                   [&](int x, int y, int z) {
                       const glm::vec3 c = host(x, y, z), p = glm::vec3(x, y, z) + 0.5f - 64.0f;
                       if (c.x < 0.0f) return c;
                       const float deep = 1.0f - glm::smoothstep(46.0f, 51.5f, glm::length(p) - 0.06f * p.y);
                       return glm::mix(c, glm::vec3(0.36f, 0.50f, 0.20f), deep);
                   },
                   {.zoom = 1.35f});

    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> inside{backend, grid.extent};
    const vp::status t =
        vp::voxelize_solid(backend, mesh, grid, unit_sphere{}, program, vp::constant(true), inside).or_throw();
    std::printf("%zu patches, %llu triangles, %llu voxels; solid: %llu voxels, %llu open rows\n", triangles.size(),
                static_cast<unsigned long long>(s.counts.triangles_in),
                static_cast<unsigned long long>(s.counts.voxels), static_cast<unsigned long long>(t.counts.voxels),
                static_cast<unsigned long long>(t.solid.open_rows));
    return t.solid.open_rows == 0 && s.counts.triangles_in > 100000 ? 0 : 1;
}
