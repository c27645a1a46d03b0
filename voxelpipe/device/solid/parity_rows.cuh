// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// fill_rule::even_odd of one constant straight into bits, without a list. Each crossing changes the bit of the first
// voxel behind it (crossing_toggler); here a voxel's bit becomes the parity of those up to it, in rows that were
// crossed.

#include <voxelpipe/device/solid/emit_crossings.cuh>
#include <voxelpipe/device/solid/sweep_rows.cuh>
#include <voxelpipe/device/targets/fill_from_mask.cuh>

#include <bit>
#include <cstdint>

namespace voxelpipe::device {

// Which rows are crossed, and which an odd number of times behind the part: a bit a row each. Zeros before a call, and
// after it.
struct row_marks {
    word *marked, *odd_behind;

    [[nodiscard]] static std::uint64_t num_words(const row_grid& grid) { return (grid.num_rows() + 31) / 32; }
    [[nodiscard]] static row_marks take(arena& memory, const row_grid& grid) {
        word* const marked = memory.take<word>(num_words(grid));
        return {marked, memory.take<word>(num_words(grid))};
    }
};

// Of a word whose bits change the parity from there on.
[[nodiscard]] __device__ VOXELPIPE_INLINE word parity_up_to(word w) {
    w ^= w << 1;
    w ^= w << 2;
    w ^= w << 4;
    w ^= w << 8;
    return w ^ w << 16;
}

// A warp takes 32 rows: lanes_per_row lanes, a power of two, share a row, a word each, in rounds where a row has more
// than 32 words.
template <class State>
__global__ __launch_bounds__(threads_per_block) void parity_rows_kernel(word* bits,
                                                                        const __grid_constant__ row_marks marks,
                                                                        const __grid_constant__ row_grid grid,
                                                                        std::uint32_t lanes_per_row, bool count_voxels,
                                                                        State* state) {
    constexpr unsigned whole_warp = 0xffffffffu;
    await_stream();
    if (state->index_error != 0) return;
    const std::uint32_t lane = threadIdx.x % 32, words_x = (static_cast<std::uint32_t>(grid.extent.x) + 31) / 32;
    const std::uint32_t rows_at_once = 32 / lanes_per_row, column = lane % lanes_per_row;
    const unsigned before = (1u << lane) - 1,
                   of_row = lanes_per_row == 32 ? whole_warp : ((1u << lanes_per_row) - 1) << (lane - column);
    const word last_bits = grid.extent.x % 32 == 0 ? ~0u : (1u << grid.extent.x % 32) - 1;
    const std::uint64_t num = (grid.num_rows() + 31) / 32, warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    unsigned long long found = 0, num_open = 0;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < num;
         i += warps) {
        const word marked = marks.marked[i], odd_behind = marks.odd_behind[i];
        if (marked == 0) continue;
        __syncwarp(); // all have read
        if (lane == 0) {
            marks.marked[i] = 0;
            if (odd_behind != 0) marks.odd_behind[i] = 0;
        }
        for (std::uint32_t first = 0; first < 32; first += rows_at_once) {
            if ((marked >> first & (rows_at_once == 32 ? ~0u : (1u << rows_at_once) - 1)) == 0) continue;
            const std::uint32_t mine = first + lane / lanes_per_row;
            const bool is_marked = (marked >> mine & 1u) != 0;
            word* const row = bits + (i * 32 + mine) * words_x;
            unsigned carry = 0;
            for (std::uint32_t start = 0; start < words_x; start += lanes_per_row) {
                const std::uint32_t at = start + column;
                const bool has_word = is_marked && at < words_x;
                const word old = has_word ? row[at] : 0;
                word w = parity_up_to(old);
                const unsigned odd = __ballot_sync(whole_warp, static_cast<int>(w >> 31)) & of_row;
                if (((carry + static_cast<unsigned>(__popc(odd & before))) & 1u) != 0) w = ~w;
                if (at + 1 == words_x) w &= last_bits;
                if (has_word) {
                    if (w != old) row[at] = w;
                    found += static_cast<unsigned>(__popc(w));
                }
                carry = (carry + static_cast<unsigned>(__popc(odd))) & 1u;
            }
            if (is_marked && column == 0) num_open += carry ^ (odd_behind >> mine & 1u);
        }
    }
    const unsigned long long all_found = block_sum(found), all_open = block_sum(num_open);
    if (threadIdx.x != 0) return;
    if (all_found != 0) {
        atomicAdd(&state->fragments, all_found);
        if (count_voxels) atomicAdd(&state->voxels, all_found);
    }
    if (all_open != 0) atomicAdd(&state->solid.open_rows, all_open);
}

template <int = 0>
void end_parities(word* bits, const row_marks& marks, const row_grid& grid, bool count_voxels, pipeline_state* state,
                  cudaStream_t stream) {
    const std::uint32_t words_x = (static_cast<std::uint32_t>(grid.extent.x) + 31) / 32;
    launch_behind(parity_rows_kernel<pipeline_state>, fill_device(grid.num_rows()), threads_per_block, stream,
                  stage::tile_resolve, bits, marks, grid, std::bit_ceil(words_x < 32 ? words_x : 32u), count_voxels,
                  state);
}

// ---- which calls ----------------------------------------------------------------------------------------------------

// A framebuffer of one target of bits in rows, which a fragment makes true.
template <class SolidShader, class Framebuffer>
struct parity_target {
    static constexpr bool is_possible = false;
};
template <class SolidShader, class Target>
requires(core::is_constant<SolidShader>&& Target::map::is_bit &&
         !Target::map::bricks) struct parity_target<SolidShader, framebuffer_view<Target>> {
    static constexpr bool is_possible = true;
    [[nodiscard]] static bool suits(const SolidShader& shader, const framebuffer_view<Target>& fb) {
        const auto& t = voxelpipe::get<0>(fb.targets);
        bool after = t.clear_value;
        Target::traits::apply(after, voxelpipe::get<0>(shader.values));
        return t.load == load_operation::clear && !t.clear_value && after;
    }
    [[nodiscard]] static word* bits(const framebuffer_view<Target>& fb) {
        return voxelpipe::get<0>(fb.targets).elements;
    }
};

} // namespace voxelpipe::device
