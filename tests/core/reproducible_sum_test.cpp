// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/reproducible_sum.hpp against exact sums in wide integers: rounding of terms and result, carries between words,
// cancellation, marks, and independence of the order.

#include "test_support.hpp"

#include <voxelpipe/blend.hpp>
#include <voxelpipe/device/targets/repeated_fold.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace {

namespace vp = voxelpipe;
using unit::splitmix64;
using unit::wide;

// The contract in exact arithmetic: terms are rounded to multiples of 2^quantum, and their sum is rounded once.
template <class T>
struct format;
template <>
struct format<float> {
    static constexpr int quantum = -32, mantissa = 23, exponent = 8;
    static constexpr double infinite_from = 0x1p31;
    static double widen(float v) { return v; }
};
template <>
struct format<vp::half> {
    static constexpr int quantum = -24, mantissa = 10, exponent = 5;
    static constexpr double infinite_from = HUGE_VAL;
    static double widen(vp::half v) { return static_cast<float>(v); }
};
template <>
struct format<double> {
    static constexpr int quantum = -64, mantissa = 52, exponent = 11;
    static constexpr double infinite_from = 0x1p63;
    static double widen(double v) { return v; }
};

// In units of 2^quantum, rounded to nearest, ties to even.
wide to_units(double v, int quantum) {
    unit::rational r = unit::exact(v);
    if (quantum < 0)
        r.numerator = r.numerator.shifted_left(-quantum);
    else
        r.denominator = r.denominator.shifted_left(quantum);
    return unit::round_to_integer(r);
}

template <class T>
struct repeated {
    T term;
    std::int64_t times;
};

template <class T>
std::uint64_t model(const std::vector<repeated<T>>& terms, int quantum = format<T>::quantum,
                    double infinite_from = format<T>::infinite_from) {
    using f = format<T>;
    wide sum;
    bool nan = false, positive = false, negative = false;
    for (const auto& [term, times] : terms) {
        const double v = f::widen(term);
        if (std::isnan(v))
            nan = true;
        else if (v >= infinite_from)
            positive = true;
        else if (v <= -infinite_from)
            negative = true;
        else
            sum = sum + to_units(v, quantum) * wide(times);
    }
    const std::uint64_t infinity = ((std::uint64_t{1} << f::exponent) - 1) << f::mantissa;
    if (nan || (positive && negative)) return infinity | (std::uint64_t{1} << (f::mantissa - 1));
    if (positive) return infinity;
    if (negative) return infinity | (std::uint64_t{1} << (f::mantissa + f::exponent));
    return quantum < 0 ? unit::nearest_bits({sum, unit::power_of_two(-quantum)}, f::mantissa, f::exponent)
                       : unit::nearest_bits({sum.shifted_left(quantum)}, f::mantissa, f::exponent);
}

template <class T>
std::uint64_t model(const std::vector<T>& terms, int quantum = format<T>::quantum,
                    double infinite_from = format<T>::infinite_from) {
    std::vector<repeated<T>> once;
    for (const T& t : terms) once.push_back({t, 1});
    return model(once, quantum, infinite_from);
}

template <class T, class Blend = vp::blend::add>
std::uint64_t library(const std::vector<T>& terms) {
    using traits = vp::core::blend_traits<Blend, T>;
    auto a = traits::begin(traits::identity());
    for (const T& t : terms) traits::apply(a, t);
    return std::bit_cast<typename vp::core::float_bits<T>::type>(traits::end(a));
}

template <class T>
T narrow(double v) {
    if constexpr (std::is_same_v<T, double>)
        return v;
    else
        return static_cast<T>(static_cast<float>(v));
}

template <class T>
void shuffle(std::vector<T>& v, splitmix64& random) {
    for (std::size_t i = v.size(); i > 1; --i) std::swap(v[i - 1], v[random.below(i)]);
}

template <class T>
T random_term(splitmix64& random);
template <>
float random_term(splitmix64& random) {
    return static_cast<float>(unit::spread_double(random, -60, 30)); // |v| <= 2^30
}
template <>
double random_term(splitmix64& random) {
    return unit::spread_double(random, -110, 62);
}
template <>
vp::half random_term(splitmix64& random) {
    for (;;) {
        const auto bits = static_cast<std::uint16_t>(random.next());
        if ((bits & 0x7c00) != 0x7c00) return vp::half::from_bits(bits);
    }
}

