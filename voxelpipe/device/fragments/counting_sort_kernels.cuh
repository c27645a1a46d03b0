// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The kernels of the counting sort (fragments/counting_sort.cuh), and their launches.

#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/fragments/counting_sort.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Numbers each fragment within its voxel, and counts each voxel's fragments.
template <class Count>
__global__ __launch_bounds__(threads_per_block) void number_fragments_kernel(
    const std::uint32_t* voxels, const __grid_constant__ Count count, const __grid_constant__ counting_memory m) {
    constexpr unsigned items = tuning::counting_items;
    await_stream();
    const auto n = static_cast<std::uint32_t>(count.get());
    const std::uint32_t lane = threadIdx.x % 32, below = (1u << lane) - 1;
    const std::uint64_t warp = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(),
                        warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t start = warp * items * 32; start < n; start += warps * items * 32) {
        const std::uint64_t first = start + lane;
        std::uint32_t voxel[items], number[items];
        unsigned same[items];
#pragma unroll
        for (unsigned k = 0; k < items; ++k) voxel[k] = first + 32 * k < n ? voxels[first + 32 * k] : ~0u;
#pragma unroll
        for (unsigned k = 0; k < items; ++k) {
            same[k] = __match_any_sync(0xffffffffu, voxel[k]); // neighbours in the list often share a voxel
            number[k] = 0;
            if ((same[k] & below) == 0 && voxel[k] != ~0u)
                number[k] = atomicAdd(&m.counts[voxel[k]], static_cast<std::uint32_t>(__popc(same[k])));
        }
#pragma unroll
        for (unsigned k = 0; k < items; ++k) {
            number[k] = __shfl_sync(0xffffffffu, number[k], __ffs(static_cast<int>(same[k])) - 1);
            if (voxel[k] != ~0u) m.numbers[first + 32 * k] = number[k] + static_cast<unsigned>(__popc(same[k] & below));
        }
    }
}

