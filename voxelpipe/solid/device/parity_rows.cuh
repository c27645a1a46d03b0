// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// fill_rule::even_odd of one constant straight into bits, without a list. Each crossing changes the bit of the first
// voxel behind it (crossing_toggler); here a voxel's bit becomes the parity of those up to it, in rows that were
// crossed.

#include <voxelpipe/device/targets/fill_from_mask.cuh>
#include <voxelpipe/solid/device/emit_crossings.cuh>
#include <voxelpipe/solid/device/sweep_rows.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <bit>
#include <cstdint>

namespace voxelpipe::device {

// Marks of rows: a byte each if they are crossed, a bit each if behind the part and an odd number of times. Zeros
// before a call, and after it.
struct row_marks {
    std::uint8_t* marked;
    word* odd_behind;

    [[nodiscard]] static std::uint64_t num_words(const row_grid& grid) { return (grid.num_rows() + 31) / 32; }
    [[nodiscard]] static row_marks take(arena& memory, const row_grid& grid) {
        auto* const marked = memory.take<std::uint8_t>(num_words(grid) * 32);
        return {marked, memory.take<word>(num_words(grid))};
    }
};

// The parity of the bits up to each bit of a word.
[[nodiscard]] __device__ VOXELPIPE_INLINE word parity_up_to(word w) {
    w ^= w << 1;
    w ^= w << 2;
    w ^= w << 4;
    w ^= w << 8;
    return w ^ w << 16;
}

// A warp takes 32 rows, of which those that are marked share its lanes: lanes_per_row lanes, a power of two, have
// tuning::row_words words each, in rounds where a row has more. by_four: rows begin at multiples of 16 bytes.
template <class State>
__global__ __launch_bounds__(threads_per_block, tuning::parity_blocks) void parity_rows_kernel(
    word* bits, const __grid_constant__ row_marks marks, const __grid_constant__ row_grid grid,
    std::uint32_t lanes_per_row, bool by_four, bool count_voxels, State* state) {
    constexpr unsigned whole_warp = 0xffffffffu;
    __shared__ std::uint8_t rows_of_warps[threads_per_block / 32][32];
    await_stream();
    const bool has_failed = state->index_error != 0;
    const std::uint32_t lane = threadIdx.x % 32, words_x = (static_cast<std::uint32_t>(grid.extent.x) + 31) / 32;
    const std::uint32_t rows_at_once = 32 / lanes_per_row, column = lane % lanes_per_row,
                        of_turn = lane / lanes_per_row;
    const std::uint32_t words_at_once = lanes_per_row * tuning::row_words,
                        rounds = (words_x + words_at_once - 1) / words_at_once;
    const unsigned before = (1u << lane) - 1,
                   of_row = lanes_per_row == 32 ? whole_warp : ((1u << lanes_per_row) - 1) << (lane - column);
    const word last_bits = grid.extent.x % 32 == 0 ? ~0u : (1u << grid.extent.x % 32) - 1;
    const std::uint64_t num = (grid.num_rows() + 31) / 32, warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    std::uint8_t(&rows)[32] = rows_of_warps[warp_in_block()]; // the marked ones
    unsigned long long found = 0;
    std::uint32_t num_open = 0;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < num;
         i += warps) {
        const bool is_own = marks.marked[i * 32 + lane] != 0;
        const word odd_behind = marks.odd_behind[i], marked = __ballot_sync(whole_warp, static_cast<int>(is_own));
        if (marked == 0 || has_failed) continue;
        if (is_own) {
            marks.marked[i * 32 + lane] = 0;
            rows[__popc(marked & before)] = static_cast<std::uint8_t>(lane);
        }
        if (lane == 0 && odd_behind != 0) marks.odd_behind[i] = 0;
        __syncwarp();
        const auto num_marked = static_cast<std::uint32_t>(__popc(marked));
        const std::uint32_t turns = (num_marked + rows_at_once - 1) / rows_at_once * rounds;
        // The lane's words of a turn: how many, and where.
        struct place {
            word* at;
            std::uint32_t rank, x, count;
            bool begins, ends; // the row's first and last round
        };
        const auto place_of = [&](std::uint32_t turn) VOXELPIPE_INLINE_LAMBDA {
            const std::uint32_t step = rounds == 1 ? turn : turn / rounds, round = turn - step * rounds;
            place p{nullptr,
                    step * rows_at_once + of_turn,
                    round * words_at_once + column * tuning::row_words,
                    0,
                    round == 0,
                    round + 1 == rounds};
            if (p.rank < num_marked && p.x < words_x) {
                p.at = bits + (i * 32 + rows[p.rank]) * words_x + p.x;
                p.count = words_x - p.x < tuning::row_words ? words_x - p.x : tuning::row_words;
            }
            return p;
        };
        unsigned carry = 0;
        for (std::uint32_t first = 0; first < turns; first += tuning::parity_loads) { // round by round, row after row
            uint4 all[tuning::parity_loads];
#pragma unroll
            for (std::uint32_t k = 0; k < tuning::parity_loads; ++k) {
                all[k] = uint4{0, 0, 0, 0};
                if (first + k >= turns) break;
                const place p = place_of(first + k);
                if (by_four) {
                    if (p.count != 0) all[k] = *reinterpret_cast<const uint4*>(p.at);
                } else {
                    if (p.count > 0) all[k].x = p.at[0];
                    if (p.count > 1) all[k].y = p.at[1];
                    if (p.count > 2) all[k].z = p.at[2];
                    if (p.count > 3) all[k].w = p.at[3];
                }
            }
#pragma unroll
            for (std::uint32_t k = 0; k < tuning::parity_loads; ++k) {
                if (first + k >= turns) break;
                const place p = place_of(first + k);
                if (p.begins) carry = 0;
                const uint4 old = all[k];
                uint4 w{parity_up_to(old.x), parity_up_to(old.y), parity_up_to(old.z), parity_up_to(old.w)};
                if ((w.x >> 31) != 0) w.y = ~w.y;
                if ((w.y >> 31) != 0) w.z = ~w.z;
                if ((w.z >> 31) != 0) w.w = ~w.w;
                const unsigned odd = __ballot_sync(whole_warp, static_cast<int>(w.w >> 31)) & of_row;
                const word flip = ((carry + static_cast<unsigned>(__popc(odd & before))) & 1u) != 0 ? ~0u : 0u;
                carry = (carry + static_cast<unsigned>(__popc(odd))) & 1u;
                if (p.ends && column == 0 && p.rank < num_marked) num_open += carry ^ (odd_behind >> rows[p.rank] & 1u);
                if (p.count == 0) continue;
                w = uint4{w.x ^ flip, w.y ^ flip, w.z ^ flip, w.w ^ flip};
                if (p.x + p.count == words_x)
                    (p.count == 1 ? w.x : p.count == 2 ? w.y : p.count == 3 ? w.z : w.w) &= last_bits;
                found += static_cast<unsigned>(__popc(w.x));
                if (p.count > 1) found += static_cast<unsigned>(__popc(w.y));
                if (p.count > 2) found += static_cast<unsigned>(__popc(w.z));
                if (p.count > 3) found += static_cast<unsigned>(__popc(w.w));
                if (by_four) {
                    *reinterpret_cast<uint4*>(p.at) = w;
                } else {
                    p.at[0] = w.x;
                    if (p.count > 1) p.at[1] = w.y;
                    if (p.count > 2) p.at[2] = w.z;
                    if (p.count > 3) p.at[3] = w.w;
                }
            }
        }
        __syncwarp(); // all have read `rows`
    }
    const unsigned long long all_found = block_sum(found);
    if (threadIdx.x == 0 && all_found != 0) {
        atomicAdd(&state->fragments, all_found);
        if (count_voxels) atomicAdd(&state->voxels, all_found);
    }
    if (__syncthreads_or(static_cast<int>(num_open != 0)) == 0) return;
    const unsigned long long all_open = block_sum(num_open);
    if (threadIdx.x == 0) atomicAdd(&state->solid.open_rows, all_open);
}

template <int = 0>
void end_parities(word* bits, const row_marks& marks, const row_grid& grid, bool count_voxels, pipeline_state* state,
                  cudaStream_t stream) {
    const std::uint32_t words_x = (static_cast<std::uint32_t>(grid.extent.x) + 31) / 32,
                        lanes = (words_x + tuning::row_words - 1) / tuning::row_words;
    const bool by_four = words_x % 4 == 0 && reinterpret_cast<std::uintptr_t>(bits) % 16 == 0;
    launch_behind(parity_rows_kernel<pipeline_state>, fill_device(grid.num_rows()), threads_per_block, stream,
                  stage::tile_resolve, bits, marks, grid, std::bit_ceil(lanes < 32 ? lanes : 32u), by_four,
                  count_voxels, state);
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
