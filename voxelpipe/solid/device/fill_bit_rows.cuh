// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep of one body, a constant, into targets of bits, from crossings that are grouped by row. A warp takes 32
// rows. Each lane sorts the entries of its row in registers and keeps the positions at which the inside begins or ends;
// then the lanes make words of the rows, four neighbours each. Rows that are too long for a lane are done by a warp
// each, which sorts up to 64 entries in registers. The cover joins as a mask. So nothing is sorted but rows, and
// targets that are cleared to zero are written once, here.

#include <voxelpipe/device/fragments/warp_sort.cuh>
#include <voxelpipe/device/targets/clear_target.cuh>
#include <voxelpipe/solid/device/fill_rows.cuh>
#include <voxelpipe/solid/device/parity_rows.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// True for types of calls that may take this path.
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

// The output of a fill: one constant into targets of bits. Words of a row are 32 voxels along x.
template <class Framebuffer, class Values>
struct bit_writer {
    template <std::size_t K>
    using target = typename targets_of<Framebuffer>::template at<K>;
    static constexpr std::size_t count = targets_of<Framebuffer>::count;

    // True if every word of a target is written, so that it need not be cleared before.
    template <class Target>
    [[nodiscard]] VOXELPIPE_HD static bool writes_all(const target_view<Target>& t) {
        return !Target::map::bricks && t.load == load_operation::clear && !t.clear_value;
    }
    [[nodiscard]] __device__ static bool writes_all_of_any(const Framebuffer& fb) {
        bool any = false;
        core::for_each_index<count>(
            [&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA { any = any || writes_all(voxelpipe::get<K>(fb.targets)); });
        return any;
    }
    // Writes n words of a row from number first on; the inside's bits are `inside`. Nobody else writes to the row.
    // by_four: n is 4 or 0, and rows begin at multiples of 16 bytes.
    template <int N>
    __device__ VOXELPIPE_INLINE static void write(const Framebuffer& fb, const Values& values, const word (&inside)[N],
                                                  std::uint32_t n, std::uint32_t first, int y, int z, bool by_four) {
        if (n == 0) return;
        word any = 0;
#pragma unroll
        for (int k = 0; k < N; ++k) any |= inside[k];
        core::for_each_index<count>([&]<std::size_t K>() VOXELPIPE_INLINE_LAMBDA {
            const auto& t = voxelpipe::get<K>(fb.targets);
            const bool is_all = writes_all(t);
            if (t.load == load_operation::off || (any == 0 && !is_all)) return;
            bool from_clear = false, from_set = true; // what a fragment makes of either bit
            target<K>::traits::apply(from_clear, voxelpipe::get<K>(values));
            target<K>::traits::apply(from_set, voxelpipe::get<K>(values));
            const auto at = [&](std::uint32_t k) VOXELPIPE_INLINE_LAMBDA {
                return t.elements + target<K>::map::cell(t.extent, static_cast<int>((first + k) * 32), y, z);
            };
            if constexpr (N == 4) {
                if (is_all && by_four) {
                    *reinterpret_cast<uint4*>(at(0)) =
                        from_clear ? uint4{inside[0], inside[1], inside[2], inside[3]} : uint4{0, 0, 0, 0};
                    return;
                }
            }
#pragma unroll
            for (int k = 0; k < N; ++k) {
                if (static_cast<std::uint32_t>(k) >= n || (inside[k] == 0 && !is_all)) continue;
                word* const w = at(static_cast<std::uint32_t>(k));
                const word old = t.load == load_operation::clear && !t.clear_value ? 0 : *w;
                *w = (old & ~inside[k]) | (inside[k] & ((from_set ? old : 0u) | (from_clear ? ~old : 0u)));
            }
        });
    }
};

// A column of shared memory a lane: what it knows of its row.
struct lane_column {
    word (*entries)[32];
    std::uint32_t lane;
    [[nodiscard]] __device__ VOXELPIPE_INLINE word& operator[](std::uint32_t k) const { return entries[k][lane]; }
};

// Sorts N numbers of a lane: a bitonic network, whose first step of each size compares mirror images.
template <int N>
__device__ VOXELPIPE_INLINE void sort_lane(word (&w)[N]) {
#pragma unroll
    for (int size = 2; size <= N; size *= 2) {
#pragma unroll
        for (int k = 0; k < N; ++k)
            if ((k & size / 2) == 0) put_in_order(w[k], w[k ^ (size - 1)]);
#pragma unroll
        for (int apart = size / 4; apart > 0; apart /= 2)
#pragma unroll
            for (int k = 0; k < N; ++k)
                if ((k & apart) == 0) put_in_order(w[k], w[k | apart]);
    }
}
// Puts the positions at which the inside of a row begins or ends, in the part, into a column; returns how many there
// are. values: the row's n <= N entries, in any order. Adds the row to the totals, but for its voxels.
template <int N>
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t find_toggles(const std::uint32_t* values, std::uint32_t n,
                                                                     const sweep_rules& rules, const lane_column& to,
                                                                     sweep_totals& totals) {
    const auto nx = static_cast<std::uint32_t>(rules.grid.extent.x);
    word w[N];
#pragma unroll
    for (int k = 0; k < N; ++k) w[k] = static_cast<std::uint32_t>(k) < n ? values[k] : ~0u;
    sort_lane(w);
    std::int32_t winding = 0;
    bool was_inside = false;
    std::uint32_t found = 0;
#pragma unroll
    for (int k = 0; k < N; ++k) {
        if (static_cast<std::uint32_t>(k) >= n) continue;
        const entry_value e{w[k]}, next{k + 1 < N ? w[k + 1] : ~0u};
        winding += e.step();
        const auto at = static_cast<std::uint32_t>(e.position());
        if (next.position() == e.position() || at >= nx) continue; // more at this voxel, or behind the part
        totals.see(winding);
        const bool is_inside = core::is_inside(rules.rule, winding);
        if (is_inside != was_inside) to[found++] = at;
        was_inside = is_inside;
    }
    totals.open_rows += static_cast<unsigned>(rules.rule == fill_rule::even_odd ? (winding & 1) != 0 : winding != 0);
    return found;
}
// The bits of words first .. first + N - 1 of a row whose inside changes at the n positions of a column.
template <int N>
__device__ VOXELPIPE_INLINE void make_words(const lane_column& toggles, std::uint32_t n, std::uint32_t first,
                                            word (&out)[N]) {
#pragma unroll
    for (int k = 0; k < N; ++k) out[k] = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
        const int at = static_cast<int>(toggles[i]) - static_cast<int>(first * 32);
#pragma unroll
        for (int k = 0; k < N; ++k) {
            const int of_word = at - 32 * k;
            out[k] ^= of_word <= 0 ? ~0u : of_word < 32 ? ~0u << of_word : 0u;
        }
    }
}

