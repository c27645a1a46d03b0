// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/exact.hpp, what needs more cases than roundings_test.cpp has: conversions of wide integers against the
// compiler's own and against the exact ones, ends of the range, integer division.

#include "test_support.hpp"

#include <voxelpipe/core/exact.hpp>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cfenv>
#include <cfloat>
#include <cmath>
#include <type_traits>

namespace {

namespace vp = voxelpipe;
namespace ex = voxelpipe::exact;
using unit::splitmix64;
using vp::int128;
using vp::uint128;

// A number of any length up to `bits`, often with runs of ones, because these make roundings carry.
uint128 any_magnitude(splitmix64& random, int bits) {
    const int length = static_cast<int>(random.between(1, bits));
    uint128 a = (static_cast<uint128>(random.next()) << 64) | random.next();
    switch (random.below(4)) {
    case 0: // all ones
        a = ~uint128{0};
        break;
    case 1: // one bit, and perhaps another
        a = (uint128{1} << (length - 1)) | (uint128{1} << random.below(static_cast<std::uint64_t>(length)));
        break;
    case 2: // a run of ones
        a = ~uint128{0} << random.below(static_cast<std::uint64_t>(length));
        break;
    default:
        break;
    }
    return length == 128 ? a : a & ((uint128{1} << length) - 1);
}

TEST(RoundToBinary, IsTheCompilersConversionOfWideIntegers) {
    splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(1'000'000); ++i) {
        const uint128 a = any_magnitude(random, 128);
        const double d = static_cast<double>(a);
        ASSERT_EQ(ex::round_to_binary(a, 0, 52, 11), std::bit_cast<std::uint64_t>(d));
        const uint128 b = any_magnitude(random, 127); // below the range that rounds to infinity
        const float f = static_cast<float>(b);
        ASSERT_EQ(ex::round_to_binary(b, 0, 23, 8), std::bit_cast<std::uint32_t>(f));
    }
}

TEST(Divide, IsTheCompilersDivisionOfWideIntegers) {
    splitmix64 random(11);
    for (std::int64_t i = 0; i < unit::cases(1'000'000); ++i) {
        const uint128 a = any_magnitude(random, 128);
        const auto b = static_cast<std::uint64_t>(any_magnitude(random, i % 3 == 0 ? 64 : 33));
        if (b == 0) continue;
        const ex::wide_quotient q = ex::divide(a, b);
        ASSERT_TRUE(q.quotient == a / b);
        ASSERT_EQ(q.has_rest, a % b != 0);
    }
}

TEST(RoundToBinary, ScalesAsLdexpDoesIntoSubnormalsAndInfinity) {
    splitmix64 random(2);
    for (std::int64_t i = 0; i < unit::cases(2'000'000); ++i) {
        // A double holds 53 bits exactly, so ldexp rounds once.
        const auto a = static_cast<std::uint64_t>(any_magnitude(random, 53));
        const int e = static_cast<int>(random.between(-1200, 1100));
        ASSERT_EQ(ex::round_to_binary(a, e, 52, 11),
                  std::bit_cast<std::uint64_t>(std::ldexp(static_cast<double>(a), e)))
            << a << " * 2^" << e;
        // The double is exact, so the conversion to float is the only rounding.
        const int fe = static_cast<int>(random.between(-210, 90));
        const double exact = std::ldexp(static_cast<double>(a), fe);
        ASSERT_EQ(ex::round_to_binary(a, fe, 23, 8), std::bit_cast<std::uint32_t>(static_cast<float>(exact)))
            << a << " * 2^" << fe;
    }
}

TEST(RoundToBinary, IsTheNearestNumberOfEveryFormat) {
    struct format {
        int mantissa, exponent;
    };
    splitmix64 random(3);
    for (const format f : {format{10, 5}, format{23, 8}, format{52, 11}, format{3, 4}, format{7, 8}})
        for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
            const uint128 a = any_magnitude(random, 126); // the model's signed type
            const int range = 1 << (f.exponent - 1);
            const int e = static_cast<int>(random.between(-std::min(range, 200) - 140, std::min(range, 200)));
            const unit::wide n(static_cast<int128>(a));
            const unit::rational exact =
                e >= 0 ? unit::rational{n.shifted_left(e)} : unit::rational{n, unit::power_of_two(-e)};
            ASSERT_EQ(ex::round_to_binary(a, e, f.mantissa, f.exponent),
                      unit::nearest_bits(exact, f.mantissa, f.exponent))
                << n.to_string() << " * 2^" << e << " to " << f.mantissa << " + " << f.exponent << " bits";
        }
}

