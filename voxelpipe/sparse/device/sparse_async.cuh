// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async into bricks: a sparse call that never waits and never allocates. Bricks and values lie in the caller's
// workspace, so that a CUDA graph can capture the call and replay it with changed vertices. workspace_limits::bricks,
// voxels and nodes say how many there may be, tiles among them as bricks and as voxels. Shaders that are not constant
// need `fragments` too, and so does every call that keeps sums (sparse_result::keep_sums) or goes on from what an
// earlier one left (sparse_result::start). If something does not fit, the result is empty, and read_status reports what
// was needed. What an earlier call left is only read.

#include <voxelpipe/sparse/device/bounded_fold.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe {
namespace device {

// One sparse call in the caller's memory.
template <class Coverage, class Draw, class... Targets>
struct bounded_call;
template <class Coverage, class Mesh, class VertexShader, class FragmentShader, class... Targets>
struct bounded_call<Coverage, draw<Mesh, VertexShader, FragmentShader>, Targets...> {
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;
    using payload = typename outputs_payload<core::shader_output<Mesh, VertexShader, FragmentShader>>::type;

    std::span<const draw_type> draws;
    const grid& g;
    const voxelize_options& options;
    std::uint64_t triangles;
    workspace_view workspace; // its limits and what may stop the call
    cudaStream_t stream;

    // Run: launches everything; otherwise only adds up the bytes. False if the result cannot be numbered.
    template <bool Run>
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        if (!are_numbered_bricks(workspace.limits, result)) return false;
        if (triangles == 0) {
            keep_bricks<payload, Run>(memory, g, options.count_voxels, workspace, result, stream);
            return true;
        }
        bounded_call all = *this;
        all.workspace.limits.expects_deferred = true; // a sparse call keeps the deferred pass
        if constexpr (may_follow_from_masks<FragmentShader, Targets...>)
            if (!result.keeps_voxels() && !result.keeps_any_sums() &&
                can_raster_masks(draws, g, options.rule, triangles)) {
                all.template by_masks<Run>(memory, result);
                return true;
            }
        all.template by_lists<Run>(memory, result);
        return true;
    }

private:
    template <bool Run>
    void by_masks(arena& memory, sparse_result<Targets...>& result) const {
        auto* const state = memory.take<pipeline_state>(1);
        brick_raster<draw_type> raster(draws, g, stream, nullptr, memory);
        raster.take_lists(memory, true);
        const bounded_result<bounded_bricks<>, Targets...> made({g.whole_extent(), to_room(workspace.limits), memory},
                                                                workspace.limits, result, memory);
        const std::uint64_t num_counts = workspace.limits.voxels + spare_ranks;
        auto* const counts = memory.take<std::uint32_t>((is_blended_once<Targets> && ...) ? 0 : num_counts);
        if constexpr (Run) {
            const bounded_bricks<>& bricks = made.bricks;
            check(cudaMemsetAsync(state, 0, sizeof(pipeline_state), stream));
            take_stop(workspace, state, stream);
            check_subsets(draws, &state->index_error, stream);
            bricks.clear(stream);
            Coverage::dispatch(options.rule, [&]<coverage Rule>() {
                constexpr bool is_coarse = brick_raster<draw_type>::template has_coarse<Rule>;
                bricks.index.mark_above([&](const index_level& level,
                                            int log2_cell) { raster.template mark<Rule>(level, log2_cell, is_coarse); },
                                        &state->sparse.nodes, stream);
                raster.template mark<Rule>(bricks.index.bricks(), index_level::log2_brick,
                                           is_coarse && has_whole_bricks());
                bricks.number(stream);
                raster.template set_masks<Rule>(bricks.index.bricks(), bricks.masks, state);
                made.publish(state, nullptr, options.count_voxels ? &bricks.totals->voxels : nullptr, stream);
                bool are_counted = false;
                const auto counted = [&]() -> const std::uint32_t* {
                    if (are_counted) return counts;
                    are_counted = true;
                    check(cudaMemsetAsync(counts, 0, num_counts * sizeof(std::uint32_t), stream));
                    raster.template count_fragments<Rule>(bricks.index.bricks(), bricks.masks, bricks.offsets, counts);
                    return counts;
                };
                const auto background = result.next_background();
                core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                    write_mask_values<I, typename core::pack_element<I, Targets...>::type>(
                        get<I>(made.values), workspace.limits.voxels,
                        reinterpret_cast<const unsigned long long*>(&bricks.counts->voxels), draws[0].fragment_shader,
                        get<I>(background), result.loads[I] == load_operation::off, counted, stream);
                });
            });
            made.set(result, g, nullptr, 0);
        }
    }
    // A raster of bricks may mark those that the border of the grid's part cuts without a voxel in it; nothing drops
    // them here.
    [[nodiscard]] bool has_whole_bricks() const {
        return g.offset % core::sparse_brick_size == glm::ivec3(0) &&
               g.extent % core::sparse_brick_size == glm::ivec3(0);
    }

    template <bool Run>
    void by_lists(arena& memory, sparse_result<Targets...>& result) const {
        using shader = payload_shader<FragmentShader>;
        using listed_type = draw<Mesh, VertexShader, shader>;
        std::vector<listed_type> shaded;
        for (const draw_type& d : draws) shaded.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
        auto* const state = reinterpret_cast<pipeline_state*>(memory_of(memory)); // the list's
        abuffer_view<payload> lists;
        auto call = make_list_call<listed_type, payload>(std::span<const listed_type>(shaded), g, options.rule,
                                                         triangles, workspace.limits);
        // A constant discards nothing, so lists need no more room if they are shaded late.
        if constexpr (core::is_constant<FragmentShader>) {
            call.may_shade_late = true;
            call.filters = false;
        }
        list_async<Coverage, Run>(call, options.rule, workspace, memory, lists, stream);
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), workspace.limits, result, memory);
        if constexpr (Run) fold.launch(lists, g, options.count_voxels, state, result, stream);
    }
    [[nodiscard]] static void* memory_of(arena memory) { return memory.take<std::byte>(1); }
};