template <class T>
class ReproducibleSum : public ::testing::Test {};
using SumTypes = ::testing::Types<float, double, vp::half>;
TYPED_TEST_SUITE(ReproducibleSum, SumTypes);

TYPED_TEST(ReproducibleSum, IsTheExactSumOfTheRoundedTermsRoundedOnce) {
    splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(3000); ++i) {
        std::vector<TypeParam> terms(random.below(random.one_in(50) ? 300 : 12));
        for (TypeParam& t : terms) t = random_term<TypeParam>(random);
        ASSERT_EQ(library(terms), model(terms)) << terms.size() << " terms, case " << i;
    }
}

TYPED_TEST(ReproducibleSum, CancelsExactly) {
    splitmix64 random(2);
    for (std::int64_t i = 0; i < unit::cases(1000); ++i) {
        // Pairs of opposite terms, and a small rest that plain additions would lose.
        std::vector<TypeParam> terms;
        for (int k = 0; k < 20; ++k) {
            const auto t = random_term<TypeParam>(random);
            terms.push_back(t);
            terms.push_back(narrow<TypeParam>(-format<TypeParam>::widen(t)));
        }
        shuffle(terms, random);
        ASSERT_EQ(library(terms), 0u); // +0
        const auto rest = narrow<TypeParam>(std::ldexp(static_cast<double>(random.below(1000)), -20));
        terms.insert(terms.begin() + static_cast<std::ptrdiff_t>(random.below(terms.size())), rest);
        ASSERT_EQ(library(terms), library(std::vector<TypeParam>{rest}));
        ASSERT_EQ(library(terms), model(terms));
    }
}

TYPED_TEST(ReproducibleSum, DoesNotDependOnTheOrder) {
    splitmix64 random(3);
    for (std::int64_t i = 0; i < unit::cases(200); ++i) {
        std::vector<TypeParam> terms(100);
        for (TypeParam& t : terms) t = random_term<TypeParam>(random);
        const std::uint64_t expected = library(terms);
        for (int k = 0; k < 5; ++k) {
            shuffle(terms, random);
            ASSERT_EQ(library(terms), expected);
        }
    }
}

TYPED_TEST(ReproducibleSum, HoldsAMillionTerms) {
    splitmix64 random(4);
    const auto count = static_cast<std::size_t>(unit::cases(1'000'000));
    // Only two thousand different terms, so that the model can multiply.
    std::vector<repeated<TypeParam>> pool(2000);
    for (auto& p : pool) p = {random_term<TypeParam>(random), 0};
    std::vector<TypeParam> terms(count);
    for (TypeParam& t : terms) {
        auto& p = pool[random.below(pool.size())];
        ++p.times;
        t = p.term;
    }
    EXPECT_EQ(library(terms), model(pool));
    // The largest terms, all of one sign, cause every possible carry.
    for (const double sign : {1.0, -1.0}) {
        TypeParam largest;
        if constexpr (std::is_same_v<TypeParam, vp::half>)
            largest = vp::half(static_cast<float>(sign * 65504.0));
        else
            largest = static_cast<TypeParam>(sign) *
                      std::nextafter(static_cast<TypeParam>(format<TypeParam>::infinite_from), TypeParam{0});
        std::fill(terms.begin(), terms.end(), largest);
        const auto other = narrow<TypeParam>(-sign);
        terms.front() = other;
        EXPECT_EQ(library(terms), (model<TypeParam>({{largest, static_cast<std::int64_t>(count) - 1}, {other, 1}})));
    }
}

TYPED_TEST(ReproducibleSum, MarksNanAndInfinity) {
    const auto make = [](double v) { return narrow<TypeParam>(v); };
    const TypeParam nan = make(std::nan("")), inf = make(HUGE_VAL), minus = make(-HUGE_VAL), one = make(1.0);
    const std::vector<std::vector<TypeParam>> table{
        {nan}, {inf}, {minus}, {inf, minus}, {minus, inf}, {nan, inf}, {inf, one}, {one, minus}, {minus, nan, inf}, {}};
    for (const auto& terms : table) EXPECT_EQ(library(terms), model(terms));
    // Any NaN becomes the one positive quiet NaN.
    using bits = typename vp::core::float_bits<TypeParam>::type;
    EXPECT_EQ(library(std::vector<TypeParam>{nan}), vp::core::float_bits<TypeParam>::nan);
    EXPECT_EQ(library(std::vector<TypeParam>{inf, minus}), vp::core::float_bits<TypeParam>::nan);
    EXPECT_EQ(library(std::vector<TypeParam>{minus}),
              static_cast<bits>(vp::core::float_bits<TypeParam>::infinity | ~(static_cast<bits>(~bits{0}) >> 1)));
    EXPECT_EQ(library(std::vector<TypeParam>{make(-0.0)}), 0u); // an empty or cancelled sum is +0
}

