// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep into an A-buffer: voxels ascending, and of each the fragments of its bodies, ascending. One kernel, twice:
// it counts the voxels and fragments of each row and, behind a sum over the rows, writes them.

#include <voxelpipe/solid/device/fill_rows.cuh>
#include <voxelpipe/solid/device/solid_call.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// Numbers of voxels and fragments of each row, by the number of the row's first entry, and their prefix sums.
struct row_counts {
    std::uint32_t *voxels, *fragments;
    unsigned long long *first_voxel, *first_fragment;

    [[nodiscard]] static row_counts take(arena& memory, std::uint64_t capacity) {
        row_counts c{};
        c.voxels = memory.take<std::uint32_t>(capacity);
        c.fragments = memory.take<std::uint32_t>(capacity);
        c.first_voxel = memory.take<unsigned long long>(capacity);
        c.first_fragment = memory.take<unsigned long long>(capacity);
        return c;
    }
};

// Arrays of an A-buffer; null where rows are counted.
template <class Payload>
struct solid_list_arrays {
    std::uint64_t *voxels, *offsets;
    std::uint32_t* primitives;
    Payload* payloads;
    std::uint64_t max_voxels = ~std::uint64_t{0}, max_fragments = ~std::uint64_t{0}; // beyond them nothing is written

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool hold(const pipeline_state& s, const capacities& limits) const {
        return !has_failed(s, limits) && s.voxels <= max_voxels && s.fragments <= max_fragments;
    }
};
// In place of the number of entries, where the host does not know it.
inline constexpr std::uint64_t all_entries = ~std::uint64_t{0};

template <class SolidShader, class Payload>
__global__ __launch_bounds__(threads_per_block) void list_rows_kernel(
    const __grid_constant__ crossing_list list, const __grid_constant__ sweep_rules rules,
    const __grid_constant__ body_shaders<SolidShader> shaders, const __grid_constant__ row_counts counts,
    const __grid_constant__ solid_list_arrays<Payload> to, std::uint64_t num_entries, pipeline_state* state,
    capacities limits) {
    __shared__ sweep_memory memory[threads_per_block / 32];
    await_stream();
    const bool is_counting = to.voxels == nullptr;
    if (is_counting ? has_failed(*state, limits) : !to.hold(*state, limits)) return;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const unsigned before = (1u << lane) - 1;
    sweep_totals totals;
    const std::uint64_t num = is_counting || num_entries == all_entries ? state->list_fragments : num_entries;
    for_each_row(list, rules, memory[warp_in_block()], num, [&](const row_sweep& sweep) {
        const auto y = static_cast<int>(sweep.row % static_cast<std::uint64_t>(rules.grid.extent.y)),
                   z = static_cast<int>(sweep.row / static_cast<std::uint64_t>(rules.grid.extent.y));
        const auto reach = sweep.find_reach();
        if (lane == 0) totals.open_rows += reach.num_open;
        std::uint32_t num_voxels = 0;
        std::uint64_t num_fragments = 0;
        unsigned long long voxel_at = is_counting ? 0 : counts.first_voxel[sweep.entries.begin],
                           fragment_at = is_counting ? 0 : counts.first_fragment[sweep.entries.begin];
        for (int x0 = reach.begin / 32 * 32; x0 < reach.end; x0 += 32) {
            const int x = x0 + lane;
            const glm::ivec3 voxel = rules.offset + glm::ivec3(x, y, z);
            std::uint32_t n = 0; // fragments of the lane's voxel
            sweep.for_each_body_at(x0, [&](const body_at_voxel& at) {
                if (x < rules.grid.extent.x) totals.see(at.winding);
                if (at.is_inside) {
                    const bool keep = shaders.shade(at, voxel).keep;
                    n += static_cast<std::uint32_t>(keep);
                    totals.discarded += static_cast<unsigned>(!keep);
                }
                __syncwarp();
            });
            const unsigned with_any = __ballot_sync(0xffffffffu, n != 0);
            if (with_any == 0) continue;
            const auto upto = static_cast<std::uint32_t>(sum_up_to_lane(static_cast<std::int32_t>(n)));
            const std::uint32_t all = __shfl_sync(0xffffffffu, upto, 31);
            if (is_counting) {
                num_voxels += static_cast<unsigned>(__popc(with_any));
                num_fragments += all;
                continue;
            }
            unsigned long long at_fragment = fragment_at + (upto - n);
            if (n != 0) {
                const unsigned long long i = voxel_at + static_cast<unsigned>(__popc(with_any & before));
                to.voxels[i] =
                    sweep.row * static_cast<std::uint64_t>(rules.grid.extent.x) + static_cast<std::uint64_t>(x);
                to.offsets[i] = at_fragment;
            }
            __syncwarp();
            sweep.for_each_body_at(x0, [&](const body_at_voxel& at) {
                if (at.is_inside) {
                    const auto out = shaders.shade(at, voxel);
                    if (out.keep) {
                        to.primitives[at_fragment] = at.body;
                        if constexpr (!std::is_same_v<Payload, no_payload>)
                            to.payloads[at_fragment] = voxelpipe::get<0>(out.values);
                        ++at_fragment;
                    }
                }
                __syncwarp();
            });
            voxel_at += static_cast<unsigned>(__popc(with_any));
            fragment_at += all;
        }
        if (is_counting && lane == 0) {
            counts.voxels[sweep.entries.begin] = num_voxels;
            counts.fragments[sweep.entries.begin] = static_cast<std::uint32_t>(num_fragments);
            totals.voxels += num_voxels;
            totals.fragments += num_fragments;
            if (num_fragments > 0xffffffffu) atomicOr(&state->next_item, 1u); // has_overlong_row
        }
    });
    if (is_counting) totals.add_up(rules, state);
}
template <class Payload>
__global__ void end_offsets_kernel(const __grid_constant__ solid_list_arrays<Payload> to, std::uint64_t num_voxels,
                                   std::uint64_t num_fragments) {
    to.offsets[num_voxels] = num_fragments;
}

