// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids into sparse framebuffers on a GPU: run_module of core::sparse_tag with solid_options, with the bytes of
// cpu_backend. Calls that make tiles (sparse/passes/solid_bricks.hpp) need the rows alone, as runs: memory is in
// proportion to the surface. For others the sweep over the rows lists the fragments with all their outputs, and the
// lists become bricks and values as those of triangles do: at most 2^32 - 2 voxels.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/solid/device/run_rows.cuh>
#include <voxelpipe/solid/device/solid.cuh>
#include <voxelpipe/sparse/device/sparse.cuh>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// Implements voxelize_solid of a sparse framebuffer. Arguments are validated.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
status run_module(sparse_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                  const grid& g, sparse_framebuffer<cuda_backend, Targets...>& fb, const solid_options& options,
                  std::uint64_t triangles_in) {
    if constexpr (is_constant<SolidShader>)
        if (makes_tiles(draws, options, fb)) {
            using call_type = device::solid_runs<draw<Mesh, VertexShader, SolidShader>>;
            found_rows<cuda_backend> found(backend);
            const auto write = [&](const call_type& call, const device::crossing_list& sorted, const auto& memory,
                                   const device::pipeline_state& state) {
                const device::run_totals n = call.totals(memory, backend);
                found.places = device_buffer<std::uint64_t>(backend, n.rows);
                found.runs.first = device_buffer<std::uint64_t>(backend, n.rows + 1);
                found.runs.bounds = device_buffer<std::uint32_t>(backend, n.bounds);
                if (n.rows != 0)
                    call.write(
                        sorted, memory, state,
                        {found.places.data(), found.runs.first.data(), found.runs.bounds.data(), n.rows, n.bounds},
                        backend.stream);
            };
            status drawn = device::sweep_solid<call_type>(backend, draws, g, options, triangles_in, write);
            if (!drawn.ok()) return drawn;
            if (!options.count_voxels) drawn.counts.voxels = 0;
            const status s = device::with_status(
                triangles_in, [&] { return store_solid_rows(backend, draws, g, std::move(found), drawn, fb); });
            return s.ok() ? drawn : s;
        }
    using shader = device::payload_shader<SolidShader>;
    using payload = typename device::outputs_payload<solid_output<SolidShader>>::type;
    std::vector<draw<Mesh, VertexShader, shader>> listed;
    for (const auto& d : draws) listed.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
    abuffer<cuda_backend, payload> lists(backend);
    const status s = run_module(solid_tag{}, backend, std::span<const draw<Mesh, VertexShader, shader>>(listed), g,
                                lists, options, triangles_in);
    if (!s.ok()) return s;
    status done = device::finish_sparse(backend, g, lists, fb, s);
    if (!options.count_voxels) done.counts.voxels = 0;
    return done;
}

} // namespace voxelpipe::core
