// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Blends of packed formats against the oracle: exact, in shuffled order and in parts.

#include "packed_oracle.hpp"

namespace packed_oracle {
namespace {

template <class T>
class PackedBlends : public ::testing::Test {};
TYPED_TEST_SUITE(PackedBlends, all_formats);

template <class Blend, class T, class Value>
T packed_fold(const std::vector<Value>& values, T start) {
    using traits = vp::core::blend_traits<Blend, T>;
    auto a = traits::begin(start);
    for (const Value& v : values) traits::apply(a, v);
    return traits::end(a);
}
// The same in parts that are joined, as threads that share a voxel do.
template <class Blend, class T, class Value>
T packed_fold_in_parts(const std::vector<Value>& values, T start) {
    using traits = vp::core::blend_traits<Blend, T>;
    auto all = traits::begin(start);
    for (std::size_t from = 0; from < values.size(); from += 3) {
        auto part = traits::begin(traits::identity());
        for (std::size_t i = from; i < std::min(values.size(), from + 3); ++i) traits::apply(part, values[i]);
        if constexpr (std::is_same_v<typename traits::accumulator, T>) {
            traits::apply(all, part);
        } else {
            add_sum(part, all); // the stored value comes last
            all = part;
        }
    }
    return traits::end(all);
}
template <class Blend, class T, class Value>
void expect_fold(std::vector<Value> values, T start, std::uint64_t expected) {
    for (int order = 0; order < 3; ++order) {
        ASSERT_EQ(std::uint64_t{packed_fold<Blend>(values, start).bits}, expected);
        ASSERT_EQ(std::uint64_t{packed_fold_in_parts<Blend>(values, start).bits}, expected);
        std::rotate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 3), values.end());
        std::reverse(values.begin(), values.end());
    }
}

// The sum of the terms over n.
number mean_number(const std::vector<number>& terms, std::int64_t n) {
    number sum;
    bool up = false, down = false;
    for (const number& t : terms) {
        sum.is_nan = sum.is_nan || t.is_nan;
        up = up || t.infinite > 0;
        down = down || t.infinite < 0;
        // Denominators are 1, powers of two or one greatest code: the greater one is a multiple of the other.
        const wide a = sum.value.denominator, b = t.value.denominator, common = a < b ? b : a;
        sum.value = {sum.value.numerator * wide::floor_divide(common, a) +
                         t.value.numerator * wide::floor_divide(common, b),
                     common};
    }
    sum.is_nan = sum.is_nan || (up && down);
    sum.infinite = up ? 1 : down ? -1 : 0;
    sum.value.denominator = sum.value.denominator * wide(n);
    return sum;
}

template <class T>
std::vector<T> random_words(unit::splitmix64& random) {
    std::vector<T> values;
    const auto count = static_cast<std::size_t>(1 + random.below(9));
    const bool small = random.one_in(2);
    while (values.size() < count) {
        T v = random_word<T>(random);
        if (std::is_same_v<T, vp::float11_11_10> && !random.one_in(4)) { // mostly finite
            typename T::wide_type f(0.0f);
            for (int i = 0; i < lanes<T>; ++i) f[i] = static_cast<float>(random.below(1 << 20)) * 0x1p-8f;
            v = T(f);
        } else if (small) {
            typename T::wide_type f(0.0f);
            for (int i = 0; i < lanes<T>; ++i) f[i] = (static_cast<float>(random.below(64)) - 20) * 0x1p-9f;
            v = T(f);
        }
        values.push_back(v);
    }
    return values;
}

