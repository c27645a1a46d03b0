// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_solid_async into bricks: never waits, never allocates; a CUDA graph can capture it. Of the workspace's
// limits, `fragments` must hold the crossings, as for framebuffers (solid_async.cuh), and `bricks`, `voxels` and
// `nodes` the result, whose bytes are those of voxelize_solid. Where that makes tiles, memory is in proportion to the
// crossings and the result. Otherwise the voxels inside are listed: in proportion to `voxels`, times the draws for
// bodies::draw. A call that goes on (sparse_result::start), or keeps sums, lists them always.

#include <voxelpipe/solid/device/list_rows.cuh>
#include <voxelpipe/solid/device/run_rows.cuh>
#include <voxelpipe/solid/device/solid_async.cuh>
#include <voxelpipe/sparse/device/bounded_solid_bricks.cuh>
#include <voxelpipe/sparse/device/sparse_async.cuh>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

namespace device {

template <class Payload>
__global__ void publish_solid_lists(const __grid_constant__ solid_list_arrays<Payload> to, const pipeline_state* state,
                                    capacities limits, list_counts* counts, pipeline_state* of_bricks) {
    if (!to.hold(*state, limits)) {
        *counts = {};
        of_bricks->index_error = stopped;
        return;
    }
    *counts = {state->voxels, state->fragments};
    to.offsets[state->voxels] = state->fragments;
}
// Makes the room that the bricks need a part of the call's state. Lists that were too short left no bricks to count.
template <int = 0> // compiled where it is called
__global__ void join_solid_state(pipeline_state* state, const pipeline_state* of_bricks, bool count_voxels) {
    const unsigned long long voxels = state->voxels;
    state->sparse = of_bricks->sparse;
    if (voxels > state->sparse.voxels) state->sparse.voxels = voxels;
    state->voxels = count_voxels ? of_bricks->voxels : 0;
    state->deferred = {}; // read_status would take them for triangles that are missing
}

// A value for each voxel in bricks and each tile.
struct count_result_values {
    const sparse_counts* made;
    unsigned long long* values;
    __device__ void operator()(std::uint64_t) const { *values = made->voxels + made->tiles; }
};

// One call in the caller's memory.
template <class Draw, class... Targets>
struct bounded_solid;
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
struct bounded_solid<draw<Mesh, VertexShader, SolidShader>, Targets...> {
    using draw_type = draw<Mesh, VertexShader, SolidShader>;
    using payload = typename outputs_payload<core::solid_output<SolidShader>>::type;

    std::span<const draw_type> draws;
    const grid& g;
    const solid_options& options;
    std::uint64_t triangles;
    workspace_view workspace; // its limits
    cudaStream_t stream;

