// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sums over earlier tiles in one pass (decoupled look-back: Merrill and Garland 2016). Each tile has a word, zero
// before the kernel: it publishes its own sum there, and later the sum up to and with it. Blocks start in the order of
// their tiles, so all earlier ones are running or done. The digits of radix_sort_kernels.cuh look back one thread a
// word, with four loads in flight.

#include <voxelpipe/config.hpp>

#include <cuda/atomic>

#include <cstdint>

namespace voxelpipe::device {

struct lookback {
    // Flags of a word; sums are less than `own`.
    static constexpr unsigned long long own = 1ull << 62, all = 2ull << 62, value = own - 1;
    using word = ::cuda::atomic_ref<unsigned long long, ::cuda::thread_scope_device>;

    // Publishes a tile's own sum. One thread calls it.
    __device__ VOXELPIPE_INLINE static void publish(unsigned long long* words, std::uint32_t tile,
                                                    unsigned long long sum) {
        if (tile != 0) word(words[tile]).store(own | sum, ::cuda::memory_order_relaxed);
    }

    // The sum over all earlier tiles; `sum` is this tile's, as published. add_up(part) gives all lanes of a warp the
    // sum of their parts. All lanes of one warp call it.
    template <class AddUp>
    [[nodiscard]] __device__ VOXELPIPE_INLINE static unsigned long long
    before(unsigned long long* words, std::uint32_t tile, unsigned long long sum, const AddUp& add_up) {
        const auto lane = threadIdx.x % 32;
        unsigned long long earlier = 0;
        for (std::int64_t last = std::int64_t{tile} - 1; tile != 0; last -= 32) { // lane k reads tile last - k
            const std::int64_t mine = last - lane;
            unsigned long long w = all; // before the first tile
            if (mine >= 0) do
                    w = word(words[mine]).load(::cuda::memory_order_relaxed);
                while ((w & ~value) == 0);
            const unsigned with_all = __ballot_sync(0xffffffffu, (w & all) != 0);
            const unsigned nearest = with_all == 0 ? 31 : static_cast<unsigned>(__ffs(static_cast<int>(with_all))) - 1;
            earlier += add_up(lane <= nearest ? w & value : 0);
            if (with_all != 0) break;
        }
        if (lane == 0) word(words[tile]).store(all | (earlier + sum), ::cuda::memory_order_relaxed);
        return earlier;
    }
};

} // namespace voxelpipe::device
