// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid_async: as voxelize_async, for solids. It never waits and never allocates, so that a CUDA graph can
// capture it and replay it with changed vertices. Of the workspace's limits, `fragments` must hold the crossings of all
// triangles with rows, in, before and behind the grid, and for outer and inner the ends of covered runs as well, two a
// run at most. fill_rule::even_odd of a constant into one cleared target of bits needs no limits.

#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/solid/device/solid.cuh>

namespace voxelpipe {

namespace device {

template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] auto make_solid_call(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                   const framebuffer_view<Targets...>& fb, const solid_options& options,
                                   std::uint64_t triangles, const workspace_limits& limits) {
    using draw_type = draw<Mesh, VertexShader, SolidShader>;
    const capacities c{0, 0, limits.fragments, limits.fragment_records};
    return solid_call<draw_type, framebuffer_view<Targets...>>{
        {draws, g, options, static_cast<std::uint32_t>(triangles), c}, fb};
}

} // namespace device

// Bytes that voxelize_solid_async needs for such a call on the current device; 0 if the arguments are invalid, or the
// call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] std::size_t solid_workspace_bytes(std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                const grid& g, const framebuffer_view<Targets...>& fb,
                                                const solid_options& options, const workspace_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !core::validate(options, g).ok() || options.repair != repair::none) return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::pipeline_state);
    return device::bytes_or_none([&]() -> std::size_t {
        const auto call = device::make_solid_call(draws, g, fb, options, s.counts.triangles_in, limits);
        return call.entries.fits() ? call.plan_memory() : 0;
    });
}

// Puts the call on the backend's stream and returns. A status other than ok means that nothing was launched, or that a
// launch failed; read_status reports what the device finds out. strategy_unavailable: the call repairs the mesh.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status voxelize_solid_async(cuda_backend& backend,
                                          std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                                          const framebuffer_view<Targets...>& fb, const solid_options& options,
                                          const workspace_view& workspace) {
    if constexpr (core::solid_fits_targets<Mesh, VertexShader, SolidShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (options.repair != repair::none) return core::failure(status_code::strategy_unavailable);
        return device::with_cuda_status([&]() -> status {
            if (s.counts.triangles_in == 0) return device::clear_async(backend, fb, workspace);
            const auto call = device::make_solid_call(draws, g, fb, options, s.counts.triangles_in, workspace.limits);
            if (!call.entries.fits()) return core::failure(status_code::size_overflow);
            const std::size_t need = call.plan_memory();
            if (workspace.memory == nullptr || workspace.bytes < need) {
                s.code = status_code::capacity_exceeded;
                s.required = {0, workspace.limits.fragments, need};
                return s;
            }
            device::launch_until(stage::tile_resolve, [&] {
                device::arena memory(workspace.memory);
                device::zero_memory(workspace.memory, call.zeroed_bytes(), backend.stream);
                call.launch(memory, backend.stream);
                if (!workspace.limits.expects_deferred) { // which read_status would take for triangles that are missing
                    auto* const state = static_cast<device::pipeline_state*>(workspace.memory);
                    device::check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), backend.stream));
                }
            });
            return s;
        });
    } else {
        return {};
    }
}

} // namespace voxelpipe
