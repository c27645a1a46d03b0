// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sparse framebuffers on a GPU: run_module of core::sparse_tag, with the bytes of cpu_backend. Its kernels are compiled
// by programs that call it, and by no other. Constant shaders go by masks (brick_masks.cuh). Fragments of others are
// listed with all their outputs; the listed voxels become bricks and ranks, and a thread a voxel folds its fragments:
// beside the result, memory is in proportion to the fragments, at most 2^32 - 2 voxels.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/surface_calls.cuh>
#include <voxelpipe/sparse/device/brick_build.cuh>
#include <voxelpipe/sparse/device/brick_masks.cuh>
#include <voxelpipe/sparse/device/voxel_fold.cuh>
#include <voxelpipe/sparse/passes/kept_tiles.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace device {

template <int = 0> // compiled where it is called
__global__ void fill_slots(const brick_table table, std::uint32_t* slots, int log2_slots) {
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= table.count) return;
    const std::uint64_t last = (std::uint64_t{1} << log2_slots) - 1;
    std::uint64_t at = brick_lookup::first_slot(table.keys[i], log2_slots);
    while (atomicCAS(slots + at, brick_lookup::free_slot, static_cast<std::uint32_t>(i)) != brick_lookup::free_slot)
        at = (at + 1) & last;
}

// The lists become the framebuffer's contents. Throws cuda_failure, std::bad_alloc or std::runtime_error.
template <class Payload, class... Targets>
[[nodiscard]] status take_lists(cuda_backend& backend, const grid& g, const abuffer<cuda_backend, Payload>& lists,
                                sparse_framebuffer<cuda_backend, Targets...>& fb) {
    using contents = sparse_contents<cuda_backend, Targets...>;
    const bool keeps = core::keeps_voxels(fb);
    const contents& before = fb.contents();
    const std::uint64_t kept = keeps ? before.num_voxels : 0;
    if (lists.num_voxels() + kept + fb.num_tiles() > core::max_numbered ||
        (keeps && fb.num_bricks() > core::max_numbered / 8))
        return core::failure(status_code::size_overflow);
    brick_table table;
    if (keeps) table = before.table(g.extent, g.offset);
    contents made(backend);
    core::kept_tiles<cuda_backend> tiles(backend);
    device_buffer<std::uint32_t> listed(backend, std::size_t{0}), existing(backend, std::size_t{0});
    status limited;
    struct beyond_limits {};
    const auto arrays = [&]() -> brick_arrays {
        return {made.keys.data(), made.masks.data(), made.offsets.data(), listed.data(),
                keeps ? existing.data() : nullptr};
    };
    const auto allocate_bricks = [&](std::uint64_t bricks) {
        made.keys = device_buffer<std::uint64_t>(backend, bricks);
        made.masks = device_buffer<brick_mask>(backend, bricks);
        made.offsets = device_buffer<std::uint64_t>(backend, bricks == 0 ? 0 : bricks + 1);
        return arrays();
    };
    const auto allocate_voxels = [&](std::uint64_t bricks, std::uint64_t voxels) {
        if (table.num_tiles != 0) tiles = core::keep_tiles(backend, before.tiles, made.keys.data(), bricks);
        if (bricks + tiles.size() > fb.limits().bricks || voxels + tiles.size() > fb.limits().voxels) {
            limited = core::failure(status_code::capacity_exceeded, stage::tile_resolve);
            limited.required.bricks = bricks + tiles.size();
            limited.required.voxels = voxels + tiles.size();
            throw beyond_limits{};
        }
        made.num_voxels = voxels;
        listed = device_buffer<std::uint32_t>(backend, voxels);
        existing = device_buffer<std::uint32_t>(backend, keeps ? voxels : 0);
        return arrays();
    };
    try {
        build_bricks(backend,
                     {lists.voxels.data(), static_cast<std::uint32_t>(lists.num_voxels()), g.extent, g.offset,
                      g.whole_extent(), table},
                     allocate_bricks, allocate_voxels);
    } catch (const beyond_limits&) {
        return limited;
    }
    const auto background = fb.next_background();
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename core::pack_element<I, Targets...>::type;
        using map = core::rank_map<target>;
        const auto& t = get<I>(fb.targets());
        const std::uint64_t num_values = made.num_voxels + tiles.size();
        if (!t.enabled || num_values == 0) return;
        auto& values = get<I>(made.values);
        values = device_buffer<typename map::element>(backend, map::elements(num_values));
        if constexpr (map::is_bit)
            if (tiles.size() != 0) // no kernel writes words of tiles as a whole
                check(cudaMemsetAsync(values.data(), 0, values.size() * sizeof(std::uint32_t), backend.stream));
        if (t.keeps_sums) get<I>(made.sums) = device_buffer<core::kept_sum<target>>(backend, num_values);
        if (made.num_voxels == 0) return;
        const fold_target<target> fold{get<I>(background),           t.load,        t.keeps_sums,
                                       get<I>(before.values).data(), values.data(), get<I>(made.sums).data()};
        launch_kernel(false, fold_voxels<I, target, Payload>, num_blocks(made.num_voxels), threads_per_block, 0,
                      backend.stream, stage::tile_resolve, fold,
                      static_cast<const std::uint64_t*>(made.offsets.data() + made.keys.size()),
                      static_cast<const std::uint32_t*>(listed.data()),
                      static_cast<const std::uint32_t*>(keeps ? existing.data() : nullptr), lists.offsets.data(),
                      lists.payloads.data());
    });
    core::store_kept_tiles(backend, fb, tiles, made);
    check(cudaStreamSynchronize(backend.stream), stage::tile_resolve);
    fb.take(std::move(made), g);
    return {};
}

