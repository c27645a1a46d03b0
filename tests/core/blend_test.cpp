// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// blend.hpp: every blend mode on every value type that it accepts, against plain folds that are written here. Also the
// total order of the floats, vectors, and blends that a user defines.

#include "test_support.hpp"

#include <voxelpipe/blend.hpp>
#include <voxelpipe/device/targets/repeated_fold.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::splitmix64;

template <class T>
bool same_bytes(const T& a, const T& b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <class Blend, class T>
T fold(const std::vector<T>& values, T start = vp::core::blend_traits<Blend, T>::identity()) {
    using traits = vp::core::blend_traits<Blend, T>;
    auto a = traits::begin(start);
    for (const T& v : values) traits::apply(a, v);
    return traits::end(a);
}

template <class T>
T random_value(splitmix64& random) {
    if constexpr (vp::core::vector_traits<T>::components > 1) {
        T v;
        for (int i = 0; i < vp::core::vector_traits<T>::components; ++i)
            v[i] = random_value<typename vp::core::vector_traits<T>::element>(random);
        return v;
    } else if constexpr (std::is_same_v<T, bool>) {
        return random.one_in(2);
    } else if constexpr (vp::core::is_floating<T>) {
        using bits = typename vp::core::float_bits<T>::type;
        constexpr bits special[] = {0, vp::core::float_bits<T>::infinity, vp::core::float_bits<T>::nan,
                                    static_cast<bits>(vp::core::float_bits<T>::infinity + 1), 1};
        bits b = random.one_in(4) ? special[random.below(5)] : static_cast<bits>(random.next());
        if (random.one_in(2)) b = static_cast<bits>(b ^ ~(static_cast<bits>(~bits{0}) >> 1)); // the other sign
        return std::bit_cast<T>(b);
    } else {
        return random.one_in(5) ? (random.one_in(2) ? std::numeric_limits<T>::max() : std::numeric_limits<T>::lowest())
                                : static_cast<T>(random.next());
    }
}

template <class T>
std::vector<T> random_values(splitmix64& random, std::uint64_t max_count) {
    std::vector<T> v(random.below(max_count + 1));
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = random_value<T>(random);
    return v;
}

template <class T>
double to_number(T v) {
    if constexpr (std::is_same_v<T, vp::half>)
        return static_cast<float>(v);
    else
        return static_cast<double>(v);
}

template <class T>
T one_nan() {
    return std::bit_cast<T>(vp::core::float_bits<T>::nan);
}

template <class T>
T lowest() { // -inf
    using bits = typename vp::core::float_bits<T>::type;
    return std::bit_cast<T>(static_cast<bits>(vp::core::float_bits<T>::infinity | ~(static_cast<bits>(~bits{0}) >> 1)));
}

// -inf < ... < -0 < +0 < ... < inf < NaN, by classification.
template <class T>
bool model_less(T a, T b) {
    const double x = to_number(a), y = to_number(b);
    if (std::isnan(x)) return false;
    if (std::isnan(y)) return true;
    if (x == 0 && y == 0) return std::signbit(x) && !std::signbit(y);
    return x < y;
}

template <class T>
class FloatOrder : public ::testing::Test {};
using FloatTypes = ::testing::Types<float, double, vp::half>;
TYPED_TEST_SUITE(FloatOrder, FloatTypes);

TYPED_TEST(FloatOrder, IsTotalWithNanOnTop) {
    splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(300'000); ++i) {
        const auto a = random_value<TypeParam>(random), b = random_value<TypeParam>(random);
        ASSERT_EQ(vp::core::ordered_less(a, b), model_less(a, b)) << to_number(a) << ' ' << to_number(b);
        ASSERT_EQ(vp::core::order_key(a) < vp::core::order_key(b), model_less(a, b));
        ASSERT_EQ(vp::core::order_key(a) == vp::core::order_key(b), !model_less(a, b) && !model_less(b, a));
    }
}

TYPED_TEST(FloatOrder, MinAndMaxKeepOneNan) {
    splitmix64 random(2);
    for (std::int64_t i = 0; i < unit::cases(30'000); ++i) {
        const auto values = random_values<TypeParam>(random, 6);
        TypeParam low = one_nan<TypeParam>(), high = lowest<TypeParam>();
        for (const TypeParam v : values) {
            const TypeParam c = std::isnan(to_number(v)) ? one_nan<TypeParam>() : v;
            if (model_less(c, low)) low = c;
            if (model_less(high, c)) high = c;
        }
        ASSERT_TRUE(same_bytes(fold<blend::min>(values), low));
        ASSERT_TRUE(same_bytes(fold<blend::max>(values), high));
    }
}

TYPED_TEST(FloatOrder, ReplaceAndCanonicalStoreOneNan) {
    splitmix64 random(3);
    for (std::int64_t i = 0; i < unit::cases(30'000); ++i) {
        const auto v = random_value<TypeParam>(random);
        const TypeParam expected = std::isnan(to_number(v)) ? one_nan<TypeParam>() : v;
        ASSERT_TRUE(same_bytes(vp::core::canonical(v), expected));
        ASSERT_TRUE(
            same_bytes(fold<blend::replace>(std::vector<TypeParam>{random_value<TypeParam>(random), v}), expected));
    }
}

TYPED_TEST(FloatOrder, UnorderedAddIsAPlainSumInThisOrder) {
    splitmix64 random(4);
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        const auto values = random_values<TypeParam>(random, 6);
        TypeParam sum = std::bit_cast<TypeParam>(typename vp::core::float_bits<TypeParam>::type{0});
        for (const TypeParam v : values) {
            if constexpr (std::is_same_v<TypeParam, vp::half>)
                sum = vp::half(static_cast<float>(sum) + static_cast<float>(v));
            else
                sum = sum + v;
            if (std::isnan(to_number(sum))) sum = one_nan<TypeParam>();
        }
        ASSERT_TRUE(same_bytes(fold<blend::add_unordered>(values), sum));
    }
}

template <class T>
class IntegerBlend : public ::testing::Test {};
using IntegerTypes = ::testing::Types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                                      std::uint32_t, std::int64_t, std::uint64_t>;
TYPED_TEST_SUITE(IntegerBlend, IntegerTypes);

TYPED_TEST(IntegerBlend, IsThePlainFold) {
    using T = TypeParam;
    splitmix64 random(5);
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        const std::vector<T> values = random_values<T>(random, 8);
        T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::lowest(), last{};
        std::uint64_t sum = 0, all_and = ~std::uint64_t{0}, all_or = 0, all_xor = 0;
        unit::wide exact;
        for (const T v : values) {
            low = std::min(low, v);
            high = std::max(high, v);
            last = v;
            const auto u = static_cast<std::uint64_t>(v);
            sum += u;
            all_and &= u;
            all_or |= u;
            all_xor ^= u;
            exact = exact + unit::wide(static_cast<vp::int128>(v));
        }
        ASSERT_EQ(fold<blend::min>(values), low);
        ASSERT_EQ(fold<blend::max>(values), high);
        ASSERT_EQ(fold<blend::replace>(values), last);
        ASSERT_EQ(fold<blend::add>(values), static_cast<T>(sum));
        ASSERT_EQ(fold<blend::bit_and>(values), static_cast<T>(all_and));
        ASSERT_EQ(fold<blend::bit_or>(values), static_cast<T>(all_or));
        ASSERT_EQ(fold<blend::bit_xor>(values), static_cast<T>(all_xor));
        ASSERT_EQ(fold<blend::count>(values), static_cast<T>(values.size()));
        const unit::wide lowest(static_cast<vp::int128>(std::numeric_limits<T>::lowest()));
        const unit::wide highest(static_cast<vp::int128>(std::numeric_limits<T>::max()));
        ASSERT_EQ(unit::wide(static_cast<vp::int128>(fold<blend::add_saturate>(values))), exact < lowest    ? lowest
                                                                                          : exact > highest ? highest
                                                                                                            : exact);
    }
}

TEST(BitBlend, IsThePlainFold) {
    splitmix64 random(6);
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        std::vector<bool> values(random.below(5));
        bool all = true, any = false, odd = false, last = false;
        for (std::size_t k = 0; k < values.size(); ++k) {
            values[k] = random.one_in(2);
            all = all && values[k];
            any = any || values[k];
            odd = odd != values[k];
            last = values[k];
        }
        const auto folded = [&]<class Blend>(Blend) {
            using traits = vp::core::blend_traits<Blend, bool>;
            auto a = traits::begin(traits::identity());
            for (const bool v : values) traits::apply(a, v);
            return traits::end(a);
        };
        ASSERT_EQ(folded(blend::bit_and{}), all);
        ASSERT_EQ(folded(blend::min{}), all);
        ASSERT_EQ(folded(blend::bit_or{}), any);
        ASSERT_EQ(folded(blend::max{}), any);
        ASSERT_EQ(folded(blend::add_saturate{}), any);
        ASSERT_EQ(folded(blend::bit_xor{}), odd);
        ASSERT_EQ(folded(blend::add{}), odd);
        ASSERT_EQ(folded(blend::replace{}), last);
        ASSERT_EQ(folded(blend::count{}), values.size() % 2 == 1);
    }
}

