// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids into sparse framebuffers on a GPU: cuda_backend::run_sparse_solid, with the bytes of cpu_backend. Calls that
// make tiles (sparse/solid_bricks.hpp) need the rows alone, as runs: memory is in proportion to the surface. For others
// the sweep over the rows lists the fragments with all their outputs, and the lists become bricks and values as those
// of triangles do: at most 2^32 - 2 voxels.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/optional/solid.cuh>
#include <voxelpipe/device/optional/sparse.cuh>
#include <voxelpipe/device/solid/run_rows.cuh>
#include <voxelpipe/sparse/solid_bricks.hpp>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe {

template <class Mesh, class VertexShader, class SolidShader, class... Targets>
status cuda_backend::run_sparse_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                      sparse_framebuffer<cuda_backend, Targets...>& fb, const solid_options& options,
                                      std::uint64_t triangles_in) {
    if constexpr (core::is_constant<SolidShader>)
        if (core::makes_tiles(draws, options, fb)) {
            using call_type = device::solid_runs<draw<Mesh, VertexShader, SolidShader>>;
            core::found_rows<cuda_backend> found(*this);
            const auto write = [&](const call_type& call, const device::crossing_list& sorted, const auto& memory,
                                   const device::pipeline_state& state) {
                const device::run_totals n = call.totals(memory, *this);
                found.places = buffer<std::uint64_t>(*this, n.rows);
                found.runs.first = buffer<std::uint64_t>(*this, n.rows + 1);
                found.runs.bounds = buffer<std::uint32_t>(*this, n.bounds);
                if (n.rows != 0)
                    call.write(
                        sorted, memory, state,
                        {found.places.data(), found.runs.first.data(), found.runs.bounds.data(), n.rows, n.bounds},
                        stream);
            };
            status drawn = sweep_solid<call_type>(draws, g, options, triangles_in, write);
            if (!drawn.ok()) return drawn;
            if (!options.count_voxels) drawn.counts.voxels = 0;
            const status s = device::with_status(
                triangles_in, [&] { return core::store_solid_rows(*this, draws, g, std::move(found), drawn, fb); });
            return s.ok() ? drawn : s;
        }
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
