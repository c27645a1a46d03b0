// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shades fragments that were listed without their shader: filter_lists removes discarded ones before the sort,
// shade_lists_kernel computes the payloads after it.

#include <voxelpipe/device/fragments/fragment_lists.cuh>

#include <utility>

namespace voxelpipe::device {

// Fragments in the order in which they were listed.
struct listed_fragments {
    std::uint32_t *voxels, *primitives;
};

// Shades listed fragments and copies those that are not discarded.
template <class Scene>
__global__ __launch_bounds__(threads_per_block, 4) void filter_lists_kernel(const __grid_constant__ Scene s,
                                                                            listed_fragments from, listed_fragments to,
                                                                            pipeline_state* state, capacities limits) {
    constexpr int rounds = 4; // fragments of a lane for one atomic of its warp
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments); // see core::max_numbered
    const std::uint32_t lane = threadIdx.x % 32;
    std::uint32_t discarded = 0;
    for (std::uint64_t start = std::uint64_t{blockIdx.x} * threads_per_block * rounds + warp_in_block() * 32 * rounds;
         start < n; start += std::uint64_t{gridDim.x} * threads_per_block * rounds) {
        unsigned keeps[rounds];
        unsigned num = 0;
        for (int k = 0; k < rounds; ++k) {
            const std::uint64_t i = start + 32 * static_cast<unsigned>(k) + lane;
            bool keep = false;
            if (i < n) {
                const voxel_position at = position_of(from.voxels[i], s.geo.extent);
                keep = shade_small_fragment<false>(s, from.primitives[i], at.x, at.y, at.z).keep;
                discarded += static_cast<std::uint32_t>(!keep);
            }
            __syncwarp();
            keeps[k] = __ballot_sync(0xffffffffu, keep);
            num += static_cast<unsigned>(__popc(keeps[k]));
        }
        unsigned long long first = 0;
        if (lane == 0 && num != 0) first = atomicAdd(&state->kept, static_cast<unsigned long long>(num));
        first = __shfl_sync(0xffffffffu, first, 0);
        for (int k = 0; k < rounds; ++k) {
            const std::uint64_t i = start + 32 * static_cast<unsigned>(k) + lane;
            if ((keeps[k] >> lane & 1u) != 0) {
                const auto at = first + static_cast<unsigned>(__popc(keeps[k] & ((1u << lane) - 1)));
                to.voxels[at] = from.voxels[i];
                to.primitives[at] = from.primitives[i];
            }
            first += static_cast<unsigned>(__popc(keeps[k]));
        }
    }
    const unsigned long long sum = block_sum(discarded);
    if (threadIdx.x == 0 && sum != 0) {
        atomicAdd(&state->filtered, sum);
        atomicAdd(&state->discarded, sum);
    }
}
// Sets the length of the list to what filter_lists_kernel kept.
VOXELPIPE_DECLARES_KERNELS void end_filter(pipeline_state* state, const capacities& limits, cudaStream_t stream);

// Removes fragments that are discarded. The first arrays of `b` hold the list before and after.
template <class Scene, class Payload>
void filter_lists(const Scene& s, list_buffers<std::uint32_t, Payload>& b, pipeline_state* state,
                  const capacities& limits, cudaStream_t stream) {
    const listed_fragments all{b.keys[0], b.values[0]}, kept{b.keys[1], b.values[1]};
    launch_behind(filter_lists_kernel<Scene>, fill_device(limits.fragments), threads_per_block, stream,
                  stage::abuffer_emit, s, all, kept, state, limits);
    end_filter(state, limits, stream);
    std::swap(b.keys[0], b.keys[1]);
    std::swap(b.values[0], b.values[1]);
}

// Shades sorted fragments: payloads[i] becomes fragment i's, if there are payloads; those of lists that are at the
// output pointers are written there instead. Counts discarded ones; if there are any, the lists are not the call's
// result.
template <class MakePayload, class Scene, class Payload>
__global__ __launch_bounds__(threads_per_block, 4) void shade_lists_kernel(
    const __grid_constant__ Scene s, const __grid_constant__ fragment_lists<std::uint32_t, Payload> lists,
    Payload* payloads, pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments); // see core::max_numbered
    const std::uint32_t* const primitives = lists.are_at_output ? lists.pointers->primitives : lists.values;
    if constexpr (!std::is_same_v<Payload, no_payload>)
        if (lists.are_at_output) payloads = static_cast<Payload*>(lists.pointers->payloads);
    std::uint32_t discarded = 0;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * threads_per_block + threadIdx.x; i < n;
         i += std::uint64_t{gridDim.x} * threads_per_block) {
        const voxel_position at = position_of(lists.keys[i], s.geo.extent);
        const auto out = shade_small_fragment<false>(s, primitives[i], at.x, at.y, at.z);
        discarded += static_cast<std::uint32_t>(!out.keep);
        if constexpr (!std::is_same_v<Payload, no_payload>) payloads[i] = MakePayload{}(out);
    }
    count_discarded(discarded, state);
}

} // namespace voxelpipe::device