// Bytes that a call into bricks needs, 0 if it cannot be numbered. call.template operator()<Run>(arena, result) takes
// its memory, launches it if Run is true, and returns false if it cannot be numbered.
template <class Call, class... Targets>
[[nodiscard]] std::size_t bounded_bytes(const sparse_result<Targets...>& result, const Call& call) {
    arena plan;
    sparse_result<Targets...> unused = result;
    return call.template operator()<false>(plan, unused) ? plan.used() : 0;
}
// The end of a call into bricks: launches it, and sets `result` to what it makes. s: of the draws.
template <class Call, class... Targets>
[[nodiscard]] status launch_bounded(const workspace_view& workspace, status s, sparse_result<Targets...>& result,
                                    const Call& call) {
    return with_cuda_status([&]() -> status {
        const std::size_t need = bounded_bytes(result, call);
        if (need == 0) return core::failure(status_code::size_overflow);
        if (workspace.memory == nullptr || workspace.bytes < need) {
            s.code = status_code::capacity_exceeded;
            s.required.fragments = workspace.limits.fragments;
            s.required.bytes = need;
            return s;
        }
        sparse_result<Targets...> made = result;
        launch_until(stage::tile_resolve, [&] {
            arena memory(workspace.memory);
            (void)call.template operator()<true>(memory, made);
        });
        result = made;
        return s;
    });
}
// A result before the call: what the caller has set.
template <class... Targets>
void forget_made(sparse_result<Targets...>& result) {
    result.counts = nullptr;
    result.view = {};
    result.sums = {};
    result.where = {};
    result.is_tiled = false;
}

} // namespace device

// Bytes that voxelize_async needs for such a call on the current device; 0 if the arguments are invalid.
template <class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                          const grid& g, const sparse_result<Targets...>& result,
                                          const voxelize_options& options, const workspace_limits& limits) {
    using call_type =
        device::bounded_call<core::known_coverage<>, draw<Mesh, VertexShader, FragmentShader>, Targets...>;
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || !core::validate_start(result, g).ok()) return 0;
    return device::bytes_or_none([&] {
        return device::bounded_bytes(
            result, call_type{draws, g, options, s.counts.triangles_in, {nullptr, 0, limits}, nullptr});
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks and values will be, and returns. A status
// other than ok means that nothing was launched, or that a launch failed; read_status reports what the device finds
// out. extent_mismatch: result.start is of another grid. null_view: it has no values of a target that is not cleared.
// size_overflow: limits beyond what is numbered. A coverage may be given between angle brackets, as for voxelize.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class... Targets>
[[nodiscard]] status
voxelize_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
               sparse_result<Targets...>& result, voxelize_options options, const workspace_view& workspace) {
    if constexpr (core::shaders_fit_targets<Mesh, VertexShader, FragmentShader, Targets...>()) {
        using call_type =
            device::bounded_call<core::known_coverage<Known...>, draw<Mesh, VertexShader, FragmentShader>, Targets...>;
        core::known_coverage<Known...>::set(options);
        device::forget_made(result);
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate_start(result, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        return device::launch_bounded(workspace, s, result,
                                      call_type{draws, g, options, s.counts.triangles_in, workspace, backend.stream});
    } else {
        return {};
    }
}

} // namespace voxelpipe
