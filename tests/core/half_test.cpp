// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/half.hpp, exhaustively: all 65,536 halves, and the floats next to every point where the rounding changes.

#include "test_support.hpp"

#include <voxelpipe/core/half.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace {

using voxelpipe::half;

// The value of the pattern by IEEE 754; not for exponent 31.
double value_of(std::uint16_t bits) {
    const int exponent = (bits >> 10) & 31, mantissa = bits & 0x3ff;
    const double magnitude = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    return (bits & 0x8000) != 0 ? -magnitude : magnitude;
}

TEST(Half, EveryPatternHasItsStandardValue) {
    for (std::uint32_t i = 0; i < 0x10000; ++i) {
        const auto bits = static_cast<std::uint16_t>(i);
        const auto f = static_cast<float>(half::from_bits(bits));
        if ((bits & 0x7c00) != 0x7c00) {
            ASSERT_EQ(double{f}, value_of(bits)) << std::hex << bits;
            ASSERT_EQ(std::signbit(f), (bits & 0x8000) != 0) << std::hex << bits; // -0 too
        } else if ((bits & 0x3ff) == 0) {
            ASSERT_EQ(f, (bits & 0x8000) != 0 ? -HUGE_VALF : HUGE_VALF);
        } else {
            ASSERT_TRUE(std::isnan(f)) << std::hex << bits;
        }
    }
}

TEST(Half, EveryPatternSurvivesTheWayThroughFloat) {
    for (std::uint32_t i = 0; i < 0x10000; ++i) {
        const auto bits = static_cast<std::uint16_t>(i);
        const half back(static_cast<float>(half::from_bits(bits)));
        if ((bits & 0x7c00) == 0x7c00 && (bits & 0x3ff) != 0)
            ASSERT_TRUE((back.bits & 0x7c00) == 0x7c00 && (back.bits & 0x3ff) != 0) << std::hex << bits;
        else
            ASSERT_EQ(back.bits, bits);
    }
}

// The nearest half, found by comparing distances; ties go to the even pattern.
std::uint16_t nearest(float f) {
    static const std::vector<double> positive = [] {
        std::vector<double> v;
        for (std::uint16_t bits = 0; bits < 0x7c00; ++bits) v.push_back(value_of(bits));
        v.push_back(65536.0); // the successor of the largest half if the exponent were wider; it stands for infinity
        return v;
    }();
    const double a = std::fabs(double{f});
    const std::uint16_t sign = std::signbit(f) ? 0x8000 : 0;
    if (a >= 65536.0) return static_cast<std::uint16_t>(sign | 0x7c00);
    const auto above = std::upper_bound(positive.begin(), positive.end(), a);
    const auto low = static_cast<std::size_t>(above - positive.begin()) - 1;
    const double down = a - positive[low],
                 up = positive[low + 1] - a; // exact, because the numbers are close to each other
    const std::size_t chosen = down < up ? low : up < down ? low + 1 : low + (low & 1);
    return static_cast<std::uint16_t>(sign | chosen);
}

TEST(Half, FloatsRoundToTheNearestTiesToEven) {
    const auto check = [](float f) {
        ASSERT_EQ(half(f).bits, nearest(f)) << std::hexfloat << f;
        ASSERT_EQ(half(-f).bits, nearest(-f)) << std::hexfloat << f;
    };
    for (std::uint16_t bits = 0; bits < 0x7c00; ++bits) {
        const auto a = static_cast<float>(value_of(bits));
        const auto next =
            bits == 0x7bff ? 65536.0f : static_cast<float>(value_of(static_cast<std::uint16_t>(bits + 1)));
        const float middle = a + (next - a) / 2; // exact in float
        for (const float f : {a, middle}) {
            check(f);
            check(std::nextafterf(f, HUGE_VALF));
            if (f > 0) check(std::nextafterf(f, 0.0f));
        }
    }
    unit::splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(4'000'000); ++i) check(unit::any_finite_float(random));
}

TEST(Half, NanStaysNanWhateverItsPayload) {
    for (const std::uint32_t payload : {1u, 0x1fffu, 0x2000u, 0x3fffffu, 0x400000u, 0x7fffffu})
        for (const std::uint32_t sign : {0u, 0x80000000u}) {
            const half h(std::bit_cast<float>(sign | 0x7f800000u | payload));
            EXPECT_EQ(h.bits & 0x7c00, 0x7c00);
            EXPECT_NE(h.bits & 0x3ff, 0);
            EXPECT_EQ((h.bits & 0x8000) != 0, sign != 0);
        }
}

TEST(Half, ComparesByBits) {
    EXPECT_EQ(half::from_bits(0x1234), half::from_bits(0x1234));
    EXPECT_NE(half(0.0f), half(-0.0f));
}

} // namespace
