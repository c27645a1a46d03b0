// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counted targets of a call without tiles: cleared ones whose fragments all have one value. During the raster, the
// target's own memory holds the number of fragments of each voxel; a last pass turns numbers into values. So a sum of
// floats need not be exact in its type, and voxels can be counted without an atomic that reports first touches. Here
// are the decision which targets are counted (immediate_plan) and the last pass (finalize_counts).

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/targets/dirty_chunks.cuh>
#include <voxelpipe/device/targets/immediate_mode.cuh>
#include <voxelpipe/tuning/tuning_raster.hpp>
#include <voxelpipe/tuning/tuning_strategy.hpp>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

namespace voxelpipe::device {

// ---- which targets --------------------------------------------------------------------------------------------------

template <std::size_t N>
struct immediate_plan {
    bool possible = true; // every target can be blended or counted in place
    bool is_cheap = true; // the last pass costs less than tiles would
    immediate_modes<N> modes;
    int voxels_of = -1; // counted target whose last pass counts the touched voxels; -1: none
    int bits_of = -1;   // target of bits that counts them; -1: none

    [[nodiscard]] bool counts(std::size_t k) const { return modes.of[k] == immediate_mode::count; }
    [[nodiscard]] bool any_counted() const { return first_counted() >= 0; }
    [[nodiscard]] bool has_last_pass() const { return any_counted() || bits_of >= 0; }
    [[nodiscard]] bool only_blends() const {
        return std::ranges::all_of(modes.of, [](immediate_mode mode) { return mode == immediate_mode::blend; });
    }
    [[nodiscard]] int first_counted() const {
        for (std::size_t k = 0; k < N; ++k)
            if (counts(k)) return static_cast<int>(k);
        return -1;
    }
};

// True if the last pass of a target uses marks: the target is large, and voxels without fragments already have their
// final bits, zero.
template <class Target>
[[nodiscard]] bool ends_by_marks(const target_view<Target>& t) {
    using map = typename Target::map;
    if constexpr (is_countable<Target> && !map::bricks) {
        constexpr typename Target::value_type none{};
        return map::elements(t.extent) * sizeof(none) >= tuning::marked_bytes &&
               core::has_same_bits(t.clear_value, none);
    } else {
        return false;
    }
}

// ---- the last pass --------------------------------------------------------------------------------------------------

// Large, rare numbers: out of line, to save registers.
template <class Fold>
__device__ __noinline__ auto fold_many(const Fold& fold, std::uint32_t n) {
    return fold(n);
}

// Converts numbers of fragments to values.
template <class Fold, class T>
struct count_values {
    using number = unsigned_word<T>;
    static constexpr int per_load = 16 / sizeof(T);
    const Fold& fold;
    const number* known;            // values of small numbers, shared by the block
    unsigned long long touched = 0; // voxels with fragments, so far

    [[nodiscard]] __device__ VOXELPIPE_INLINE number of(number n) {
        touched += static_cast<unsigned>(n != 0);
        return n < threads_per_block ? known[n]
                                     : core::bit_cast<number>(fold_many<Fold>(fold, static_cast<std::uint32_t>(n)));
    }
    // Does not write voxels without fragments if they already have their final bits.
    __device__ VOXELPIPE_INLINE void end(uint4* at, const uint4& v) {
        if ((v.x | v.y | v.z | v.w) == 0 && known[0] == 0) return;
        number numbers[per_load];
        memcpy(numbers, &v, 16);
        for (int k = 0; k < per_load; ++k) numbers[k] = of(numbers[k]);
        uint4 made;
        memcpy(&made, numbers, 16);
        *at = made;
    }
};

// Turns numbers of fragments into values, padding included; only marked chunks, if there are marks. Does nothing if the
// call has failed.
template <class Fold, class T>
__global__ __launch_bounds__(threads_per_block) void finalize_counts_kernel(
    unsigned_word<T>* at, std::uint64_t num_elements, const __grid_constant__ chunk_marks marks,
    const __grid_constant__ Fold fold, bool count_voxels, pipeline_state* state, capacities limits) {
    using number = unsigned_word<T>;
    constexpr int per_load = 16 / sizeof(T), batch = tuning::last_pass_loads;
    __shared__ number known[threads_per_block];
    await_stream();
    if (has_failed(*state, limits)) return;
    known[threadIdx.x] = core::bit_cast<number>(fold(threadIdx.x));
    __syncthreads();
    count_values<Fold, T> values{fold, known};
    // Ends address(i) for i in [0, count).
    const auto end_all = [&](std::uint64_t count, const auto& address) {
        for (std::uint64_t first = 0; first < count; first += batch) {
            uint4 loaded[batch];
            for (unsigned b = 0; b < batch; ++b)
                loaded[b] = first + b < count ? *address(first + b) : uint4{0, 0, 0, 0};
            for (unsigned b = 0; b < batch; ++b)
                if (first + b < count) values.end(address(first + b), loaded[b]);
        }
    };
    if (marks.words == nullptr) {
        const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
        const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
        std::uint64_t done = 0;
        if (reinterpret_cast<std::uintptr_t>(at) % 16 == 0) {
            auto* const wide = reinterpret_cast<uint4*>(at);
            const std::uint64_t loads = num_elements / per_load;
            if (thread < loads)
                end_all((loads - thread - 1) / threads + 1,
                        [&](std::uint64_t i) { return wide + thread + i * threads; });
            done = loads * per_load;
        }
        for (std::uint64_t i = done + thread; i < num_elements; i += threads) at[i] = values.of(at[i]);
    } else if (has_wide_rows(at, marks)) {
        for_each_marked<uint4>(at, marks, [&](const unit_column<uint4>& c) {
            end_all(static_cast<unsigned>(c.rows), [&](std::uint64_t i) { return c.first + c.step * i; });
        });
    } else {
        for_each_marked<number>(at, marks, [&](const unit_column<number>& c) {
            for (int i = 0; i < c.rows; ++i) {
                number& n = c.first[c.step * static_cast<unsigned>(i)];
                if (n != 0) n = values.of(n);
            }
        });
    }
    if (count_voxels) {
        const unsigned long long sum = block_sum(values.touched);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->voxels, sum);
    }
}

