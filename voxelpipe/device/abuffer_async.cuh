// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async into fragment lists: an A-buffer call that never waits and never allocates. The lists and their counts
// lie in the caller's workspace, so a CUDA graph can capture the call and replay it with changed vertices. Capacities
// are fixed beforehand; if the fragments do not fit, the lists are empty, and read_status reports what was needed.

#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/fragments/store_lists.cuh>
#include <voxelpipe/device/scene/subset.cuh>
#include <voxelpipe/device/voxelize_async.cuh>

namespace voxelpipe {

using device::list_counts;

// Lists in device memory, laid out like an abuffer. voxelize_async sets the pointers: they point into its workspace,
// stay valid as long as that serves the same call, and may be read once the stream has passed the call.
template <class Payload = void>
struct abuffer_view {
    using payload_type = payload_storage<Payload>; // the element of `payloads`

    const list_counts* counts = nullptr;       // numbers of voxels and fragments; both 0 if the call failed
    const std::uint64_t* voxels = nullptr;     // occupied voxels, ascending
    const std::uint64_t* offsets = nullptr;    // one more than voxels, if there are any
    const std::uint32_t* primitives = nullptr; // one per fragment
    const payload_type* payloads = nullptr;    // one per fragment; null if Payload is void
    glm::ivec3 extent{0};                      // voxels of the computed part

    // Copies to the host and waits. Throws std::runtime_error with the CUDA error.
    [[nodiscard]] host_abuffer<Payload> to_host(cuda_backend& backend) const {
        host_abuffer<Payload> h;
        h.extent = extent;
        if (counts == nullptr) return h;
        const auto copy = [&](void* to, const void* from, std::size_t bytes) {
            if (bytes != 0) device::check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, backend.stream));
        };
        device::with_runtime_errors([&] {
            list_counts n{};
            copy(&n, counts, sizeof(n));
            device::check(cudaStreamSynchronize(backend.stream));
            h.voxels.resize(n.voxels);
            h.offsets.resize(n.voxels == 0 ? 0 : n.voxels + 1);
            h.primitives.resize(n.fragments);
            h.payloads.resize(std::is_void_v<Payload> ? 0 : n.fragments);
            copy(h.voxels.data(), voxels, h.voxels.size() * sizeof(std::uint64_t));
            copy(h.offsets.data(), offsets, h.offsets.size() * sizeof(std::uint64_t));
            copy(h.primitives.data(), primitives, h.primitives.size() * sizeof(std::uint32_t));
            copy(h.payloads.data(), payloads, h.payloads.size() * sizeof(payload_type));
            device::check(cudaStreamSynchronize(backend.stream));
        });
        return h;
    }
};

namespace device {

// Carves the memory and, with Run, launches every stage and sets the view. Stages write straight to the final arrays if
// they can.
template <coverage Rule, bool Run, class Key, class Payload, class Call>
void list_async(const Call& call, const workspace_view& workspace, arena& memory, abuffer_view<Payload>& lists,
                cudaStream_t stream) {
    arena behind = memory; // behind the memory of the stages
    call.template plan_memory<Key>(behind);
    const std::size_t capacity = call.limits.fragments;
    auto* const counts = behind.take<list_counts>(1);
    auto* const voxels = behind.take<std::uint64_t>(capacity);
    auto* const offsets = behind.take<std::uint64_t>(capacity + 1);
    auto* const primitives = behind.take<std::uint32_t>(capacity);
    auto* const listed = behind.take<listed_draw>(core::has_subset(call.draws) ? call.draws.size() : 0);
    auto* const payloads = std::is_void_v<Payload> ? nullptr : behind.take<payload_storage<Payload>>(capacity);
    if constexpr (Run) {
        arena start = memory;
        auto* const state = start.take<pipeline_state>(1); // first in the call's memory
        zero_memory(state, start.used() - memory.used(), stream);
        take_stop(workspace, state, stream);
        check_subsets(call.draws, &state->index_error, stream);
        output_pointers outputs;
        outputs.value.voxels = voxels;
        outputs.value.offsets = offsets;
        outputs.value.voxel_capacity = capacity;
        outputs.value.primitives = primitives;
        outputs.value.payloads = payloads;
        const auto sorted = call.template launch<Rule, Key>(memory, stream, outputs);
        const unsigned blocks = sorted.are_stored() ? 1 : fill_device(capacity); // 1: only the lengths are missing
        launch_behind(publish_lists_kernel<Key, payload_storage<Payload>>, blocks, threads_per_block, stream,
                      stage::abuffer_emit, sorted, state, call.limits, counts, voxels, offsets, primitives, payloads);
        if (core::has_subset(call.draws)) {
            const std::vector<listed_draw> draws = listed_draws(call.draws);
            upload(
                listed, draws.size(), [&](std::size_t d) { return draws[d]; }, stream);
            renumber_lists(listed, draws.size(), primitives, &counts->fragments, capacity, stream);
        }
        lists = {counts, voxels, offsets, primitives, payloads, call.g.extent};
    }
    memory = behind;
}

template <class Coverage, bool Run, class Payload, class Call>
void list_async(const Call& call, coverage rule, const workspace_view& workspace, arena& memory,
                abuffer_view<Payload>& lists, cudaStream_t stream) {
    const bool small = num_voxels(call.g) < std::numeric_limits<std::uint32_t>::max();
    Coverage::dispatch(rule, [&]<coverage Rule>() {
        small ? list_async<Rule, Run, std::uint32_t>(call, workspace, memory, lists, stream)
              : list_async<Rule, Run, std::uint64_t>(call, workspace, memory, lists, stream);
    });
}

template <class Call, class Payload>
[[nodiscard]] std::size_t list_bytes(const Call& call, coverage rule, abuffer_view<Payload> lists) {
    arena plan;
    list_async<core::known_coverage<>, false>(call, rule, {}, plan, lists, nullptr);
    return plan.used();
}

// The workspace of a call without triangles.
struct empty_lists {
    pipeline_state state;
    list_counts counts;
};

// With lists_fragments, the raster lists one draw of a shader that computes; discarded fragments must fit too. The
// number of voxels is unknown: small triangles are assumed to share them.
template <class Draw, class Payload>
[[nodiscard]] abuffer_call<Draw, payload_storage<Payload>> make_list_call(std::span<const Draw> draws, const grid& g,
                                                                          coverage rule, std::uint64_t triangles,
                                                                          const workspace_limits& limits) {
    return {draws,
            g,
            static_cast<std::uint32_t>(triangles),
            to_capacities(limits),
            nullptr,
            limits.lists_fragments,
            true,
            limits.fragments > 2 * triangles,
            core::arms_of(rule),
            true};
}

} // namespace device