TYPED_TEST(PackedBlends, BlendsAreExactAndIndependentOfTheOrder) {
    using T = TypeParam;
    using w = typename T::word_type;
    unit::splitmix64 random(5);
    for (std::int64_t k = 0; k < unit::cases(1'000); ++k) {
        const std::vector<T> values = random_words<T>(random);
        const T start = random_words<T>(random)[0].canonical();
        std::vector<number> sums, means, least, greatest;
        for (int i = 0; i < lanes<T>; ++i) {
            std::vector<number> terms;
            for (const T& v : values) terms.push_back(value_of(v, i));
            means.push_back(mean_number(terms, static_cast<std::int64_t>(values.size())));
            terms.push_back(value_of(start, i));
            sums.push_back(mean_number(terms, 1));
            const auto before = [](const number& a, const number& b) { // NaN is the greatest
                if (a.is_nan || b.is_nan) return !a.is_nan && b.is_nan;
                if (a.infinite != b.infinite) return a.infinite < b.infinite;
                return a.infinite == 0 && less(a.value, b.value);
            };
            least.push_back(*std::min_element(terms.begin(), terms.end(), before));
            greatest.push_back(*std::max_element(terms.begin(), terms.end(), before));
        }
        expect_fold<blend::add>(values, start, packed_word<T>(sums));
        expect_fold<blend::add_saturate>(values, start, packed_word<T>(sums));
        expect_fold<blend::mean>(values, start, packed_word<T>(means));
        expect_fold<blend::min>(values, start, packed_word<T>(least));
        expect_fold<blend::max>(values, start, packed_word<T>(greatest));
        ASSERT_EQ(packed_fold<blend::replace>(values, start).bits, values.back().canonical().bits);
        ASSERT_EQ(std::uint64_t{packed_fold<blend::mean>(std::vector<T>{}, start).bits}, std::uint64_t{start.bits});
        // What a voxel starts from changes nothing.
        ASSERT_EQ(
            packed_fold<blend::min>(values, vp::core::blend_traits<blend::min, T>::identity()).bits,
            packed_fold<blend::min>(std::vector<T>(values.begin() + 1, values.end()), values[0].canonical()).bits);
        ASSERT_EQ(
            packed_fold<blend::max>(values, vp::core::blend_traits<blend::max, T>::identity()).bits,
            packed_fold<blend::max>(std::vector<T>(values.begin() + 1, values.end()), values[0].canonical()).bits);
        static_assert(std::is_trivially_copyable_v<T> && sizeof(T) == sizeof(w));
    }
}

// Floats are not packed before the mean is: they are moved into the range only.
TYPED_TEST(PackedBlends, MeansOfFloatsArePackedOnce) {
    using T = TypeParam;
    unit::splitmix64 random(6);
    bool differs = false;
    for (std::int64_t k = 0; k < unit::cases(1'000); ++k) {
        std::vector<typename T::wide_type> values(1 + random.below(7));
        std::vector<T> packed;
        std::vector<number> means;
        for (auto& v : values) {
            for (int i = 0; i < lanes<T>; ++i) // exact in the accumulator
                v[i] = (static_cast<float>(random.below(1 << 20)) - 0x1p18f) * (random.one_in(3) ? 0x1p-16f : 0x1p-19f);
            if (random.one_in(9)) v[0] = infinity;
            if (random.one_in(9)) v[1] = quiet_nan;
            packed.push_back(T(v));
        }
        for (int i = 0; i < lanes<T>; ++i) {
            std::vector<number> terms;
            for (const auto& v : values) {
                number n = number::of(v[i]);
                constexpr bool is_float = std::is_same_v<T, vp::float11_11_10>;
                constexpr bool below = is_norm<T> && [] {
                    if constexpr (is_norm<T>) return T::is_signed;
                    return false;
                }();
                if (n.is_nan && !is_float) n = {};
                if (n.is_below_zero() && !below) n = {};
                if constexpr (is_norm<T>)
                    n = number::of(std::isnan(v[i]) ? 0.0f : std::clamp(v[i], below ? -1.0f : 0.0f, 1.0f));
                if (std::is_same_v<T, vp::rgb9e5> && n.infinite > 0) n = number::of(65408.0f);
                terms.push_back(n);
            }
            means.push_back(mean_number(terms, static_cast<std::int64_t>(values.size())));
        }
        const std::uint64_t expected = packed_word<T>(means);
        expect_fold<blend::mean>(values, T::from_bits(1), expected);
        differs = differs || std::uint64_t{packed_fold<blend::mean>(packed, T::from_bits(1)).bits} != expected;
    }
    EXPECT_TRUE(differs); // so the test above tells the two apart
}

// Signed sums that leave the range on the way come back: they are clamped at the end.
TEST(PackedBlendsNamed, SignedSumsSaturateAtTheEndOnly) {
    const std::vector<vp::snorm8x2> there_and_back{vp::snorm8x2(glm::vec2(1, -1)), vp::snorm8x2(glm::vec2(1, -1)),
                                                   vp::snorm8x2(glm::vec2(-1, 1)), vp::snorm8x2(glm::vec2(-1, 1))};
    EXPECT_EQ(packed_fold<blend::add>(there_and_back, vp::snorm8x2::from_bits(0)).bits, 0);
    // Fine terms of rgb9e5 count beside a large one that would swallow each of them.
    std::vector<vp::rgb9e5> terms(64, vp::rgb9e5(glm::vec3(1.0f, 0, 0)));
    terms.push_back(vp::rgb9e5(glm::vec3(4096.0f, 0, 0)));
    EXPECT_EQ(packed_fold<blend::add>(terms, vp::rgb9e5::from_bits(0)).unpack(), glm::vec3(4160, 0, 0));
    // The greatest component takes the small one's bits with it, whatever the order.
    const std::vector<vp::rgb9e5> three{vp::rgb9e5(glm::vec3(0, 1.25f, 0)), vp::rgb9e5(glm::vec3(400, 0, 0)),
                                        vp::rgb9e5(glm::vec3(600, 0.5f, 0))};
    expect_fold<blend::max>(three, vp::rgb9e5::from_bits(0), vp::rgb9e5(glm::vec3(600, 1.25f, 0)).bits);
}

// Means of the floating types, and of bfloat16's floats.
template <class T, int Mantissa, int Exponent>
void expect_float_means() {
    using bits = typename vp::core::float_bits<T>::type;
    unit::splitmix64 random(7);
    for (std::int64_t k = 0; k < unit::cases(4'000); ++k) {
        std::vector<T> values(1 + random.below(7));
        std::vector<number> terms;
        for (T& v : values) {
            v = static_cast<T>(static_cast<float>(static_cast<std::int32_t>(random.next() >> 33) - (1 << 30)) *
                               (random.one_in(2) ? 0x1p-24f : 0x1p-31f));
            if (random.one_in(30))
                v = static_cast<T>(random.one_in(3) ? quiet_nan : random.one_in(2) ? infinity : -infinity);
            terms.push_back(number::of(static_cast<float>(v)));
        }
        const number mean = mean_number(terms, static_cast<std::int64_t>(values.size()));
        std::uint64_t expected = float_code(mean, Mantissa, Exponent);
        if (!mean.is_nan && mean.is_below_zero()) expected |= std::uint64_t{1} << (Mantissa + Exponent);
        ASSERT_EQ(std::uint64_t{std::bit_cast<bits>(packed_fold<blend::mean>(values, T(1.0f)))}, expected);
        ASSERT_EQ(std::uint64_t{std::bit_cast<bits>(packed_fold_in_parts<blend::mean>(values, T(1.0f)))}, expected);
    }
    EXPECT_EQ(packed_fold<blend::mean>(std::vector<T>{}, T(3.0f)), T(3.0f));
}
TEST(PackedBlendsNamed, MeansOfFloatingTypesAreExact) {
    expect_float_means<float, 23, 8>();
    expect_float_means<vp::half, 10, 5>();
    expect_float_means<vp::bfloat16, 7, 8>();
    // Three floats of which each alone would round the other way.
    const std::vector<float> floats{0x1.01p0f, 0x1.01p0f, 0x1.03p0f};
    EXPECT_EQ(packed_fold<blend::mean>(floats, vp::bfloat16(0.0f)).bits, 0x3f81u);
}

} // namespace
} // namespace packed_oracle
