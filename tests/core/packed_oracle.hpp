// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An oracle of the packed formats in rational numbers, which uses nothing of theirs but the bits.

#include "test_support.hpp"

#include <voxelpipe/formats/formats.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace packed_oracle {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::rational;
using unit::wide;

inline constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN(),
                       infinity = std::numeric_limits<float>::infinity();

// ---- the oracle -----------------------------------------------------------------------------------------------------

inline rational operator*(const rational& a, const wide& b) { return {a.numerator * b, a.denominator}; }
inline bool less(const rational& a, const rational& b) {
    return a.numerator * b.denominator < b.numerator * a.denominator;
}

// A component before it is packed: a rational number, or NaN, or infinite.
struct number {
    rational value{wide(0)};
    bool is_nan = false;
    int infinite = 0; // its sign

    static number of(float f) {
        number n;
        if (std::isnan(f))
            n.is_nan = true;
        else if (std::isinf(f))
            n.infinite = f < 0 ? -1 : 1;
        else
            n.value = unit::exact(double{f});
        return n;
    }
    friend bool operator==(const number& a, const number& b) {
        return a.is_nan == b.is_nan && a.infinite == b.infinite &&
               (a.value.numerator - b.value.numerator).sign() == 0 &&
               (a.value.denominator - b.value.denominator).sign() == 0;
    }
    [[nodiscard]] bool is_below_zero() const {
        return infinite != 0 ? infinite < 0 : !is_nan && value.numerator.sign() < 0;
    }
};

struct component { // of a word: its lowest bit and its width
    int first, width;
};
template <class T>
struct format;
template <>
struct format<vp::unorm8x4> {
    static constexpr std::array<component, 4> components{{{0, 8}, {8, 8}, {16, 8}, {24, 8}}};
};
template <>
struct format<vp::unorm10_10_10_2> {
    static constexpr std::array<component, 4> components{{{0, 10}, {10, 10}, {20, 10}, {30, 2}}};
};
template <>
struct format<vp::snorm8x2> {
    static constexpr std::array<component, 2> components{{{0, 8}, {8, 8}}};
};
template <>
struct format<vp::snorm8x4> {
    static constexpr std::array<component, 4> components{{{0, 8}, {8, 8}, {16, 8}, {24, 8}}};
};
template <>
struct format<vp::snorm16x2> {
    static constexpr std::array<component, 2> components{{{0, 16}, {16, 16}}};
};
template <>
struct format<vp::snorm16x4> {
    static constexpr std::array<component, 4> components{{{0, 16}, {16, 16}, {32, 16}, {48, 16}}};
};
template <>
struct format<vp::float11_11_10> {
    static constexpr std::array<component, 3> components{{{0, 11}, {11, 11}, {22, 10}}};
};
template <>
struct format<vp::rgb9e5> {
    static constexpr std::array<component, 3> components{{{0, 9}, {9, 9}, {18, 9}}};
};
template <class T>
constexpr int lanes = static_cast<int>(format<T>::components.size());
template <class T>
std::uint64_t code_of(const T& v, int i) {
    const component c = format<T>::components[static_cast<std::size_t>(i)];
    return std::uint64_t{v.bits} >> c.first & ((std::uint64_t{1} << c.width) - 1);
}
template <class T>
constexpr bool is_norm = !std::is_same_v<T, vp::float11_11_10> && !std::is_same_v<T, vp::rgb9e5>;

// The code of a float of `mantissa` and 5 or 8 bits of exponent; the sign is left to the caller.
inline std::uint64_t float_code(const number& n, int mantissa, int exponent) {
    const std::uint64_t inf = ((std::uint64_t{1} << exponent) - 1) << mantissa;
    if (n.is_nan) return inf | std::uint64_t{1} << (mantissa - 1);
    if (n.infinite != 0) return inf;
    const rational magnitude{n.is_below_zero() ? -n.value.numerator : n.value.numerator, n.value.denominator};
    return std::min(unit::nearest_bits(magnitude, mantissa, exponent), inf - 1);
}

