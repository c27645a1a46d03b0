// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Policies of the fine raster are legal on every architecture for every set of targets, and are chosen by the
// architecture whose code the device runs.

#include <voxelpipe/tuning/tuning_fine_raster.hpp>

#include <gtest/gtest.h>

namespace {

namespace tuning = voxelpipe::tuning;

TEST(Tuning, TablesAscendAndNameTheSameArchitectures) {
    ASSERT_EQ(tuning::architectures.size(), tuning::fine_raster_table.size());
    for (std::size_t i = 0; i < tuning::architectures.size(); ++i) {
        EXPECT_EQ(tuning::architectures[i].capability, tuning::fine_raster_table[i].capability);
        if (i == 0) continue;
        EXPECT_LT(tuning::architectures[i - 1].capability, tuning::architectures[i].capability);
    }
}

TEST(Tuning, PoliciesAreLegalWhereverTheyAreUsed) {
    for (const tuning::architecture& a : tuning::architectures)
        for (int bits = 1; bits <= tuning::max_bits_per_voxel; ++bits) {
            const tuning::fine_raster_policy p = tuning::fine_raster_selector{}(bits, a.capability);
            ASSERT_EQ(p.threads_per_block % 32, 0);
            ASSERT_TRUE(p.threads_per_block >= 32 && p.threads_per_block <= 1024);
            ASSERT_TRUE(p.log2_tile_size >= 3 && p.log2_tile_size <= 5);
            ASSERT_LE(p.threads_per_block * p.min_blocks_per_sm, a.threads_per_sm);
            ASSERT_EQ(p.blocks_per_sm, tuning::fine_raster_numbers_of(a.capability).blocks_per_sm);
            ASSERT_TRUE(p.blocks_per_sm >= 0 && p.threads_per_block * p.blocks_per_sm <= a.threads_per_sm);
            ASSERT_LE((std::int64_t{bits} << (3 * p.log2_tile_size)) / 8, a.shared_per_block - tuning::batch_bytes)
                << bits;
        }
}

// The fastest policies of the sweep on an NVIDIA H200. One bit of each voxel is the occupancy mask.
TEST(Tuning, PoliciesForTheH200AreThoseOfTheSweep) {
    constexpr tuning::fine_raster_selector select;
    EXPECT_EQ(select(1 + 1, 90), (tuning::fine_raster_policy{256, 4, 4}));  // a target of bits
    EXPECT_EQ(select(96 + 1, 90), (tuning::fine_raster_policy{256, 4, 2})); // a sum of floats
    EXPECT_EQ(select(2 + 1, 90), (tuning::fine_raster_policy{256, 5, 2}));  // not in the sweep: the largest tile
}

TEST(Tuning, ADeviceRunsTheNewestArchitectureThatIsNotNewer) {
    EXPECT_EQ(tuning::architecture_of(75).capability, 80);
    EXPECT_EQ(tuning::architecture_of(80).capability, 80);
    EXPECT_EQ(tuning::architecture_of(87).capability, 86);
    EXPECT_EQ(tuning::architecture_of(90).capability, 90);
    EXPECT_EQ(tuning::architecture_of(103).capability, 100);
    EXPECT_EQ(tuning::architecture_of(121).capability, 120);
    EXPECT_EQ(tuning::portable_shared_per_block(), 99 * 1024);
    EXPECT_EQ(tuning::compiled_for(90), tuning::compiled_architectures().back().capability);
}

struct one_for_all {
    constexpr tuning::fine_raster_policy operator()(int) const { return {64, 3, 4}; }
};
struct by_architecture {
    constexpr tuning::fine_raster_policy operator()(int bits, int capability) const {
        return {capability >= 90 ? 512 : 128, bits > 32 ? 3 : 4, 1};
    }
};

struct return_it {
    template <tuning::fine_raster_policy Policy>
    tuning::fine_raster_policy operator()() const {
        return Policy;
    }
};
template <class Selector, int Bits>
tuning::fine_raster_policy chosen(int capability) {
    return tuning::with_policy<Selector, Bits>(capability, return_it{});
}

TEST(Tuning, UserSelectorsMayUseTheArchitectureOrIgnoreIt) {
    EXPECT_EQ((chosen<one_for_all, 8>(90)), (tuning::fine_raster_policy{64, 3, 4}));
    EXPECT_EQ((chosen<by_architecture, 8>(80)), (tuning::fine_raster_policy{128, 4, 1}));
    EXPECT_EQ((chosen<by_architecture, 64>(80)), (tuning::fine_raster_policy{128, 3, 1}));
    // A newer device uses the policy of 8.0 if only 8.0 is compiled.
    const tuning::fine_raster_policy newest = chosen<by_architecture, 8>(90);
    EXPECT_EQ(newest.threads_per_block, tuning::compiled_for(90) >= 90 ? 512 : 128);
}

} // namespace
