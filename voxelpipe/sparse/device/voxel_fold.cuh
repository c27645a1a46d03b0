// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Values of the voxels of a sparse framebuffer: a thread a voxel folds its fragments in the order of their primitives,
// which is the meaning of every blend; a block shares a voxel of very many. The fragments' outputs come from an
// A-buffer whose payload is all of them.

#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/sparse/device/brick_build.cuh>
#include <voxelpipe/sparse/passes/all_outputs.hpp>
#include <voxelpipe/sparse/sparse.hpp>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe::device {

using core::outputs_payload;
using core::payload_shader;

// One target of a call, in device memory.
template <class Target>
struct fold_target {
    using map = core::rank_map<Target>;
    typename Target::value_type background; // where a voxel starts that did not exist
    load_operation load;
    bool keeps_sums;
    const typename map::element* before; // values by earlier rank
    typename map::element* values;
    core::kept_sum<Target>* sums;
};

// How the parts of a voxel's fragments are joined, where their order does not matter. A part begins with the identity.
template <class Target>
VOXELPIPE_HD void merge_parts(typename Target::traits::accumulator& a,
                              const typename Target::traits::accumulator& part) {
    using blend_type = typename Target::blend_type;
    using value_type = typename Target::value_type;
    if constexpr (core::has_wide_sums<Target>)
        core::add_sums(a, part);
    else if constexpr (std::is_same_v<blend_type, blend::count>)
        core::blend_traits<blend::add, value_type>::apply(a, part);
    else
        Target::traits::apply(a, part);
}

// A voxel of very many fragments, which its block shares.
struct long_voxel {
    std::uint64_t first, last;
    unsigned thread; // that has the voxel
};

// The type that threads which share a voxel pass on: sums, or values if the order matters. Not used if it does not fit.
template <std::size_t I, class Target, class Payload>
using fold_part = std::conditional_t<Target::traits::order_free, typename Target::traits::accumulator,
                                     std::remove_cvref_t<decltype(get<I>(std::declval<const Payload&>()))>>;
static_assert(tuning::max_folded_alone >= threads_per_block);
template <class Part>
inline constexpr bool can_share = alignof(Part) <= 16 && sizeof(Part) <= tuning::fold_bytes;

// Applies the fragments of a long voxel to the sum of the thread that has it, and returns the thread's sum. The block's
// threads fold a part each; if the order matters, the fold is serial, and they fetch for that thread. All threads of
// the block call it; `memory` is unused before and after. Out of line and by value, so that the kernel's bound on
// registers costs this alone: folds of short voxels wait for memory, and need many warps.
template <std::size_t I, class Target, class Payload>
__device__ __noinline__ typename Target::traits::accumulator fold_together(const long_voxel v, const Payload* payloads,
                                                                           unsigned char* memory,
                                                                           typename Target::traits::accumulator sum) {
    using traits = typename Target::traits;
    using part_type = fold_part<I, Target, Payload>;
    constexpr unsigned fits = tuning::fold_bytes / sizeof(part_type);
    constexpr unsigned most = fits < threads_per_block ? fits : threads_per_block;
    auto* const parts = reinterpret_cast<part_type*>(memory);
    const unsigned mine = threadIdx.x;
    if constexpr (traits::order_free) {
        if (mine < most) {
            // There are more fragments than threads. A user's blend begins with the first of them: nothing says that
            // its identity changes no value.
            using value_type = typename Target::value_type;
            using blend_type = typename Target::blend_type;
            constexpr bool is_users =
                core::user_blend<blend_type, value_type> || core::user_blend_template<blend_type, value_type>;
            auto part = traits::begin(traits::identity());
            std::uint64_t f = v.first + mine;
            if constexpr (is_users) {
                part = get<I>(payloads[f]);
                f += most;
            }
            for (; f < v.last; f += most) traits::apply(part, get<I>(payloads[f]));
            parts[mine] = part;
        }
        __syncthreads();
        for (unsigned n = most; n > 1;) { // the upper parts join the lower ones
            const unsigned half = (n + 1) / 2;
            if (mine + half < n) merge_parts<Target>(parts[mine], parts[mine + half]);
            __syncthreads();
            n = half;
        }
        if (mine == v.thread) merge_parts<Target>(sum, parts[0]);
        __syncthreads();
    } else {
        for (std::uint64_t from = v.first; from < v.last; from += most) {
            const unsigned n = v.last - from < most ? static_cast<unsigned>(v.last - from) : most;
            if (mine < n) parts[mine] = get<I>(payloads[from + mine]);
            __syncthreads();
            if (mine == v.thread)
                for (unsigned i = 0; i < n; ++i) traits::apply(sum, parts[i]);
            __syncthreads();
        }
    }
    return sum;
}

// num_voxels, on the device: how many there are. existing: null if no voxel existed. Of the fragments of a target whose
// last one wins, that one alone is applied.
template <std::size_t I, class Target, class Payload>
__global__ __launch_bounds__(threads_per_block,
                             6) void fold_voxels(const fold_target<Target> t, const std::uint64_t* num_voxels,
                                                 const std::uint32_t* listed, const std::uint32_t* existing,
                                                 const std::uint64_t* first, const Payload* payloads) {
    using map = core::rank_map<Target>;
    using traits = typename Target::traits;
    __shared__ __align__(16) unsigned char memory[tuning::fold_bytes];
    __shared__ long_voxel long_voxels[threads_per_block];
    __shared__ unsigned num_long;
    constexpr bool last_wins = std::is_same_v<typename Target::blend_type, blend::replace>;
    const std::uint64_t rank = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const bool in = rank < *num_voxels;
    std::uint32_t from = no_source, old = no_source;
    std::uint64_t begin = 0, end = 0;
    if (in) {
        from = listed[rank];
        if (existing != nullptr) old = existing[rank];
        if (t.load != load_operation::off && from != no_source) {
            begin = first[from];
            end = first[from + 1];
            if constexpr (last_wins) begin = end - 1;
        }
    }
    if (threadIdx.x == 0) num_long = 0;
    __syncthreads();
    constexpr bool shares = can_share<fold_part<I, Target, Payload>>;
    const bool is_long = shares && end - begin > tuning::max_folded_alone;
    if (is_long) long_voxels[atomicAdd(&num_long, 1u)] = {begin, end, threadIdx.x};
    __syncthreads();
    const bool loaded = old != no_source && t.load != load_operation::clear;
    typename Target::value_type value = t.background;
    if (loaded) value = map::load(t.before, old);
    // Sums that are kept begin without the clear value, which is added at the end.
    auto sum = traits::begin(t.keeps_sums && !loaded ? traits::identity() : value);
    if (!is_long)
        for (std::uint64_t f = begin; f < end; ++f) traits::apply(sum, get<I>(payloads[f]));
    const unsigned n = num_long;
    if constexpr (shares)
        for (unsigned k = 0; k < n; ++k) sum = fold_together<I, Target>(long_voxels[k], payloads, memory, sum);
    if (in && (t.load != load_operation::off || t.keeps_sums)) {
        if constexpr (core::has_wide_sums<Target>) {
            if (t.keeps_sums) {
                t.sums[rank] = sum;
                if (!loaded) core::add_sums(sum, traits::begin(t.background));
            }
        }
        if (t.keeps_sums || from != no_source) value = traits::end(sum);
    }
    if constexpr (map::is_bit) { // a word has the bits of a warp
        const unsigned word = __ballot_sync(0xffffffffu, in && value);
        if (in && rank % 32 == 0) t.values[rank / 32] = word;
    } else {
        if (in) map::store(t.values, rank, value);
    }
}

} // namespace voxelpipe::device