// Two promises of every blend: its identity changes nothing, and a blend that is declared order-free does not depend on
// the order.
template <class Blend, class T>
void check_laws() {
    using traits = vp::core::blend_traits<Blend, T>;
    if constexpr (traits::available) {
        splitmix64 random(7);
        for (std::int64_t i = 0; i < unit::cases(2000); ++i) {
            std::vector<T> values = random_values<T>(random, 6);
            const T stored = random_value<T>(random);
            const T all = fold<Blend>(values, stored);
            if constexpr (!std::is_same_v<Blend, blend::replace> && !std::is_same_v<Blend, blend::count> &&
                          !std::is_same_v<Blend, blend::add_unordered>) {
                std::vector<T> more = values;
                more.insert(more.begin() + static_cast<std::ptrdiff_t>(random.below(more.size() + 1)),
                            traits::identity());
                ASSERT_TRUE(same_bytes(fold<Blend>(more, stored), all));
            }
            if constexpr (traits::order_free) {
                for (std::size_t k = values.size(); k > 1; --k) std::swap(values[k - 1], values[random.below(k)]);
                ASSERT_TRUE(same_bytes(fold<Blend>(values, stored), all));
            }
        }
    }
}

template <class T>
class EveryBlend : public ::testing::Test {};
using ValueTypes =
    ::testing::Types<std::uint8_t, std::int16_t, std::uint32_t, std::int32_t, std::uint64_t, std::int64_t, vp::half,
                     float, double, glm::vec2, glm::vec3, glm::vec4, glm::dvec3, glm::vec<3, vp::half>, glm::ivec2,
                     glm::uvec4, glm::vec<3, std::uint8_t>, glm::vec<2, std::int64_t>>;