// The status of work(), or what that throws as a status.
template <class Work>
[[nodiscard]] status with_status(std::uint64_t triangles_in, const Work& work) {
    status s;
    try {
        s = work();
    } catch (const cuda_failure& e) {
        s = to_status(e);
    } catch (const std::bad_alloc&) {
        s = core::failure(status_code::out_of_memory, stage::tile_resolve);
    } catch (const std::runtime_error&) { // of a buffer
        s = core::failure(status_code::device_error, stage::tile_resolve);
    }
    s.counts.triangles_in = triangles_in;
    return s;
}

// A call that follows_from_masks.
template <class Coverage, class Draw, class... Targets>
[[nodiscard]] status run_masks(cuda_backend& backend, std::span<const Draw> draws, const grid& g,
                               sparse_framebuffer<cuda_backend, Targets...>& fb, const voxelize_options& options,
                               std::uint64_t triangles_in) {
    return with_status(triangles_in, [&] {
        std::optional<stage_clock> clock;
        if (backend.times != nullptr) clock.emplace(backend.stream);
        mask_call<Draw, cuda_backend, Targets...> call(backend, draws, g, clock ? &*clock : nullptr);
        const status s = Coverage::dispatch(options.rule, [&]<coverage Rule>() {
            return call.template run<Rule>(fb, options.count_voxels, triangles_in);
        });
        if (clock) clock->read(*backend.times);
        return s;
    });
}

// take_lists, with what it throws as a status.
template <class Payload, class... Targets>
[[nodiscard]] status finish_sparse(cuda_backend& backend, const grid& g, const abuffer<cuda_backend, Payload>& lists,
                                   sparse_framebuffer<cuda_backend, Targets...>& fb, const status& drawn) {
    const status s = with_status(drawn.counts.triangles_in, [&] { return take_lists(backend, g, lists, fb); });
    return s.ok() ? drawn : s;
}

} // namespace device

namespace core {

// Implements voxelize of a sparse framebuffer. Arguments are validated.
template <class Mesh, class VertexShader, class FragmentShader, class... Targets, class Coverage>
status run_module(sparse_tag, cuda_backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                  const grid& g, sparse_framebuffer<cuda_backend, Targets...>& fb, const voxelize_options& options,
                  std::uint64_t triangles_in, Coverage) {
    if constexpr (device::may_follow_from_masks<FragmentShader, Targets...>)
        if (device::follows_from_masks(draws, g, options.rule, triangles_in, fb)) {
            if (const status s = device::check_subsets(draws, backend); !s.ok()) return s;
            return device::run_masks<Coverage>(backend, draws, g, fb, options, triangles_in);
        }
    using shader = device::payload_shader<FragmentShader>;
    using payload = typename device::outputs_payload<shader_output<Mesh, VertexShader, FragmentShader>>::type;
    std::vector<draw<Mesh, VertexShader, shader>> listed;
    for (const auto& d : draws) listed.push_back({d.mesh, d.vertex_shader, {d.fragment_shader}});
    abuffer<cuda_backend, payload> lists(backend);
    const status s = backend.run(std::span<const draw<Mesh, VertexShader, shader>>(listed), g, lists, options,
                                 triangles_in, Coverage{});
    if (!s.ok()) return s;
    status done = device::finish_sparse(backend, g, lists, fb, s);
    if (!options.count_voxels) done.counts.voxels = 0;
    return done;
}

// Fills the slots of a brick_slots; table and slots are in device memory. Throws std::runtime_error with the CUDA
// error.
template <int = 0> // its kernel is compiled where it is called
void run_module(brick_slots_tag, cuda_backend& backend, const brick_table& table, std::uint32_t* slots,
                int log2_slots) {
    device::with_runtime_errors([&] {
        device::check(cudaMemsetAsync(slots, 0xff, sizeof(std::uint32_t) << log2_slots, backend.stream));
        if (table.count != 0)
            device::launch_kernel(false, device::fill_slots<0>, device::num_blocks(table.count),
                                  device::threads_per_block, 0, backend.stream, stage::tile_resolve, table, slots,
                                  log2_slots);
    });
}

// Implements voxelize of nothing into a sparse framebuffer.
template <class... Targets>
status run_module(clear_sparse_tag, cuda_backend& backend, const grid& g,
                  sparse_framebuffer<cuda_backend, Targets...>& fb) {
    const abuffer<cuda_backend, pack<typename Targets::value_type...>> none(backend);
    return device::finish_sparse(backend, g, none, fb, status{});
}

// Lists with all outputs become the contents of a sparse framebuffer. `drawn` has the counts of the call.
template <class Payload, class... Targets>
status run_module(store_sparse_tag, cuda_backend& backend, const grid& g, const abuffer<cuda_backend, Payload>& lists,
                  sparse_framebuffer<cuda_backend, Targets...>& fb, const status& drawn) {
    return device::finish_sparse(backend, g, lists, fb, drawn);
}

} // namespace core

} // namespace voxelpipe
