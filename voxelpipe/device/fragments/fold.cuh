// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Targets that no atomic can serve (order-dependent user-defined blends, large order-free ones): their fragments are
// listed with all shader outputs and ordered by (voxel, primitive), and each voxel is folded in triangle order, as
// core/blend defines every blend. A thread takes a voxel. A block shares a voxel of very many fragments: if the blend
// is order-free, each thread folds a part; otherwise the fold is serial by definition, and the block only fetches for
// one thread.

#include <voxelpipe/device/fragments/fragment_lists.cuh>
#include <voxelpipe/device/targets/target_traits.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <utility>

namespace voxelpipe::device {

struct voxel_fragments {
    std::uint64_t first = 0, last = 0;
    int x = 0, y = 0, z = 0;
    [[nodiscard]] VOXELPIPE_HD bool is_long() const { return last - first > tuning::max_folded_alone; }
};

// Voxel number v of the lists.
template <class Key, class Values>
[[nodiscard]] __device__ voxel_fragments find_fragments(const fragment_lists<Key, Values>& lists, std::uint64_t v,
                                                        const pipeline_state& state, const glm::ivec3& extent) {
    const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
    voxel_fragments f;
    f.first = lists.first_of_voxel[v];
    f.last = v + 1 < state.list_voxels ? lists.first_of_voxel[v + 1] : state.list_fragments;
    const std::uint64_t id = lists.keys[f.first];
    f.x = static_cast<int>(id % nx);
    f.y = static_cast<int>(id / nx % ny);
    f.z = static_cast<int>(id / nx / ny);
    return f;
}

// The fold of target K.
template <std::size_t K, class Key, class Values, class Framebuffer>
struct target_fold {
    using target = typename targets_of<Framebuffer>::template at<K>;
    using traits = typename target::traits;
    using blend_type = typename target::blend_type;
    using value = std::remove_cvref_t<decltype(voxelpipe::get<K>(std::declval<const Values&>()))>;
    static constexpr bool any_order =
        traits::order_free && (core::user_blend<blend_type, value> || core::user_blend_template<blend_type, value>);
    // Values that fit the block's memory at once; 0 if a voxel is always one thread's.
    static constexpr unsigned max_staged = alignof(value) > 16 ? 0
                                                               : (tuning::fold_bytes / sizeof(value) < threads_per_block
                                                                      ? tuning::fold_bytes / sizeof(value)
                                                                      : threads_per_block);

    const fragment_lists<Key, Values>& lists;
    const target_view<target>& view;

