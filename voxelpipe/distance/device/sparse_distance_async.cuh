// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_distance_async into bricks: the samples of the band in the caller's memory, without waits and allocations,
// as a CUDA graph needs it. The search is that of distance_async.cuh; its samples become lists of limits.voxels at
// most, and the lists the bricks of a sparse_result.

#include <voxelpipe/distance/device/distance_async.cuh>
#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/sparse/device/sparse_async.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe {

// Room of a call with distances into bricks.
struct sparse_distance_limits : distance_limits {
    std::uint64_t voxels = 0;        // samples that the shader keeps, and those that stay of what the call goes on from
    std::uint64_t result_bricks = 0; // that they lie in
    std::uint64_t nodes = 0;         // as workspace_limits::nodes

    // A start for a mesh of small triangles.
    [[nodiscard]] static sparse_distance_limits for_triangles(std::uint64_t triangles) {
        sparse_distance_limits l;
        static_cast<distance_limits&>(l) = distance_limits::for_triangles(triangles);
        l.result_bricks = l.bricks;
        l.voxels = 256 * l.bricks;
        return l;
    }
};

// The caller's memory, as workspace_view.
struct sparse_distance_workspace_view {
    void* memory = nullptr;        // on the device, aligned to 256 bytes
    std::size_t bytes = 0;         // at least distance_workspace_bytes(...)
    sparse_distance_limits limits; // that `bytes` was computed for
};

namespace device {

[[nodiscard]] inline workspace_limits to_workspace_limits(const sparse_distance_limits& l) {
    workspace_limits limits = to_workspace_limits(static_cast<const distance_limits&>(l));
    limits.bricks = l.result_bricks;
    limits.voxels = l.voxels;
    limits.nodes = l.nodes;
    return limits;
}

// Ends the lists of samples, one fragment each. If they do not fit, they are empty, and the bricks' call is stopped.
template <class Payload>
__global__ void publish_sample_lists(const __grid_constant__ solid_list_arrays<Payload> to, const pipeline_state* state,
                                     capacities limits, list_counts* counts, pipeline_state* of_bricks) {
    if (!to.hold(*state, limits)) {
        *counts = {};
        of_bricks->index_error = stopped;
        return;
    }
    *counts = {state->fragments, state->fragments};
    to.offsets[state->fragments] = state->fragments;
}
// Makes the room that the bricks need a part of the search's state. Lists that were too short left no bricks to count.
template <int = 0> // compiled where it is called
__global__ void join_sparse_state(pipeline_state* state, const pipeline_state* of_bricks) {
    state->sparse = of_bricks->sparse;
    if (state->fragments > state->sparse.voxels) state->sparse.voxels = state->fragments;
}

// One call in the caller's memory.
template <class Draw, class... Targets>
struct bounded_distance;
template <class Mesh, class VertexShader, class Shader, class... Targets>
struct bounded_distance<draw<Mesh, VertexShader, Shader>, Targets...> {
    using draw_type = draw<Mesh, VertexShader, Shader>;
    using payload = typename outputs_payload<
        core::distance_output<Shader, typename distance_call<draw_type>::draws_type::varyings>>::type;

    std::span<const draw_type> draws;
    grid samples;
    const distance_options& options;
    std::uint64_t triangles;
    sparse_distance_limits limits;
    cudaStream_t stream;

