// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Conversions of packed formats against an oracle in rational numbers: every code both ways, and floats at and next to
// every point where the rounding changes.

#include "../test_scale.hpp"
#include "packed_oracle.hpp"

namespace packed_oracle {
namespace {

template <class T>
typename T::wide_type all_lanes(float f) {
    return typename T::wide_type(f);
}
template <class T>
void expect_packed(const typename T::wide_type& v) {
    std::vector<number> n;
    for (int i = 0; i < lanes<T>; ++i) n.push_back(number::of(v[i]));
    ASSERT_EQ(std::uint64_t{T(v).bits}, packed_word<T>(n)) << std::hexfloat << v[0] << ' ' << v[1];
}
template <class T>
void expect_packed_near(float f) {
    for (const float at : {f, -f}) {
        float below = at, above = at;
        expect_packed<T>(all_lanes<T>(at));
        for (int step = 0; step < 2; ++step) {
            below = std::nextafterf(below, -HUGE_VALF);
            above = std::nextafterf(above, HUGE_VALF);
            expect_packed<T>(all_lanes<T>(below));
            expect_packed<T>(all_lanes<T>(above));
        }
    }
}

// Builds with sanitizers take a seventh of the codes.
const int code_step = tests::is_slow_build() ? 7 : 1;

// ---- conversions ----------------------------------------------------------------------------------------------------

template <class T>
class Packed : public ::testing::Test {};
TYPED_TEST_SUITE(Packed, all_formats);

// Every code of each component, the others 0 or random.
TYPED_TEST(Packed, EveryCodeSurvivesTheWayThroughFloats) {
    using T = TypeParam;
    unit::splitmix64 random(1);
    for (int i = 0; i < lanes<T>; ++i) {
        const component c = format<T>::components[static_cast<std::size_t>(i)];
        const int others = std::is_same_v<T, vp::rgb9e5> ? 32 : 1; // every exponent
        for (int code = 0; code < 1 << c.width; code += code_step)
            for (int other = 0; other < others; ++other) {
                std::uint64_t word = code % 64 == 0 || others > 1 ? random.next() : 0;
                word = (word & ~(((std::uint64_t{1} << c.width) - 1) << c.first)) | static_cast<std::uint64_t>(code)
                                                                                        << c.first;
                if (others > 1) word = (word & ~(std::uint64_t{31} << 27)) | static_cast<std::uint64_t>(other) << 27;
                const T v = T::from_bits(static_cast<typename T::word_type>(word));
                std::vector<number> n;
                for (int k = 0; k < lanes<T>; ++k) {
                    n.push_back(value_of(v, k));
                    const float f = v.unpack()[k];
                    if (n.back().is_nan)
                        ASSERT_TRUE(std::isnan(f));
                    else if (n.back().infinite != 0)
                        ASSERT_EQ(f, infinity);
                    else
                        ASSERT_EQ(f, unit::nearest_float(n.back().value)) << std::hex << word;
                }
                const T back(v.unpack());
                ASSERT_EQ(std::uint64_t{back.bits}, packed_word<T>(n)) << std::hex << word;
                ASSERT_EQ(back.bits, v.canonical().bits) << std::hex << word;
                ASSERT_EQ(back.bits, back.canonical().bits);
            }
    }
}

TYPED_TEST(Packed, CanonicalChangesNothingElse) {
    using T = TypeParam;
    unit::splitmix64 random(2);
    for (int k = 0; k < 20'000; ++k) {
        const T v = random_word<T>(random);
        for (int i = 0; i < lanes<T>; ++i) {
            const number a = value_of(v, i), b = value_of(v.canonical(), i);
            ASSERT_EQ(a.is_nan, b.is_nan);
            ASSERT_EQ(a.infinite, b.infinite);
            ASSERT_FALSE(less(a.value, b.value) || less(b.value, a.value));
        }
    }
    if constexpr (is_norm<T>)
        if constexpr (T::is_signed) {
            T least = T::from_bits(0);
            for (const component c : format<T>::components)
                least.bits = static_cast<typename T::word_type>(
                    least.bits |
                    static_cast<typename T::word_type>(typename T::word_type{1} << (c.first + c.width - 1)));
            EXPECT_EQ(least.unpack(), all_lanes<T>(-1.0f));
            EXPECT_EQ(least.canonical().bits, T(all_lanes<T>(-1.0f)).bits);
        }
}

// Floats at and around every value, and half way to the next.
TYPED_TEST(Packed, FloatsRoundOnceToTheNearestTiesToEven) {
    using T = TypeParam;
    const component c = format<T>::components[0];
    if constexpr (is_norm<T>) {
        for (const component each : format<T>::components) {
            const int greatest = (1 << (T::is_signed ? each.width - 1 : each.width)) - 1;
            const int step = greatest > 2000 ? 37 : 1;
            for (int code = 0; code <= greatest; code += code < 200 || code + 200 > greatest ? 1 : step) {
                expect_packed_near<T>(static_cast<float>(static_cast<double>(code) / greatest));
                expect_packed_near<T>(static_cast<float>((code + 0.5) / greatest));
            }
        }
    } else if constexpr (std::is_same_v<T, vp::rgb9e5>) {
        for (int exponent = 0; exponent < 32; ++exponent)
            for (int twice = exponent == 0 ? 0 : 510; twice <= 1026; twice += code_step)
                expect_packed_near<T>(std::ldexp(static_cast<float>(twice), exponent - 25));
    } else {
        for (int code = 0; code < 31 << (c.width - 5); code += code_step) {
            const auto at = [](int k) { return vp::half::from_bits(static_cast<std::uint16_t>(k << 3)); };
            expect_packed_near<T>(static_cast<float>(at(2 * code))); // of 7 bits: the values, and those half way
            expect_packed_near<T>(static_cast<float>(at(2 * code + 1)));
            expect_packed_near<T>(static_cast<float>(vp::half::from_bits(static_cast<std::uint16_t>((code << 4) + 4))));
        }
    }
    unit::splitmix64 random(3);
    for (std::int64_t k = 0; k < unit::cases(10'000); ++k) {
        typename T::wide_type v(0.0f);
        for (int i = 0; i < lanes<T>; ++i)
            v[i] = random.one_in(2) ? unit::any_finite_float(random)
                                    : static_cast<float>(unit::spread_double(random, -30, 18));
        expect_packed<T>(v);
    }
}

TYPED_TEST(Packed, TakesWhatIsNoNumberOrBeyondTheRange) {
    using T = TypeParam;
    const float denormal = std::numeric_limits<float>::denorm_min(), most = std::numeric_limits<float>::max();
    for (const float f : {quiet_nan, -quiet_nan, infinity, -infinity, 0.0f, -0.0f, denormal, -denormal, most, -most,
                          1.0f, -1.0f, 65024.0f, 65408.0f, 65471.9f, 65472.0f, 65536.0f, 65519.0f, 64512.0f})
        for (int i = 0; i < lanes<T>; ++i) {
            typename T::wide_type v(0.25f);
            v[i] = f;
            expect_packed<T>(v);
            expect_packed<T>(all_lanes<T>(f));
        }
}

TEST(PackedNamed, ValuesAreThoseOfTheirDefinitions) {
    EXPECT_EQ(vp::unorm8x4(glm::vec4(0, 1, 0.5f, quiet_nan)).bits, 0x0080ff00u); // 127.5 is a tie: to 128
    EXPECT_EQ(vp::unorm10_10_10_2(glm::vec4(1, 0, 0.5f, 0.5f)).bits, 2u << 30 | 512u << 20 | 1023u);
    EXPECT_EQ(vp::snorm8x2(glm::vec2(-7, 0.5f)).bits, 64u << 8 | 0x81u);
    EXPECT_EQ(vp::snorm16x2(glm::vec2(-0.5f, 1)).bits, 0x7fffc000u);
    EXPECT_EQ(vp::float11_11_10(glm::vec3(1, -2, infinity)).bits, 0x3e0u << 22 | 15u << 6);
    EXPECT_EQ(vp::float11_11_10(glm::vec3(1e9f, quiet_nan, 1e9f)).unpack().x, 65024.0f);
    EXPECT_EQ(vp::float11_11_10(glm::vec3(1e9f, quiet_nan, 1e9f)).unpack().z, 64512.0f);
    EXPECT_EQ(vp::rgb9e5(glm::vec3(infinity, quiet_nan, -1)).unpack(), glm::vec3(65408, 0, 0));
    EXPECT_EQ(vp::rgb9e5(glm::vec3(1, 2, 3)).unpack(), glm::vec3(1, 2, 3));
    EXPECT_EQ(vp::bfloat16(std::numeric_limits<float>::max()).bits, 0x7f7fu);
    EXPECT_EQ(vp::bfloat16(-infinity).bits, 0xff80u);
}

TEST(Bfloat16, EveryPatternSurvivesAndFloatsRoundToTheNearest) {
    for (std::uint32_t i = 0; i < 0x10000; i += static_cast<std::uint32_t>(code_step)) {
        const auto bits = static_cast<std::uint16_t>(i);
        const vp::bfloat16 v = vp::bfloat16::from_bits(bits);
        const auto f = static_cast<float>(v);
        ASSERT_EQ(std::bit_cast<std::uint32_t>(f), i << 16);
        if (std::isnan(f)) {
            ASSERT_TRUE(std::isnan(static_cast<float>(vp::bfloat16(f))));
            continue;
        }
        ASSERT_EQ(vp::bfloat16(f).bits, bits);
        if (std::isinf(f)) continue;
        // The values around it, the tie, and what is next to the tie.
        for (const std::uint32_t low : {1u, 0x7fffu, 0x8000u, 0x8001u, 0xffffu}) {
            const auto between = std::bit_cast<float>(i << 16 | low);
            const std::uint64_t sign = i & 0x8000u;
            ASSERT_EQ(vp::bfloat16(between).bits, sign | float_code(number::of(between), 7, 8)) << std::hex << i;
        }
    }
    unit::splitmix64 random(4);
    for (std::int64_t k = 0; k < unit::cases(40'000); ++k) {
        const float f = unit::any_finite_float(random);
        ASSERT_EQ(vp::bfloat16(f).bits, (std::signbit(f) ? 0x8000u : 0u) | float_code(number::of(f), 7, 8));
    }
    for (const std::uint32_t payload : {1u, 0xffffu, 0x10000u, 0x3fffffu, 0x400000u, 0x7fffffu})
        EXPECT_TRUE(std::isnan(static_cast<float>(vp::bfloat16(std::bit_cast<float>(0x7f800000u | payload)))));
}

} // namespace
} // namespace packed_oracle