    [[nodiscard]] __device__ const value& get(std::uint64_t i) const { return voxelpipe::get<K>(lists.payload_of(i)); }
    __device__ void store(const voxel_fragments& f, const typename traits::accumulator& a) const {
        if constexpr (target::map::is_bit)
            store_bit(view, f.x, f.y, f.z, traits::end(a));
        else
            view.store(f.x, f.y, f.z, traits::end(a));
    }
    // One thread calls it.
    __device__ void alone(const voxel_fragments& f) const {
        auto a = traits::begin(view(f.x, f.y, f.z));
        for (std::uint64_t i = f.first; i < f.last; ++i) traits::apply(a, get(i));
        store(f, a);
    }
    // All threads of the block call it; `memory` is unused before and after.
    __device__ void together(const voxel_fragments& f, unsigned char* memory) const {
        value* const values = reinterpret_cast<value*>(memory);
        const unsigned mine = threadIdx.x;
        auto a = traits::begin(view(f.x, f.y, f.z));
        if constexpr (any_order) {
            // Each thread folds a part; then half of the parts are folded onto the other half.
            if (mine < max_staged && f.first + mine < f.last) {
                value part = get(f.first + mine);
                for (std::uint64_t i = f.first + mine + max_staged; i < f.last; i += max_staged)
                    traits::apply(part, get(i));
                values[mine] = part;
            }
            __syncthreads();
            for (unsigned n = f.last - f.first < max_staged ? static_cast<unsigned>(f.last - f.first) : max_staged;
                 n > 1;) {
                const unsigned half = (n + 1) / 2;
                if (mine + half < n) traits::apply(values[mine], values[mine + half]);
                __syncthreads();
                n = half;
            }
            if (mine == 0) traits::apply(a, values[0]);
        } else {
            for (std::uint64_t first = f.first; first < f.last; first += max_staged) {
                const unsigned n = f.last - first < max_staged ? static_cast<unsigned>(f.last - first) : max_staged;
                if (mine < n) values[mine] = get(first + mine);
                __syncthreads();
                if (mine == 0)
                    for (unsigned i = 0; i < n; ++i) traits::apply(a, values[i]);
                __syncthreads();
            }
        }
        if (mine == 0) store(f, a);
        __syncthreads();
    }
};

template <class Key, class Values, class Framebuffer, std::size_t... I>
__global__ void fold_kernel(const __grid_constant__ fragment_lists<Key, Values> lists,
                            const __grid_constant__ Framebuffer fb, pipeline_state* state, capacities limits,
                            bool count_voxels) {
    __shared__ __align__(16) unsigned char memory[tuning::fold_bytes];
    __shared__ unsigned num_long, long_voxels[threads_per_block];
    if (has_failed(*state, limits)) return;
    const std::uint64_t num_voxels = state->list_voxels;
    if (blockIdx.x == 0 && threadIdx.x == 0) {
        state->fragments = state->list_fragments;
        if (count_voxels) state->voxels = num_voxels;
    }
    for (std::uint64_t start = std::uint64_t{blockIdx.x} * blockDim.x; start < num_voxels;
         start += std::uint64_t{gridDim.x} * blockDim.x) {
        const bool valid = start + threadIdx.x < num_voxels;
        voxel_fragments mine;
        if (valid) mine = find_fragments(lists, start + threadIdx.x, *state, fb.extent);
        if (threadIdx.x == 0) num_long = 0;
        __syncthreads();
        if (mine.is_long()) long_voxels[atomicAdd(&num_long, 1u)] = threadIdx.x;
        __syncthreads();
        const unsigned n = num_long;
        const auto fold = [&]<std::size_t K>() {
            using fold_type = target_fold<K, Key, Values, Framebuffer>;
            const fold_type target{lists, voxelpipe::get<K>(fb.targets)};
            if (target.view.load == load_operation::off) return;
            const bool together =
                fold_type::max_staged != 0 && (fold_type::any_order || n <= tuning::max_long_in_order);
            if (valid && !(together && mine.is_long())) target.alone(mine);
            if constexpr (fold_type::max_staged != 0) {
                for (unsigned k = 0; together && k < n; ++k)
                    target.together(find_fragments(lists, start + long_voxels[k], *state, fb.extent), memory);
            }
        };
        (fold.template operator()<I>(), ...);
        __syncthreads(); // all threads have read num_long
    }
}

template <class Key, class Values, class Framebuffer, std::size_t... I>
void launch_fold(const fragment_lists<Key, Values>& lists, const Framebuffer& fb, bool count_voxels,
                 pipeline_state* state, const capacities& limits, std::index_sequence<I...>, cudaStream_t stream) {
    fold_kernel<Key, Values, Framebuffer, I...>
        <<<fill_device(limits.fragments), threads_per_block, 0, stream>>>(lists, fb, state, limits, count_voxels);
    check(cudaGetLastError(), stage::fine_raster);
}

// Folds lists with all shader outputs (all_values) into the targets I... of a framebuffer, and sets the state's
// counters of fragments and, if wanted, voxels.
template <class Key, class Values, class Framebuffer, std::size_t... I>
void fold_lists(const fragment_lists<Key, Values>& lists, const Framebuffer& fb, bool count_voxels,
                pipeline_state* state, const capacities& limits, std::index_sequence<I...> targets, cudaStream_t stream,
                stage_clock* clock = nullptr) {
    launch_fold(lists, fb, count_voxels, state, limits, targets, stream);
    end_stage(clock, &stage_times::fine_raster);
}
// Folds lists into the targets that are not drawn in tiles.
template <class Key, class Values, class Framebuffer>
void fold_ordered(const fragment_lists<Key, Values>& lists, const Framebuffer& fb, bool count_voxels,
                  pipeline_state* state, const capacities& limits, cudaStream_t stream, stage_clock* clock = nullptr) {
    using groups = target_groups<Framebuffer>;
    fold_lists(lists, fb, count_voxels, state, limits, typename groups::template indices<groups::ordered>{}, stream,
               clock);
}

} // namespace voxelpipe::device
