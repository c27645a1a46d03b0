// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep of one body, a constant, into targets of bits: a lane takes 32 voxels instead of one. A row of up to 64
// entries is sorted in a warp's registers. The entries at which the inside begins or ends change bits of a row of
// words, whose running parity is the inside.

#include <voxelpipe/device/fragments/warp_sort.cuh>
#include <voxelpipe/device/solid/fill_rows.cuh>
#include <voxelpipe/device/solid/parity_rows.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Which calls, as far as types tell.
template <class SolidShader, class Framebuffer>
inline constexpr bool fills_bit_rows = false;
template <class SolidShader, class... Targets>
inline constexpr bool fills_bit_rows<SolidShader, framebuffer_view<Targets...>> = core::is_constant<SolidShader> &&
                                                                                  (Targets::map::is_bit && ...);

// The inside of one row of one body, 32 words a round; all members are for all lanes of the warp.
class inside_words {
    static constexpr std::uint32_t items = 2; // entries of a lane

public:
    // totals: what the row adds to them, but for voxels and fragments.
    __device__ VOXELPIPE_INLINE inside_words(const row_sweep& sweep, word* words, sweep_totals& totals)
        : sweep_(sweep), words_(words), totals_(totals) {
        const std::uint64_t n = sweep.entries.end - sweep.entries.begin;
        is_sorted_ = n <= 32 * items;
        if (is_sorted_)
            sort(static_cast<std::uint32_t>(n));
        else
            see_open(sweep.find_reach().num_open);
    }
    // The lane's word of words first_word .. first_word + 31, which come in order; beyond the row it is 0.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word next(std::uint32_t first_word) {
        const auto nx = static_cast<std::uint32_t>(sweep_.rules.grid.extent.x);
        word w = is_sorted_ ? from_toggles(first_word) : from_bodies(first_word);
        const std::uint32_t x0 = (first_word + lane_) * 32;
        if (x0 >= nx)
            w = 0;
        else if (nx - x0 < 32)
            w &= (1u << (nx - x0)) - 1;
        return w;
    }

