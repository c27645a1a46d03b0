// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A coloured torus knot at 4096 voxels a side, which no dense grid would fit: its bricks, a NanoVDB file of its colours
// (knot.nvdb), and a picture of it by rays through the octree (knot.ppm). Another resolution: 04_sparse 512.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/sparse/backend_octree.hpp>
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

namespace vp = voxelpipe;

struct colored { // by the direction that the surface faces
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const glm::vec3 c = f.normal * 100.0f + 128.0f;
        return vp::outputs(glm::u8vec4(c.x, c.y, c.z, 255));
    }
};

int main(int argc, char** argv) {
    constexpr int around = 2000, sides = 80; // a tube round a (2, 3) torus knot
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    const auto knot = [](double t) {
        const double r = 2 + std::cos(3 * t);
        return glm::dvec3(r * std::cos(2 * t), r * std::sin(2 * t), std::sin(3 * t));
    };
    for (unsigned i = 0; i < around; ++i) {
        const double t = 6.283185307179586 * i / around;
        const glm::dvec3 along = glm::normalize(knot(t + 1e-4) - knot(t - 1e-4));
        const glm::dvec3 u = glm::normalize(glm::cross(along, glm::dvec3(0, 0.1, 1))), v = glm::cross(along, u);
        for (unsigned s = 0; s < sides; ++s) {
            const double a = 6.283185307179586 * s / sides;
            positions.emplace_back(knot(t) + 0.5 * (std::cos(a) * u + std::sin(a) * v));
            const unsigned j = (i + 1) % around, k = (s + 1) % sides, n = sides;
            triangles.emplace_back(i * n + s, j * n + k, j * n + s);
            triangles.emplace_back(i * n + s, i * n + k, j * n + k);
        }
    }
    const int n = argc > 1 ? std::atoi(argv[1]) : 4096;
    vp::cpu_backend backend;
    const vp::grid grid = vp::fit_longest(vp::bounds(positions), n);
    // snippet: draw
    vp::sparse_framebuffer<vp::cpu_backend, vp::target<glm::u8vec4, vp::blend::replace>> surface{backend, grid.extent};
    const vp::mesh mesh{backend, positions, triangles};
    const auto drawn = vp::voxelize(backend, mesh, grid, vp::passthrough{}, colored{}, surface).or_throw();
    const auto voxels = surface.to_host(backend);
    // end snippet
    std::printf("%llu voxels in %llu bricks, %.1f MB\n", static_cast<unsigned long long>(drawn.counts.voxels),
                static_cast<unsigned long long>(voxels.num_bricks()), static_cast<double>(surface.num_bytes()) / 1e6);

    std::ofstream file("knot.nvdb", std::ios::binary);
    // snippet: file
    vp::io::nanovdb_file nvdb;
    nvdb.add_target<0>("color", voxels);
    nvdb.write(file);
    // end snippet

    // Rays from the front through the octree, and from what they meet to the sun.
    // snippet: octree
    const vp::backend_octree tree(backend, surface);
    const vp::octree_view nodes = tree.view(); // refers to the tree, in the backend's memory
    // end snippet
    const glm::dvec3 centre = glm::dvec3(grid.extent) * 0.5, sun = glm::normalize(glm::dvec3(-0.4, 0.7, 0.8));
    int hits = 0, rays = 0;
    picture::write_pixels("knot.ppm", 1.1f, [&](float x, float y, const glm::vec2&) {
        const glm::dvec3 from = centre + 1.12 * n * glm::dvec3(1.1 * (x - 0.5), 0.5 - y, 1.0);
        const vp::voxel_hit hit = nodes.first_hit(from, {0, 0, -1});
        ++rays;
        if (!hit.found) return glm::mix(glm::vec3(0.42f, 0.52f, 0.64f), glm::vec3(0.78f, 0.80f, 0.82f), y);
        ++hits;
        const glm::vec3 color = glm::vec3(vp::get<0>(voxels)[hit.rank]) / 255.0f, normal = 2.55f * color - 1.28f;
        const glm::dvec3 above = from - glm::dvec3(0, 0, hit.distance) + 0.01 * n * glm::dvec3(normal);
        const bool is_lit = !nodes.first_hit(above, sun).found;
        return color * color * (0.4f + (is_lit ? 0.9f * std::max(0.0f, glm::dot(normal, glm::vec3(sun))) : 0.0f));
    });
    return hits > rays / 8 && voxels.num_voxels() == drawn.counts.voxels && file ? 0 : 1;
}
