// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The number of blocks for any number of items. A count that is truncated to 32 bits would leave the device idle, or
// work undone.

#include <voxelpipe/device/base/launch_size.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace {

namespace core = voxelpipe::core;

// Numbers around every power of two, including 2^63 and the largest number.
std::vector<std::uint64_t> numbers(int max_bits) {
    std::vector<std::uint64_t> all{0};
    for (int bit = 0; bit < max_bits; ++bit) {
        const std::uint64_t power = std::uint64_t{1} << bit;
        for (const std::uint64_t n : {power - 1, power, power + 1, power + power / 3}) all.push_back(n);
    }
    all.push_back(max_bits == 64 ? std::numeric_limits<std::uint64_t>::max() : (std::uint64_t{1} << max_bits) - 1);
    return all;
}

TEST(LaunchSize, LoopingKernelsFillTheDeviceAndNoMore) {
    for (const std::uint64_t items : numbers(64))
        for (const std::uint32_t threads : {32u, 128u, 256u, 1024u})
            for (const std::uint32_t multiprocessors : {0u, 1u, 7u, 132u, 1000u, 0xffffffffu})
                for (const std::uint32_t each : {0u, 1u, 4u, 8u, 16u, 0xffffffffu}) {
                    const std::uint64_t blocks = core::blocks_to_fill(items, threads, multiprocessors, each);
                    ASSERT_GE(blocks, 1u);
                    ASSERT_LE(blocks, core::max_blocks);
                    const auto room = std::uint64_t{multiprocessors} * each;
                    const auto reached = blocks * threads;
                    // Every item has a thread, or the device is full, or the grid has its largest size.
                    ASSERT_TRUE(reached >= items || blocks >= room || blocks == core::max_blocks)
                        << items << ' ' << threads << ' ' << multiprocessors << ' ' << each << ": " << blocks;
                    // No block is without an item, except the one that a launch needs, and no more blocks than fit the
                    // device.
                    if (blocks > 1) {
                        ASSERT_LT(reached - threads, items);
                        ASSERT_LE(blocks, room);
                    }
                }
}

TEST(LaunchSize, TwoToTheFortyItemsFillTheDevice) {
    EXPECT_EQ(core::blocks_to_fill(std::uint64_t{1} << 40, 256, 132, 8), 132u * 8u);
    EXPECT_EQ(core::blocks_to_fill((std::uint64_t{1} << 40) + 1, 256, 132, 4), 132u * 4u);
    EXPECT_EQ(core::blocks_to_fill(std::uint64_t{1} << 63, 256, 132, 8), 132u * 8u);
    EXPECT_EQ(core::blocks_to_fill(0, 256, 132, 8), 1u);
    EXPECT_EQ(core::blocks_to_fill(257, 256, 132, 8), 2u);
}

TEST(LaunchSize, EveryItemHasAThread) {
    for (const std::uint64_t n : numbers(32)) {
        const auto items = static_cast<std::uint32_t>(n);
        for (const std::uint32_t threads : {32u, 128u, 256u, 1024u}) {
            const std::uint64_t blocks = core::blocks_for_each(items, threads);
            ASSERT_GE(blocks, 1u);
            ASSERT_LE(blocks, core::max_blocks);
            ASSERT_GE(blocks * threads, items);
            ASSERT_TRUE(blocks == 1 || (blocks - 1) * threads < items);
        }
    }
    EXPECT_EQ(core::blocks_for_each(0xffffffffu, 256), 1u << 24);
}

} // namespace
