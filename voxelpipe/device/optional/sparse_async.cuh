// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async into bricks: a sparse call that never waits and never allocates. Bricks and values lie in the caller's
// workspace, so that a CUDA graph can capture the call and replay it with changed vertices. workspace_limits::bricks,
// voxels and nodes say how many there may be; shaders that are not constant need `fragments` too. If something does not
// fit, the result is empty, and read_status reports what was needed.

#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/device/optional/sparse.cuh>
#include <voxelpipe/device/sparse/bounded_bricks.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe {

// Bricks and values in device memory, as those of a sparse framebuffer whose targets are all cleared. voxelize_async
// sets everything but the clear values: pointers into its workspace, which stay valid as long as that serves the same
// call, and may be read once the stream has passed the call.
template <class... Targets>
struct sparse_result {
    // What voxels start from, and absent ones read as. To be set before the call.
    core::pack<typename Targets::value_type...> clear_values = core::make_pack(Targets::traits::identity()...);

    const sparse_counts* counts = nullptr; // numbers of bricks and voxels
    // For device code. Its table counts as many bricks as there is room for: those behind the last have the key ~0,
    // which no voxel has.
    sparse_view<Targets...> view{};
    grid where; // of the call

    // Copies to the host and waits. Throws std::runtime_error with the CUDA error.
    [[nodiscard]] host_sparse<Targets...> to_host(cuda_backend& backend) const {
        host_sparse<Targets...> h;
        h.where = where;
        h.clear_values = clear_values;
        if (counts == nullptr) return h;
        const auto copy = [&](auto& to, const auto* from, std::uint64_t count) {
            to.resize(count);
            if (count != 0)
                device::check(
                    cudaMemcpyAsync(to.data(), from, count * sizeof(*from), cudaMemcpyDeviceToHost, backend.stream));
        };
        device::with_runtime_errors([&] {
            std::vector<sparse_counts> n;
            copy(n, counts, 1);
            device::check(cudaStreamSynchronize(backend.stream));
            copy(h.keys, view.table.keys, n[0].bricks);
            copy(h.masks, view.table.masks, n[0].bricks);
            copy(h.offsets, view.table.offsets, n[0].bricks == 0 ? 0 : n[0].bricks + 1);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
                copy(get<I>(h.values), get<I>(view.values), map::elements(n[0].voxels));
            });
            device::check(cudaStreamSynchronize(backend.stream));
        });
        return h;
    }
};

namespace device {

[[nodiscard]] inline brick_room to_room(const workspace_limits& l) { return {l.nodes, l.bricks, l.voxels}; }
// Bricks are numbered with 32 bits, and so are the words of their nodes.
[[nodiscard]] inline bool are_numbered_bricks(const workspace_limits& l) {
    return l.bricks <= core::max_numbered - spare_cells && l.nodes < std::uint64_t{1} << 25 &&
           l.fragments <= core::max_numbered && l.voxels < std::uint64_t{1} << 40;
}

// A sparse result in an arena: its bricks, and values for each voxel that there is room for.
template <class... Targets>
struct bounded_result {
    using values_type = core::pack<typename core::rank_map<Targets>::element*...>;
    workspace_limits limits;
    bounded_bricks<> bricks;
    values_type values{};

    bounded_result(const glm::ivec3& whole, const workspace_limits& l, arena& memory)
        : limits(l), bricks(whole, to_room(l), memory) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
            get<I>(values) = memory.take<typename map::element>(map::elements(limits.voxels));
        });
    }
    // When the masks are complete. read_status would take triangles that were left to the deferred pass for missing
    // ones.
    void publish(bool count_voxels, pipeline_state* state, cudaStream_t stream) const {
        bricks.publish(state, to_capacities(limits), count_voxels, stream);
        check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
    }
    void set(sparse_result<Targets...>& result, const grid& g) const {
        result.counts = bricks.counts;
        result.where = g;
        result.view.table = {bricks.keys, bricks.masks, bricks.offsets, limits.bricks, g.extent, g.offset};
        result.view.clear_values = result.clear_values;
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { get<I>(result.view.values) = get<I>(values); });
    }
};

// A result that is made of lists with all outputs of the shader, at most limits.fragments.
template <class Payload, class... Targets>
struct bounded_fold {
    bounded_result<Targets...> made;
    std::uint32_t* listed; // of each voxel, by rank: its number in the lists

    bounded_fold(const glm::ivec3& whole, const workspace_limits& limits, arena& memory)
        : made(whole, limits, memory), listed(memory.take<std::uint32_t>(limits.voxels + spare_ranks)) {}

