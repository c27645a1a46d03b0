// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Capacities of arrays whose size only the device finds out: a repeated call fits at once, with little to spare.

#include <voxelpipe/device/call/capacity_history.hpp>

#include <gtest/gtest.h>

#include <cstdint>

namespace {

namespace core = voxelpipe::core;
using room = core::capacity_history<int, 2>;
using lengths = room::lengths;

room make_room() { return room({true, false}); }

// Runs a call that needs these sizes. Returns the number of attempts.
int run(room& r, int key, const lengths& needed, const lengths& first, lengths* given = nullptr) {
    lengths there = r.guess(key, first);
    for (int tries = 1;; ++tries) {
        if (needed[0] <= there[0] && needed[1] <= there[1]) {
            r.fitted(key, needed);
            if (given != nullptr) *given = there;
            return tries;
        }
        if (tries == 5) return -1;
        r.raise(there, needed);
    }
}

TEST(CallRoom, AFirstCallGetsTheFirstGuess) {
    room r = make_room();
    lengths given{};
    EXPECT_EQ(run(r, 1, {50, 60}, {100, 200}, &given), 1);
    EXPECT_EQ(given, (lengths{100, 200}));
}

TEST(CallRoom, WhatDoesNotFitIsRunOnceMore) {
    room r = make_room();
    EXPECT_EQ(run(r, 1, {1000000, 60}, {100, 200}), 2);
    EXPECT_EQ(run(r, 1, {1000000, 60}, {100, 200}), 1);
    EXPECT_EQ(run(r, 2, {1000000, 60}, {100, 200}), 1); // a second call starts from the first one's sizes
}

TEST(CallRoom, TheSameCallGetsLittleMoreThanItNeeds) {
    room r = make_room();
    const lengths needed{8000000, 500000}, first{29000000, 2000000};
    EXPECT_EQ(run(r, 1, needed, first), 1);
    lengths given{};
    EXPECT_EQ(run(r, 1, needed, first, &given), 1);
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_GE(given[k], needed[k] + needed[k] / 16);
        EXPECT_LE(given[k], needed[k] + needed[k] / 8);
    }
    // A sixteenth more than the last time still fits.
    EXPECT_EQ(run(r, 1, {needed[0] + needed[0] / 17, needed[1]}, first), 1);
}

// Two calls with the same key alternate, and one needs twice as much as the other.
TEST(CallRoom, CallsInTurnFitAfterOnce) {
    room r = make_room();
    const lengths small{100000, 1000}, large{200000, 900000}, first{150000, 50000};
    (void)run(r, 1, small, first);
    EXPECT_EQ(run(r, 1, large, first), 2);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(run(r, 1, small, first), 1);
        EXPECT_EQ(run(r, 1, large, first), 1);
    }
}

TEST(CallRoom, CallsWithOtherKeysInTurnFit) {
    room r = make_room();
    const lengths small{1000, 1000}, large{2000000, 2000000}, first{5000, 5000};
    (void)run(r, 1, large, first);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(run(r, 2, small, first), 1);
        EXPECT_EQ(run(r, 1, large, first), 1);
    }
}

TEST(CallRoom, AnArrayThatTheLastCallDidNotUseGetsTheFirstGuess) {
    room r = make_room();
    EXPECT_EQ(run(r, 1, {0, 700}, {5000, 5000}), 1);
    lengths given{};
    EXPECT_EQ(run(r, 1, {4000, 700}, {5000, 5000}, &given), 1);
    EXPECT_EQ(given[0], 5000u);
}

TEST(CallRoom, SaysWhatCallsLikeTheLastNeeded) {
    room r = make_room();
    EXPECT_FALSE(r.max_needed(1, 0).has_value());
    EXPECT_EQ(run(r, 1, {7, 0}, {100, 100}), 1);
    EXPECT_EQ(r.max_needed(1, 0), 7u);
    EXPECT_EQ(r.max_needed(1, 1), 0u);
    EXPECT_FALSE(r.max_needed(2, 0).has_value());
    EXPECT_EQ(run(r, 1, {3, 9}, {100, 100}), 1); // the larger of the two
    EXPECT_EQ(r.max_needed(1, 0), 7u);
    EXPECT_EQ(r.max_needed(1, 1), 9u);
    EXPECT_EQ(run(r, 2, {1, 1}, {100, 100}), 1);
    EXPECT_EQ(r.max_needed(2, 0), 1u);
    EXPECT_FALSE(r.max_needed(1, 0).has_value());
}

TEST(CallRoom, NumberedArraysStayWithin32Bits) {
    room r = make_room();
    lengths there = r.guess(1, {core::max_numbered + 5, core::max_numbered + 5});
    EXPECT_EQ(there, (lengths{core::max_numbered, core::max_numbered + 5}));
    there = {10, 10};
    r.raise(there, {core::max_numbered - 1, core::max_numbered});
    EXPECT_EQ(there[0], core::max_numbered);
    EXPECT_GT(there[1], core::max_numbered);
}

} // namespace