// Bytes that voxelize_async needs for such a call; 0 if the arguments are invalid. Uses limits.fragments,
// fragment_records and lists_fragments only.
template <class Mesh, class VertexShader, class FragmentShader, class Payload>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                          const grid& g, const abuffer_view<Payload>& lists,
                                          const voxelize_options& options, const workspace_limits& limits) {
    const status s = core::validate_draws(draws);
    if (!s.ok() || !validate(g).ok() || limits.fragments > core::max_numbered) return 0;
    if (s.counts.triangles_in == 0) return sizeof(device::empty_lists);
    return device::bytes_or_none([&]() -> std::size_t {
        const auto call = device::make_list_call<draw<Mesh, VertexShader, FragmentShader>, Payload>(
            draws, g, options.rule, s.counts.triangles_in, limits);
        return device::list_bytes(call, options.rule, lists);
    });
}

// Puts the call on the backend's stream, sets `lists` to where its results will be, and returns. A status other than ok
// means that nothing was launched, or that a launch failed; read_status reports what the device finds out. A coverage
// may be given between angle brackets, as for voxelize.
template <coverage... Known, class Mesh, class VertexShader, class FragmentShader, class Payload>
[[nodiscard]] status
voxelize_async(cuda_backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
               abuffer_view<Payload>& lists, voxelize_options options, const workspace_view& workspace) {
    if constexpr (core::shaders_fit_payload<Mesh, VertexShader, FragmentShader, Payload>()) {
        core::known_coverage<Known...>::set(options);
        lists = {};
        if (const status s = validate(g); !s.ok()) return s;
        status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (workspace.limits.fragments > core::max_numbered) return core::failure(status_code::size_overflow);
        return device::with_cuda_status([&]() -> status {
            if (s.counts.triangles_in == 0) {
                if (workspace.memory == nullptr || workspace.bytes < sizeof(device::empty_lists)) {
                    s.code = status_code::capacity_exceeded;
                    s.required.bytes = sizeof(device::empty_lists);
                    return s;
                }
                auto* const empty = static_cast<device::empty_lists*>(workspace.memory);
                device::check(cudaMemsetAsync(empty, 0, sizeof(device::empty_lists), backend.stream));
                lists.counts = &empty->counts;
                lists.extent = g.extent;
                return s;
            }
            const auto call = device::make_list_call<draw<Mesh, VertexShader, FragmentShader>, Payload>(
                draws, g, options.rule, s.counts.triangles_in, workspace.limits);
            const std::size_t need = device::list_bytes(call, options.rule, lists);
            if (workspace.memory == nullptr || workspace.bytes < need) {
                s.code = status_code::capacity_exceeded;
                s.required = {0, workspace.limits.fragments, need};
                return s;
            }
            device::launch_until(stage::abuffer_emit, [&] {
                device::arena memory(workspace.memory);
                device::list_async<core::known_coverage<Known...>, true>(call, options.rule, workspace, memory, lists,
                                                                         backend.stream);
            });
            return s;
        });
    } else {
        return {};
    }
}

} // namespace voxelpipe