    // Run: launches everything; otherwise only adds up the bytes. False if the crossings or the result cannot be
    // numbered.
    template <bool Run>
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        if (!are_numbered_bricks(workspace.limits, result)) return false;
        if (triangles == 0) {
            keep_bricks<payload, Run>(memory, g, true, workspace, result, stream);
            return true;
        }
        if constexpr (core::is_constant<SolidShader>)
            if (makes_tiles(result)) return by_rows<Run>(memory, result);
        return workspace.limits.voxels < core::max_numbered && by_lists<Run>(memory, result);
    }

private:
    // As core::makes_tiles. Only the device knows whether anything exists where `result` goes on, so voxels stay then.
    [[nodiscard]] bool makes_tiles(const sparse_result<Targets...>& result) const {
        return !result.keeps_voxels() && !result.keeps_any_sums() &&
               core::has_one_value<Targets...>(draws, options,
                                               [&](std::size_t i) { return result.loads[i] != load_operation::off; });
    }
    // Bricks and tiles of the rows' runs, and one value.
    template <bool Run>
    [[nodiscard]] bool by_rows(arena& memory, sparse_result<Targets...>& result) const {
        workspace_limits limits = workspace.limits;
        limits.expects_deferred = limits.orders_long_voxels = true; // of the solid's passes, which are all launched
        const capacities room{0, 0, limits.fragments, limits.fragment_records};
        const solid_runs<draw_type> call{{{draws, g, options, static_cast<std::uint32_t>(triangles), room}}};
        if (!call.entries.fits() || limits.fragments >= core::max_numbered / 2) return false;
        const auto m = call.take(memory); // its state comes first
        bounded_result<bounded_arrays<>, Targets...> made({to_room(limits), memory}, limits, result, memory);
        auto* const num_values = memory.take<unsigned long long>(1);
        bounded_solid_bricks<> bricks(g, limits.fragments, to_room(limits), stream, memory);
        if constexpr (Run) {
            zero_memory(m.state, sizeof(pipeline_state), stream);
            const crossing_list sorted = call.launch(m, stream);
            bricks.clear();
            call.total(m, bricks.totals(), stream);
            call.write_within(sorted, m, bricks.found(), stream);
            made.bricks.clear(stream);
            bricks.launch(made.bricks);
            made.publish(m.state, bricks.num_tiles(), options.count_voxels ? &m.state->voxels : nullptr, stream);
            bricks.end_tiles(made.bricks.counts);
            for_each(1, count_result_values{made.bricks.counts, num_values}, stage::tile_resolve, stream);
            const auto background = result.next_background();
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using target = typename core::pack_element<I, Targets...>::type;
                const auto value =
                    core::solid_value<I, target>(draws[0].fragment_shader, result.loads[I], get<I>(background));
                fill_mask_values<target>(get<I>(made.values), limits.voxels, num_values, value, stream);
            });
            made.set(result, g, bricks.tiles(), limits.bricks);
            result.is_tiled = true;
        }
        return true;
    }
    template <bool Run>
    [[nodiscard]] bool by_lists(arena& memory, sparse_result<Targets...>& result) const {
        using shader = payload_shader<SolidShader>;
        using listed_type = draw<Mesh, VertexShader, shader>;
        const workspace_limits& limits = workspace.limits;
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
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), of_fold, result, memory);
        if constexpr (Run) {
            zero_memory(m.state, sizeof(pipeline_state), stream);
            zero_memory(of_bricks, sizeof(pipeline_state), stream);
            const crossing_list sorted = call.launch(m, stream);
            launch_kernel(false, publish_solid_lists<payload>, 1u, 1u, 0, stream, stage::abuffer_emit, to,
                          static_cast<const pipeline_state*>(m.state), room, counts, of_bricks);
            call.write_within(sorted, m, to, stream);
            const abuffer_view<payload> lists{counts, to.voxels, to.offsets, to.primitives, to.payloads, g.extent};
            fold.launch(lists, g, true, of_bricks, result, stream);
            launch_kernel(false, join_solid_state<0>, 1u, 1u, 0, stream, stage::tile_resolve, m.state,
                          static_cast<const pipeline_state*>(of_bricks), options.count_voxels);
        }
        return true;
    }
};

} // namespace device

// Bytes that voxelize_solid_async needs for such a call on the current device; 0 if the arguments are invalid, or the
// call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] std::size_t solid_workspace_bytes(std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                const grid& g, const sparse_result<Targets...>& result,
                                                const solid_options& options, const workspace_limits& limits) {
    using call_type = device::bounded_solid<draw<Mesh, VertexShader, SolidShader>, Targets...>;
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !core::validate(options, g).ok() || options.repair != repair::none ||
        !core::validate_start(result, g).ok())
        return 0;
    return device::bytes_or_none([&] {
        return device::bounded_bytes(
            result, call_type{draws, g, options, s.counts.triangles_in, {nullptr, 0, limits}, nullptr});
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks and values will be, and returns. A status
// other than ok means that nothing was launched, or that a launch failed; read_status reports what the device finds
// out. strategy_unavailable: the call repairs the mesh. Other errors are those of voxelize_async.
template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status
voxelize_solid_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws, const grid& g,
                     sparse_result<Targets...>& result, const solid_options& options, const workspace_view& workspace) {
    if constexpr (core::solid_fits_targets<Mesh, VertexShader, SolidShader, Targets...>()) {
        using call_type = device::bounded_solid<draw<Mesh, VertexShader, SolidShader>, Targets...>;
        device::forget_made(result);
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        if (const status s = core::validate_start(result, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (options.repair != repair::none) return core::failure(status_code::strategy_unavailable);
        return device::launch_bounded(workspace, s, result,
                                      call_type{draws, g, options, s.counts.triangles_in, workspace, backend.stream});
    } else {
        return {};
    }
}

} // namespace voxelpipe