template <class T, class Blend = vp::blend::add>
std::uint64_t repeat(T clear, T value, std::uint32_t n) {
    return std::bit_cast<typename vp::core::float_bits<T>::type>(vp::core::repeated_fold<Blend, T>(clear, value)(n));
}

// Up to the largest number of fragments that a voxel can have. For 1 to 3, also compared with folding one by one.
TYPED_TEST(ReproducibleSum, OfOneTermManyTimesIsAProduct) {
    splitmix64 random(6);
    const auto any_term = [&] {
        switch (random.below(12)) {
        case 0:
            return narrow<TypeParam>(random.one_in(2) ? HUGE_VAL : -HUGE_VAL);
        case 1:
            return narrow<TypeParam>(std::nan(""));
        case 2:
            return narrow<TypeParam>(-0.0);
        case 3: // the largest
            if constexpr (std::is_same_v<TypeParam, vp::half>)
                return vp::half(random.one_in(2) ? 65504.0f : -65504.0f);
            else
                return std::nextafter(static_cast<TypeParam>(format<TypeParam>::infinite_from), TypeParam{0}) *
                       (random.one_in(2) ? TypeParam{1} : TypeParam{-1});
        default:
            return random_term<TypeParam>(random);
        }
    };
    for (std::int64_t i = 0; i < unit::cases(5000); ++i) {
        const TypeParam clear = any_term(), value = any_term();
        const auto n = static_cast<std::uint32_t>(random.one_in(3) ? 1 + random.below(3)
                                                                   : 1 + (random.next() >> (32 + random.below(32))));
        if (n == 0) continue;
        using term = repeated<TypeParam>;
        ASSERT_EQ(repeat(clear, value, n), model(std::vector<term>{{clear, 1}, {value, n}})) << n;
        if (n <= 3) {
            std::vector<TypeParam> terms(n, value);
            terms.push_back(clear);
            ASSERT_EQ(repeat(clear, value, n), library(terms));
        }
        using bits = typename vp::core::float_bits<TypeParam>::type;
        ASSERT_EQ(repeat(clear, value, 0), std::bit_cast<bits>(clear));
    }
}

TEST(ReproducibleSumFloat, RoundsToEvenAtTheSmallEndAndToInfinityAtTheLarge) {
    using v = std::vector<float>;
    const float below = std::nextafterf(0x1p31f, 0.0f);
    EXPECT_EQ(library(v{below}), std::bit_cast<std::uint32_t>(below));
    EXPECT_EQ(library(v{0x1p31f}), 0x7f800000u);
    EXPECT_EQ(library(v{-0x1p31f}), 0xff800000u);
    EXPECT_EQ(library(v{-below}), std::bit_cast<std::uint32_t>(-below));
    EXPECT_EQ(library(v{0x1p-32f}), std::bit_cast<std::uint32_t>(0x1p-32f));
    EXPECT_EQ(library(v{0x1p-33f}), 0u);                                       // a tie: zero is even
    EXPECT_EQ(library(v{0x1.8p-32f}), std::bit_cast<std::uint32_t>(0x1p-31f)); // a tie: two quanta are even
    EXPECT_EQ(library(v{std::nextafterf(0x1p-33f, 1.0f)}), std::bit_cast<std::uint32_t>(0x1p-32f));
    EXPECT_EQ(library(v{1e9f, -1e9f, 0.1f}), std::bit_cast<std::uint32_t>(0.1f));
}

