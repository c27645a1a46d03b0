// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The list that a solid is made from: where triangles cross rows along x, and, for extents that ask for it, where runs
// of covered voxels begin and end. An entry is a key, the row and the body, and a value, the voxel and the kind. The
// entries of a row fix its voxels in whatever order they are listed, so they are appended by atomics and sorted by key
// alone.

#include <voxelpipe/device/fragments/radix_sort.cuh>
#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/tuning/tuning_solid.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// The change at the voxel of an entry, which holds from there on.
enum class entry_kind : std::uint32_t { leave, enter, cover_begin, cover_end };

// Position and kind in one word: a position is 0 .. extent, at most 2^20.
struct entry_value {
    std::uint32_t bits;

    [[nodiscard]] __device__ VOXELPIPE_INLINE static entry_value of(std::uint32_t position, entry_kind kind) {
        return {position << 2 | static_cast<std::uint32_t>(kind)};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int position() const { return static_cast<int>(bits >> 2); }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_crossing() const { return (bits & 2u) == 0; }
    // 1 where a body or a run begins, -1 where it ends.
    [[nodiscard]] __device__ VOXELPIPE_INLINE int step() const {
        return is_crossing() ? ((bits & 1u) != 0 ? 1 : -1) : ((bits & 1u) != 0 ? -1 : 1);
    }
};

// Entries are numbered with 32 bits. Keys have 32 bits where rows times bodies fit, otherwise 64; one kernel serves
// both.
struct crossing_list {
    void* keys;
    std::uint32_t* values;
    std::uint64_t capacity;
    std::uint32_t num_bodies; // the draws, or 1 if all are one body
    bool are_wide;            // the keys

    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t key(std::uint64_t i) const {
        return are_wide ? static_cast<const std::uint64_t*>(keys)[i] : static_cast<const std::uint32_t*>(keys)[i];
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t row(std::uint64_t i) const {
        const std::uint64_t k = key(i);
        return num_bodies == 1 ? k : k / num_bodies; // 64-bit divisions take long
    }
    // Nothing beyond the capacity.
    __device__ VOXELPIPE_INLINE void store(std::uint64_t i, std::uint64_t row, std::uint32_t body,
                                           const entry_value& value) const {
        if (i >= capacity) return;
        const std::uint64_t key = row * num_bodies + body;
        if (are_wide)
            static_cast<std::uint64_t*>(keys)[i] = key;
        else
            static_cast<std::uint32_t*>(keys)[i] = static_cast<std::uint32_t>(key);
        values[i] = value.bits;
    }
};

// The crossings of one body by row without a sort. They are listed with their rows and counted by row; then rows get
// room for their entries, in any order, and each entry takes the next place of its row.
struct row_groups {
    std::uint32_t* counts = nullptr;  // of entries, by row; zeros before a call, and after it. Null: not used
    crossing_list list{};             // keys of 32 bits
    std::uint32_t* ends = nullptr;    // of rows in `grouped`
    std::uint32_t* grouped = nullptr; // values, row by row
    uint2* long_rows = nullptr;       // rows of more than tuning::lane_entries, and how many they have

