// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid on a GPU: run_module of core::solid_tag. Its kernels are compiled by programs that call it, and by no
// other.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/solid/device/kernel_instances.cuh>
#include <voxelpipe/solid/device/list_rows.cuh>
#include <voxelpipe/solid/device/solid_call.cuh>
#include <voxelpipe/solid/device/solid_cones.cuh>

#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelpipe::device {

// A solid call that counts its rows, then write(call, sorted entries, its memory, state).
template <class Call, class Draw, class Write>
[[nodiscard]] status sweep_solid(cuda_backend& backend, std::span<const Draw> draws, const grid& g,
                                 const solid_options& options, std::uint64_t triangles_in, const Write& write) {
    return device::with_cones(backend, draws, g, options, triangles_in, [&](const device::solid_cones& cones) {
        const auto triangles = static_cast<std::uint32_t>(triangles_in + cones.num_triangles);
        return device::attempt(
            backend.history<core::solid_tag>(), {triangles_in, g.extent, g.offset, coverage::conservative},
            device::max_listed_entries, backend.times, backend.stream,
            [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
                Call call{{{draws, g, options, triangles, guess.limits, cones.parts}}};
                call.entries.clock = clock;
                if (!call.entries.fits()) throw std::bad_alloc();
                device::arena carved(backend.workspace().prepare(call.plan_memory(), backend, backend.use_pinned_memory,
                                                                 backend.use_graphs));
                const auto memory = call.take(carved);
                device::crossing_list sorted{};
                device::launch_until(stage::abuffer_emit, [&] {
                    state = backend.workspace().run(clock, std::nullopt, sizeof(device::pipeline_state), backend.stream,
                                                    [&](cudaStream_t on) { sorted = call.launch(memory, on); });
                });
                if (!device::has_failed(state, guess.limits)) write(call, sorted, memory, state);
                return false;
            });
    });
}

} // namespace voxelpipe::device

namespace voxelpipe::core {

// Implements voxelize_solid into a framebuffer. Arguments are validated.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
status run_module(solid_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                  const grid& g, const framebuffer_view<Targets...>& fb, const solid_options& options,
                  std::uint64_t triangles_in) {
    using call_type = device::solid_call<draw<Mesh, VertexShader, SolidShader>, framebuffer_view<Targets...>>;
    return device::with_cones(backend, draws, g, options, triangles_in, [&](const device::solid_cones& cones) {
        const auto triangles = static_cast<std::uint32_t>(triangles_in + cones.num_triangles);
        return device::attempt(
            backend.history<core::solid_tag>(), {triangles_in, g.extent, g.offset, coverage::conservative},
            device::max_listed_entries, backend.times, backend.stream,
            [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
                call_type call{{draws, g, options, triangles, guess.limits, cones.parts}, fb};
                call.entries.clock = clock;
                if (!call.entries.fits()) throw std::bad_alloc();
                void* const memory = backend.workspace().prepare(call.plan_memory(), backend, backend.use_pinned_memory,
                                                                 backend.use_graphs);
                device::launch_until(stage::tile_resolve, [&] {
                    std::optional<device::call_bytes> bytes;
                    if constexpr (call_type::has_bytes)
                        if (options.repair == repair::none)
                            bytes = backend.workspace().bytes_for_graph(
                                clock,
                                [&](const void* workspace, const void* page) { return call.bytes(workspace, page); });
                    state = backend.workspace().run(clock, bytes, call.zeroed_bytes(), backend.stream,
                                                    [&](cudaStream_t on) {
                                                        device::arena carved(memory);
                                                        call.launch(carved, on);
                                                    });
                });
                return false;
            });
    });
}

// Implements voxelize_solid into an A-buffer. Arguments are validated.
template <class Mesh, class VertexShader, class SolidShader, class Payload>
status run_module(solid_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                  const grid& g, abuffer<cuda_backend, Payload>& lists, const solid_options& options,
                  std::uint64_t triangles_in) {
    using call_type = device::solid_lists<draw<Mesh, VertexShader, SolidShader>, payload_storage<Payload>>;
    abuffer<cuda_backend, Payload> made(backend); // so that a call that fails leaves `lists` as they were
    const auto write = [&](const call_type& call, const device::crossing_list& sorted, const auto& memory,
                           const device::pipeline_state& state) {
        if (call.has_overlong_row(state)) throw std::bad_alloc();
        device::list_arrays<Payload> arrays(backend, state.voxels, state.fragments);
        if (state.fragments != 0)
            call.write(sorted, memory, state,
                       {arrays.voxels.data(), arrays.offsets.data(), arrays.primitives.data(), arrays.payloads.data()},
                       backend.stream);
        arrays.move_into(made, state.voxels, state.fragments);
    };
    const status s = device::sweep_solid<call_type>(backend, draws, g, options, triangles_in, write);
    if (s.ok()) {
        made.extent = g.extent;
        lists = std::move(made);
    }
    return s;
}

// Implements diagnose_repair: lids on the holes of each body, of at most max_hole_edges edges. Waits. Throws
// std::bad_alloc, std::length_error, or std::runtime_error with CUDA's text.
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] std::vector<hole_cones>
run_module(find_holes_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
           const grid& g, bodies each, std::uint64_t max_hole_edges = ~std::uint64_t{0}) {
    solid_options options;
    options.bodies = each;
    options.max_hole_edges = max_hole_edges;
    try {
        return device::find_cones(backend, draws, g, options);
    } catch (const device::cuda_failure& e) {
        if (e.error == cudaErrorMemoryAllocation) throw std::bad_alloc();
        throw std::runtime_error(std::string("voxelpipe: ") + cudaGetErrorString(e.error));
    }
}

} // namespace voxelpipe::core