// Joins n words of the cover to the inside, as the extent says.
template <int N>
__device__ VOXELPIPE_INLINE void add_cover(const sweep_rules& rules, const word* cover, std::uint32_t n,
                                           word (&inside)[N]) {
#pragma unroll
    for (int k = 0; k < N; ++k) {
        if (static_cast<std::uint32_t>(k) >= n) continue;
        const word w = cover[k];
        inside[k] = rules.extent == solid_extent::outer ? inside[k] | w : inside[k] & ~w;
    }
}

struct row_memory {
    word entries[tuning::lane_entries][32];
    sweep_memory sweep;
    word words[32];
};

template <class Framebuffer, class Values>
__global__ __launch_bounds__(threads_per_block, tuning::fill_blocks) void fill_bit_rows_kernel(
    const __grid_constant__ row_groups groups, const word* cover, const __grid_constant__ sweep_rules rules,
    const __grid_constant__ Framebuffer fb, const __grid_constant__ Values values, std::uint32_t lanes_per_row,
    bool by_four, pipeline_state* state, capacities limits) {
    constexpr unsigned warps_of_block = threads_per_block / 32, whole_warp = 0xffffffffu;
    using writer = bit_writer<Framebuffer, Values>;
    __shared__ row_memory memory[warps_of_block];
    await_stream();
    const bool failed = has_failed(*state, limits);
    row_memory& mine = memory[warp_in_block()];
    const std::uint32_t lane = threadIdx.x % 32, column = lane % lanes_per_row;
    const std::uint32_t rows_at_once = 32 / lanes_per_row, words_at_once = lanes_per_row * tuning::row_words;
    const auto words_x = (static_cast<std::uint32_t>(rules.grid.extent.x) + 31) / 32;
    const word last_bits = rules.grid.extent.x % 32 == 0 ? ~0u : (1u << rules.grid.extent.x % 32) - 1;
    const bool writes_all = writer::writes_all_of_any(fb);
    const auto ny = static_cast<std::uint64_t>(rules.grid.extent.y);
    const std::uint64_t num = rules.grid.num_rows(), step = std::uint64_t{gridDim.x} * threads_per_block;
    sweep_totals totals;
    for (std::uint64_t start = (std::uint64_t{blockIdx.x} * warps_of_block + warp_in_block()) * 32; start < num;
         start += step) {
        const std::uint64_t row = start + lane;
        const std::uint32_t n = row < num ? groups.counts[row] : 0;
        const bool is_long = n > tuning::lane_entries;
        if (n != 0) groups.counts[row] = 0;
        const std::uint32_t most = __reduce_max_sync(whole_warp, is_long ? 0 : n);
        const unsigned marked = __ballot_sync(whole_warp, static_cast<int>(n != 0));
        if (failed || (marked == 0 && !writes_all && cover == nullptr)) continue;
        std::uint32_t num_toggles = 0;
        if (n != 0 && !is_long) {
            const lane_column to{mine.entries, lane};
            const std::uint32_t* const values = groups.grouped + (groups.ends[row] - n);
            num_toggles = most <= 8    ? find_toggles<8>(values, n, rules, to, totals)
                          : most <= 16 ? find_toggles<16>(values, n, rules, to, totals)
                                       : find_toggles<tuning::lane_entries>(values, n, rules, to, totals);
        }
        __syncwarp(); // all columns are ready
        const unsigned long_rows = __ballot_sync(whole_warp, static_cast<int>(is_long));
        const auto y = static_cast<int>(row % ny), z = static_cast<int>(row / ny);
        for (std::uint32_t turn = 0; turn < 32; turn += rows_at_once) {
            const std::uint32_t of = turn + lane / lanes_per_row;
            const std::uint32_t toggles = __shfl_sync(whole_warp, num_toggles, static_cast<int>(of));
            const int row_y = __shfl_sync(whole_warp, y, static_cast<int>(of)),
                      row_z = __shfl_sync(whole_warp, z, static_cast<int>(of));
            const bool is_done =
                start + of >= num || (long_rows >> of & 1u) != 0 || (toggles == 0 && !writes_all && cover == nullptr);
            for (std::uint32_t first = column * tuning::row_words; !is_done && first < words_x;
                 first += words_at_once) {
                const std::uint32_t left = words_x - first, here = left < tuning::row_words ? left : tuning::row_words;
                word inside[tuning::row_words];
                make_words(lane_column{mine.entries, of}, toggles, first, inside);
                if (cover != nullptr) add_cover(rules, cover + (start + of) * words_x + first, here, inside);
#pragma unroll
                for (std::uint32_t k = 0; k < tuning::row_words; ++k) {
                    if (k >= left) inside[k] = 0;
                    if (k + 1 == left) inside[k] &= last_bits;
                    totals.fragments += static_cast<unsigned>(__popc(inside[k]));
                }
                writer::write(fb, values, inside, here, first, row_y, row_z, by_four);
            }
            __syncwarp();
        }
    }
    // Long rows, one after the other, by whichever warp is free.
    const std::uint32_t num_long = failed ? 0 : state->num_splits;
    const crossing_list grouped{nullptr, groups.grouped, groups.list.capacity, 1, false};
    for (;;) {
        std::uint32_t ticket = 0;
        if (lane == 0 && num_long != 0) ticket = atomicAdd(&state->num_images, 1u);
        ticket = __shfl_sync(whole_warp, ticket, 0);
        if (ticket >= num_long) break;
        const std::uint64_t row = groups.long_rows[ticket].x, end = groups.ends[row];
        const row_sweep sweep{grouped, rules, mine.sweep, row, {end - groups.long_rows[ticket].y, end}};
        const auto y = static_cast<int>(row % ny), z = static_cast<int>(row / ny);
        inside_words words(sweep, mine.words, totals);
        for (std::uint32_t first = 0; first < words_x; first += 32) {
            word inside[1] = {words.next(first)};
            if (cover != nullptr)
                add_cover(rules, cover + row * words_x + first + lane, first + lane < words_x ? 1 : 0, inside);
            totals.fragments += static_cast<unsigned>(__popc(inside[0]));
            writer::write(fb, values, inside, first + lane < words_x ? 1 : 0, first + lane, y, z, false);
            __syncwarp();
        }
    }
    totals.voxels = totals.fragments; // one body
    totals.add_up(rules, state);
}

