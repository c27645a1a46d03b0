// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The samples of the band as lists of one fragment each, ascending. One kernel, twice: it counts the fragments of each
// row and, behind a sum over the rows, writes them.

#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/distance/device/shade_samples.cuh>
#include <voxelpipe/solid/device/list_rows.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Fragments of each row of samples along x, and how many lie before it.
struct sample_rows {
    std::uint32_t* counts;
    unsigned long long* before;
    void* storage; // of the sums
    std::size_t storage_bytes;
    std::uint32_t num;

    [[nodiscard]] static sample_rows take(arena& a, const glm::ivec3& extent) {
        sample_rows r{};
        r.num = static_cast<std::uint32_t>(extent.y) * static_cast<std::uint32_t>(extent.z);
        r.counts = a.take<std::uint32_t>(r.num);
        r.before = a.take<unsigned long long>(r.num);
        r.storage_bytes = cell_scan_bytes(r.num);
        r.storage = a.take<std::byte>(r.storage_bytes);
        return r;
    }
};

// Counts if `to` has no arrays.
template <class Shading, class Payload>
__global__ __launch_bounds__(threads_per_block) void list_samples_kernel(
    const __grid_constant__ distance_input in, const __grid_constant__ Shading s,
    const __grid_constant__ found_samples found, const __grid_constant__ inside_rows inside,
    const __grid_constant__ sample_rows rows, const __grid_constant__ solid_list_arrays<Payload> to, bool count_voxels,
    pipeline_state* state, capacities limits) {
    const bool is_counting = to.voxels == nullptr;
    if (is_counting ? has_failed(*state, limits) : !to.hold(*state, limits)) return;
    const int lane = static_cast<int>(threadIdx.x % 32);
    const unsigned before = (1u << lane) - 1;
    const std::uint64_t warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    sample_totals totals;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x / 32 + warp_in_block(); i < rows.num; i += warps) {
        const int y = static_cast<int>(i % static_cast<std::uint64_t>(in.extent.y)),
                  z = static_cast<int>(i / static_cast<std::uint64_t>(in.extent.y));
        std::uint32_t count = 0;
        const unsigned long long first = is_counting ? 0 : rows.before[i];
        const int runs = sample_run::count(in.extent.x);
        for (int r = 0; r < runs; ++r) {
            const sample_run run = sample_run::of(in, found, r, y, z);
            if (run.placed == 0) continue;
            for (int part = 0; part < sample_run::samples / 32; ++part) {
                if (!run.has_any(part)) continue;
                const std::uint64_t slot = run.slot_of(part);
                const int x0 = r * sample_run::samples + 32 * part, x = x0 + lane;
                std::uint32_t primitive = no_primitive;
                float length = in.band;
                if (x < in.extent.x && slot != found_samples::nowhere) {
                    const std::uint64_t from = found_samples::place(slot, x, y, z);
                    primitive = found.primitives[from];
                    length = found.distances[from];
                }
                const bool in_band = primitive != no_primitive;
                if (__ballot_sync(0xffffffffu, in_band) == 0) continue;
                const word row = inside.row(x0, y, z);
                using output_type = decltype(shade_sample(in, s, glm::ivec3(0), 0u, 0.0f, false));
                output_type out{};
                bool keeps = false;
                if (in_band) {
                    out = shade_sample(in, s, {x, y, z}, primitive, length, (row >> lane & 1u) != 0);
                    keeps = out.keep;
                    ++(keeps ? totals.fragments : totals.discarded);
                    ++totals.in_band;
                }
                __syncwarp();
                const unsigned kept = __ballot_sync(0xffffffffu, keeps);
                if (!is_counting && keeps) {
                    const unsigned long long at = first + count + static_cast<unsigned>(__popc(kept & before));
                    to.voxels[at] = i * static_cast<std::uint64_t>(in.extent.x) + static_cast<std::uint64_t>(x);
                    to.offsets[at] = at;
                    to.primitives[at] = primitive;
                    to.payloads[at] = out.values;
                }
                count += static_cast<unsigned>(__popc(kept));
            }
        }
        if (is_counting && lane == 0) rows.counts[i] = count;
    }
    if (is_counting) totals.add_up(count_voxels, state);
}

// Counts the fragments of the rows, or writes them into arrays that hold them.
template <class Payload, class Call>
void list_samples(const Call& call, const typename Call::memory& m, const typename Call::shading_type& s,
                  const inside_rows& inside, const solid_list_arrays<Payload>& to, cudaStream_t stream) {
    list_samples_kernel<typename Call::shading_type, Payload>
        <<<fill_device(std::uint64_t{m.rows.num} * 32), threads_per_block, 0, stream>>>(
            m.in, s, m.found, inside, m.rows, to, call.options.count_voxels, m.state, call.limits);
    check(cudaGetLastError(), stage::abuffer_emit);
    if (to.voxels != nullptr) return;
    sum_counts(m.rows.counts, m.rows.before, m.rows.num, m.rows.storage, m.rows.storage_bytes, stage::abuffer_emit,
               stream);
}

} // namespace voxelpipe::device