TYPED_TEST_SUITE(EveryBlend, ValueTypes);

TYPED_TEST(EveryBlend, KeepsItsLaws) {
    check_laws<blend::replace, TypeParam>();
    check_laws<blend::add, TypeParam>();
    check_laws<blend::add_saturate, TypeParam>();
    check_laws<blend::add_unordered, TypeParam>();
    check_laws<blend::min, TypeParam>();
    check_laws<blend::max, TypeParam>();
    check_laws<blend::bit_and, TypeParam>();
    check_laws<blend::bit_or, TypeParam>();
    check_laws<blend::bit_xor, TypeParam>();
    check_laws<blend::count, TypeParam>();
}

TYPED_TEST(EveryBlend, IsThereForTheTypesThatTheTableNames) {
    using S = typename vp::core::vector_traits<TypeParam>::element;
    const auto available = []<class Blend>(Blend) { return vp::core::blend_traits<Blend, TypeParam>::available; };
    constexpr bool integer = vp::core::is_integer<S>, floating = vp::core::is_floating<S>;
    EXPECT_TRUE(available(blend::replace{}));
    EXPECT_TRUE(available(blend::add{}));
    EXPECT_TRUE(available(blend::min{}));
    EXPECT_TRUE(available(blend::max{}));
    EXPECT_EQ(available(blend::add_unordered{}), floating);
    EXPECT_EQ(available(blend::add_quantum<-16>{}), (std::is_same_v<S, float>));
    EXPECT_EQ(available(blend::add_saturate{}), integer);
    EXPECT_EQ(available(blend::bit_and{}), integer);
    EXPECT_EQ(available(blend::bit_or{}), integer);
    EXPECT_EQ(available(blend::bit_xor{}), integer);
    EXPECT_EQ(available(blend::count{}), integer);
}

