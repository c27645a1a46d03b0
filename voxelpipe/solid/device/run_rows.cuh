// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep into runs: where the voxels that lie in any body begin and end along a row. One kernel, twice: it counts
// the bounds of each row and, behind a sum over the rows, writes them. Where no entry lies, the sweep steps over
// whatever length there is, so its time follows the entries.

#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/solid/device/list_rows.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Rows and their bounds, as core::found_rows has them; null where rows are counted. With all_entries the number of
// bounds behind the last row is not written, and num_rows and num_bounds are not read.
struct run_arrays {
    std::uint64_t *places, *first;
    std::uint32_t* bounds;
    std::uint64_t num_rows, num_bounds;
};

// The first entry of a row at voxel `from` or behind, but no later than `end`. All lanes take part.
[[nodiscard]] __device__ VOXELPIPE_INLINE int find_next_entry(const row_sweep& sweep, int from, int end) {
    auto next = static_cast<unsigned>(end);
    for (std::uint64_t i = sweep.entries.begin + threadIdx.x % 32; i < sweep.entries.end; i += 32) {
        const int at = entry_value{sweep.list.values[i]}.position();
        if (at >= from && static_cast<unsigned>(at) < next) next = static_cast<unsigned>(at);
    }
    __syncwarp();
    return static_cast<int>(__reduce_min_sync(0xffffffffu, next));
}

// counts.voxels becomes 1 for rows that have runs, counts.fragments their bounds.
template <int = 0> // compiled where it is called
__global__ __launch_bounds__(threads_per_block) void run_rows_kernel(const __grid_constant__ crossing_list list,
                                                                     const __grid_constant__ sweep_rules rules,
                                                                     const __grid_constant__ row_counts counts,
                                                                     const __grid_constant__ run_arrays to,
                                                                     std::uint64_t num_entries, pipeline_state* state,
                                                                     capacities limits) {
    __shared__ sweep_memory memory[threads_per_block / 32];
    await_stream();
    const bool is_counting = to.first == nullptr;
    if (has_failed(*state, limits)) return;
    if (!is_counting && num_entries != all_entries && blockIdx.x == 0 && threadIdx.x == 0)
        to.first[to.num_rows] = to.num_bounds;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const unsigned before = (1u << lane) - 1;
    sweep_totals totals;
    const std::uint64_t num = is_counting || num_entries == all_entries ? state->list_fragments : num_entries;
    for_each_row(list, rules, memory[warp_in_block()], num, [&](const row_sweep& sweep) {
        const auto reach = sweep.find_reach();
        if (lane == 0) totals.open_rows += reach.num_open;
        const unsigned long long first = is_counting ? 0 : counts.first_fragment[sweep.entries.begin];
        std::uint32_t num_bounds = 0;
        unsigned is_in = 0; // behind the voxels so far
        const auto offset = static_cast<std::uint32_t>(rules.offset.x);
        for (int x0 = reach.begin / 32 * 32; x0 < reach.end;) {
            const int x = x0 + lane;
            std::uint32_t n = 0; // bodies that have the lane's voxel
            sweep.for_each_body_at(x0, [&](const body_at_voxel& at) VOXELPIPE_INLINE_LAMBDA {
                if (x < rules.grid.extent.x) totals.see(at.winding);
                n += at.is_inside ? 1 : 0;
            });
            const unsigned mask = __ballot_sync(0xffffffffu, n != 0), ends = mask ^ (mask << 1 | is_in);
            if (!is_counting && (ends >> lane & 1u) != 0)
                to.bounds[first + num_bounds + static_cast<unsigned>(__popc(ends & before))] =
                    offset + static_cast<std::uint32_t>(x);
            num_bounds += static_cast<unsigned>(__popc(ends));
            is_in = mask >> 31;
            // Up to the next entry all voxels are as the last one here.
            const int next = find_next_entry(sweep, x0 + 32, reach.end), window_end = x0 + 32;
            x0 = next / 32 * 32 > window_end ? next / 32 * 32 : window_end;
            if (next == reach.end && reach.end > x0) x0 = reach.end;
            const std::uint64_t stretch = x0 > window_end ? static_cast<std::uint64_t>(x0 - window_end) : 0;
            totals.fragments += n + (lane == 31 ? n * stretch : 0);
            if (lane == 31) totals.voxels += static_cast<unsigned>(__popc(mask)) + is_in * stretch;
        }
        if (is_in != 0) {
            if (!is_counting && lane == 0)
                to.bounds[first + num_bounds] = offset + static_cast<std::uint32_t>(reach.end);
            ++num_bounds;
        }
        if (is_counting && lane == 0) {
            counts.voxels[sweep.entries.begin] = num_bounds != 0 ? 1 : 0;
            counts.fragments[sweep.entries.begin] = num_bounds;
        } else if (num_bounds != 0 && lane == 0) {
            const auto y = static_cast<int>(sweep.row % static_cast<std::uint64_t>(rules.grid.extent.y)),
                       z = static_cast<int>(sweep.row / static_cast<std::uint64_t>(rules.grid.extent.y));
            const unsigned long long row = counts.first_voxel[sweep.entries.begin];
            to.places[row] = core::morton_key(0, y + rules.offset.y, z + rules.offset.z);
            to.first[row] = first;
        }
    });
    if (is_counting) totals.add_up(rules, state);
}