TEST(RoundToBinary, KeepsZeroAndTheEndsOfTheRange) {
    EXPECT_EQ(ex::round_to_binary(0, 500, 52, 11), 0u);
    EXPECT_EQ(ex::round_to_binary(1, -1074, 52, 11), 1u); // smallest subnormal
    EXPECT_EQ(ex::round_to_binary(1, -1075, 52, 11), 0u); // half of it: ties to even
    EXPECT_EQ(ex::round_to_binary(3, -1076, 52, 11), 1u); // three quarters
    EXPECT_EQ(ex::round_to_binary(1, -5000, 52, 11), 0u);
    EXPECT_EQ(ex::round_to_binary(65519, 0, 10, 5), 0x7bffu); // largest half
    EXPECT_EQ(ex::round_to_binary(65520, 0, 10, 5), 0x7c00u); // half-way to the next: infinity
    EXPECT_EQ(ex::round_to_binary(~uint128{0}, 5000, 52, 11), 0x7ff0000000000000u);
}

TEST(ShiftRightRne, IsTheNearestMultiple) {
    splitmix64 random(4);
    for (std::int64_t i = 0; i < unit::cases(100'000); ++i) {
        const uint128 a = any_magnitude(random, 126);
        const int shift = static_cast<int>(random.below(128));
        const unit::wide expected =
            unit::round_to_integer({unit::wide(static_cast<int128>(a)), unit::power_of_two(shift)});
        ASSERT_EQ(unit::wide(static_cast<int128>(ex::shift_right_rne(a, shift))), expected) << shift;
    }
}

TEST(ToDouble, RoundsWideIntegersOfBothSigns) {
    splitmix64 random(5);
    for (std::int64_t i = 0; i < unit::cases(500'000); ++i) {
        const auto a = static_cast<int128>(any_magnitude(random, 127));
        ASSERT_EQ(ex::to_double(a), static_cast<double>(a));
        ASSERT_EQ(ex::to_double(-a), -static_cast<double>(a));
    }
    EXPECT_EQ(ex::to_double(std::numeric_limits<int128>::min()), -0x1p127);
    EXPECT_EQ(ex::to_double(std::numeric_limits<int128>::max()), 0x1p127);
}

TEST(RoundToInt64, TakesTiesToEven) {
    EXPECT_EQ(std::fegetround(), FE_TONEAREST);
    const std::array<std::array<double, 2>, 12> table{{{0.5, 0},
                                                       {1.5, 2},
                                                       {2.5, 2},
                                                       {-0.5, 0},
                                                       {-1.5, -2},
                                                       {-2.5, -2},
                                                       {0.49999999999999994, 0},
                                                       {4503599627370495.5, 4503599627370496.0},
                                                       {4503599627370494.5, 4503599627370494.0},
                                                       {9007199254740993.0, 9007199254740992.0},
                                                       {0x1p62, 0x1p62},
                                                       {-0x1p63, -0x1p63}}};
    for (const auto& [value, expected] : table)
        EXPECT_EQ(ex::round_to_int64(value), static_cast<std::int64_t>(expected)) << value;
    splitmix64 random(6);
    for (std::int64_t i = 0; i < unit::cases(50'000); ++i) {
        const double a = unit::spread_double(random, -3, 61);
        ASSERT_EQ(ex::round_to_int64(a), unit::round_to_integer(unit::exact(a)).to_int64()) << a;
        const double tie = static_cast<double>(random.between(-(1 << 30), 1 << 30)) + 0.5;
        ASSERT_EQ(ex::round_to_int64(tie), unit::round_to_integer(unit::exact(tie)).to_int64()) << tie;
    }
}

template <class Int>
void check_divisions(Int a, Int b) {
    const int128 floor = ex::floor_div(a, b), ceil = ex::ceil_div(a, b); // the products below may exceed 64 bits
    EXPECT_EQ(ex::floor_div_inline(a, b), floor);
    ASSERT_TRUE(floor * b <= a && a - floor * b < b);
    ASSERT_TRUE(ceil * b >= a && ceil * b - a < b);
}

#if !defined(VOXELPIPE_SOFTWARE_FMA) // where fma is this function, roundings_test.cpp has it against rational numbers
template <class T>
void expect_fma(T a, T b, T c) {
    const T expected = ex::fma(a, b, c), result = ex::software_fma(a, b, c);
    if (std::isnan(expected) && std::isnan(result)) return;
    using bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    ASSERT_EQ(std::bit_cast<bits>(result), std::bit_cast<bits>(expected)) << a << " * " << b << " + " << c;
}

TEST(SoftwareFma, HasTheBitsOfTheInstruction) {
    splitmix64 random(11);
    for (std::int64_t i = unit::cases(300000); i > 0 && !HasFatalFailure(); --i) {
        double a = std::bit_cast<double>(random.next()), b = std::bit_cast<double>(random.next()),
               c = std::bit_cast<double>(random.next());
        const double few = static_cast<double>(random.between(-3, 3));
        if (i % 4 == 1) c = -a * b * (1 + few * 0x1p-52); // cancels all but some bits
        if (i % 4 == 2) {                                 // results between 0 and the least normal number
            a = std::ldexp(unit::spread_double(random, 0, 0), -500);
            b = unit::spread_double(random, -600, -545);
            c = unit::spread_double(random, -1100, -1040);
        }
        if (i % 4 == 3) { // ties: few bits at any distance
            a = 1 + few * 0x1p-4;
            b = std::ldexp(1 + few * 0x1p-51, static_cast<int>(random.between(-60, 60)));
            c = std::ldexp(few, static_cast<int>(random.between(-60, 60)));
        }
        expect_fma(a, b, c);
        const float x = std::bit_cast<float>(static_cast<std::uint32_t>(random.next())), y = static_cast<float>(b);
        expect_fma(x, y, i % 2 == 0 ? static_cast<float>(c) : -x * y * (1 + static_cast<float>(few) * 0x1p-23f));
        expect_fma(static_cast<float>(a), y, static_cast<float>(c));
    }
    constexpr double ends[] = {0.0,       -0.0,       1,        -1,       INFINITY,  -INFINITY, NAN,
                               0x1p-1074, -0x1p-1074, 0x1p-149, 0x1p1023, -0x1p1023, DBL_MAX,   0x1.fffffep127};
    for (const double a : ends)
        for (const double b : ends)
            for (const double c : ends) {
                expect_fma(a, b, c);
                expect_fma(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c));
            }
}
#endif

TEST(IntegerDivision, RoundsDownAndUpForBothSigns) {
    for (int a = -40; a <= 40; ++a)
        for (int b = 1; b <= 12; ++b) {
            check_divisions<std::int64_t>(a, b);
            check_divisions<int128>(a, b);
        }
    splitmix64 random(7);
    for (std::int64_t i = 0; i < unit::cases(300'000); ++i) {
        const auto a = static_cast<std::int64_t>(random.next()) >> random.below(63);
        const auto b = static_cast<std::int64_t>(random.next() >> 1 >> random.below(62)) | 1;
        check_divisions<std::int64_t>(a, b);
        check_divisions<int128>(static_cast<int128>(a) * 0x7fffffff, static_cast<int128>(b) * 3);
    }
}

TEST(IntegerShift, RoundsDownAndUpForBothSigns) {
    for (std::int64_t a = -300; a <= 300; ++a)
        for (int bits = 0; bits < 12; ++bits) {
            const std::int64_t b = std::int64_t{1} << bits;
            EXPECT_EQ(ex::floor_shift(a, bits), ex::floor_div(a, b));
            EXPECT_EQ(ex::ceil_shift(a, bits), ex::ceil_div(a, b));
            EXPECT_EQ(ex::floor_shift<int128>(a, bits), ex::floor_div<int128>(a, b));
            EXPECT_EQ(ex::ceil_shift<int128>(a, bits), ex::ceil_div<int128>(a, b));
        }
}

TEST(BitWidth, CountsFromTheHighestBit) {
    EXPECT_EQ(ex::bit_width(std::uint64_t{0}), 0);
    EXPECT_EQ(ex::bit_width(uint128{0}), 0);
    for (int i = 0; i < 128; ++i) {
        if (i < 64) {
            EXPECT_EQ(ex::bit_width(std::uint64_t{1} << i), i + 1);
            EXPECT_EQ(ex::bit_width(~std::uint64_t{0} >> (63 - i)), i + 1);
        }
        EXPECT_EQ(ex::bit_width(uint128{1} << i), i + 1);
        EXPECT_EQ(ex::bit_width(~uint128{0} >> (127 - i)), i + 1);
    }
}

} // namespace