TYPED_TEST(EveryBlend, TreatsVectorsComponentByComponent) {
    using S = typename vp::core::vector_traits<TypeParam>::element;
    constexpr int n = vp::core::vector_traits<TypeParam>::components;
    if constexpr (n > 1) {
        splitmix64 random(8);
        const auto check = [&]<class Blend>(Blend) {
            if constexpr (vp::core::blend_traits<Blend, TypeParam>::available) {
                for (std::int64_t i = 0; i < unit::cases(1000); ++i) {
                    const auto values = random_values<TypeParam>(random, 5);
                    const TypeParam r = fold<Blend>(values);
                    for (int c = 0; c < n; ++c) {
                        std::vector<S> component;
                        for (const TypeParam& v : values) component.push_back(v[c]);
                        const S expected = fold<Blend>(component), got = r[c];
                        ASSERT_TRUE(same_bytes(got, expected));
                    }
                }
            }
        };
        check(blend::replace{});
        check(blend::add{});
        check(blend::add_saturate{});
        check(blend::add_unordered{});
        check(blend::min{});
        check(blend::max{});
        check(blend::bit_and{});
        check(blend::bit_or{});
        check(blend::bit_xor{});
        check(blend::count{});
    }
}

// Closed forms for one value that is folded many times; those of reproducible sums are in reproducible_sum_test.cpp.
template <class T>
class RepeatedFold : public ::testing::Test {};
using Integers = ::testing::Types<std::uint8_t, std::int16_t, std::uint32_t, std::int32_t, std::uint64_t, std::int64_t>;
TYPED_TEST_SUITE(RepeatedFold, Integers);

TYPED_TEST(RepeatedFold, OfIntegersIsTheFold) {
    splitmix64 random(12);
    const auto check = [&]<class Blend>(Blend) {
        for (std::int64_t i = 0; i < unit::cases(1000); ++i) {
            const auto clear = random_value<TypeParam>(random), value = random_value<TypeParam>(random);
            const auto n = static_cast<std::uint32_t>(random.below(random.one_in(20) ? 700 : 5));
            const TypeParam got = vp::core::repeated_fold<Blend, TypeParam>(clear, value)(n);
            ASSERT_EQ(got, fold<Blend>(std::vector<TypeParam>(n, value), clear));
        }
    };
    check(blend::add{});
    check(blend::count{});
    check(blend::min{});
    check(blend::max{});
    check(blend::bit_and{});
    check(blend::bit_or{});
    check(blend::bit_xor{});
}

