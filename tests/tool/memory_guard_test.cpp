// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The budget as the program keeps it: this test has the program's operator new (memory_guard.cpp).
#include "sanitized.hpp"

#include <model/memory.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <thread>
#include <vector>

using namespace voxelize;

namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20;

using block = std::unique_ptr<char[]>;
// One page of it is resident.
block untouched(std::size_t bytes) {
    block made(new char[bytes]);
    static_cast<volatile char*>(made.get())[bytes / 2] = 1; // a block without use is left out by compilers
    return made;
}
// Resident as a whole.
block touched(std::size_t bytes) {
    block made(new char[bytes]);
    std::fill_n(made.get(), bytes, '\1');
    return made;
}

// What was given back between small blocks that stay, beside a counted block that is not resident: the heap must not
// keep it where nobody counts it.
TEST(MemoryGuard, MemoryThatIsGivenBackIsGoneOrCounted) {
    if (tool_test::sanitized) return;
    const std::uint64_t limit = memory::resident() + 200 * mebibyte;
    memory::set_limit(limit, true);
    const block kept = untouched(100 * mebibyte);
    std::vector<block> small, middle;
    for (int i = 0; i < 150; ++i) {
        middle.push_back(touched(mebibyte / 2));
        small.push_back(touched(4096));
    }
    middle.clear();
    std::vector<block> all;
    try {
        for (;;) all.push_back(touched(3 * mebibyte));
    } catch (const std::bad_alloc&) {
    }
    memory::set_limit(0, false);
    EXPECT_GE(limit, memory::peak());
    EXPECT_LT(25U, all.size()); // what nothing had touched is counted: not much more than 100 MiB are left
    EXPECT_GT(36U, all.size());
}

// Small blocks are not counted one by one, yet leave less room.
TEST(MemoryGuard, SmallBlocksLeaveLessRoom) {
    if (tool_test::sanitized) return;
    memory::set_limit(memory::resident() + 400 * mebibyte, true);
    const block kept = untouched(200 * mebibyte);
    const std::uint64_t before = memory::room();
    std::vector<block> small;
    for (std::size_t i = 0; i < 50 * mebibyte / 4096; ++i) small.push_back(touched(4096));
    const std::uint64_t after = memory::room();
    memory::set_limit(0, false);
    EXPECT_LE(after + 49 * mebibyte, before); // the heap may have had some room
    EXPECT_GE(after + 55 * mebibyte, before);
}

// Nor do they go past the limit where no counted block comes between them, on whatever thread.
TEST(MemoryGuard, SmallBlocksEndAtTheLimit) {
    if (tool_test::sanitized) return;
    const std::uint64_t limit = std::max(memory::peak(), memory::resident() + 100 * mebibyte);
    memory::set_limit(limit, true);
    std::size_t taken = 0;
    bool refused = false;
    std::thread([&] {
        std::vector<block> small(limit / 16384);
        try {
            for (block& b : small) {
                b = touched(32768);
                taken += 32768;
            }
        } catch (const std::bad_alloc&) {
            refused = true;
        }
    }).join();
    const std::uint64_t peak = memory::peak();
    memory::set_limit(0, false);
    EXPECT_TRUE(refused);
    EXPECT_LT(80 * mebibyte, taken);
    EXPECT_GE(limit + mebibyte, peak);
}

} // namespace