// Counts the voxels of a target whose bit is no longer its clear value. Padding is zero.
template <class Target>
__global__ __launch_bounds__(threads_per_block) void count_bits_kernel(const __grid_constant__ target_view<Target> t,
                                                                       pipeline_state* state, capacities limits) {
    await_stream();
    if (has_failed(*state, limits)) return;
    const std::uint64_t num = Target::map::elements(t.extent);
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    std::uint64_t done = 0, set = 0;
    if (reinterpret_cast<std::uintptr_t>(t.elements) % 16 == 0) {
        const auto* const wide = reinterpret_cast<const uint4*>(t.elements);
#pragma unroll 4
        for (std::uint64_t i = thread; i < num / 4; i += threads) {
            const uint4 v = wide[i];
            set += static_cast<unsigned>(__popc(v.x) + __popc(v.y) + __popc(v.z) + __popc(v.w));
        }
        done = num / 4 * 4;
    }
    for (std::uint64_t i = done + thread; i < num; i += threads) set += static_cast<unsigned>(__popc(t.elements[i]));
    const unsigned long long sum = block_sum(set);
    if (threadIdx.x != 0) return;
    const auto of_grid = static_cast<unsigned long long>(t.extent.x) * static_cast<unsigned>(t.extent.y) *
                         static_cast<unsigned>(t.extent.z);
    const unsigned long long all = t.clear_value && blockIdx.x == 0 ? of_grid : 0;
    atomicAdd(&state->voxels, t.clear_value ? all - sum : sum);
}

// Ends the counted targets of a call whose draws give these values, by marks if there are any, and counts voxels.
template <class... Targets, class Values>
void finalize_counts(const immediate_plan<sizeof...(Targets)>& plan, const framebuffer_view<Targets...>& fb,
                     const Values& values, const chunk_marks& marks, pipeline_state* state, const capacities& limits,
                     cudaStream_t stream) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t K>() {
        using target = typename core::pack_element<K, Targets...>::type;
        if constexpr (target::map::is_bit) {
            if (plan.bits_of != static_cast<int>(K)) return;
            const auto& t = voxelpipe::get<K>(fb.targets);
            launch_behind(count_bits_kernel<target>, fill_device(target::map::elements(t.extent) / 16 + 1),
                          threads_per_block, stream, stage::tile_resolve, t, state, limits);
        } else if constexpr (is_countable<target>) {
            if (!plan.counts(K)) return;
            using value_type = typename target::value_type;
            using fold_type = core::repeated_fold<typename target::blend_type, value_type>;
            const auto& t = voxelpipe::get<K>(fb.targets);
            value_type value{}; // a count needs none
            if constexpr (!std::is_same_v<typename target::blend_type, blend::count>) value = voxelpipe::get<K>(values);
            const std::uint64_t count = target::map::elements(t.extent);
            launch_behind(finalize_counts_kernel<fold_type, value_type>,
                          fill_device(count / (16 / sizeof(value_type)) + 1), threads_per_block, stream,
                          stage::tile_resolve, reinterpret_cast<unsigned_word<value_type>*>(t.elements), count,
                          ends_by_marks(t) ? marks : chunk_marks{}, fold_type(t.clear_value, value),
                          plan.voxels_of == static_cast<int>(K), state, limits);
        }
    });
}

} // namespace voxelpipe::device
