// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async: a framebuffer call that never waits and never allocates. It works in the caller's memory, so a CUDA
// graph can capture it and replay it with changed vertices. Capacities are fixed beforehand; a call that does not fit
// leaves every target as it was, and read_status reports what was needed.

#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/call/kernel_instances.cuh>
#include <voxelpipe/device/scene/subset.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

namespace voxelpipe {

// Capacities of a call. tile_pairs: (tile, triangle) pairs. fragments: only for targets whose blend needs triangle
// order, or with lists_fragments. The records are parts of large triangles, 512 columns of tiles or voxels each.
struct workspace_limits {
    std::uint64_t tile_pairs = 0;       // (tile, triangle) pairs, below 2^32
    std::uint64_t tile_records = 0;     // parts of large triangles in tiles
    std::uint64_t fragments = 0;        // listed fragments, below 2^32
    std::uint64_t fragment_records = 0; // parts of large triangles in lists
    // Fragments of shaders that compute may be listed and sorted by voxel instead of drawn in tiles (strategies
    // sorted_reduce and sorted_fold). Then `fragments` must suffice, at most 2^28, instead of tile_pairs.
    bool lists_fragments = false;
    // For calls that list fragments: voxels may have more than 256. Without it, the kernels that order those are left
    // out, which saves some 10 us of a short call; a call that meets such a voxel then fails for its capacity.
    bool orders_long_voxels = true;
    // For calls without tiles of one draw: more than a few triangles may have bounding boxes of more than two voxels a
    // side, or three for conservative coverage. Without it, the deferred pass for those is left out, which saves 3 to 6
    // us for a mesh that is finer than the grid. A few in a hundred may then be larger, none by much; a call that meets
    // more fails for its capacity and writes no target. Calls of several draws, and the strategies immediate and tiled,
    // keep the pass and never fail for it.
    bool expects_deferred = true;
    // As cuda_backend::strategy.
    voxelpipe::strategy strategy = voxelpipe::strategy::automatic;
    // Sparse results alone: bricks of 8 x 8 x 8 voxels and tiles, voxels that exist in bricks and one a tile, and nodes
    // of 128 x 128 x 128 voxels that hold a voxel of the grid's part and meet a triangle. Grids of at most 2048 voxels
    // a side have no nodes.
    std::uint64_t bricks = 0, voxels = 0, nodes = 0;

    // A start for a mesh whose triangles are mostly smaller than a tile.
    [[nodiscard]] static workspace_limits for_triangles(std::uint64_t triangles) {
        const auto first = tuning::first_capacities(triangles);
        workspace_limits l;
        l.tile_pairs = first[0];
        l.tile_records = first[1];
        l.fragments = first[2];
        l.fragment_records = first[3];
        return l;
    }
};

// The caller's memory: at least workspace_bytes(...), aligned to 256 bytes. One call at a time uses it, from the call
// until the stream has passed it. Calls on different streams or threads need different workspaces; calls that follow
// each other on one stream may share one. Any thread may launch a captured graph, one at a time.
struct workspace_view {
    void* memory = nullptr;  // on the device, aligned to 256 bytes
    std::size_t bytes = 0;   // at least workspace_bytes(...)
    workspace_limits limits; // that `bytes` was computed for
    // For calls behind others that may fail on the device, such as programs: 0 or `device::stopped`, in device memory
    // when the stream reaches the call, which then writes no target. May be null.
    const unsigned int* stop = nullptr;
};

namespace device {

// Pairs and fragments are numbered with 32 bits.
[[nodiscard]] inline bool are_numbered(const workspace_limits& l) {
    return l.tile_pairs <= core::max_numbered && l.fragments <= core::max_numbered;
}
[[nodiscard]] inline capacities to_capacities(const workspace_limits& l) {
    capacities c{l.tile_pairs, l.tile_records, l.fragments, l.fragment_records};
    if (!l.orders_long_voxels) c.longest_ordered = 0;
    c.deferred = l.expects_deferred ? deferral::by_pass : deferral::by_blocks;
    return c;
}

template <class Draw, class Framebuffer, class F>
auto with_call(std::span<const Draw> draws, const grid& g, const Framebuffer& fb, const voxelize_options& options,
               std::uint64_t triangles, const workspace_limits& limits, const F& f) {
    return with_framebuffer_call<tuning::fine_raster_selector>(
        draws, g, fb, options, triangles, to_capacities(limits), [&](auto call) {
            const bool is_served = call.choose(limits.strategy, limits.lists_fragments);
            if (is_served) call.plan.limits.deferred = call.deferral_for(limits.expects_deferred ? ~0ull : 0);
            return f(call, is_served);
        });
}

// Takes over workspace.stop, once the state is zero.
inline void take_stop(const workspace_view& workspace, pipeline_state* state, cudaStream_t stream) {
    if (workspace.stop != nullptr)
        check(cudaMemcpyAsync(&state->index_error, workspace.stop, sizeof(*workspace.stop), cudaMemcpyDeviceToDevice,
                              stream));
}

// Waits for the stream and copies what a workspace begins with.
template <class State>
[[nodiscard]] status read_start(const void* memory, State& to, cudaStream_t stream) {
    return with_cuda_status([&] {
        check(cudaMemcpyAsync(&to, memory, sizeof(to), cudaMemcpyDeviceToHost, stream));
        check(cudaStreamSynchronize(stream));
        return status{};
    });
}

// A call without triangles.
template <class... Targets>
[[nodiscard]] status clear_async(cuda_backend& backend, const framebuffer_view<Targets...>& fb,
                                 const workspace_view& workspace) {
    if (workspace.memory == nullptr || workspace.bytes < sizeof(pipeline_state)) {
        status s = core::failure(status_code::capacity_exceeded);
        s.required.bytes = sizeof(pipeline_state);
        return s;
    }
    auto* const state = static_cast<pipeline_state*>(workspace.memory);
    launch_until(stage::fine_raster, [&] {
        check(cudaMemsetAsync(state, 0, sizeof(pipeline_state), backend.stream));
        take_stop(workspace, state, backend.stream);
        clear_framebuffer(fb, state, backend.stream);
    });
    return {};
}

} // namespace device

// Bytes that voxelize_async needs for such a call on the current device; 0 if the arguments are invalid.
template <class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                          const grid& g, const framebuffer_view<Targets...>& fb,
                                          const voxelize_options& options, const workspace_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !device::are_numbered(limits)) return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::pipeline_state);
    return device::bytes_or_none([&]() -> std::size_t {
        return device::with_call(draws, g, fb, options, s.counts.triangles_in, limits,
                                 [](const auto& call, bool is_served) { return is_served ? call.plan_memory() : 0; });
    });
}

