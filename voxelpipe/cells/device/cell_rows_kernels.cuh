// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Rows of cut cells on a GPU: a warp goes along a row, 32 voxels at a time, each lane with one of them. Neighbouring
// lanes write neighbouring voxels, and what lies before a voxel is a sum over lanes. With the bytes of
// passes::shade_cells and the counts of passes::measure_rows, because sums of integers do not depend on their order.

#include <voxelpipe/cells/passes/cell_walk.hpp>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr unsigned whole_warp = 0xffffffffu;
inline constexpr int cell_row_warps = 4;        // of a block
inline constexpr std::uint64_t rows_a_warp = 8; // in turn, which share one search for their first term

[[nodiscard]] inline unsigned cell_row_blocks(std::uint64_t num_rows) { // which are fewer than 2^32
    return static_cast<unsigned>((num_rows - 1) / (cell_row_warps * rows_a_warp) + 1);
}

[[nodiscard]] __device__ inline std::uint64_t warp_sum(std::uint64_t value) {
    for (int step = 16; step > 0; step /= 2) value += __shfl_xor_sync(whole_warp, value, step);
    return value;
}
// The sum of the values of lower lanes.
[[nodiscard]] __device__ inline std::uint64_t sum_of_lower_lanes(std::uint64_t value) {
    const unsigned lane = threadIdx.x % 32;
    std::uint64_t sum = value;
    for (unsigned step = 1; step < 32; step *= 2) {
        const std::uint64_t other = __shfl_up_sync(whole_warp, sum, step);
        if (lane >= step) sum += other;
    }
    return sum - value;
}
// The first term whose key is not less, found by all lanes.
template <class Terms>
[[nodiscard]] __device__ std::uint64_t find_by_warp(const core::passes::record_list<Terms>& list, std::uint64_t key) {
    const unsigned lane = threadIdx.x % 32;
    std::uint64_t first = 0, count = list.count; // the term lies in [first, first + count]
    while (count > 0) {
        const std::uint64_t step = count / 33 + 1, at = (lane + 1) * step - 1;
        const bool is_less = at < count && list.keys[first + at] < key;
        const auto less = static_cast<unsigned>(__popc(__ballot_sync(whole_warp, is_less)));
        first += less * step;
        count = less == 32 ? count - 32 * step : min(count - less * step, step - 1);
    }
    return first;
}
// Adds what all lanes have counted.
__device__ inline void add_by_warp(const core::passes::cell_tally& tally, std::uint64_t* counts) {
    using core::cell_count;
    const auto add = [&](cell_count c, std::uint64_t n) {
        n = warp_sum(n);
        if (threadIdx.x % 32 == 0) core::add_count(counts, c, n);
    };
    add(cell_count::cut_voxels, tally.cut);
    add(cell_count::below_zero, tally.below);
    add(cell_count::above_one, tally.above);
    add(cell_count::fragments, tally.fragments);
    add(cell_count::discarded, tally.discarded);
    add(cell_count::voxels, tally.voxels);
    add(cell_count::lost_centroids, tally.lost);
    add(cell_count::volume_low, static_cast<std::uint64_t>(tally.volume) & 0xffffffffu);
    add(cell_count::volume_middle, static_cast<std::uint64_t>(tally.volume) >> 32);
    add(cell_count::volume_high, static_cast<std::uint64_t>(tally.volume >> 64));
}

// Looks at the sums of rows, as passes::measure_rows does. A warp takes rows_a_warp rows of bodies.
template <class Terms>
__global__ __launch_bounds__(32 * cell_row_warps) void measure_cell_rows_kernel(
    const __grid_constant__ core::passes::measure_rows<Terms> pass, std::uint64_t num_rows) {
    await_stream();
    const auto& list = pass.list;
    const unsigned lane = threadIdx.x % 32;
    const std::uint64_t slots = list.keys_of.slots, bodies = list.keys_of.bodies;
    const std::uint64_t first = (std::uint64_t{blockIdx.x} * cell_row_warps + warp_in_block()) * rows_a_warp;
    std::uint64_t at = 0, open = 0, too_large = 0;
    for (std::uint64_t i = first; i < num_rows && i < first + rows_a_warp; ++i) {
        const std::uint64_t row = pass.rows == nullptr ? i : pass.rows[i / bodies] * bodies + i % bodies;
        if (i == first) at = find_by_warp(list, row * slots);
        const std::uint64_t end_key = (row + 1) * slots;
        std::uint64_t sum = 0, size = 0;
        while (true) {
            const bool is_of_row = at + lane < list.count && list.keys[at + lane] < end_key;
            const unsigned lanes = __ballot_sync(whole_warp, is_of_row);
            if (is_of_row) {
                const std::int64_t cover = list.terms[list.order[at + lane]].cover;
                sum += static_cast<std::uint64_t>(cover);
                size += core::passes::size_of_cover(cover);
            }
            at += static_cast<unsigned>(__popc(lanes));
            if (lanes != whole_warp) break;
        }
        open += warp_sum(sum) != 0 ? 1 : 0;
        if (pass.checks_size) too_large += warp_sum(size) > std::uint64_t{1} << 38 ? 1 : 0;
    }
    if (lane != 0) return;
    core::add_count(pass.counts, core::cell_count::open_rows, open);
    core::add_count(pass.counts, core::cell_count::too_large, too_large);
}

