// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize into framebuffers and A-buffers on a GPU: cuda_backend::run.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/call/abuffer_call.cuh>
#include <voxelpipe/device/call/kernel_instances.cuh>
#include <voxelpipe/device/call/kernels.cuh>
#include <voxelpipe/device/call/list_arrays.cuh>
#include <voxelpipe/device/scene/subset.cuh>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe {

// Outside the class, and so not inline: a unit that links voxelpipe::cuda_kernels does not compile the calls that the
// library holds (device/call/kernel_instances.cuh).
template <class Selector, class Mesh, class VertexShader, class FragmentShader, class... Targets, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         const framebuffer_view<Targets...>& fb, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    if (const status s = device::check_subsets(draws, *this); !s.ok()) return s;
    // Tiny triangles have few fragments, so the first guess stays within what lists can be sorted.
    return device::attempt(
        history<framebuffer_view<>>(), {triangles_in, g.extent, g.offset, options.rule}, device::max_sorted_fragments,
        times, stream, [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
            device::capacities& limits = guess.limits;
            limits.longest_ordered = ~0ull; // an order may come before a blend
            return device::with_framebuffer_call<Selector>(draws, g, fb, options, triangles_in, limits, [&](auto call) {
                call.clock = clock;
                choose(call, true);
                limits.deferred = call.plan.limits.deferred = call.deferral_for(guess.num_deferred);
                launch_within_memory<Coverage>(call, state);
                return call.lists_fragments() && strategy == voxelpipe::strategy::automatic;
            });
        });
}

template <class Mesh, class VertexShader, class FragmentShader, class Payload, class Coverage>
status cuda_backend::run(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                         abuffer<cuda_backend, Payload>& lists, const voxelize_options& options,
                         std::uint64_t triangles_in, Coverage) {
    using call_type = device::abuffer_call<draw<Mesh, VertexShader, FragmentShader>, payload_storage<Payload>>;
    if (const status wrong = device::check_subsets(draws, *this); !wrong.ok()) return wrong;
    abuffer<cuda_backend, Payload> made(*this); // so that a call that fails leaves `lists` as they were
    status s = device::attempt(
        history<abuffer<cuda_backend, void>>(), {triangles_in, g.extent, g.offset, options.rule}, core::max_numbered,
        times, stream, [&](device::attempt_guess& guess, device::pipeline_state& state, device::stage_clock* clock) {
            device::capacities& limits = guess.limits;
            call_type call{draws, g, static_cast<std::uint32_t>(triangles_in), limits, clock};
            limits.deferred = call.limits.deferred = call.deferral_for(guess.num_deferred);
            call.arms = core::arms_of(options.rule);
            call.has_few_a_voxel = limits.fragments < tuning::min_counted * guess.expected_voxels;
            device::list_filler filler(call, *this, workspace_, use_pinned_memory, use_graphs, made, state);
            if (device::num_voxels(g) >= std::numeric_limits<std::uint32_t>::max()) {
                filler.template fill<Coverage, std::uint64_t>(options.rule, guess.expected_voxels);
                return false;
            }
            call.may_shade_late = true;
            const void* const type = device::tag_of_call<call_type>();
            call.filters = std::find(discarding_.begin(), discarding_.end(), type) != discarding_.end();
            filler.template fill<Coverage, std::uint32_t>(options.rule, guess.expected_voxels);
            if (state.discarded != 0 && call.template shades_late<std::uint32_t>() && !call.filters) {
                discarding_.push_back(type);
                call.filters = true;
                filler.template fill<Coverage, std::uint32_t>(options.rule, guess.expected_voxels);
            }
            return false;
        });
    if (s.ok() && core::has_subset(draws))
        s = guard([&] {
            const std::vector<device::listed_draw> listed = device::listed_draws(draws);
            const buffer<device::listed_draw> in_device(*this, array_view<const device::listed_draw>(listed));
            device::with_runtime_errors([&] {
                device::renumber_lists(in_device.data(), listed.size(), made.primitives.data(), nullptr,
                                       made.primitives.size(), stream);
            });
            return s;
        });
    if (s.ok()) {
        made.extent = g.extent;
        lists = std::move(made);
        s.counts.fragments = lists.num_fragments();
        s.counts.voxels = lists.num_voxels();
    }
    return s;
}

#if defined(VOXELPIPE_LINKS_CUDA_KERNELS)
VOXELPIPE_BIT_CALLS(extern template)
VOXELPIPE_SUM_CALLS(extern template)
VOXELPIPE_LIST_CALLS(extern template)
#endif

} // namespace voxelpipe