    [[nodiscard]] static row_groups take(arena& memory, std::uint64_t capacity, std::uint64_t num_rows,
                                         std::uint32_t* counts) {
        row_groups g;
        g.counts = counts;
        auto* const keys = memory.take<std::uint32_t>(capacity);
        g.list = {keys, memory.take<std::uint32_t>(capacity), capacity, 1, false};
        g.ends = memory.take<std::uint32_t>(num_rows);
        g.grouped = memory.take<std::uint32_t>(capacity);
        g.long_rows = memory.take<uint2>(capacity / (tuning::lane_entries + 1) + 1);
        return g;
    }
};

// Room for n items of each thread behind what *total counts: the number of the thread's first one. One atomic a block,
// because atomics on one address wait for one another. All threads of the block take part.
template <class Total>
__device__ unsigned long long reserve_for_block(unsigned long long n, Total* total) {
    __shared__ unsigned long long first_of_warp[threads_per_block / 32];
    const unsigned lane = threadIdx.x % 32, warp = warp_in_block();
    unsigned long long before = n; // with its own
    for (unsigned step = 1; step < 32; step *= 2) {
        const unsigned long long other = __shfl_up_sync(0xffffffffu, before, step);
        if (lane >= step) before += other;
    }
    __syncthreads(); // the last use of first_of_warp is over
    if (lane == 31) first_of_warp[warp] = before;
    __syncthreads();
    if (threadIdx.x == 0) {
        unsigned long long sum = 0;
        for (auto& w : first_of_warp) {
            const unsigned long long of_warp = w;
            w = sum;
            sum += of_warp;
        }
        const unsigned long long first = sum != 0 ? atomicAdd(total, static_cast<Total>(sum)) : 0;
        for (auto& w : first_of_warp) w += first;
    }
    __syncthreads();
    return first_of_warp[warp] + before - n;
}

// ---- grouping by row ------------------------------------------------------------------------------------------------

// Gives each row room for its entries, and lists the long ones. A thread a row.
template <class State>
__global__ __launch_bounds__(threads_per_block) void place_rows_kernel(const __grid_constant__ row_groups groups,
                                                                       std::uint64_t num_rows, State* state,
                                                                       capacities limits) {
    await_stream();
    if (has_failed(*state, limits) || state->list_fragments == 0) return;
    for (std::uint64_t start = std::uint64_t{blockIdx.x} * threads_per_block; start < num_rows;
         start += std::uint64_t{gridDim.x} * threads_per_block) {
        const std::uint64_t row = start + threadIdx.x;
        const std::uint32_t n = row < num_rows ? groups.counts[row] : 0;
        if (__syncthreads_or(static_cast<int>(n != 0)) == 0) continue;
        const auto first = static_cast<std::uint32_t>(reserve_for_block(n, &state->next_item));
        if (n != 0) groups.ends[row] = first;
        if (n > tuning::lane_entries)
            groups.long_rows[atomicAdd(&state->num_splits, 1u)] = uint2{static_cast<std::uint32_t>(row), n};
    }
}
// Afterwards groups.ends says where the rows end.
template <class State>
__global__ __launch_bounds__(threads_per_block) void group_entries_kernel(const __grid_constant__ row_groups groups,
                                                                          const State* state, capacities limits) {
    constexpr int batch = 4; // entries of a thread at once
    await_stream();
    if (has_failed(*state, limits)) return;
    const std::uint64_t num = state->list_fragments, step = std::uint64_t{gridDim.x} * threads_per_block;
    const auto* const rows = static_cast<const std::uint32_t*>(groups.list.keys);
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * threads_per_block + threadIdx.x; first < num;
         first += batch * step) {
        std::uint32_t row[batch], value[batch], at[batch];
#pragma unroll
        for (int k = 0; k < batch; ++k) {
            const std::uint64_t i = first + static_cast<std::uint64_t>(k) * step;
            row[k] = i < num ? rows[i] : 0;
            value[k] = i < num ? groups.list.values[i] : 0;
        }
#pragma unroll
        for (int k = 0; k < batch; ++k)
            if (first + static_cast<std::uint64_t>(k) * step < num) at[k] = atomicAdd(groups.ends + row[k], 1u);
#pragma unroll
        for (int k = 0; k < batch; ++k)
            if (first + static_cast<std::uint64_t>(k) * step < num) groups.grouped[at[k]] = value[k];
    }
}
// The values of each row behind each other in `grouped`.
template <int = 0>
void group_by_row(const row_groups& groups, std::uint64_t num_rows, pipeline_state* state, const capacities& limits,
                  cudaStream_t stream) {
    launch_behind(place_rows_kernel<pipeline_state>, fill_device(num_rows), threads_per_block, stream, stage::tile_sort,
                  groups, num_rows, state, limits);
    launch_behind(group_entries_kernel<pipeline_state>, fill_device(limits.fragments / 4 + 1), threads_per_block,
                  stream, stage::tile_sort, groups, static_cast<const pipeline_state*>(state), limits);
}

// ---- the sort -------------------------------------------------------------------------------------------------------

// Memory of the list and of its sort.
struct crossing_memory {
    std::uint64_t capacity = 0;
    std::uint32_t num_bodies = 1;
    bool are_wide = false;
    int bits = 0; // of a key
    sort_pairs pairs;
    sort_memory sort;
    std::uint64_t* wide_keys[2]{};
    std::uint32_t* wide_values[2]{};
    void* storage = nullptr;
    std::size_t storage_bytes = 0;

    // Keys below num_keys, of which there may be 2^64. A template, so that programs without solids compile no sort.
    template <int = 0>
    [[nodiscard]] static crossing_memory take(arena& memory, std::uint64_t capacity, uint128 num_keys,
                                              std::uint32_t num_bodies) {
        crossing_memory m;
        m.capacity = capacity;
        m.num_bodies = num_bodies;
        m.are_wide = num_keys > (uint128{1} << 32) || !are_sorted_here<std::uint32_t>(capacity);
        if (!m.are_wide) {
            m.bits = exact::bit_width(static_cast<std::uint64_t>(num_keys - 1));
            m.pairs = sort_pairs::take(memory, capacity);
            m.sort = sort_memory::take(memory, capacity, m.bits);
            return m;
        }
        m.bits = std::min(exact::bit_width(num_keys), 64); // with the filler
        for (int i = 0; i < 2; ++i) {
            m.wide_keys[i] = memory.take<std::uint64_t>(capacity);
            m.wide_values[i] = memory.take<std::uint32_t>(capacity);
        }
        m.storage_bytes = sort_bytes<std::uint64_t>(capacity, m.bits);
        m.storage = memory.take<std::byte>(m.storage_bytes);
        return m;
    }
    [[nodiscard]] crossing_list list(int at = 0) const {
        return {are_wide ? static_cast<void*>(wide_keys[at]) : pairs.keys[at],
                are_wide ? wide_values[at] : pairs.values[at], capacity, num_bodies, are_wide};
    }
};

// Makes what the sort of 32-bit keys starts from: zeros for the entries that there are.
template <class State>
__global__ __launch_bounds__(threads_per_block) void prepare_crossings_kernel(const __grid_constant__ sort_memory sort,
                                                                              const State* state, capacities limits) {
    await_stream();
    sort.zero(has_failed(*state, limits) ? 0 : state->list_fragments,
              std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x, std::uint64_t{gridDim.x} * blockDim.x);
}

// Sorts the entries by key; where they are then. state->list_fragments says how many there are.
template <int = 0>
[[nodiscard]] crossing_list sort_crossings(const crossing_memory& m, pipeline_state* state, const capacities& limits,
                                           cudaStream_t stream) {
    if (m.are_wide) {
        fill_end(m.wide_keys[0], m.wide_values[0], &state->list_fragments, m.capacity, state, limits, stream);
        return m.list(sort_by_cell(m.wide_keys, m.wide_values, m.capacity, m.bits, m.storage, m.storage_bytes,
                                   stage::tile_sort, stream));
    }
    launch_behind(prepare_crossings_kernel<pipeline_state>, fill_device(m.capacity / 8 + 1), threads_per_block, stream,
                  stage::tile_sort, m.sort, static_cast<const pipeline_state*>(state), limits);
    return m.list(sort_fragments(m.pairs, sort_count{state, limits}, m.capacity, m.sort, stream));
}

} // namespace voxelpipe::device
