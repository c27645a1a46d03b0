// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid_async into bricks: never waits, never allocates; a CUDA graph can capture it. Of the workspace's
// limits, `fragments` must hold the crossings, as for framebuffers (solid_async.cuh), and `bricks`, `voxels` and
// `nodes` the result. The voxels inside are listed, so memory is in proportion to `voxels`, times the draws for
// bodies::draw. Made dense the result is that of voxelize_solid; its insides are bricks, not tiles, and otherwise its
// bytes are the same.

#include <voxelpipe/device/optional/solid_async.cuh>
#include <voxelpipe/device/optional/sparse_async.cuh>
#include <voxelpipe/device/solid/list_rows.cuh>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

namespace device {

template <class Payload>
__global__ void publish_solid_lists(const __grid_constant__ solid_list_arrays<Payload> to, const pipeline_state* state,
                                    capacities limits, list_counts* counts) {
    if (!to.hold(*state, limits)) {
        *counts = {};
        return;
    }
    *counts = {state->voxels, state->fragments};
    to.offsets[state->voxels] = state->fragments;
}
// What the bricks need becomes part of the call's state. Lists that were too short left no bricks to count.
template <int = 0> // compiled where it is called
__global__ void join_solid_state(pipeline_state* state, const pipeline_state* of_bricks, const sparse_counts* made,
                                 bool count_voxels) {
    const unsigned long long voxels = state->voxels;
    state->sparse = of_bricks->sparse;
    if (voxels > state->sparse.voxels) state->sparse.voxels = voxels;
    state->voxels = count_voxels ? made->voxels : 0;
    state->deferred = {}; // read_status would take them for triangles that are missing
}

// One call in the caller's memory. Run: launches everything; otherwise only adds up the bytes.
template <bool Run, class Draw, class... Targets>
struct bounded_solid;
template <bool Run, class Mesh, class VertexShader, class SolidShader, class... Targets>
struct bounded_solid<Run, draw<Mesh, VertexShader, SolidShader>, Targets...> {
    std::span<const draw<Mesh, VertexShader, SolidShader>> draws;
    const grid& g;
    const solid_options& options;
    std::uint64_t triangles;
    workspace_limits limits;
    cudaStream_t stream;

    // False if the crossings cannot be numbered.
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        using shader = payload_shader<SolidShader>;
        using payload = typename outputs_payload<core::solid_output<SolidShader>>::type;
        using listed_type = draw<Mesh, VertexShader, shader>;
        std::vector<listed_type> listed;
        for (const auto& d : draws) listed.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
        const capacities room{0, 0, limits.fragments, limits.fragment_records};
        const solid_lists<listed_type, payload> call{
            {{std::span<const listed_type>(listed), g, options, static_cast<std::uint32_t>(triangles), room}}};
        if (!call.entries.fits()) return false;
        const auto m = call.take(memory); // its state comes first
        solid_list_arrays<payload> to{};
        to.max_voxels = limits.voxels;
        to.max_fragments = limits.voxels * (options.bodies == bodies::draw ? draws.size() : 1);
        to.voxels = memory.take<std::uint64_t>(to.max_voxels);
        to.offsets = memory.take<std::uint64_t>(to.max_voxels + 1);
        to.primitives = memory.take<std::uint32_t>(to.max_fragments);
        to.payloads = memory.take<payload>(to.max_fragments);
        auto* const counts = memory.take<list_counts>(1);
        auto* const of_bricks = memory.take<pipeline_state>(1);
        workspace_limits of_fold = limits;
        of_fold.fragments = limits.voxels;
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), of_fold, memory);
        if constexpr (Run) {
            zero_memory(m.state, sizeof(pipeline_state), stream);
            zero_memory(of_bricks, sizeof(pipeline_state), stream);
            const crossing_list sorted = call.launch(m, stream);
            launch_kernel(false, publish_solid_lists<payload>, 1u, 1u, 0, stream, stage::abuffer_emit, to,
                          static_cast<const pipeline_state*>(m.state), room, counts);
            call.write_within(sorted, m, to, stream);
            const abuffer_view<payload> lists{counts, to.voxels, to.offsets, to.primitives, to.payloads, g.extent};
            fold.launch(lists, g, true, of_bricks, result, stream);
            launch_kernel(false, join_solid_state<0>, 1u, 1u, 0, stream, stage::tile_resolve, m.state,
                          static_cast<const pipeline_state*>(of_bricks), result.counts, options.count_voxels);
        }
        return true;
    }
};

// 0 if the crossings cannot be numbered.
template <class... Targets, class Draw>
[[nodiscard]] std::size_t bounded_solid_bytes(std::span<const Draw> draws, const grid& g, const solid_options& options,
                                              std::uint64_t triangles, const workspace_limits& limits) {
    arena plan;
    sparse_result<Targets...> unused;
    return bounded_solid<false, Draw, Targets...>{draws, g, options, triangles, limits, nullptr}(plan, unused)
               ? plan.used()
               : 0;
}
// Whether the lists of a solid, and its bricks, can be numbered.
[[nodiscard]] inline bool are_numbered_solids(const workspace_limits& l) {
    return are_numbered_bricks(l) && l.voxels < core::max_numbered;
}

} // namespace device

// Bytes that voxelize_solid_async needs for such a call on the current device; 0 if the arguments are invalid, or the
// call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] std::size_t solid_workspace_bytes(std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                const grid& g, const sparse_result<Targets...>&,
                                                const solid_options& options, const workspace_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !core::validate(options, g).ok() || options.repair != repair::none ||
        !device::are_numbered_solids(limits))
        return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::empty_bricks);
    return device::bytes_or_none([&]() -> std::size_t {
        return device::bounded_solid_bytes<Targets...>(draws, g, options, s.counts.triangles_in, limits);
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks and values will be, and returns. A status
// other than ok means that nothing was launched, or that a launch failed; read_status reports what the device finds
// out. strategy_unavailable: the call repairs the mesh. size_overflow: limits beyond what is numbered.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status
voxelize_solid_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                     sparse_result<Targets...>& result, const solid_options& options, const workspace_view& workspace) {
    if constexpr (core::solid_fits_targets<Mesh, VertexShader, SolidShader, Targets...>()) {
        sparse_result<Targets...> made;
        made.clear_values = result.clear_values;
        result = made;
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (options.repair != repair::none) return core::failure(status_code::strategy_unavailable);
        if (!device::are_numbered_solids(workspace.limits)) return core::failure(status_code::size_overflow);
        return device::with_cuda_status([&]() -> status {
            const std::uint64_t triangles = s.counts.triangles_in;
            const std::size_t need =
                triangles == 0
                    ? sizeof(device::empty_bricks)
                    : device::bounded_solid_bytes<Targets...>(draws, g, options, triangles, workspace.limits);
            if (need == 0) return core::failure(status_code::size_overflow);
            const auto launch = [&](device::arena& memory, sparse_result<Targets...>& to) {
                (void)device::bounded_solid<true, draw<Mesh, VertexShader, SolidShader>, Targets...>{
                    draws, g, options, triangles, workspace.limits, backend.stream}(memory, to);
            };
            const status launched = device::launch_bounded(backend, g, workspace, need, s, made, launch);
            if (launched.ok()) result = made;
            return launched;
        });
    } else {
        return {};
    }
}

} // namespace voxelpipe