TEST(ReproducibleSumDouble, CancelsTermsOfTwoToTheHundredQuanta) {
    using v = std::vector<double>;
    EXPECT_EQ(library(v{0x1p36, 0x1p-64, -0x1p36}), std::bit_cast<std::uint64_t>(0x1p-64));
    EXPECT_EQ(library(v{0x1p62, 0x1p62, 1.0, -0x1p62, 0x1p-60, -0x1p62}),
              std::bit_cast<std::uint64_t>(1.0 + 0x1p-60)); // rounds to 1
    EXPECT_EQ(library(v{0x1p63}), 0x7ff0000000000000u);
    EXPECT_EQ(library(v{std::nextafter(0x1p63, 0.0)}), std::bit_cast<std::uint64_t>(std::nextafter(0x1p63, 0.0)));
    EXPECT_EQ(library(v{0x1p-65}), 0u);
    EXPECT_EQ(library(v{0x1.8p-64}), std::bit_cast<std::uint64_t>(0x1p-63));
    EXPECT_EQ(library(v{-0x1.4p-64}), std::bit_cast<std::uint64_t>(-0x1p-64));
}

TEST(ReproducibleSumQuantum, MovesTheWindow) {
    splitmix64 random(5);
    const auto check = [&]<int Q>() {
        for (int i = 0; i < 300; ++i) {
            std::vector<float> terms(random.below(10));
            for (float& t : terms)
                t = static_cast<float>(unit::spread_double(random, std::max(Q - 20, -120), std::min(Q + 62, 120)));
            ASSERT_EQ((library<float, vp::blend::add_quantum<Q>>(terms)), model(terms, Q, std::ldexp(1.0, 63 + Q)))
                << Q;
            if (terms.size() < 2) continue;
            const auto n = static_cast<std::uint32_t>(random.next() | 1u);
            ASSERT_EQ((repeat<float, vp::blend::add_quantum<Q>>(terms[0], terms[1], n)),
                      model(std::vector<repeated<float>>{{terms[0], 1}, {terms[1], n}}, Q, std::ldexp(1.0, 63 + Q)))
                << Q;
        }
        const float limit = std::ldexp(1.0f, std::min(63 + Q, 127));
        if (63 + Q <= 127) {
            EXPECT_EQ((library<float, vp::blend::add_quantum<Q>>({limit})), 0x7f800000u);
            EXPECT_NE((library<float, vp::blend::add_quantum<Q>>({std::nextafterf(limit, 0.0f)})), 0x7f800000u);
        }
    };
    check.operator()<-126>();
    check.operator()<-60>();
    check.operator()<-32>();
    check.operator()<0>();
    check.operator()<20>();
    check.operator()<64>();
}

// The accumulator's words: every pattern of carries and borrows, against one wide number.
template <int Limbs>
wide value_of(const vp::core::wide_sum<Limbs>& s) {
    wide v = wide(std::int64_t{s.top});
    for (int i = Limbs - 1; i >= 0; --i) v = v.shifted_left(64) + wide(static_cast<vp::int128>(s.limb[i]));
    return v;
}

TEST(WideSum, CarriesAndBorrowsAcrossItsWords) {
    splitmix64 random(6);
    const auto term64 = [&]() -> std::int64_t {
        switch (random.below(5)) {
        case 0:
            return std::numeric_limits<std::int64_t>::min();
        case 1:
            return std::numeric_limits<std::int64_t>::max();
        case 2:
            return random.between(-2, 2);
        default:
            return static_cast<std::int64_t>(random.next()) >> random.below(64);
        }
    };
    for (int run = 0; run < 20; ++run) {
        vp::core::wide_sum<1> one{};
        vp::core::wide_sum<2> two{};
        wide sum_one, sum_two;
        for (int i = 0; i < 2000; ++i) {
            const std::int64_t t = term64();
            vp::core::add_term(one, t);
            sum_one = sum_one + wide(t);
            const vp::int128 u = static_cast<vp::int128>(
                (static_cast<vp::uint128>(static_cast<std::uint64_t>(term64())) << 64) |
                static_cast<std::uint64_t>(random.one_in(3) ? term64() : static_cast<std::int64_t>(random.next())));
            vp::core::add_term(two, u);
            // The most negative 128-bit number has no counterpart in the model's constructor.
            const vp::int128 half = u >> 1;
            sum_two = sum_two + wide(half) + wide(half) + wide(static_cast<std::int64_t>(u & 1));
            ASSERT_EQ(value_of(one), sum_one);
            ASSERT_EQ(value_of(two), sum_two);
        }
        const auto m1 = vp::core::to_magnitude(one);
        EXPECT_EQ(wide(static_cast<vp::int128>(m1.magnitude)), sum_one.sign() < 0 ? -sum_one : sum_one);
        EXPECT_EQ(m1.negative, sum_one.sign() < 0);
        for (const int mantissa : {10, 23, 52}) {
            EXPECT_EQ(vp::core::round_sum(two, 0, mantissa, 11), unit::nearest_bits({sum_two}, mantissa, 11));
            EXPECT_EQ(vp::core::round_sum(one, -5, mantissa, 11),
                      unit::nearest_bits({sum_one, wide(32)}, mantissa, 11));
        }
    }
}