    // `state`: of the call that made the lists.
    void launch(const abuffer_view<Payload>& lists, const grid& g, bool count_voxels, pipeline_state* state,
                sparse_result<Targets...>& result, cudaStream_t stream) const {
        const workspace_limits& limits = made.limits;
        const bounded_bricks<>& bricks = made.bricks;
        bricks.clear(stream);
        const brick_voxels from{lists.voxels,
                                static_cast<std::uint32_t>(limits.fragments),
                                g.extent,
                                g.offset,
                                g.whole_extent(),
                                {},
                                0,
                                &lists.counts->voxels};
        const auto by_voxels = [&](auto* kernel, const auto&... rest) {
            if (limits.fragments != 0)
                launch_kernel(false, kernel, num_blocks(limits.fragments), threads_per_block, 0, stream,
                              stage::tile_resolve, from, rest...);
        };
        bricks.index.mark_above(
            [&](const index_level& level, int log2_cell) { by_voxels(mark_listed_voxels<0>, level, log2_cell); },
            &state->sparse.nodes, stream);
        by_voxels(mark_listed_voxels<0>, bricks.index.bricks(), 3);
        bricks.index.number_bricks(&state->sparse.bricks, bricks.keys, stream);
        by_voxels(mask_listed_voxels<0>, bricks.index.bricks(), bricks.masks);
        made.publish(count_voxels, state, stream);
        by_voxels(place_listed_voxels<0>, bricks.index.bricks(),
                  brick_arrays{bricks.keys, bricks.masks, bricks.offsets, listed, nullptr});
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            const fold_target<target> fold{
                get<I>(result.clear_values), load_operation::clear, false, nullptr, get<I>(made.values), nullptr};
            const std::uint64_t most = std::min(limits.voxels, limits.fragments);
            if (most != 0)
                launch_kernel(false, fold_voxels<I, target, Payload>, num_blocks(most), threads_per_block, 0, stream,
                              stage::tile_resolve, fold, static_cast<const std::uint64_t*>(&bricks.counts->voxels),
                              static_cast<const std::uint32_t*>(listed), static_cast<const std::uint32_t*>(nullptr),
                              lists.offsets, lists.payloads);
        });
        made.set(result, g);
    }
};

// One sparse call in the caller's memory. Run: launches everything; otherwise only adds up the bytes.
template <class Coverage, bool Run, class Draw, class... Targets>
struct bounded_call;
template <class Coverage, bool Run, class Mesh, class VertexShader, class FragmentShader, class... Targets>
struct bounded_call<Coverage, Run, draw<Mesh, VertexShader, FragmentShader>, Targets...> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;

    std::span<const draw_type> draws;
    const grid& g;
    const voxelize_options& options;
    std::uint64_t triangles;
    workspace_view workspace; // its limits and what may stop the call
    cudaStream_t stream;

    void operator()(arena& memory, sparse_result<Targets...>& result) {
        workspace.limits.expects_deferred = true; // a sparse call keeps the deferred pass
        if constexpr (may_follow_from_masks<FragmentShader, Targets...>)
            if (can_raster_masks(draws, g, options.rule, triangles)) {
                by_masks(memory, result);
                return;
            }
        by_lists(memory, result);
    }

private:
    void by_masks(arena& memory, sparse_result<Targets...>& result) {
        auto* const state = memory.take<pipeline_state>(1);
        brick_raster<draw_type> raster(draws, g, stream, nullptr, memory);
        const bounded_result<Targets...> made(g.whole_extent(), workspace.limits, memory);
        const std::uint64_t num_counts = workspace.limits.voxels + spare_ranks;
        auto* const counts = memory.take<std::uint32_t>((is_blended_once<Targets> && ...) ? 0 : num_counts);
        if constexpr (Run) {
            const bounded_bricks<>& bricks = made.bricks;
            check(cudaMemsetAsync(state, 0, sizeof(pipeline_state), stream));
            take_stop(workspace, state, stream);
            check_subsets(draws, &state->index_error, stream);
            bricks.clear(stream);
            Coverage::dispatch(options.rule, [&]<coverage Rule>() {
                bricks.index.mark_above(
                    [&](const index_level& level, int log2_cell) {
                        raster.template mark<Rule>(level, log2_cell, is_coarse<Rule>(raster, log2_cell));
                    },
                    &state->sparse.nodes, stream);
                raster.template mark<Rule>(bricks.index.bricks(), 3, is_coarse<Rule>(raster, 3));
                bricks.index.number_bricks(&state->sparse.bricks, bricks.keys, stream);
                raster.template set_masks<Rule>(bricks.index.bricks(), bricks.masks, state);
                made.publish(options.count_voxels, state, stream);
                bool are_counted = false;
                const auto counted = [&]() -> const std::uint32_t* {
                    if (are_counted) return counts;
                    are_counted = true;
                    check(cudaMemsetAsync(counts, 0, num_counts * sizeof(std::uint32_t), stream));
                    raster.template count_fragments<Rule>(bricks.index.bricks(), bricks.masks, bricks.offsets, counts);
                    return counts;
                };
                core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                    write_mask_values<I, typename core::pack_element<I, Targets...>::type>(
                        get<I>(made.values), workspace.limits.voxels,
                        reinterpret_cast<const unsigned long long*>(&bricks.counts->voxels), draws[0].fragment_shader,
                        get<I>(result.clear_values), false, counted, stream);
                });
            });
            made.set(result, g);
        }
    }
    // A raster of cells would mark bricks at the border of a grid that is cut there, in which no voxel is.
    template <coverage Rule>
    [[nodiscard]] bool is_coarse(const brick_raster<draw_type>& raster, int log2_cell) const {
        return raster.template is_coarse<Rule>(log2_cell) && g.extent % core::sparse_brick_size == glm::ivec3(0);
    }

    void by_lists(arena& memory, sparse_result<Targets...>& result) {
        using shader = payload_shader<FragmentShader>;
        using payload = typename outputs_payload<core::shader_output<Mesh, VertexShader, FragmentShader>>::type;
        using listed_type = draw<Mesh, VertexShader, shader>;
        std::vector<listed_type> shaded;
        for (const draw_type& d : draws) shaded.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
        auto* const state = reinterpret_cast<pipeline_state*>(memory_of(memory)); // the list's
        abuffer_view<payload> lists;
        list_async<Coverage, Run>(make_list_call<listed_type, payload>(std::span<const listed_type>(shaded), g,
                                                                       options.rule, triangles, workspace.limits),
                                  options.rule, workspace, memory, lists, stream);
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), workspace.limits, memory);
        if constexpr (Run) fold.launch(lists, g, options.count_voxels, state, result, stream);
    }
    [[nodiscard]] static void* memory_of(arena memory) { return memory.take<std::byte>(1); }
};