// A warp's way along the rows of passes::shade_cells.
template <class CellShader>
class warp_walk {
    using walk_type = core::passes::cell_walk<CellShader>;
    using terms_type = typename walk_type::terms_type;
    using cursor = typename walk_type::cursor;

public:
    // starts: 32 words of shared memory of the warp.
    __device__ warp_walk(const walk_type& walk, std::uint64_t* starts) : walk_(walk), starts_(starts) {}

    // Sums the terms before the grid, of which `at` is the first, if there are any. row: of a body.
    [[nodiscard]] __device__ cursor begin(std::uint64_t row, std::uint64_t at) const {
        const auto& list = walk_.list;
        const std::uint64_t key = row * list.keys_of.slots;
        cursor sums{at, key, 0, 0, 0};
        while (true) {
            const bool is_before = sums.at + lane() < list.count && list.keys[sums.at + lane()] == key;
            const unsigned lanes = __ballot_sync(whole_warp, is_before);
            if (lanes == 0) return sums;
            std::uint64_t cover = 0, y = 0, z = 0;
            if (is_before) {
                const terms_type& t = list.terms[list.order[sums.at + lane()]];
                cover = static_cast<std::uint64_t>(t.cover);
                if constexpr (core::has_cover_moments<terms_type>) {
                    y = static_cast<std::uint64_t>(t.cover_y);
                    z = static_cast<std::uint64_t>(t.cover_z);
                }
            }
            sums.at += static_cast<unsigned>(__popc(lanes));
            add(sums.aperture, warp_sum(cover));
            if constexpr (core::has_cover_moments<terms_type>) {
                sums.y += warp_sum(y);
                sums.z += warp_sum(z);
            }
        }
    }
    // The first term behind a row, of whose terms `at` is one, or the first behind them.
    [[nodiscard]] __device__ std::uint64_t behind(std::uint64_t row, std::uint64_t at) const {
        const auto& list = walk_.list;
        while (true) {
            const bool is_of_row = at + lane() < list.count && list.keys[at + lane()] < (row + 1) * list.keys_of.slots;
            const unsigned lanes = __ballot_sync(whole_warp, is_of_row);
            at += static_cast<unsigned>(__popc(lanes));
            if (lanes != whole_warp) return at;
        }
    }
    // The next voxel of the row that has terms, or one behind the row.
    [[nodiscard]] __device__ int next_voxel(std::uint64_t row, const cursor& carry) const {
        const auto& list = walk_.list;
        if (carry.at >= list.count) return walk_.row_extent;
        const std::uint64_t voxel = list.keys[carry.at] - row * list.keys_of.slots - 1; // of other rows: far
        return voxel < static_cast<std::uint64_t>(walk_.row_extent) ? static_cast<int>(voxel) : walk_.row_extent;
    }
    // Shades 32 voxels of a row for a body, from `first` on. place: of this lane's voxel; is_drawn: of it.
    template <class Visit>
    __device__ void shade(std::uint64_t row, std::uint64_t body, int first, const glm::ivec3& place, cursor& carry,
                          bool& is_drawn, core::passes::cell_tally& tally, Visit& visit) const {
        const auto& list = walk_.list;
        const std::uint64_t first_key = row * list.keys_of.slots + 1 + static_cast<std::uint64_t>(first);
        const std::uint64_t end_key = first_key + static_cast<std::uint64_t>(min(32, walk_.row_extent - first));
        const unsigned found = find_starts(first_key, end_key, carry.at);
        const bool has_any = (found >> lane() & 1u) != 0;
        cursor own{has_any ? starts_[lane()] : 0, first_key + lane(), 0, 0, 0};
        typename cursor::slot_sums sums{};
        if (has_any) sums = own.take(list);
        auto before = static_cast<std::uint64_t>(carry.aperture);
        [[maybe_unused]] std::uint64_t y = carry.y, z = carry.z; // moments of what lies before this lane's voxel
        if (found != 0) {
            before += sum_of_lower_lanes(sums.cover);
            add(carry.aperture, warp_sum(sums.cover));
            if constexpr (core::has_cover_moments<terms_type>) {
                y += sum_of_lower_lanes(own.y);
                z += sum_of_lower_lanes(own.z);
                carry.y += warp_sum(own.y);
                carry.z += warp_sum(own.z);
            }
        }
        if constexpr (core::has_cover_moments<terms_type>) {
            sums.before = {y, z};
            sums.behind = {y + own.y, z + own.z};
        }
        if (place.x < walk_.row_extent)
            walk_.shade_body(body, place, place.x + 1, sums, static_cast<std::int64_t>(before), own.at, is_drawn, tally,
                             visit);
        __syncwarp(); // the starts are read
    }

private:
    [[nodiscard]] __device__ static unsigned lane() { return threadIdx.x % 32; }
    __device__ static void add(std::int64_t& to, std::uint64_t n) { // which may wrap on its way
        to = static_cast<std::int64_t>(static_cast<std::uint64_t>(to) + n);
    }