    // Run: launches everything; otherwise only adds up the bytes. False if the result cannot be numbered.
    template <bool Run>
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        workspace_limits of_fold = to_workspace_limits(limits);
        if (!are_numbered_bricks(of_fold, result) || limits.voxels >= core::max_numbered) return false;
        if (triangles == 0) {
            keep_bricks<payload, Run>(memory, samples, options.count_voxels, {nullptr, 0, of_fold, nullptr}, result,
                                      stream);
            return true;
        }
        of_fold.fragments = limits.voxels;
        const async_distance<draw_type> search(draws, samples, options, triangles, limits, true);
        if (!search.fits()) return false;
        const auto with_lists = [&](const auto& launch) {
            solid_list_arrays<payload> to{};
            to.max_voxels = to.max_fragments = limits.voxels;
            to.voxels = memory.take<std::uint64_t>(limits.voxels);
            to.offsets = memory.take<std::uint64_t>(limits.voxels + 1);
            to.primitives = memory.take<std::uint32_t>(limits.voxels);
            to.payloads = memory.take<payload>(limits.voxels);
            auto* const counts = memory.take<list_counts>(1);
            auto* const of_bricks = memory.take<pipeline_state>(1);
            const bounded_fold<payload, Targets...> fold(samples.whole_extent(), of_fold, result, memory);
            launch(to, counts, of_bricks, fold);
        };
        if constexpr (Run) {
            search.launch(
                memory, nullptr, stream,
                [&](const auto& call, const auto& m, const auto& shading, const inside_rows& inside) {
                    with_lists([&](const auto& to, list_counts* counts, pipeline_state* of_bricks, const auto& fold) {
                        zero_memory(of_bricks, sizeof(pipeline_state), stream);
                        list_samples<payload>(call, m, shading, inside, {}, stream);
                        launch_kernel(false, publish_sample_lists<payload>, 1u, 1u, 0, stream, stage::abuffer_emit, to,
                                      static_cast<const pipeline_state*>(m.state), call.limits, counts, of_bricks);
                        list_samples<payload>(call, m, shading, inside, to, stream);
                        const abuffer_view<payload> lists{counts,        to.voxels,   to.offsets,
                                                          to.primitives, to.payloads, samples.extent};
                        fold.launch(lists, samples, true, of_bricks, result, stream);
                        launch_kernel(false, join_sparse_state<0>, 1u, 1u, 0, stream, stage::tile_resolve, m.state,
                                      static_cast<const pipeline_state*>(of_bricks));
                    });
                });
        } else {
            search.plan(memory);
            with_lists([](const auto&...) {});
        }
        return true;
    }
};

} // namespace device

// Bytes that voxelize_distance_async needs for such a call on the current device; 0 if the arguments are invalid, or
// the call repairs the mesh, which takes waits.
template <class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] std::size_t distance_workspace_bytes(std::span<const draw<Mesh, VertexShader, DistanceShader>> draws,
                                                   const grid& g, const sparse_result<Targets...>& result,
                                                   const distance_options& options,
                                                   const sparse_distance_limits& limits) {
    using call_type = device::bounded_distance<draw<Mesh, VertexShader, DistanceShader>, Targets...>;
    const status s = core::validate_draws(draws);
    const grid samples = core::sample_grid(g, options.sample);
    if (!s.ok() || !device::validate_async(options, g).ok() || !core::validate_start(result, samples).ok()) return 0;
    return device::bytes_or_none([&] {
        return device::bounded_bytes(result,
                                     call_type{draws, samples, options, s.counts.triangles_in, limits, nullptr});
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks and values will be, and returns: the samples
// of the band, of band::whole all. A status other than ok means that nothing was launched, or that a launch failed;
// read_distance_status reports what the device finds out. If something does not fit, the result is empty.
// strategy_unavailable: the call repairs the mesh. Other errors are those of voxelize_distance, and of voxelize_async
// into bricks.
template <class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] status
voxelize_distance_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, DistanceShader>> draws,
                        const grid& g, sparse_result<Targets...>& result, const distance_options& options,
                        const sparse_distance_workspace_view& workspace) {
    if constexpr (core::distance_fits_targets<Mesh, VertexShader, DistanceShader, Targets...>()) {
        using call_type = device::bounded_distance<draw<Mesh, VertexShader, DistanceShader>, Targets...>;
        device::forget_made(result);
        if (const status s = device::validate_async(options, g); !s.ok()) return s;
        const grid samples = core::sample_grid(g, options.sample);
        if (const status s = core::validate_start(result, samples); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        const workspace_limits limits = device::to_workspace_limits(workspace.limits);
        return device::launch_bounded(
            {workspace.memory, workspace.bytes, limits, nullptr}, s, result,
            call_type{draws, samples, options, s.counts.triangles_in, workspace.limits, backend.stream});
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// Waits for the stream and returns the status of the last call in this workspace, that of voxelize_distance. `need` may
// be null. Where something did not fit (capacity_exceeded), *need receives larger limits, with which the same call may
// fail once more: what did not come to be for want of room has not been counted.
[[nodiscard]] inline status read_distance_status(cuda_backend& backend, const sparse_distance_workspace_view& workspace,
                                                 sparse_distance_limits* need = nullptr) {
    const workspace_limits limits = device::to_workspace_limits(workspace.limits);
    workspace_limits larger = limits;
    const status s = device::read_search(backend, workspace.memory, workspace.bytes, limits, &larger);
    if (need != nullptr && s.code == status_code::capacity_exceeded) {
        static_cast<distance_limits&>(*need) = device::to_distance_limits(larger);
        need->voxels = larger.voxels;
        need->result_bricks = larger.bricks;
        need->nodes = larger.nodes;
    }
    return s;
}

} // namespace voxelpipe
