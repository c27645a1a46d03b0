// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Several workers walk several lists: every chunk once, all lists at the same pace.

#include <voxelpipe/device/raster/list_walk.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace {

using walk = voxelpipe::core::list_walk<3>;

// All chunks in the order in which workers reach them: the first of each worker, the second of each, and so on.
std::vector<walk::chunk> all_chunks(const std::uint32_t (&chunks)[3], std::uint32_t workers) {
    std::vector<walk> walks;
    for (std::uint32_t w = 0; w < workers; ++w) walks.emplace_back(chunks, w, workers);
    std::vector<walk::chunk> all;
    for (bool any = true; any;) {
        any = false;
        for (walk& w : walks) {
            const walk::chunk c = w.next();
            if (c.list < 0) continue;
            EXPECT_TRUE(any || &w == walks.data()); // no worker has more chunks than the one before it
            any = true;
            all.push_back(c);
        }
    }
    for (walk& w : walks)
        for (int again = 0; again < 3; ++again) EXPECT_LT(w.next().list, 0);
    return all;
}

const std::array<std::array<std::uint32_t, 3>, 12> cases{{{0, 0, 0},
                                                          {1, 0, 0},
                                                          {0, 1, 0},
                                                          {0, 0, 1},
                                                          {1, 1, 1},
                                                          {5, 7, 3},
                                                          {100, 0, 1},
                                                          {1000, 1, 63},
                                                          {3, 5000, 129},
                                                          {20011, 3, 700},
                                                          {64, 64, 64},
                                                          {9999, 9999, 9999}}};

TEST(ListWalk, VisitsEveryChunkOnce) {
    for (const auto& c : cases)
        for (const std::uint32_t workers : {1u, 2u, 7u, 64u, 1000u}) {
            const std::uint32_t chunks[3] = {c[0], c[1], c[2]};

            std::uint32_t next[3]{};
            for (const walk::chunk& chunk : all_chunks(chunks, workers)) {
                ASSERT_LT(chunk.list, 3);
                ASSERT_EQ(chunk.number, next[chunk.list]++) << "list " << chunk.list << ", " << workers << " workers";
            }
            for (int k = 0; k < 3; ++k) EXPECT_EQ(next[k], chunks[k]);
        }
}

// In long lists, progress differs by at most 1/64 of each list and one chunk. Short lists come one after the other,
// the last one first.
TEST(ListWalk, AdvancesAllListsAtTheSamePace) {
    const std::uint32_t chunks[3] = {20000, 900, 5000}, workers = 20;
    std::uint32_t done[3]{};
    for (const walk::chunk& chunk : all_chunks(chunks, workers)) {
        ++done[chunk.list];
        double lowest = 1, highest = 0;
        for (int k = 0; k < 3; ++k) {
            const double part = static_cast<double>(done[k]) / chunks[k];
            lowest = std::min(lowest, part);
            highest = std::max(highest, part);
        }
        ASSERT_LE(highest - lowest, 1.0 / 64 + 1.0 / 900);
    }
    int last = 2;
    for (const walk::chunk& chunk : all_chunks({30, 20, 10}, workers)) {
        EXPECT_LE(chunk.list, last);
        last = chunk.list;
    }
    EXPECT_EQ(last, 0);
}

// Lists as long as those of a mesh with 2^32 triangles.
TEST(ListWalk, HoldsForListsOf2To32Entries) {
    const std::uint32_t chunks[3] = {1u << 27, 3, 1u << 26};
    walk w(chunks, 5, 1u << 22);
    std::uint64_t num = 0;
    for (walk::chunk c = w.next(); c.list >= 0; c = w.next(), ++num) ASSERT_LT(c.number, chunks[c.list]);
    EXPECT_EQ(num, ((1u << 27) + 3 + (1u << 26) - 5 + (1u << 22) - 1) >> 22);
}

} // namespace
