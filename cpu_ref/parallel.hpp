// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Threads of the CPU backend: a parallel loop over items that any thread may take, and a stable radix sort. Results
// never depend on the number of threads: items are fixed pieces of work, each with its own part of the output.

#include <voxelpipe/core/threads.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
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

// Items of a number that is not known before: those of each block of the calls that make them, in order. Items with a
// key and a member merge(other) are merged with an equal key's of their block if that one is remembered, which is so
// unless another key has taken its place.
template <class Item>
class collected_items {
public:
    // Calls make(i, add) for i below `count`, which calls add(item).
    template <class Make>
    collected_items(unsigned num_threads, std::uint64_t count, const Make& make)
        : parts_((core::length_of(count) + block - 1) / block), first_(parts_.size() + 1), added_(parts_.size()) {
        struct memory {
            std::vector<Item> part;
            std::vector<std::uint32_t> remembered;
        };
        std::vector<memory> of_worker(std::max(num_threads, 1u));
        parallel_for(num_threads, parts_.size(), [&](unsigned worker, std::size_t b) {
            auto& [part, remembered] = of_worker[worker];
            if (merges && remembered.empty()) remembered.resize(num_remembered);
            part.clear();
            std::uint64_t added = 0;
            std::vector<Item>& items = part; // lambdas capture no structured bindings
            std::vector<std::uint32_t>& places = remembered;
            const auto add = [&](const Item& item) {
                ++added;
                if constexpr (merges) {
                    std::uint32_t& at = places[item.key * 0x9e3779b97f4a7c15u >> (64 - log2_remembered)];
                    if (at < items.size() && items[at].key == item.key) {
                        items[at].merge(item);
                        return;
                    }
                    at = static_cast<std::uint32_t>(items.size());
                }
                items.push_back(item);
            };
            const std::uint64_t last = std::min<std::uint64_t>(count, (b + 1) * block);
            for (std::uint64_t i = b * block; i < last; ++i) make(i, add);
            parts_[b] = std::vector<Item>(part); // no larger than it has to be
            added_[b] = added;
        });
        for (std::size_t b = 0; b < parts_.size(); ++b) first_[b + 1] = first_[b] + parts_[b].size();
    }
    [[nodiscard]] std::uint64_t size() const { return first_.back(); }
    // Calls of add.
    [[nodiscard]] std::uint64_t num_added() const {
        return std::accumulate(added_.begin(), added_.end(), std::uint64_t{0});
    }

    // Calls store(number, item) for all, and frees each block behind its last.
    template <class Store>
    void take(unsigned num_threads, const Store& store) {
        parallel_for(num_threads, parts_.size(), [&](unsigned, std::size_t b) {
            const std::vector<Item> part = std::move(parts_[b]);
            for (std::size_t i = 0; i < part.size(); ++i) store(first_[b] + i, part[i]);
        });
    }

private:
    static constexpr std::size_t block = 1024;
    static constexpr int log2_remembered = 12;
    static constexpr std::size_t num_remembered = std::size_t{1} << log2_remembered;
    static constexpr bool merges = requires(Item & a, const Item& b) { a.merge(b); };
    std::vector<std::vector<Item>> parts_;
    std::vector<std::uint64_t> first_, added_;
};

} // namespace voxelpipe::cpu
