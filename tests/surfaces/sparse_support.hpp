// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces of sparse framebuffers, on any backend.

#include "surface_support.hpp"

#include <voxelpipe/surfaces/remesh_sparse.hpp>

#include <span>

namespace surface_tests {

using bit_target = vp::target<vp::bit, vp::blend::replace>;
using field_target = vp::target<float, vp::blend::replace>;

// A cube for each voxel that is set: its middle is inside, and no other one.
[[nodiscard]] inline host_mesh cubes(const bit_volume& v, const vp::grid& g) {
    host_mesh m;
    for (int z = 0; z < v.extent.z; ++z)
        for (int y = 0; y < v.extent.y; ++y)
            for (int x = 0; x < v.extent.x; ++x) {
                if (!v.at(x, y, z)) continue;
                const glm::dvec3 low = g.to_world(glm::dvec3(x + 0.25, y + 0.25, z + 0.25)),
                                 high = g.to_world(glm::dvec3(x + 0.75, y + 0.75, z + 0.75));
                m.add(box(glm::vec3(low), glm::vec3(high)));
            }
    return m;
}

// The bits of a solid, in bricks and in a grid, and the surfaces of both.
struct both_surfaces {
    host_surface sparse, dense;
    std::uint64_t tiles = 0, voxels = 0;
    [[nodiscard]] bool are_the_same() const { return sparse.status.ok() && sparse.has_same_arrays(dense); }
};
template <class Backend>
[[nodiscard]] both_surfaces extract_solid(Backend& backend, const host_mesh& m, const vp::grid& g,
                                          const vp::extract_options& o = {}) {
    const vp::mesh<Backend> mesh{backend, m.positions, m.triangles};
    vp::sparse_framebuffer<Backend, bit_target> bricks(backend, g.extent);
    vp::framebuffer<Backend, bit_target> bits(backend, g.extent);
    vp::voxelize_solid(backend, mesh, g, vp::passthrough{}, vp::constant(true), bricks).or_throw();
    vp::voxelize_solid(backend, mesh, g, vp::passthrough{}, vp::constant(true), bits).or_throw();
    vp::surface<Backend> a(backend), b(backend);
    const vp::status of_a = vp::extract(backend, bricks, g, a, o), of_b = vp::extract(backend, bits, g, b, o);
    return {to_host(backend, a, of_a), to_host(backend, b, of_b), bricks.num_tiles(), bricks.num_voxels()};
}

template <class Backend>
[[nodiscard]] host_surface remesh_sparse(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                         const vp::remesh_options& options = {}) {
    const vp::mesh<Backend> m{backend, mesh.positions, mesh.triangles};
    vp::surface<Backend> s(backend);
    const vp::status status = vp::remesh_sparse(backend, m, g, vp::passthrough{}, s, options);
    return to_host(backend, s, status);
}

} // namespace surface_tests