// A call whose rows are counted before they are written.
template <class Draw>
struct counted_rows {
    using entries_type = solid_entries<Draw>;
    entries_type entries;

    struct memory {
        pipeline_state* state;
        typename entries_type::memory entries;
        row_counts counts;
        void* storage; // of the sums
        std::size_t storage_bytes;
    };
    [[nodiscard]] memory take(arena& a) const {
        memory m{};
        m.state = a.take<pipeline_state>(1);
        m.entries = entries.take(a);
        const auto capacity = entries.plan.limits.fragments;
        m.counts = row_counts::take(a, capacity);
        m.storage_bytes = cell_scan_bytes(static_cast<std::uint32_t>(capacity));
        m.storage = a.take<std::byte>(m.storage_bytes);
        return m;
    }
    [[nodiscard]] std::size_t plan_memory() const {
        arena a;
        (void)take(a);
        return a.used();
    }
    [[nodiscard]] sweep_rules rules() const {
        sweep_rules r = entries.rules();
        r.count_voxels = true;
        return r;
    }

protected:
    // Sorted entries, and counts that are zero.
    [[nodiscard]] crossing_list sort(const memory& m, cudaStream_t stream) const {
        const auto capacity = entries.plan.limits.fragments;
        const crossing_list sorted = entries.launch(m.entries, m.state, stream);
        check(cudaMemsetAsync(m.counts.voxels, 0, capacity * sizeof(std::uint32_t), stream), stage::abuffer_emit);
        check(cudaMemsetAsync(m.counts.fragments, 0, capacity * sizeof(std::uint32_t), stream), stage::abuffer_emit);
        return sorted;
    }
    void sum(const memory& m, cudaStream_t stream) const {
        const auto capacity = static_cast<std::uint32_t>(entries.plan.limits.fragments);
        sum_counts(m.counts.voxels, m.counts.first_voxel, capacity, m.storage, m.storage_bytes, stage::abuffer_emit,
                   stream);
        sum_counts(m.counts.fragments, m.counts.first_fragment, capacity, m.storage, m.storage_bytes,
                   stage::abuffer_emit, stream);
    }
};

template <class Draw, class Payload>
struct solid_lists : counted_rows<Draw> {
    using typename counted_rows<Draw>::entries_type;
    using typename counted_rows<Draw>::memory;
    using counted_rows<Draw>::entries;
    using counted_rows<Draw>::rules;

    // Sorted entries and counted rows: state->voxels and state->fragments are what the lists will have.
    [[nodiscard]] crossing_list launch(const memory& m, cudaStream_t stream) const {
        const crossing_list sorted = this->sort(m, stream);
        sweep(sorted, m, {}, 0, entries.shaders(m.entries, stream), stream);
        this->sum(m, stream);
        end_stage(entries.clock, &stage_times::tile_resolve);
        return sorted;
    }
    // True if a row has 2^32 fragments or more.
    [[nodiscard]] static bool has_overlong_row(const pipeline_state& on_host) { return on_host.next_item != 0; }
    // As write(), within the arrays' capacities, without knowing what there is.
    void write_within(const crossing_list& sorted, const memory& m, const solid_list_arrays<Payload>& to,
                      cudaStream_t stream) const {
        sweep(sorted, m, to, all_entries, body_shaders_of(m), stream);
    }
    void write(const crossing_list& sorted, const memory& m, const pipeline_state& on_host,
               const solid_list_arrays<Payload>& to, cudaStream_t stream) const {
        if (entries.clock != nullptr) entries.clock->start(); // leaves the wait and the allocations out
        sweep(sorted, m, to, on_host.list_fragments, body_shaders_of(m), stream);
        end_offsets_kernel<Payload><<<1, 1, 0, stream>>>(to, on_host.voxels, on_host.fragments);
        check(cudaGetLastError(), stage::abuffer_emit);
        end_stage(entries.clock, &stage_times::abuffer_emit);
    }

private:
    [[nodiscard]] auto body_shaders_of(const memory& m) const {
        return body_shaders<typename entries_type::solid_shader>{entries.draws[0].fragment_shader, m.entries.shaders};
    }
    void sweep(const crossing_list& sorted, const memory& m, const solid_list_arrays<Payload>& to, std::uint64_t num,
               const body_shaders<typename entries_type::solid_shader>& shaders, cudaStream_t stream) const {
        const auto& limits = entries.plan.limits;
        launch_behind(list_rows_kernel<typename entries_type::solid_shader, Payload>, fill_device(limits.fragments),
                      threads_per_block, stream, stage::abuffer_emit, sorted, rules(), shaders, m.counts, to, num,
                      m.state, limits);
    }
};

} // namespace voxelpipe::device
