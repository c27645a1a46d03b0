// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The whole pipeline in one minute: a mesh, two fragment shaders, a framebuffer of two render targets, an A-buffer.
// Prints what a 64^3 grid around an octahedron holds, checks it, and exits with 0 when all is right (first_voxels.ppm).
// The backend is a template parameter: the same function serves a GPU.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

struct lambert { // one value per render target
    glm::vec3 sun;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(vp::exact::dot(f.normal, sun), 1U);
    }
};

struct weight { // of an A-buffer: its one value is the payload
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.barycentric.x); }
};

template <class Backend>
bool bake(const std::vector<glm::vec3>& positions, const std::vector<glm::uvec3>& triangles, Backend backend = {}) {
    const vp::grid grid = vp::fit(positions, {64, 64, 64});
    const vp::mesh mesh{backend, positions, triangles};

    // Every voxel that a triangle touches: its brightest fragment, and how many there are.
    vp::framebuffer<Backend, vp::target<float, vp::blend::max>, vp::target<unsigned, vp::blend::add>> picture{
        backend, grid.extent};
    const lambert shader{{0, 0, 1}};
    const vp::status drawn = vp::voxelize(backend, mesh, grid, vp::passthrough{}, shader, picture).or_throw();
    const auto brightest = vp::get<0>(picture).to_host_target(backend); // addressed by voxel
    const auto count = vp::get<1>(picture).to_host_target(backend);

    // The thinnest cover without a hole: all its fragments, by voxel and triangle.
    vp::abuffer<Backend, float> lists{backend};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, weight{}, lists, vp::coverage::thin).or_throw();
    bool good = true;
    unsigned long long thin = 0;
    float light = 0;
    for (const auto& [voxel, fragments] : lists.to_host(backend)) {
        good = good && count(voxel.x, voxel.y, voxel.z) >= fragments.size(); // part of the conservative cover
        light = std::max(light, brightest(voxel.x, voxel.y, voxel.z));
        for (const auto& [triangle, value] : fragments) {
            good = good && triangle < triangles.size() && std::isfinite(value);
            ++thin;
        }
    }
    picture::write("first_voxels.ppm", grid.extent,
                   [&](int x, int y, int z) {
                       const float shade = 0.5f + 0.5f * static_cast<float>(y) / 64.0f; // deeper below
                       return count(x, y, z) == 0 ? glm::vec3(-1.0f) : shade * glm::vec3(0.96f, 0.60f, 0.32f);
                   },
                   {.zoom = 1.3f});
    const unsigned long long all = drawn.counts.fragments, voxels = drawn.counts.voxels;
    std::printf("%llu fragments in %llu voxels, %llu in the thin cover, brightest %.4f\n", all, voxels, thin, light);
    return good && 0 < thin && thin < all && light == static_cast<float>(1 / std::sqrt(3.0)); // how the faces lean
}

int main() {
    const std::vector<glm::vec3> positions{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const std::vector<glm::uvec3> triangles{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                            {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return bake<vp::cpu_backend>(positions, triangles) ? 0 : 1;
}
