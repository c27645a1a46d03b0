// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sums over earlier tiles in one pass (decoupled look-back: Merrill and Garland 2016). Each tile has a word, zero
// before the kernel: it publishes its own sum there, and later the sum up to and with it. Blocks start in the order of
// their tiles, so all earlier ones are running or done. (Taking the tile's number from a counter cost a tenth of a pass
// of a sort.)

#include <voxelpipe/device/base/relaxed_access.cuh>

#include <cstdint>

namespace voxelpipe::device {

struct lookback {
    // Flags of a word; sums are less than `own`.
    static constexpr unsigned long long own = 1ull << 62, all = 2ull << 62, value = own - 1;

    // Publishes a tile's own sum. One thread calls it.
    __device__ VOXELPIPE_INLINE static void publish(unsigned long long* words, std::uint32_t tile,
                                                    unsigned long long sum) {
        if (tile != 0) store_relaxed(words[tile], own | sum);
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
                    w = load_relaxed(words[mine]);
                while ((w & ~value) == 0);
            const unsigned with_all = __ballot_sync(0xffffffffu, (w & all) != 0);
            const unsigned nearest = with_all == 0 ? 31 : static_cast<unsigned>(__ffs(static_cast<int>(with_all))) - 1;
            earlier += add_up(lane <= nearest ? w & value : 0);
            if (with_all != 0) break;
        }
        if (lane == 0) store_relaxed(words[tile], all | (earlier + sum));
        return earlier;
    }

    // The sum over all earlier tiles for one thread alone, which has a digit of a sort. mine: the word of this tile;
    // words of consecutive tiles are `apart` words apart. all, value: the flags and the bits of a sum.
    template <class Word>
    [[nodiscard]] __device__ VOXELPIPE_INLINE static Word before_alone(const Word* mine, std::uint32_t tile,
                                                                       std::uint32_t apart, Word all, Word value) {
        constexpr int at_once = 4; // loads in flight
        Word sum = 0;
        for (std::int64_t last = std::int64_t{tile} - 1;;) {
            Word w[at_once];
#pragma unroll
            for (int k = 0; k < at_once; ++k)
                w[k] = last < k ? all // before the first tile
                                : load_relaxed(mine[(last - k - std::int64_t{tile}) * apart]);
            bool is_ready = true;
#pragma unroll
            for (int k = 0; k < at_once; ++k) {
                is_ready = is_ready && (w[k] & ~value) != 0;
                if (!is_ready) continue;
                sum += w[k] & value;
                --last;
                if ((w[k] & all) != 0) return sum;
            }
        }
    }
};

} // namespace voxelpipe::device