// Prefix sum over the lanes before this one; `all`: the sum over all lanes.
[[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long sum_before(unsigned long long own,
                                                                        unsigned long long& all) {
    const unsigned long long up_to = warp_sum_up_to(own);
    all = __shfl_sync(0xffffffffu, up_to, 31);
    return up_to - own;
}

// Words that tiles publish for later tiles: numbers of fragments and, from bit `voxels` on, of voxels that have some.
struct tile_sums {
    static constexpr int voxels = 31;
    static constexpr unsigned long long low = (1ull << voxels) - 1;

    // The sums of all earlier tiles; `sums` are this tile's. All lanes of one warp call it.
    [[nodiscard]] __device__ static unsigned long long before(unsigned long long* words, std::uint32_t tile,
                                                              unsigned long long sums) {
        if (threadIdx.x % 32 == 0) lookback::publish(words, tile, sums);
        return lookback::before(words, tile, sums, [](unsigned long long part) {
            const unsigned fragments = __reduce_add_sync(0xffffffffu, static_cast<unsigned>(part & low));
            const unsigned of_voxels = __reduce_add_sync(0xffffffffu, static_cast<unsigned>(part >> voxels));
            return static_cast<unsigned long long>(of_voxels) << voxels | fragments;
        });
    }
};

// Turns each voxel's count into the offset of its first fragment, and lists the voxels that have any.
template <class Memory>
__global__ __launch_bounds__(tuning::counting_threads) void list_counted_kernel(const __grid_constant__ order_buffers b,
                                                                                const __grid_constant__ Memory m,
                                                                                pipeline_state* state,
                                                                                capacities limits) {
    constexpr unsigned rounds = Memory::tile / tuning::counting_threads / 4, warps = tuning::counting_threads / 32;
    constexpr int shift = tile_sums::voxels;
    __shared__ unsigned long long of_warps[warps];
    __shared__ unsigned long long before_tile;
    // Long voxels of the tile by list: their number, later the slot of the next one. One global atomic per list and
    // tile, because all tiles update the same words.
    constexpr int lists = order_lists::block_list + 1;
    __shared__ unsigned num_long[lists], next_long[lists];
    if (threadIdx.x < lists) num_long[threadIdx.x] = 0;
    await_stream();
    __syncthreads();
    if (has_failed(*state, limits)) return;
    const auto n = static_cast<std::uint32_t>(state->list_fragments);
    if (n == 0) return;
    const std::uint32_t lane = threadIdx.x % 32, warp = warp_in_block(), tile = blockIdx.x;
    // A warp's voxels are neighbours; in each round a lane has four.
    const std::uint32_t first_four = tile * (Memory::tile / 4) + warp * (32 * rounds) + lane;
    uint4* const mine = reinterpret_cast<uint4*>(m.counts) + first_four;
    uint4 four[rounds];
    unsigned long long before[rounds], sum = 0;
#pragma unroll
    for (unsigned r = 0; r < rounds; ++r) four[r] = mine[32 * r];
#pragma unroll
    for (unsigned r = 0; r < rounds; ++r) {
        const uint4 c = four[r];
        const unsigned voxels = (c.x != 0) + (c.y != 0) + (c.z != 0) + (c.w != 0);
        const std::uint32_t fragments = c.x + c.y + c.z + c.w;
        if (fragments > tuning::max_of_window)
            for (const std::uint32_t one : {c.x, c.y, c.z, c.w})
                if (const int list = order_lists::list_of(one); list >= 0) atomicAdd(&num_long[list], 1u);
        unsigned long long all = 0;
        before[r] = sum + sum_before(static_cast<unsigned long long>(voxels) << shift | fragments, all);
        sum += all;
    }
    if (lane == 0) of_warps[warp] = sum;
    __syncthreads();
    if (warp == 0) {
        unsigned long long all = 0;
        const unsigned long long earlier = sum_before(lane < warps ? of_warps[lane] : 0, all);
        if (lane < warps) of_warps[lane] = earlier;
        const unsigned long long of_tiles = tile_sums::before(m.tiles, tile, all);
        if (lane == 0) before_tile = of_tiles;
        if (lane == 0 && tile == gridDim.x - 1) {
            const csr_pointers to = b.pointers();
            const std::uint64_t num = (of_tiles + all) >> shift;
            state->list_voxels = num;
            if (num <= to.voxel_capacity) to.offsets[num] = n;
            atomicOr(&m.starts[n / 32], 1u << n % 32);
        }
    }
    if (warp == 1 && lane < lists)
        next_long[lane] = num_long[lane] == 0 ? 0 : atomicAdd(&b.lists.counts[lane], num_long[lane]);
    __syncthreads();
    const unsigned long long earlier = before_tile + of_warps[warp];
    const csr_pointers to = b.pointers();
#pragma unroll
    for (unsigned r = 0; r < rounds; ++r) {
        const std::uint32_t c[4] = {four[r].x, four[r].y, four[r].z, four[r].w};
        if ((c[0] | c[1] | c[2] | c[3]) == 0) continue;
        const unsigned long long at = earlier + before[r];
        auto offset = static_cast<std::uint32_t>(at & tile_sums::low);
        std::uint64_t number = at >> shift;
        std::uint32_t offsets_of_four[4];
#pragma unroll
        for (unsigned k = 0; k < 4; ++k) {
            offsets_of_four[k] = offset;
            if (c[k] == 0) continue;
            if (const int list = order_lists::list_of(c[k]); list >= 0)
                b.lists.add(atomicAdd(&next_long[list], 1u), offset, c[k]);
            else if (c[k] > tuning::max_of_block)
                b.lists.push(offset, c[k]);
            const std::uint32_t voxel = 4 * (first_four + 32 * r) + k;
            if (number < to.voxel_capacity) {
                if (to.voxels != nullptr)
                    to.voxels[number] = voxel;
                else
                    to.narrow_voxels[number] = voxel;
                to.offsets[number] = offset;
            }
            ++number;
            atomicOr(&m.starts[offset / 32], 1u << offset % 32);
            offset += c[k];
        }
        mine[32 * r] = {offsets_of_four[0], offsets_of_four[1], offsets_of_four[2], offsets_of_four[3]};
    }
}

// Writes each fragment's primitive to its position.
template <class Count>
__global__ __launch_bounds__(threads_per_block) void scatter_fragments_kernel(
    const std::uint32_t* voxels, const std::uint32_t* values, std::uint32_t* to, const __grid_constant__ Count count,
    const __grid_constant__ counting_memory m) {
    constexpr unsigned items = tuning::counting_items;
    await_stream();
    const auto n = static_cast<std::uint32_t>(count.get());
    for (std::uint64_t first = std::uint64_t{blockIdx.x} * items * threads_per_block + threadIdx.x; first < n;
         first += std::uint64_t{gridDim.x} * items * threads_per_block) {
        std::uint32_t voxel[items], value[items], at[items];
#pragma unroll
        for (unsigned k = 0; k < items; ++k) {
            const std::uint64_t i = first + k * threads_per_block;
            if (i >= n) continue;
            voxel[k] = voxels[i];
            value[k] = values[i];
            at[k] = m.numbers[i];
        }
#pragma unroll
        for (unsigned k = 0; k < items; ++k)
            if (first + k * threads_per_block < n) at[k] += m.counts[voxel[k]];
#pragma unroll
        for (unsigned k = 0; k < items; ++k)
            if (first + k * threads_per_block < n) to[at[k]] = value[k];
    }
}

VOXELPIPE_DEFINES_KERNELS void order_by_counting(order_buffers b, const counted_pairs& pairs, const counting_memory& m,
                                                 std::uint64_t num_primitives, pipeline_state* state,
                                                 const capacities& limits, cudaStream_t stream, stage_clock* clock) {
    constexpr stage where = stage::abuffer_emit;
    const unsigned blocks = fill_device(limits.fragments / tuning::counting_items + 1);
    b.starts = m.starts;
    if (num_primitives <= std::uint64_t{tuning::dense_part} * tuning::max_dense_parts)
        b.lists.num_primitives = static_cast<std::uint32_t>(num_primitives);
    capacities of_lists = limits;
    of_lists.longest_ordered = ~0ull; // properties of voxels must not stop these kernels
    const sort_count count{state, of_lists};
    launch_behind(number_fragments_kernel<sort_count>, blocks, threads_per_block, stream, where, pairs.voxels, count,
                  m);
    launch_behind(list_counted_kernel<counting_memory>, static_cast<unsigned>(m.num_tiles()), tuning::counting_threads,
                  stream, where, b, m, state, of_lists);
    launch_behind(scatter_fragments_kernel<sort_count>, blocks, threads_per_block, stream, where, pairs.voxels,
                  pairs.primitives, b.from, count, m);
    end_stage(clock, &stage_times::tile_sort);
    order_fragments(b, num_primitives, state, limits, stream);
}

} // namespace voxelpipe::device
