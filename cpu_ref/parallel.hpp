// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Threads of the CPU backend: a parallel loop over items that any thread may take, and a stable radix sort. Results
// never depend on the number of threads: items are fixed pieces of work, each with its own part of the output.

#include <voxelpipe/core/threads.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

using core::parallel_for;
using core::raw_array;

// Sorts items by the lowest key_bits bits of item.key, stably.
template <class Item>
void radix_sort(unsigned num_threads, raw_array<Item>& items, int key_bits) {
    constexpr int max_digit_bits = 13; // 32 KB of counters: one pass up to 8192 keys, cache-friendly scatter beyond
    if (key_bits <= 0 || items.size() < 2) return;
    const int passes = (key_bits + max_digit_bits - 1) / max_digit_bits;
    const int digit_bits = (key_bits + passes - 1) / passes;
    const std::size_t num_digits = std::size_t{1} << digit_bits;
    const std::size_t blocks = items.size() < 65536 ? 1 : std::max(1u, num_threads);
    const std::size_t block_size = (items.size() + blocks - 1) / blocks;
    std::vector<std::size_t> counts(blocks * num_digits);
    raw_array<Item> scratch(items.size());
    for (int pass = 0; pass < passes; ++pass) {
        const int shift = pass * digit_bits;
        const auto digit = [&](const Item& i) {
            return static_cast<std::size_t>(static_cast<std::uint64_t>(i.key) >> shift) & (num_digits - 1);
        };
        std::fill(counts.begin(), counts.end(), std::size_t{0});
        parallel_for(num_threads, blocks, [&](unsigned, std::size_t b) {
            std::size_t* const c = counts.data() + b * num_digits;
            const std::size_t last = std::min(items.size(), (b + 1) * block_size);
            for (std::size_t i = b * block_size; i < last; ++i) ++c[digit(items[i])];
        });
        std::size_t sum = 0;
        for (std::size_t d = 0; d < num_digits; ++d)
            for (std::size_t b = 0; b < blocks; ++b) {
                const std::size_t n = counts[b * num_digits + d];
                counts[b * num_digits + d] = sum;
                sum += n;
            }
        parallel_for(num_threads, blocks, [&](unsigned, std::size_t b) {
            std::size_t* const c = counts.data() + b * num_digits;
            const std::size_t last = std::min(items.size(), (b + 1) * block_size);
            for (std::size_t i = b * block_size; i < last; ++i) scratch[c[digit(items[i])]++] = items[i];
        });
        std::swap(items, scratch);
    }
}

} // namespace voxelpipe::cpu