TEST(WideSum, RoundsWhatNeedsMoreThan128Bits) {
    // top = 2^20: the low 32 bits only count as sticky.
    for (const std::uint64_t low : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 31, ~std::uint64_t{0}})
        for (const std::uint64_t high :
             {std::uint64_t{0}, std::uint64_t{1} << 31, (std::uint64_t{1} << 32) + 1, ~std::uint64_t{0}})
            for (const std::int32_t top : {1 << 20, -(1 << 20), 1, -1, -2, 0x7fffffff}) {
                const vp::core::wide_sum<2> s{{low, high}, top, 0};
                EXPECT_EQ(vp::core::round_sum(s, -64, 52, 11),
                          unit::nearest_bits({value_of(s), unit::power_of_two(64)}, 52, 11))
                    << low << ' ' << high << ' ' << top;
            }
}

// A 64-bit sum becomes a float by one conversion. round_sum, which handles every sum, gives the same.
TEST(RoundSum, ToFloatByOneConversionIsTheSame) {
    splitmix64 random(9);
    const auto check = [&]<int Quantum>(std::integral_constant<int, Quantum>, const vp::core::wide_sum<1>& s) {
        const auto bits = static_cast<std::uint32_t>(vp::core::round_sum(s, Quantum, 23, 8));
        ASSERT_EQ(vp::core::bit_cast<std::uint32_t>(vp::core::round_sum_to_float<Quantum>(s)), bits)
            << s.limb[0] << ' ' << s.top << ' ' << s.marks << ' ' << Quantum;
    };
    const auto check_all = [&](const vp::core::wide_sum<1>& s) {
        check(std::integral_constant<int, -126>{}, s);
        check(std::integral_constant<int, -32>{}, s);
        check(std::integral_constant<int, 0>{}, s);
        check(std::integral_constant<int, 64>{}, s);
    };
    for (const std::uint64_t low : {0ull, 1ull, (1ull << 63) - 1, 1ull << 63, (1ull << 63) + 1, ~0ull, (1ull << 24) + 1,
                                    (1ull << 25) + 2, (1ull << 25) + 6, 0x7fffff4000000000ull, 0x7fffffc000000000ull})
        for (const std::int32_t top : {0, -1, 1, -2})
            for (const std::uint32_t marks : {0u, 1u, 2u, 3u, 4u}) check_all({{low}, top, marks});
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        const auto units = static_cast<std::int64_t>(random.next()) >> random.below(64);
        check_all({{static_cast<std::uint64_t>(units)}, static_cast<std::int32_t>(units >> 63), 0});
    }
}

TEST(AddSaturate, SignedIsTheExactSumThenClamped) {
    splitmix64 random(7);
    const auto check = [&]<class T>(T) {
        using traits = vp::core::blend_traits<vp::blend::add_saturate, T>;
        for (std::int64_t i = 0; i < unit::cases(2000); ++i) {
            std::vector<T> terms(random.below(12));
            for (T& t : terms)
                t = random.one_in(3)
                        ? (random.one_in(2) ? std::numeric_limits<T>::max() : std::numeric_limits<T>::min())
                        : static_cast<T>(random.next());
            auto a = traits::begin(traits::identity());
            wide sum;
            for (const T t : terms) {
                traits::apply(a, t);
                sum = sum + wide(static_cast<vp::int128>(t));
            }
            const wide low(static_cast<vp::int128>(std::numeric_limits<T>::min())),
                high(static_cast<vp::int128>(std::numeric_limits<T>::max()));
            const wide expected = sum < low ? low : sum > high ? high : sum;
            ASSERT_EQ(wide(static_cast<vp::int128>(traits::end(a))), expected);
        }
    };
    check(std::int8_t{});
    check(std::int16_t{});
    check(std::int32_t{});
    check(std::int64_t{});
    check(std::uint8_t{});
    check(std::uint16_t{});
    check(std::uint32_t{});
    check(std::uint64_t{});
}

} // namespace