template <class T>
std::uint64_t packed_word(const std::vector<number>& n) {
    std::uint64_t word = 0;
    if constexpr (std::is_same_v<T, vp::rgb9e5>) {
        const auto mantissa = [](const number& x, int exponent) -> std::int64_t {
            if (x.is_nan || x.is_below_zero()) return 0;
            if (x.infinite > 0) return 1 << 20;
            const rational units = x.value * unit::power_of_two(24); // in units of 2^-24
            const wide rounded = unit::round_to_integer({units.numerator, units.denominator.shifted_left(exponent)});
            return rounded.bit_width() > 40 ? 1 << 20 : rounded.to_int64();
        };
        int exponent = 0;
        for (const number& x : n) { // below it no mantissa of the number fits: 2^(exponent - 14) <= the number
            const int least = x.value.numerator.bit_width() - x.value.denominator.bit_width() - 1 + 14;
            if (!x.is_nan && x.value.numerator.sign() > 0) exponent = std::clamp(least, exponent, 31);
        }
        while (exponent < 31 &&
               std::any_of(n.begin(), n.end(), [&](const number& x) { return mantissa(x, exponent) > 511; }))
            ++exponent;
        word = static_cast<std::uint64_t>(exponent) << 27;
        for (std::size_t i = 0; i < 3; ++i)
            word |= static_cast<std::uint64_t>(std::min<std::int64_t>(mantissa(n[i], exponent), 511)) << (9 * i);
    } else {
        for (std::size_t i = 0; i < n.size(); ++i) {
            const component c = format<T>::components[i];
            if (i > 0 && c.width == format<T>::components[i - 1].width && n[i] == n[i - 1]) {
                word |= (word >> (c.first - c.width) & ((std::uint64_t{1} << c.width) - 1)) << c.first;
                continue;
            }
            std::int64_t code = 0;
            if constexpr (is_norm<T>) {
                constexpr bool is_signed = T::is_signed;
                const std::int64_t greatest = (std::int64_t{1} << (is_signed ? c.width - 1 : c.width)) - 1;
                const std::int64_t least = is_signed ? -greatest : 0;
                if (n[i].infinite != 0) {
                    code = n[i].infinite > 0 ? greatest : least;
                } else if (!n[i].is_nan) {
                    const wide nearest = unit::round_to_integer(n[i].value * wide(greatest));
                    code = nearest > wide(greatest) ? greatest : nearest < wide(least) ? least : nearest.to_int64();
                }
            } else {
                code = n[i].is_below_zero() ? 0 : static_cast<std::int64_t>(float_code(n[i], c.width - 5, 5));
            }
            word |= (static_cast<std::uint64_t>(code) & ((std::uint64_t{1} << c.width) - 1)) << c.first;
        }
    }
    return word;
}

// The value of a component, as an exact number.
template <class T>
number value_of(const T& v, int i) {
    const auto code = static_cast<std::int64_t>(code_of(v, i));
    const component c = format<T>::components[static_cast<std::size_t>(i)];
    number n;
    if constexpr (std::is_same_v<T, vp::rgb9e5>) {
        n.value = {wide(code).shifted_left(static_cast<int>(v.bits >> 27)), unit::power_of_two(24)};
    } else if constexpr (is_norm<T>) {
        const std::int64_t half = std::int64_t{1} << (c.width - 1);
        const std::int64_t whole = T::is_signed && code >= half ? code - 2 * half : code;
        const std::int64_t greatest = T::is_signed ? half - 1 : 2 * half - 1;
        n.value = {wide(std::max(whole, -greatest)), wide(greatest)};
    } else {
        const int mantissa = c.width - 5;
        const std::int64_t exponent = code >> mantissa, low = code & ((1 << mantissa) - 1);
        if (exponent == 31) {
            n.is_nan = low != 0;
            n.infinite = low == 0 ? 1 : 0;
        } else {
            const std::int64_t significand = exponent == 0 ? low : low + (1 << mantissa);
            n.value = {wide(significand).shifted_left(static_cast<int>(exponent == 0 ? 1 : exponent)),
                       unit::power_of_two(15 + mantissa)};
        }
    }
    return n;
}

template <class T>
T random_word(unit::splitmix64& random) {
    return T::from_bits(static_cast<typename T::word_type>(random.next()));
}

using all_formats = ::testing::Types<vp::unorm8x4, vp::unorm10_10_10_2, vp::snorm8x2, vp::snorm8x4, vp::snorm16x2,
                                     vp::snorm16x4, vp::float11_11_10, vp::rgb9e5>;

} // namespace packed_oracle
