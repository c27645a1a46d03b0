// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Meshes and targets in memory of one's own, a grid in slabs, several passes into the same target, and errors. Exits
// with 0 when the slabs are the crops of the whole grid.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

int main() {
    const std::vector<glm::vec3> positions{{0, 0, 0}, {7, 1, 3}, {2, 8, 6}};
    const std::vector<glm::uvec3> triangles{{0, 1, 2}};
    vp::cpu_backend backend;
    const vp::grid whole{{0, 0, 0}, {1, 1, 1}, {8, 8, 8}};

    // snippet: own memory
    // Nothing is copied: the views name memory that the caller keeps alive until the call returns.
    const vp::mesh_view<> mesh{positions, triangles};
    using count = vp::target<std::uint32_t, vp::blend::count>;
    std::vector<std::uint32_t> voxels(count::map::elements(whole.extent));
    const auto view = vp::framebuffer_view<count>::on(whole.extent, voxels.data()); // one pointer per target
    const vp::status drawn = vp::voxelize(backend, mesh, whole, vp::passthrough{}, vp::constant(1U), view);
    // end snippet
    bool good = drawn.ok() && drawn.counts.fragments != 0;

    // snippet: crops
    std::uint64_t fragments = 0;
    for (int z = 0; z < whole.extent.z; z += 3) { // slabs of three layers, the last one thinner
        const vp::grid slab = whole.crop({0, 0, z}, {8, 8, std::min(3, whole.extent.z - z)});
        vp::framebuffer<vp::cpu_backend, count> part{backend, slab.extent};
        fragments +=
            vp::voxelize(backend, mesh, slab, vp::passthrough{}, vp::constant(1U), part).or_throw().counts.fragments;
        const auto layers = vp::get<0>(part).to_host(backend); // the same layers of the whole, bit for bit
        good = good && std::equal(layers.begin(), layers.end(), voxels.begin() + std::ptrdiff_t{z} * 64);
    }
    // end snippet
    good = good && fragments == drawn.counts.fragments;

    // snippet: passes
    vp::framebuffer<vp::cpu_backend, count> sum{backend, whole.extent};
    vp::get<0>(sum).clear(100); // the value before the first fragment; the default is the blend's identity
    vp::voxelize(backend, mesh, whole, vp::passthrough{}, vp::constant(1U), sum).or_throw();
    vp::get<0>(sum).load(); // from now on calls blend onto what is there
    vp::voxelize(backend, mesh, whole, vp::passthrough{}, vp::constant(1U), sum).or_throw();
    // end snippet
    const auto twice = vp::get<0>(sum).to_host(backend);
    for (std::size_t i = 0; i < twice.size(); ++i) good = good && twice[i] == 100 + 2 * voxels[i];

    // snippet: errors
    const std::vector<glm::uvec3> broken{{0, 1, 3}}; // there is no vertex 3
    const vp::status failed =
        vp::voxelize(backend, vp::mesh_view<>{positions, broken}, whole, vp::passthrough{}, vp::constant(1U), sum);
    if (!failed.ok()) std::puts(failed.message().c_str()); // "coarse raster: index out of range: ..."
    // A call that fails has written nothing: sum holds what it held.
    // end snippet
    good = good && failed.code == vp::status_code::index_out_of_range && vp::get<0>(sum).to_host(backend) == twice;
    std::puts(good ? "slabs and passes are right" : "wrong voxels");
    return good ? 0 : 1;
}
