// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The whole API in one minute: an octahedron becomes a grid of light and of counts in one pass, then the list of all
// its fragments. Prints what it finds and exits with 1 where that is not what has to come out.

#include <cpu_ref/backend.hpp> // vp::cpu_backend, plain C++
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

struct lambert { // fragment shader: one value per render target
    glm::vec3 sun;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(vp::exact::dot(f.normal, sun), 1u);
    }
};

struct weight { // for the A-buffer: the one value that is kept with every fragment
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.barycentric.x); }
};

template <class Backend> // the only thing that changes
bool bake(const std::vector<glm::vec3>& positions, const std::vector<glm::uvec3>& triangles, Backend backend = {}) {
    const vp::grid grid = vp::fit(positions, {64, 64, 64});
    const vp::mesh mesh{backend, positions, triangles};

    vp::framebuffer<Backend, vp::target<float, vp::blend::max>, vp::target<std::uint32_t, vp::blend::add>> fb{
        backend, grid.extent};
    const vp::status drawn =
        vp::voxelize(backend, mesh, grid, vp::passthrough{}, lambert{{0, 0, 1}}, fb, vp::coverage::conservative);
    drawn.or_throw(); // or look at drawn.ok() and drawn.message()

    std::uint64_t fragments = 0;
    for (const std::uint32_t count : vp::get<1>(fb).to_host(backend)) fragments += count;
    float brightest = -1.0f;
    for (const float light : vp::get<0>(fb).to_host(backend)) brightest = light > brightest ? light : brightest;
    std::printf("conservative: %llu voxels, %llu fragments, brightest %.3f\n",
                static_cast<unsigned long long>(drawn.counts.voxels), static_cast<unsigned long long>(fragments),
                static_cast<double>(brightest));

    vp::abuffer<Backend, float> lists{backend};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, weight{}, lists, vp::coverage::thin).or_throw();
    std::size_t longest = 0, kept = 0;
    for (const auto& [voxel, voxel_fragments] : lists.to_host(backend)) { // voxels ascending
        if (voxel_fragments.size() > longest) longest = voxel_fragments.size();
        for (const auto& [triangle, value] : voxel_fragments) kept += triangle < triangles.size() ? 1 : 0;
    }
    std::printf("thin: %zu voxels, %zu fragments, at most %zu in a voxel\n", lists.num_voxels(), kept, longest);

    const bool lit = brightest > 0.577f && brightest < 0.578f; // a face of an octahedron under the sun: 1 / sqrt(3)
    return lit && fragments == drawn.counts.fragments && kept == lists.num_fragments() &&
           lists.num_voxels() < drawn.counts.voxels;
}

int main() {
    const std::vector<glm::vec3> corners{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const std::vector<glm::uvec3> faces{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                        {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return bake<vp::cpu_backend>(corners, faces) ? 0 : 1;
}