// As fill_rows, for calls with one body whose crossings are grouped by row. cover: null, or the mask of the extent's
// cover. Clears the targets that the kernel does not write as a whole.
template <class SolidShader, class Framebuffer>
void fill_bit_rows(const row_groups& groups, const word* cover, const sweep_rules& rules, const SolidShader& shader,
                   const Framebuffer& fb, pipeline_state* state, const capacities& limits, cudaStream_t stream) {
    using values_type = std::remove_cvref_t<decltype(shader.values)>;
    const std::uint32_t words_x = (static_cast<std::uint32_t>(rules.grid.extent.x) + 31) / 32,
                        lanes = (words_x + tuning::row_words - 1) / tuning::row_words;
    bool by_four = words_x % 4 == 0;
    core::for_each_index<targets_of<Framebuffer>::count>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(fb.targets);
        by_four = by_four && reinterpret_cast<std::uintptr_t>(t.elements) % 16 == 0;
        if (t.load == load_operation::clear && !bit_writer<Framebuffer, values_type>::writes_all(t))
            clear_target(t, state, limits, stream);
    });
    launch_behind(fill_bit_rows_kernel<Framebuffer, values_type>, fill_device(rules.grid.num_rows()), threads_per_block,
                  stream, stage::tile_resolve, groups, cover, rules, fb, shader.values,
                  std::bit_ceil(lanes < 32 ? lanes : 32u), by_four, state, limits);
}

} // namespace voxelpipe::device