// How many rows have runs, and their bounds.
struct run_totals {
    unsigned long long rows, bounds;
};
template <int = 0> // compiled where it is called
__global__ void total_runs(const __grid_constant__ row_counts counts, std::uint32_t capacity, run_totals* totals) {
    const std::uint32_t last = capacity - 1;
    *totals = {counts.first_voxel[last] + counts.voxels[last], counts.first_fragment[last] + counts.fragments[last]};
}

template <class Draw>
struct solid_runs : counted_rows<Draw> {
    using base = counted_rows<Draw>;
    using typename base::memory;

    // Sorted entries and counted rows.
    [[nodiscard]] crossing_list launch(const memory& m, cudaStream_t stream) const {
        const crossing_list sorted = this->sort(m, stream);
        sweep(sorted, m, {}, 0, stream);
        this->sum(m, stream);
        end_stage(this->entries.clock, &stage_times::tile_resolve);
        return sorted;
    }
    void total(const memory& m, run_totals* to, cudaStream_t stream) const {
        const auto capacity = static_cast<std::uint32_t>(this->entries.plan.limits.fragments);
        if (capacity == 0)
            check(cudaMemsetAsync(to, 0, sizeof(*to), stream), stage::tile_resolve);
        else
            launch_kernel(false, total_runs<0>, 1u, 1u, 0, stream, stage::tile_resolve, m.counts, capacity, to);
    }
    // Waits.
    [[nodiscard]] run_totals totals(const memory& m, const stream_memory& on) const {
        device_buffer<run_totals> there(on, std::size_t{1});
        total(m, there.data(), on.stream);
        run_totals here{};
        check(cudaMemcpyAsync(&here, there.data(), sizeof(here), cudaMemcpyDeviceToHost, on.stream));
        check(cudaStreamSynchronize(on.stream), stage::tile_resolve);
        return here;
    }
    void write(const crossing_list& sorted, const memory& m, const pipeline_state& on_host, const run_arrays& to,
               cudaStream_t stream) const {
        sweep(sorted, m, to, on_host.list_fragments, stream);
    }
    // As write(), without knowing what there is. `to` has room for the runs of as many entries as the list has.
    void write_within(const crossing_list& sorted, const memory& m, const run_arrays& to, cudaStream_t stream) const {
        sweep(sorted, m, to, all_entries, stream);
    }

private:
    void sweep(const crossing_list& sorted, const memory& m, const run_arrays& to, std::uint64_t num,
               cudaStream_t stream) const {
        const auto& limits = this->entries.plan.limits;
        launch_behind(run_rows_kernel<0>, fill_device(limits.fragments), threads_per_block, stream, stage::tile_resolve,
                      sorted, this->rules(), m.counts, to, num, m.state, limits);
    }
};

} // namespace voxelpipe::device
