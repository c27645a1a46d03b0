// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid on a GPU: cuda_backend::run_solid. Its kernels are compiled by programs that call it, and by no other.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/solid/kernel_instances.cuh>
#include <voxelpipe/device/solid/list_rows.cuh>
#include <voxelpipe/device/solid/solid_call.cuh>
#include <voxelpipe/device/solid/solid_cones.cuh>

#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace voxelpipe {

template <class Mesh, class VertexShader, class SolidShader, class... Targets>
status cuda_backend::run_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                               const framebuffer_view<Targets...>& fb, const solid_options& options,
                               std::uint64_t triangles_in) {
    using call_type = device::solid_call<draw<Mesh, VertexShader, SolidShader>, framebuffer_view<Targets...>>;
    return device::with_cones(*this, draws, g, options, triangles_in, [&](const device::solid_cones& cones) {
        const auto triangles = static_cast<std::uint32_t>(triangles_in + cones.num_triangles);
        return device::attempt(
            solid_history_, {triangles_in, g.extent, g.offset, coverage::conservative}, device::max_listed_entries,
            times, stream,
            [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
                call_type call{{draws, g, options, triangles, guess.limits, cones.parts}, fb};
                call.entries.clock = clock;
                if (!call.entries.fits()) throw std::bad_alloc();
                void* const memory = workspace_.prepare(call.plan_memory(), *this, use_pinned_memory, use_graphs);
                device::launch_until(stage::tile_resolve, [&] {
                    std::optional<device::call_bytes> bytes;
                    if constexpr (call_type::has_bytes)
                        if (options.repair == repair::none)
                            bytes = workspace_.bytes_for_graph(clock, [&](const void* workspace, const void* page) {
                                return call.bytes(workspace, page);
                            });
                    state = workspace_.run(clock, bytes, call.zeroed_bytes(), stream, [&](cudaStream_t on) {
                        device::arena carved(memory);
                        call.launch(carved, on);
                    });
                });
                return false;
            });
    });
}

template <class Mesh, class VertexShader, class SolidShader>
std::vector<core::hole_cones> cuda_backend::find_holes(std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                       const grid& g, bodies each) {
    solid_options options;
    options.bodies = each;
    try {
        return device::find_cones(*this, draws, g, options);
    } catch (const device::cuda_failure& e) {
        if (e.error == cudaErrorMemoryAllocation) throw std::bad_alloc();
        throw std::runtime_error(std::string("voxelpipe: ") + cudaGetErrorString(e.error));
    }
}

template <class Call, class Draw, class Write>
status cuda_backend::sweep_solid(std::span<const Draw> draws, const grid& g, const solid_options& options,
                                 std::uint64_t triangles_in, const Write& write) {
    return device::with_cones(*this, draws, g, options, triangles_in, [&](const device::solid_cones& cones) {
        const auto triangles = static_cast<std::uint32_t>(triangles_in + cones.num_triangles);
        return device::attempt(
            solid_history_, {triangles_in, g.extent, g.offset, coverage::conservative}, device::max_listed_entries,
            times, stream,
            [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
                Call call{{{draws, g, options, triangles, guess.limits, cones.parts}}};
                call.entries.clock = clock;
                if (!call.entries.fits()) throw std::bad_alloc();
                device::arena carved(workspace_.prepare(call.plan_memory(), *this, use_pinned_memory, use_graphs));
                const auto memory = call.take(carved);
                device::crossing_list sorted{};
                device::launch_until(stage::abuffer_emit, [&] {
                    state = workspace_.run(clock, std::nullopt, sizeof(device::pipeline_state), stream,
                                           [&](cudaStream_t on) { sorted = call.launch(memory, on); });
                });
                if (!device::has_failed(state, guess.limits)) write(call, sorted, memory, state);
                return false;
            });
    });
}

template <class Mesh, class VertexShader, class SolidShader, class Payload>
status cuda_backend::run_solid(std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                               abuffer<cuda_backend, Payload>& lists, const solid_options& options,
                               std::uint64_t triangles_in) {
    using call_type = device::solid_lists<draw<Mesh, VertexShader, SolidShader>, payload_storage<Payload>>;
    abuffer<cuda_backend, Payload> made(*this); // so that a call that fails leaves `lists` as they were
    const auto write = [&](const call_type& call, const device::crossing_list& sorted, const auto& memory,
                           const device::pipeline_state& state) {
        if (call.has_overlong_row(state)) throw std::bad_alloc();
        device::list_arrays<Payload> arrays(*this, state.voxels, state.fragments);
        if (state.fragments != 0)
            call.write(sorted, memory, state,
                       {arrays.voxels.data(), arrays.offsets.data(), arrays.primitives.data(), arrays.payloads.data()},
                       stream);
        arrays.move_into(made, state.voxels, state.fragments);
    };
    const status s = sweep_solid<call_type>(draws, g, options, triangles_in, write);
    if (s.ok()) {
        made.extent = g.extent;
        lists = std::move(made);
    }
    return s;
}

} // namespace voxelpipe
