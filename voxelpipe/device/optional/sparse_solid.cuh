// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids into sparse framebuffers on a GPU: cuda_backend::run_sparse_solid, with the bytes of cpu_backend. The sweep
// over the rows lists the fragments with all their outputs, and the lists become bricks and values as those of
// triangles do. Beside the result, memory is in proportion to the fragments. At most 2^32 - 2 voxels.

#include <voxelpipe/device/optional/solid.cuh>
#include <voxelpipe/device/optional/sparse.cuh>

#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

template <class Mesh, class VertexShader, class SolidShader, class... Targets>
status cuda_backend::run_sparse_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                      sparse_framebuffer<cuda_backend, Targets...>& fb, const solid_options& options,
                                      std::uint64_t triangles_in) {
    using shader = device::payload_shader<SolidShader>;
    using payload = typename device::outputs_payload<core::solid_output<SolidShader>>::type;
    std::vector<draw<Mesh, VertexShader, shader>> listed;
    for (const auto& d : draws) listed.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
    abuffer<cuda_backend, payload> lists(*this);
    const status s =
        run_solid(std::span<const draw<Mesh, VertexShader, shader>>(listed), g, lists, options, triangles_in);
    if (!s.ok()) return s;
    status done = device::finish_sparse(*this, g, lists, fb, s);
    if (!options.count_voxels) done.counts.voxels = 0;
    return done;
}

} // namespace voxelpipe
