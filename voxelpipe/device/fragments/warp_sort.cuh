// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sorting the numbers of a warp in registers: sorting networks, and loads and stores of neighbours.

#include <voxelpipe/device/scene/scene.cuh>

#include <cstdint>

namespace voxelpipe::device {

template <class Word>
__device__ VOXELPIPE_INLINE void put_in_order(Word& low, Word& high) {
    const Word a = low, b = high;
    low = min(a, b);
    high = max(a, b);
}

// Bitonic merge of a warp's numbers; a lane has Items consecutive ones. Sorts runs of 2 * apart numbers, each of which
// is less than all later runs, or becomes so when numbers `apart` from each other have been compared.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void merge_warp(Word (&w)[Items], int apart) {
    const int lane = static_cast<int>(threadIdx.x % 32);
#pragma unroll
    for (; apart > 0; apart /= 2) {
        if (apart >= Items) {
            const bool lower = (lane & apart / Items) == 0;
#pragma unroll
            for (int k = 0; k < Items; ++k) {
                const Word other = __shfl_xor_sync(0xffffffffu, w[k], apart / Items);
                w[k] = lower ? min(w[k], other) : max(w[k], other);
            }
        } else {
#pragma unroll
            for (int k = 0; k < Items; ++k)
                if ((k & apart) == 0) put_in_order(w[k], w[k | apart]);
        }
    }
}

// Sorts a warp's numbers. Each run is first compared with its mirror image, so that all comparisons go in the same
// direction.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void sort_warp(Word (&w)[Items]) {
    const int lane = static_cast<int>(threadIdx.x % 32);
#pragma unroll
    for (int size = 2; size <= 32 * Items; size *= 2) {
        if (size <= Items) {
#pragma unroll
            for (int k = 0; k < Items; ++k)
                if ((k & size / 2) == 0) put_in_order(w[k], w[k ^ (size - 1)]);
        } else {
            const int lanes = size / Items;
            const bool lower = (lane & lanes / 2) == 0;
#pragma unroll
            for (int k = 0; k < Items / 2; ++k) {
                const Word a = __shfl_xor_sync(0xffffffffu, w[Items - 1 - k], lanes - 1);
                const Word b = __shfl_xor_sync(0xffffffffu, w[k], lanes - 1);
                w[k] = lower ? min(w[k], a) : max(w[k], a);
                w[Items - 1 - k] = lower ? min(w[Items - 1 - k], b) : max(w[Items - 1 - k], b);
            }
        }
        merge_warp(w, size / 4);
    }
}

// Sorts a warp's numbers that consist of runs of at most `longest`, each run less than the next: odd-even
// transposition, which takes as many rounds as the longest run has numbers.
template <class Word, int Items>
__device__ VOXELPIPE_INLINE void sort_runs_of_warp(Word (&w)[Items], std::uint32_t longest) {
    static_assert(Items % 2 == 0);
    const bool is_first = threadIdx.x % 32 == 0, is_last = threadIdx.x % 32 == 31;
    for (std::uint32_t round = 0; round < longest; round += 2) {
#pragma unroll
        for (int k = 0; k < Items; k += 2) put_in_order(w[k], w[k + 1]);
#pragma unroll
        for (int k = 1; k < Items - 1; k += 2) put_in_order(w[k], w[k + 1]);
        const Word previous = __shfl_up_sync(0xffffffffu, w[Items - 1], 1);
        const Word next = __shfl_down_sync(0xffffffffu, w[0], 1);
        w[0] = max(w[0], is_first ? Word{0} : previous);
        w[Items - 1] = min(w[Items - 1], is_last ? ~Word{0} : next);
    }
}

// Loads a lane's Items neighbours of n numbers, from number `first` on; ~0 beyond. numbers: aligned to 16 bytes.
template <int Items>
__device__ VOXELPIPE_INLINE void load_neighbours(const std::uint32_t* numbers, std::uint32_t first, std::uint32_t n,
                                                 std::uint32_t (&to)[Items]) {
    static_assert(Items % 4 == 0);
    if (first + Items <= n) {
#pragma unroll
        for (int k = 0; k < Items; k += 4) {
            const uint4 four = *reinterpret_cast<const uint4*>(numbers + first + k);
            to[k] = four.x;
            to[k + 1] = four.y;
            to[k + 2] = four.z;
            to[k + 3] = four.w;
        }
    } else {
#pragma unroll
        for (std::uint32_t k = 0; k < Items; ++k) to[k] = first + k < n ? numbers[first + k] : ~0u;
    }
}
// Stores those with index in [begin, end).
template <int Items>
__device__ VOXELPIPE_INLINE void store_neighbours(std::uint32_t* numbers, std::uint32_t first, std::uint32_t begin,
                                                  std::uint32_t end, const std::uint32_t (&from)[Items]) {
    if (first >= begin && first + Items <= end && reinterpret_cast<std::uintptr_t>(numbers) % 16 == 0) {
#pragma unroll
        for (int k = 0; k < Items; k += 4)
            *reinterpret_cast<uint4*>(numbers + first + k) = {from[k], from[k + 1], from[k + 2], from[k + 3]};
    } else {
#pragma unroll
        for (std::uint32_t k = 0; k < Items; ++k)
            if (first + k >= begin && first + k < end) numbers[first + k] = from[k];
    }
}

} // namespace voxelpipe::device