    // Puts the first terms of the voxels with keys from first_key up to end_key into `starts`; returns which have any.
    // at: the first term that may be of them; becomes the first behind them.
    [[nodiscard]] __device__ unsigned find_starts(std::uint64_t first_key, std::uint64_t end_key,
                                                  std::uint64_t& at) const {
        const auto& list = walk_.list;
        unsigned found = 0; // voxels with terms
        std::uint64_t last = ~std::uint64_t{0};
        while (true) {
            const std::uint64_t key = at + lane() < list.count ? list.keys[at + lane()] : ~std::uint64_t{0};
            const bool is_here = key < end_key;
            const unsigned lanes = __ballot_sync(whole_warp, is_here);
            std::uint64_t earlier = __shfl_up_sync(whole_warp, key, 1);
            if (lane() == 0) earlier = last;
            const bool is_first = is_here && key != earlier;
            const auto voxel = static_cast<unsigned>(key - first_key) % 32;
            if (is_first) starts_[voxel] = at + lane();
            found |= __reduce_or_sync(whole_warp, is_first ? 1u << voxel : 0u);
            last = __shfl_sync(whole_warp, key, 31);
            at += static_cast<unsigned>(__popc(lanes));
            if (lanes != whole_warp) break;
        }
        __syncwarp();
        return found;
    }

    const walk_type& walk_;
    std::uint64_t* starts_;
};

// Shades rows of the grid as passes::shade_cells does. A warp takes rows_a_warp of them. error: null, or a word that is
// not 0 where the call has failed; nothing is done then.
template <class CellShader, class... Targets>
__global__ __launch_bounds__(32 * cell_row_warps) void shade_cell_rows_kernel(
    const __grid_constant__ core::passes::shade_cells<CellShader, Targets...> pass, std::uint64_t num_rows,
    const unsigned* error) {
    __shared__ std::uint64_t starts[cell_row_warps][32];
    await_stream();
    if (error != nullptr && *error != 0) return;
    const auto& list = pass.walk.list;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const std::uint64_t bodies = list.keys_of.bodies, slots = list.keys_of.slots;
    const int extent = pass.walk.row_extent;
    const warp_walk<CellShader> walk(pass.walk, starts[warp_in_block()]);
    core::passes::cell_tally tally;
    core::passes::blended_voxel<Targets...> voxel{pass.fb, pass.walk.axis, {}};
    const std::uint64_t first = (std::uint64_t{blockIdx.x} * cell_row_warps + warp_in_block()) * rows_a_warp;
    std::uint64_t at = find_by_warp(list, first * bodies * slots);
    for (std::uint64_t row = first; row < num_rows && row < first + rows_a_warp; ++row) {
        const auto u = static_cast<int>(row % list.keys_of.rows_y), v = static_cast<int>(row / list.keys_of.rows_y);
        typename core::passes::cell_walk<CellShader>::cursor one{};
        auto* const all = pass.walk.cursors == nullptr ? &one : pass.walk.cursors + row * bodies;
        for (std::uint64_t b = 0; b < bodies; ++b) {
            const auto begun = walk.begin(row * bodies + b, at);
            if (bodies == 1 || lane == 0) all[b] = begun;
            if (bodies != 1) at = walk.behind(row * bodies + b, begun.at);
        }
        __syncwarp();
        for (int w = 0; w < extent; w += 32) {
            int next = extent;
            bool is_inside = false;
            for (std::uint64_t b = 0; b < bodies; ++b) {
                next = min(next, walk.next_voxel(row * bodies + b, all[b]));
                is_inside = is_inside || all[b].aperture != 0;
            }
            if (!is_inside) w = next / 32 * 32;
            if (next == extent && !is_inside) break;
            bool is_drawn = false;
            const glm::ivec3 place(w + lane, u, v);
            for (std::uint64_t b = 0; b < bodies; ++b) {
                auto carry = all[b];
                walk.shade(row * bodies + b, b, w, place, carry, is_drawn, tally, voxel);
                if (bodies == 1 || lane == 0) all[b] = carry;
                __syncwarp();
            }
            if (!is_drawn) continue;
            voxel.end(core::passes::place_in_part(place.x, u, v, pass.walk.axis), place.x, place.x + 1);
            ++tally.voxels;
        }
        if (bodies == 1) at = walk.behind(row, one.at);
    }
    add_by_warp(tally, pass.counts);
}

} // namespace voxelpipe::device
