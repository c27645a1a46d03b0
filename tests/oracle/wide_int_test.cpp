// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// wide_int against the compiler's 128-bit integers, and beyond their range against the laws of arithmetic.

#include "triangles.hpp"
#include "wide_int.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using oracle::int128;
using oracle::splitmix64;
using wide = oracle::wide_int<4>;

// Numbers of every length, so that carries, borrows and limb borders occur.
int128 any_int128(splitmix64& random, int max_bits) {
    const auto high = static_cast<int128>(random.next() >> 1);
    int128 value = (high << 64) | static_cast<int128>(random.next());
    if (random.one_in(4)) value = (int128{1} << 126) - 1 + static_cast<int128>(random.below(3)); // runs of ones
    value >>= 127 - static_cast<int>(random.below(static_cast<std::uint64_t>(max_bits) + 1));
    return random.one_in(2) ? -value : value;
}

wide any_wide(splitmix64& random, int limbs) {
    wide value = 0;
    for (int n = 0; n < limbs; ++n)
        value = value.shifted_left(62) + wide(static_cast<std::int64_t>(random.next() >> 2));
    return random.one_in(2) ? -value : value;
}

TEST(WideInt, AgreesWithTheCompilers128Bits) {
    splitmix64 random(1);
    for (int n = 0; n < oracle::repeats(200000); ++n) {
        const int128 a = any_int128(random, 125);
        const int128 b = any_int128(random, 125);
        ASSERT_TRUE(wide(a).to_int128() == a);
        ASSERT_TRUE((wide(a) + wide(b)).to_int128() == a + b);
        ASSERT_TRUE((wide(a) - wide(b)).to_int128() == a - b);
        ASSERT_EQ(wide(a) < wide(b), a < b);
        ASSERT_EQ(wide(a) == wide(b), a == b);
        ASSERT_EQ(wide(a).sign(), a < 0 ? -1 : (a > 0 ? 1 : 0));
        const int128 c = any_int128(random, 62);
        const int128 d = any_int128(random, 62);
        ASSERT_TRUE((wide(c) * wide(d)).to_int128() == c * d);
        if (d != 0) {
            int128 floor = a / d;
            if (floor * d != a && (a < 0) != (d < 0)) --floor;
            ASSERT_TRUE(wide::floor_divide(wide(a), wide(d)).to_int128() == floor);
        }
    }
}

TEST(WideInt, KeepsTheLawsOfArithmeticBeyond128Bits) {
    splitmix64 random(2);
    for (int n = 0; n < oracle::repeats(20000); ++n) {
        const wide a = any_wide(random, 2), b = any_wide(random, 2);
        const wide c = any_wide(random, 1), d = any_wide(random, 1);
        ASSERT_TRUE((a + b) * c == a * c + b * c);
        ASSERT_TRUE((a * d) * c == a * (d * c));
        ASSERT_TRUE((a - b) + b == a);
        ASSERT_TRUE((a + b) * (a - b) == a * a - b * b);
        ASSERT_EQ((a - b).sign(), a < b ? -1 : (a == b ? 0 : 1));
        const wide numerator = any_wide(random, 4);
        const wide quotient = wide::floor_divide(numerator, b);
        const wide rest = numerator - quotient * b; // 0 <= rest < |b| with the sign of b
        ASSERT_TRUE(rest.sign() == 0 || rest.sign() == b.sign());
        ASSERT_TRUE(b.sign() > 0 ? rest < b : b < rest);
    }
}

TEST(WideInt, ShiftIsMultiplicationByAPowerOfTwo) {
    splitmix64 random(3);
    for (int count = 0; count < 120; ++count) {
        const wide a = any_wide(random, 2);
        wide doubled = a;
        for (int n = 0; n < count; ++n) doubled = doubled + doubled;
        EXPECT_TRUE(a.shifted_left(count) == doubled) << count;
        EXPECT_EQ(a.shifted_left(count).bit_width(), a.bit_width() + count);
    }
}

TEST(WideInt, ThrowsInsteadOfWrapping) {
    const wide big = wide(1).shifted_left(255);
    EXPECT_THROW(static_cast<void>(big + big), std::overflow_error);
    EXPECT_THROW(static_cast<void>(-big - big), std::overflow_error);
    EXPECT_THROW(static_cast<void>(big * wide(2)), std::overflow_error);
    EXPECT_THROW(static_cast<void>(wide(1).shifted_left(200) * wide(1).shifted_left(56)), std::overflow_error);
    EXPECT_THROW(static_cast<void>(big.shifted_left(1)), std::overflow_error);
    EXPECT_THROW(static_cast<void>(big.to_int128()), std::overflow_error);
    EXPECT_THROW(static_cast<void>(wide(1).shifted_left(63).to_int64()), std::overflow_error);
    EXPECT_THROW(static_cast<void>(wide::floor_divide(big, wide(0))), std::domain_error);
    EXPECT_TRUE(wide(1).shifted_left(200) * wide(1).shifted_left(55) == big);
    EXPECT_TRUE((big - wide(1)) + big - big == big - wide(1)); // 2^256 - 1 still fits
}

TEST(WideInt, WritesHexadecimal) {
    EXPECT_EQ(wide(0).to_string(), "0");
    EXPECT_EQ(wide(-255).to_string(), "-0xff");
    EXPECT_EQ(wide(1).shifted_left(64).to_string(), "0x10000000000000000");
}

} // namespace
