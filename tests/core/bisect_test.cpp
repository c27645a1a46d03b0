// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Bisections against a walk over all numbers.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/shared_counter.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace {

namespace core = voxelpipe::core;

TEST(Bisect, FindsEveryBorder) {
    for (std::uint32_t count = 0; count < 40; ++count)
        for (std::uint32_t border = 0; border <= count; ++border) {
            std::uint32_t asked = 0;
            const auto is_before = [&](std::uint32_t i) {
                EXPECT_LT(i, count);
                ++asked;
                return i < border;
            };
            EXPECT_EQ(core::bisect(count, is_before), border);
            EXPECT_LE(asked, 6u);
        }
}

TEST(Bisect, FindsTheLastOfEveryRange) {
    for (int first = -3; first < 3; ++first)
        for (int end = first + 1; end < first + 40; ++end)
            for (int last = first; last < end; ++last) {
                int asked = 0;
                const auto holds = [&](int i) {
                    EXPECT_TRUE(first < i && i < end);
                    ++asked;
                    return i <= last;
                };
                EXPECT_EQ(core::bisect_last(first, end, holds), last);
                EXPECT_LE(asked, end - first == 1 ? 0 : 6);
            }
}

TEST(Bisect, TakesNumbersOfAllBits) {
    const std::uint64_t most = ~std::uint64_t{0};
    EXPECT_EQ(core::bisect(most, [=](std::uint64_t i) { return i < most - 1; }), most - 1);
    EXPECT_EQ(core::bisect_last(std::uint64_t{0}, most, [](std::uint64_t) { return true; }), most - 1);
    const std::uint32_t many = ~std::uint32_t{0};
    EXPECT_EQ(core::bisect(many, [](std::uint32_t) { return true; }), many);
    EXPECT_EQ(core::bisect_last(0u, many, [=](std::uint32_t i) { return i < many - 1; }), many - 2);
}

// Empty parts precede the one that begins at the same number.
TEST(Bisect, FindsTheOwnerOfANumber) {
    const std::vector<std::uint64_t> first{0, 0, 5, 5, 5, 9};
    const auto owner = [&](std::uint64_t number) {
        return core::find_owner(first.data(), static_cast<std::uint32_t>(first.size()), number);
    };
    EXPECT_EQ(owner(0), 1u);
    EXPECT_EQ(owner(4), 1u);
    EXPECT_EQ(owner(5), 4u);
    EXPECT_EQ(owner(8), 4u);
    EXPECT_EQ(owner(9), 5u);
    EXPECT_EQ(owner(1000), 5u);
    EXPECT_EQ(core::count_below(first.data(), first.size(), 5), 2u);
    EXPECT_EQ(core::count_below(first.data(), first.size(), 10), 6u);
}

} // namespace