private:
    __device__ VOXELPIPE_INLINE void see_open(std::uint32_t num_open) {
        if (lane_ == 0) totals_.open_rows += num_open;
    }
    // A lane has two neighbours of the sorted entries.
    __device__ VOXELPIPE_INLINE void sort(std::uint32_t n) {
        const auto nx = static_cast<std::uint32_t>(sweep_.rules.grid.extent.x);
        const fill_rule rule = sweep_.rules.rule;
        word values[items];
        for (std::uint32_t k = 0; k < items; ++k)
            values[k] = items * lane_ + k < n ? sweep_.list.values[sweep_.entries.begin + items * lane_ + k] : ~0u;
        sort_warp(values);
        std::int32_t of_lane = 0;
        for (std::uint32_t k = 0; k < items; ++k)
            if (items * lane_ + k < n) of_lane += entry_value{values[k]}.step();
        std::int32_t winding = sum_up_to_lane(of_lane) - of_lane; // before the lane's entries
        const word behind = __shfl_down_sync(0xffffffffu, values[0], 1);
        for (std::uint32_t k = 0; k < items; ++k) {
            const entry_value e{values[k]};
            const std::uint32_t i = items * lane_ + k;
            const bool was_inside = core::is_inside(rule, winding);
            if (i < n) winding += e.step();
            position_[k] = static_cast<std::uint32_t>(e.position());
            toggles_[k] = core::is_inside(rule, winding) != was_inside;
            const entry_value next{k + 1 < items ? values[k + 1] : behind};
            const bool is_last = i + 1 >= n || next.position() != e.position(); // of its position
            if (i < n && is_last && position_[k] < nx) totals_.see(winding);
            if (i + 1 == n && (rule == fill_rule::even_odd ? (winding & 1) != 0 : winding != 0)) ++totals_.open_rows;
        }
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word from_toggles(std::uint32_t first_word) {
        words_[lane_] = 0;
        __syncwarp();
        for (std::uint32_t k = 0; k < items; ++k) {
            const std::uint32_t at = position_[k] / 32 - first_word; // large before
            if (toggles_[k] && at < 32) atomicXor(words_ + at, 1u << position_[k] % 32);
        }
        __syncwarp();
        const word w = parity_up_to(words_[lane_]);
        const unsigned odd = __ballot_sync(0xffffffffu, static_cast<int>(w >> 31));
        const bool is_flipped = ((carry_ + static_cast<unsigned>(__popc(odd & ((1u << lane_) - 1)))) & 1u) != 0;
        carry_ += static_cast<unsigned>(__popc(odd));
        return is_flipped ? ~w : w;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE word from_bodies(std::uint32_t first_word) {
        const int nx = sweep_.rules.grid.extent.x;
        word mine = 0;
        for (std::uint32_t k = 0; k < 32 && static_cast<int>((first_word + k) * 32) < nx; ++k) {
            const int x0 = static_cast<int>((first_word + k) * 32);
            sweep_.for_each_body_at(x0, [&](const body_at_voxel& at) VOXELPIPE_INLINE_LAMBDA {
                if (x0 + static_cast<int>(lane_) < nx) totals_.see(at.winding);
                const word inside = __ballot_sync(0xffffffffu, static_cast<int>(at.is_inside));
                mine = lane_ == k ? inside : mine;
            });
        }
        return mine;
    }

    const row_sweep& sweep_;
    word* const words_; // 32 of the warp
    sweep_totals& totals_;
    const std::uint32_t lane_ = threadIdx.x % 32;
    std::uint32_t position_[items]; // of the lane's entries
    bool toggles_[items];           // the inside begins or ends there
    bool is_sorted_;
    unsigned carry_ = 0; // parity of the rounds before
};

template <class Framebuffer, class Values>
__global__ __launch_bounds__(threads_per_block) void fill_bit_rows_kernel(const __grid_constant__ crossing_list list,
                                                                          const __grid_constant__ sweep_rules rules,
                                                                          const __grid_constant__ Framebuffer fb,
                                                                          const __grid_constant__ Values values,
                                                                          pipeline_state* state, capacities limits) {
    constexpr unsigned warps = threads_per_block / 32;
    __shared__ sweep_memory memory[warps];
    __shared__ word words[warps][32];
    await_stream();
    if (has_failed(*state, limits)) return;
    const std::uint32_t lane = threadIdx.x % 32;
    const auto words_x = (static_cast<std::uint32_t>(rules.grid.extent.x) + 31) / 32;
    sweep_totals totals;
    for_each_row(list, rules, memory[warp_in_block()], state->list_fragments, [&](const row_sweep& sweep) {
        const auto y = static_cast<int>(sweep.row % static_cast<std::uint64_t>(rules.grid.extent.y)),
                   z = static_cast<int>(sweep.row / static_cast<std::uint64_t>(rules.grid.extent.y));
        inside_words inside(sweep, words[warp_in_block()], totals);
        for (std::uint32_t first = 0; first < words_x; first += 32) {
            const word mask = inside.next(first);
            totals.fragments += static_cast<unsigned>(__popc(mask));
            if (mask != 0)
                core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
                    using target = typename targets_of<Framebuffer>::template at<K>;
                    const auto& t = voxelpipe::get<K>(fb.targets);
                    if (t.load == load_operation::off) return;
                    bool from_clear = false, from_set = true; // what a fragment makes of either bit
                    target::traits::apply(from_clear, voxelpipe::get<K>(values));
                    target::traits::apply(from_set, voxelpipe::get<K>(values));
                    word* const w =
                        t.elements + target::map::cell(t.extent, static_cast<int>((first + lane) * 32), y, z);
                    const bool was_cleared =
                        t.load == load_operation::clear && !t.clear_value; // and nobody else writes
                    const word old = was_cleared ? 0 : *w;
                    *w = (old & ~mask) | (mask & ((from_set ? old : 0u) | (from_clear ? ~old : 0u)));
                });
            __syncwarp();
        }
    });
    totals.voxels = totals.fragments; // one body
    totals.add_up(rules, state);
}

// As fill_rows, of calls with one body and without cover.
template <class SolidShader, class Framebuffer>
void fill_bit_rows(const crossing_list& list, const sweep_rules& rules, const SolidShader& shader,
                   const Framebuffer& fb, pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    launch_behind(fill_bit_rows_kernel<Framebuffer, std::remove_cvref_t<decltype(shader.values)>>,
                  fill_device(limits.fragments), threads_per_block, stream, stage::tile_resolve, list, rules, fb,
                  shader.values, state, limits);
}

} // namespace voxelpipe::device