template <class T>
void check_unordered() {
    splitmix64 random(13);
    constexpr T epsilon = std::numeric_limits<T>::epsilon();
    const T infinity = std::numeric_limits<T>::infinity();
    const auto repeat = [](T clear, T value, std::uint32_t n) {
        return vp::core::repeated_fold<blend::add_unordered, T>(clear, value)(n);
    };
    for (std::int64_t i = 0; i < unit::cases(1000); ++i) {
        // Within the error bound of any order of additions; equal if all additions are exact.
        const auto n = static_cast<std::uint32_t>(random.below(300));
        const T clear = static_cast<T>(unit::spread_double(random, -9, 9));
        const T value = static_cast<T>(unit::spread_double(random, -9, 9));
        const T folded = fold<blend::add_unordered>(std::vector<T>(n, value), clear);
        const T terms = std::abs(clear) + static_cast<T>(n) * std::abs(value);
        ASSERT_LE(std::abs(repeat(clear, value, n) - folded), static_cast<T>(n) * epsilon * terms);
        const T whole = static_cast<T>(random.below(1000)) - T(500), eighths = static_cast<T>(random.below(64)) / T(8);
        const T exact = fold<blend::add_unordered>(std::vector<T>(n, eighths), whole);
        ASSERT_TRUE(same_bytes(repeat(whole, eighths, n), exact));
    }
    ASSERT_TRUE(same_bytes(repeat(T(-0.0), T(-0.0), 3), T(-0.0)));
    ASSERT_TRUE(same_bytes(repeat(T(0), T(-0.0), 3), T(0)));
    ASSERT_TRUE(same_bytes(repeat(T(-0.0), T(1), 0), T(-0.0)));
    ASSERT_TRUE(same_bytes(repeat(T(1), infinity, 2), infinity));
    const T nan = fold<blend::add_unordered>(std::vector<T>{infinity}, -infinity);
    ASSERT_TRUE(same_bytes(repeat(-infinity, infinity, 1), nan));
}

TEST(RepeatedFoldUnordered, StaysWithinTheBound) {
    check_unordered<float>();
    check_unordered<double>();
}

// Blends that a user defines.
struct color {
    float r, g, b, alpha;
};
struct over { // depends on the order
    static constexpr bool order_free = false;
    VOXELPIPE_HD
    color identity() const { return {0, 0, 0, 0}; }
    VOXELPIPE_HD
    color combine(color below, color above) const {
        const float keep = 1.0f - above.alpha;
        const auto mix = [&](float x, float y) { return vp::exact::fma(keep, x, y); };
        return {mix(below.r, above.r), mix(below.g, above.g), mix(below.b, above.b), mix(below.alpha, above.alpha)};
    }
};
struct gcd { // a template, and order-free
    static constexpr bool order_free = true;
    template <class T>
    VOXELPIPE_HD T identity() const {
        return T{0};
    }
    template <class T>
    VOXELPIPE_HD T combine(T a, T b) const {
        while (b != 0) {
            const T r = static_cast<T>(a % b);
            a = b;
            b = r;
        }
        return a;
    }
};

TEST(UserBlend, FoldsInOrderFromItsIdentity) {
    static_assert(vp::core::blend_traits<over, color>::available && !vp::core::blend_traits<over, color>::order_free);
    const color red{0.5f, 0, 0, 0.5f}, green{0, 0.25f, 0, 0.25f};
    const color a = fold<over>(std::vector<color>{red, green}), b = fold<over>(std::vector<color>{green, red});
    EXPECT_EQ(a.r, 0.375f);
    EXPECT_EQ(a.g, 0.25f);
    EXPECT_EQ(b.r, 0.5f);
    EXPECT_EQ(b.g, 0.125f);
    EXPECT_EQ(fold<over>(std::vector<color>{}).alpha, 0.0f);
}

TEST(UserBlend, MayBeATemplate) {
    static_assert(vp::core::blend_traits<gcd, std::uint32_t>::order_free);
    EXPECT_EQ((fold<gcd>(std::vector<std::uint32_t>{84, 36, 30})), 6u);
    EXPECT_EQ((fold<gcd>(std::vector<std::uint64_t>{})), 0u);
}

} // namespace
