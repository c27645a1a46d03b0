// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include <voxelpipe/core/radix_order.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace {

using voxelpipe::core::radix_order;

template <class Key>
std::vector<std::uint32_t> sorted_by(const std::vector<Key>& keys, std::vector<std::uint32_t> order) {
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    return order;
}
std::vector<std::uint32_t> all_of(std::size_t count) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    return order;
}

TEST(RadixOrder, IsThatOfAStableSortBySeveralKeys) {
    std::mt19937_64 random(1);
    for (const std::size_t count : {0U, 1U, 2U, 300U, 5000U})
        for (const int bits : {0, 1, 11, 12, 43, 64}) {
            std::vector<std::int64_t> first(count);
            std::vector<std::uint64_t> second(count);
            for (std::size_t i = 0; i < count; ++i) {
                const std::uint64_t key = bits == 0 ? 0 : random() >> (64 - bits);
                first[i] = static_cast<std::int64_t>(key - (bits == 0 ? 7 : std::uint64_t{1} << (bits - 1)));
                second[i] = random() % 40 << (bits / 2);
            }
            if (count > 2) {
                first[0] = std::numeric_limits<std::int64_t>::max();
                first[1] = std::numeric_limits<std::int64_t>::min();
            }
            radix_order order(count);
            order.sort([&](std::uint32_t i) { return second[i]; });
            const std::vector<std::uint32_t> by_second = sorted_by(second, all_of(count));
            ASSERT_EQ(order.items(), by_second) << count << " " << bits;
            order.sort([&](std::uint32_t i) { return first[i]; });
            ASSERT_EQ(order.items(), sorted_by(first, by_second)) << count << " " << bits;
        }
}

} // namespace
