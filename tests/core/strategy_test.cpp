// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// device/call/strategy.hpp: which strategy a call takes, from the facts alone, and which ones may be forced.

#include <voxelpipe/device/call/strategy.hpp>

#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <string>

namespace {

using voxelpipe::strategy;
using voxelpipe::device::call_facts;
using voxelpipe::device::choose_rule;
using voxelpipe::device::rules;

// One constant bit into 128^3 voxels, from a mesh that is not checked.
call_facts constant_bit() {
    call_facts f;
    f.possible = {true, true, true, false};
    f.num_triangles = 100000;
    f.num_voxels = 128 * 128 * 128;
    f.mask_bytes = f.num_voxels / 8;
    f.fragment_capacity = 4 * f.num_triangles;
    f.fits_int32 = f.all_draws_equal = f.blends_in_place = f.counts_are_cheap = true;
    f.counts_voxels = true;
    return f;
}
call_facts computed(bool has_order) {
    call_facts f = constant_bit();
    f.possible = {false, false, !has_order, has_order};
    f.all_draws_equal = f.blends_in_place = false;
    return f;
}

strategy chosen(const call_facts& f, strategy forced = strategy::automatic) {
    const auto* const rule = choose_rule(f, forced);
    return rule == nullptr ? strategy::automatic : rule->value; // automatic: refused
}

TEST(Strategy, EveryCallHasOne) {
    EXPECT_EQ(chosen(call_facts{}), strategy::tiled);
    EXPECT_EQ(chosen(constant_bit()), strategy::occupancy_mask);
    EXPECT_EQ(chosen(computed(false)), strategy::sorted_reduce);
    EXPECT_EQ(chosen(computed(true)), strategy::sorted_fold);
    call_facts f = constant_bit();
    f.possible.occupancy_mask = false;
    EXPECT_EQ(chosen(f), strategy::immediate);
}

TEST(Strategy, TheTableHasEachStrategyOnceAndSaysWhy) {
    std::set<strategy> seen;
    for (const auto& rule : rules) {
        EXPECT_TRUE(seen.insert(rule.value).second);
        EXPECT_FALSE(std::string(rule.when).empty());
        EXPECT_NE(std::string(to_string(rule.value)), "unknown");
    }
    EXPECT_EQ(seen.size(), 5u);
    EXPECT_EQ(std::size(rules), 5u);
}

// A rule that applied to a call that its strategy cannot serve would draw wrong voxels.
TEST(Strategy, ARuleAppliesOnlyIfItsStrategyServes) {
    for (unsigned bits = 0; bits < 1u << 13; ++bits) {
        call_facts f;
        f.possible = {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0};
        f.fits_int32 = (bits & 16) != 0;
        f.all_draws_equal = (bits & 32) != 0;
        f.blends_in_place = (bits & 64) != 0;
        f.counts_are_cheap = (bits & 128) != 0;
        f.counts_voxels = (bits & 256) != 0;
        f.clears_values = (bits & 512) != 0;
        f.may_list = (bits & 1024) != 0;
        f.mask_bytes = (bits & 2048) != 0 ? std::uint64_t{1} << 30 : 1 << 20;
        f.num_draws = (bits & 4096) != 0 ? 17 : 1;
        for (const auto& rule : rules)
            EXPECT_TRUE(!rule.applies(f) || rule.can_serve(f)) << to_string(rule.value) << ' ' << bits;
        ASSERT_NE(choose_rule(f, strategy::automatic), nullptr);
    }
}

TEST(Strategy, AForcedOneServesOrIsRefused) {
    const call_facts bit = constant_bit();
    EXPECT_EQ(chosen(bit, strategy::occupancy_mask), strategy::occupancy_mask);
    EXPECT_EQ(chosen(bit, strategy::immediate), strategy::immediate);
    EXPECT_EQ(chosen(bit, strategy::sorted_reduce), strategy::sorted_reduce);
    EXPECT_EQ(chosen(bit, strategy::tiled), strategy::tiled);
    EXPECT_EQ(choose_rule(bit, strategy::sorted_fold), nullptr);
    EXPECT_EQ(choose_rule(computed(false), strategy::immediate), nullptr);
    EXPECT_EQ(choose_rule(computed(false), strategy::occupancy_mask), nullptr);
    EXPECT_EQ(choose_rule(computed(true), strategy::sorted_reduce), nullptr);
    EXPECT_EQ(chosen(call_facts{}, strategy::tiled), strategy::tiled);
}

TEST(Strategy, LimitsOfAMask) {
    call_facts f = constant_bit();
    f.counts_voxels = false;
    f.has_checked_indices = true;
    EXPECT_EQ(chosen(f), strategy::immediate); // nothing needs a last pass
    f.clears_values = true;
    EXPECT_EQ(chosen(f), strategy::occupancy_mask);
    f.mask_bytes = voxelpipe::tuning::max_mask_bytes_in_place;
    EXPECT_EQ(chosen(f), strategy::occupancy_mask);
    ++f.mask_bytes;
    EXPECT_EQ(chosen(f), strategy::immediate);
    f.blends_in_place = false;
    EXPECT_EQ(chosen(f), strategy::occupancy_mask);
    f.mask_bytes = voxelpipe::tuning::max_mask_bytes + 1;
    EXPECT_EQ(chosen(f), strategy::sorted_reduce);
    f = constant_bit();
    f.all_draws_equal = false;
    EXPECT_EQ(chosen(f), strategy::immediate);
    f.num_draws = voxelpipe::tuning::max_raster_draws + 1;
    EXPECT_EQ(chosen(f), strategy::tiled);
}

TEST(Strategy, LimitsOfLists) {
    call_facts f = computed(false);
    f.fragment_capacity = voxelpipe::device::max_sorted_fragments;
    EXPECT_EQ(chosen(f), strategy::sorted_reduce);
    ++f.fragment_capacity;
    EXPECT_EQ(chosen(f), strategy::tiled);
    EXPECT_EQ(choose_rule(f, strategy::sorted_reduce), nullptr);
    f = computed(false);
    f.may_list = false;
    EXPECT_EQ(chosen(f), strategy::tiled);
    f = computed(false);
    f.num_voxels = voxelpipe::device::max_listed_voxels;
    EXPECT_EQ(chosen(f), strategy::tiled);
    f = computed(false);
    f.fits_int32 = false;
    EXPECT_EQ(chosen(f), strategy::tiled);
}

} // namespace