// Puts the call on the backend's stream and returns. A status other than ok means that nothing was launched, or that a
// launch failed; read_status reports what the device finds out. A coverage may be given between angle brackets, as for
// voxelize.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] status
voxelize_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
               const framebuffer_view<Targets...>& fb, voxelize_options options, const workspace_view& workspace) {
    if constexpr (core::shaders_fit_targets<Mesh, VertexShader, FragmentShader, Targets...>()) {
        core::known_coverage<Known...>::set(options);
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (!device::are_numbered(workspace.limits)) return core::failure(status_code::size_overflow);
        return device::with_cuda_status([&]() -> status {
            if (s.counts.triangles_in == 0) return device::clear_async(backend, fb, workspace);
            const auto launch = [&](const auto& call, bool is_served) {
                if (!is_served) {
                    s.code = status_code::strategy_unavailable;
                    return;
                }
                const std::size_t need = call.plan_memory();
                if (workspace.memory == nullptr || workspace.bytes < need) {
                    s.code = status_code::capacity_exceeded;
                    s.required = {workspace.limits.tile_pairs, workspace.limits.fragments, need};
                    return;
                }
                device::launch_until(call.last_stage(), [&] {
                    device::arena memory(workspace.memory);
                    device::zero_memory(workspace.memory, call.zeroed_bytes(), backend.stream);
                    device::take_stop(workspace, static_cast<device::pipeline_state*>(workspace.memory),
                                      backend.stream);
                    device::check_subsets(draws, &static_cast<device::pipeline_state*>(workspace.memory)->index_error,
                                          backend.stream);
                    core::known_coverage<Known...>::dispatch(
                        options.rule, [&]<coverage Rule>() { call.template launch<Rule>(memory, backend.stream); });
                });
            };
            device::with_call(draws, g, fb, options, s.counts.triangles_in, workspace.limits, launch);
            return s;
        });
    } else {
        return {};
    }
}

// Waits for the stream and returns the status of the last call in this workspace. `need` may be null.
// - The workspace was too small (capacity_exceeded): *need receives larger limits. The same call may fail with these
//   too, because a pass stops counting pairs when its records do not fit.
// - The call succeeded: *need stays as it is, except that expects_deferred is set if the call is quicker with it.
// - A CUDA error that shows only here has stage validate: it may stem from any earlier work of the stream.
[[nodiscard]] inline status read_status(cuda_backend& backend, const workspace_view& workspace,
                                        workspace_limits* need = nullptr) {
    device::pipeline_state state{};
    if (const status s = device::read_start(workspace.memory, state, backend.stream); !s.ok()) return s;
    if ((state.index_error & device::bad_numbers) != 0) return core::failure(status_code::bad_subset);
    if ((state.index_error & device::stopped) != 0) return core::failure(status_code::other_rank_failed);
    if (state.index_error != 0) return core::failure(status_code::index_out_of_range, stage::coarse_raster);
    const device::capacities limits = device::to_capacities(workspace.limits);
    const auto& bricks = state.sparse;
    const bool lacks_bricks = bricks.nodes > workspace.limits.nodes || bricks.bricks > workspace.limits.bricks ||
                              bricks.voxels > workspace.limits.voxels;
    if (device::has_failed(state, limits) || lacks_bricks) {
        status s = core::failure(status_code::capacity_exceeded,
                                 lacks_bricks ? stage::tile_resolve : device::find_overflow(state, limits));
        s.required = {state.tile_pairs, state.list_fragments, 0, bricks.bricks, bricks.voxels};
        if (need != nullptr) {
            const auto larger = [](std::uint64_t a, std::uint64_t b) { return a > b ? a : b; };
            *need = {larger(workspace.limits.tile_pairs, state.tile_pairs),
                     larger(workspace.limits.tile_records, state.tile_records),
                     larger(workspace.limits.fragments, state.list_fragments),
                     larger(workspace.limits.fragment_records, state.fragment_records),
                     workspace.limits.lists_fragments,
                     workspace.limits.orders_long_voxels || state.longest_ordered() != 0,
                     workspace.limits.expects_deferred || !state.deferred.are_none(),
                     workspace.limits.strategy,
                     larger(workspace.limits.bricks, bricks.bricks),
                     larger(workspace.limits.voxels, bricks.voxels),
                     larger(workspace.limits.nodes, bricks.nodes)};
        }
        return s;
    }
    // A call that kept the deferred pass has drawn what blocks left to it, but would better not have let them try.
    if (need != nullptr && !state.deferred.are_none()) need->expects_deferred = true;
    return device::to_status(state);
}

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
VOXELPIPE_BIT_ASYNC_CALLS(extern template)
VOXELPIPE_SUM_ASYNC_CALLS(extern template)
#endif

} // namespace voxelpipe
