// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The path of one of many workers through several lists, chunk by chunk. All lists advance together, part by part, the
// last list first in each part; a worker takes every num_workers-th chunk.

#include <voxelpipe/config.hpp>
#include <voxelpipe/tuning/tuning_raster.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

template <int Lists>
class list_walk {
public:
    struct chunk {
        int list; // negative after the last one
        std::uint32_t number;
    };

    // chunks: the lengths of the lists, in chunks; fewer than 2^32 - num_workers in all. num_workers is below 2^29.
    VOXELPIPE_HD VOXELPIPE_INLINE list_walk(const std::uint32_t (&chunks)[std::size_t{Lists}], std::uint32_t worker,
                                            std::uint32_t num_workers)
        : at_(worker), step_(num_workers) {
        std::uint32_t all = 0;
        for (int k = 0; k < Lists; ++k) {
            chunks_[k] = chunks[k];
            all += chunks[k];
        }
        while (part_bits_ < tuning::max_part_bits && all >> part_bits_ >= 8 * num_workers) ++part_bits_;
    }
    // This worker's next chunk. After the last, always none.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE chunk next() {
        while (at_ >= end_) {
            if (list_ == 0) {
                if (part_ + 1 == 1u << part_bits_) return {-1, 0};
                ++part_;
                list_ = Lists;
            }
            --list_;
            std::uint32_t chunks = chunks_[0]; // selected without an index, which would force the array into memory
            for (int k = 1; k < Lists; ++k) chunks = list_ == k ? chunks_[k] : chunks;
            const std::uint32_t begin = begin_of(part_, chunks);
            shift_ = begin - end_;
            end_ += begin_of(part_ + 1, chunks) - begin;
        }
        const std::uint32_t number = at_ + shift_;
        at_ += step_;
        return {list_, number};
    }

private:
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t begin_of(std::uint32_t part, std::uint32_t chunks) const {
        return static_cast<std::uint32_t>(static_cast<std::uint64_t>(chunks) * part >> part_bits_);
    }
    std::uint32_t chunks_[std::size_t{Lists}];
    int part_bits_ = 0;
    // Chunks are numbered in the order of the walk: those of part_ and list_ end at end_, and number n is the list's n
    // + shift_.
    std::uint32_t at_, step_, part_ = 0, end_ = 0, shift_ = 0;
    int list_ = Lists;
};

} // namespace voxelpipe::core