template <class Draw, class... Targets>
[[nodiscard]] std::size_t bounded_bytes(std::span<const Draw> draws, const grid& g, const voxelize_options& options,
                                        std::uint64_t triangles, const workspace_limits& limits) {
    arena plan;
    sparse_result<Targets...> unused;
    bounded_call<core::known_coverage<>, false, Draw, Targets...>{draws,  g, options, triangles, {nullptr, 0, limits},
                                                                  nullptr}(plan, unused);
    return plan.used();
}

// The workspace of a call without triangles.
struct empty_bricks {
    pipeline_state state;
    sparse_counts counts;
};

// The end of a call that asks for `need` bytes, or for sizeof(empty_bricks) without triangles: what is launched, by
// launch(arena, result) where there are triangles, and the result of that. `made`: a result with its clear values
// alone.
template <class Launch, class... Targets>
[[nodiscard]] status launch_bounded(cuda_backend& backend, const grid& g, const workspace_view& workspace,
                                    std::size_t need, status s, sparse_result<Targets...>& made, const Launch& launch) {
    if (workspace.memory == nullptr || workspace.bytes < need) {
        s.code = status_code::capacity_exceeded;
        s.required.fragments = workspace.limits.fragments;
        s.required.bytes = need;
        return s;
    }
    made.where = g;
    if (s.counts.triangles_in == 0) {
        auto* const empty = static_cast<empty_bricks*>(workspace.memory);
        check(cudaMemsetAsync(empty, 0, sizeof(empty_bricks), backend.stream));
        made.counts = &empty->counts;
        made.view.table.extent = g.extent;
        made.view.table.offset = g.offset;
        made.view.clear_values = made.clear_values;
    } else {
        launch_until(stage::tile_resolve, [&] {
            arena memory(workspace.memory);
            launch(memory, made);
        });
    }
    return s;
}

} // namespace device

// Bytes that voxelize_async needs for such a call on the current device; 0 if the arguments are invalid.
template <class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                          const grid& g, const sparse_result<Targets...>&,
                                          const voxelize_options& options, const workspace_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !device::are_numbered_bricks(limits)) return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::empty_bricks);
    return device::bytes_or_none([&]() -> std::size_t {
        return device::bounded_bytes<draw<Mesh, VertexShader, FragmentShader>, Targets...>(
            draws, g, options, s.counts.triangles_in, limits);
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks and values will be, and returns. A status
// other than ok means that nothing was launched, or that a launch failed; read_status reports what the device finds
// out. size_overflow: limits beyond what is numbered. A coverage may be given between angle brackets, as for voxelize.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] status
voxelize_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
               sparse_result<Targets...>& result, voxelize_options options, const workspace_view& workspace) {
    if constexpr (core::shaders_fit_targets<Mesh, VertexShader, FragmentShader, Targets...>()) {
        using draw_type = draw<Mesh, VertexShader, FragmentShader>;
        core::known_coverage<Known...>::set(options);
        sparse_result<Targets...> made;
        made.clear_values = result.clear_values;
        result = made;
        if (const status s = validate(g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (!device::are_numbered_bricks(workspace.limits)) return core::failure(status_code::size_overflow);
        return device::with_cuda_status([&]() -> status {
            const bool is_empty = s.counts.triangles_in == 0;
            const std::size_t need = is_empty ? sizeof(device::empty_bricks)
                                              : device::bounded_bytes<draw_type, Targets...>(
                                                    draws, g, options, s.counts.triangles_in, workspace.limits);
            const auto launch = [&](device::arena& memory, sparse_result<Targets...>& to) {
                device::bounded_call<core::known_coverage<Known...>, true, draw_type, Targets...>{
                    draws, g, options, s.counts.triangles_in, workspace, backend.stream}(memory, to);
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
