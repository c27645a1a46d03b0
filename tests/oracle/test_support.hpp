// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of core/ and of the API: random numbers, numbers of cases, exact roundings. The roundings use the
// oracle's checked wide integers and nothing of core/.

#include "triangles.hpp"
#include "wide_int.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace unit {

using oracle::splitmix64;
using wide = oracle::wide_int<8>; // 512 bits

// Number of random cases: `count` times VOXELPIPE_TEST_SCALE (1 if unset), at least 100.
inline std::int64_t cases(std::int64_t count) {
    const char* const text = std::getenv("VOXELPIPE_TEST_SCALE");
    const double scale = text == nullptr ? 1.0 : std::strtod(text, nullptr);
    const auto n = static_cast<std::int64_t>(static_cast<double>(count) * scale);
    return n < 100 ? 100 : n;
}

// A rational number; the denominator is positive.
struct rational {
    wide numerator;
    wide denominator = wide(1);
};

inline wide power_of_two(int n) { return wide(1).shifted_left(n); }

// An exact double: significand * 2^exponent.
inline rational exact(double a) {
    int exponent = 0;
    const auto significand = static_cast<std::int64_t>(std::ldexp(std::frexp(a, &exponent), 53));
    exponent -= 53;
    if (exponent >= 0) return {wide(significand).shifted_left(exponent)};
    return {wide(significand), power_of_two(-exponent)};
}

// floor(a / b) with the remainder's comparison to half of b, rounded to the nearest integer, ties to even.
inline wide round_to_integer(const rational& a) {
    const wide q = wide::floor_divide(a.numerator, a.denominator);
    const wide rest = a.numerator - q * a.denominator;
    const wide twice = rest + rest;
    if (twice > a.denominator || (twice == a.denominator && q.bit(0) != 0)) return q + wide(1);
    return q;
}

// The bits of a binary format that are nearest to a, ties to even: `mantissa` stored bits, `exponent` exponent bits.
inline std::uint64_t nearest_bits(const rational& a, int mantissa, int exponent) {
    const std::uint64_t sign = a.numerator.sign() < 0 ? std::uint64_t{1} << (mantissa + exponent) : 0;
    const wide n = a.numerator.sign() < 0 ? -a.numerator : a.numerator;
    if (n.sign() == 0) return 0;
    const int bias = (1 << (exponent - 1)) - 1;
    // 2^e <= a < 2^(e + 2); lowered by one where that is too much.
    int e = n.bit_width() - a.denominator.bit_width() - 1;
    const auto at_least = [&](int k) { // a >= 2^k
        return k >= 0 ? n >= a.denominator.shifted_left(k) : n.shifted_left(-k) >= a.denominator;
    };
    while (at_least(e + 1)) ++e;
    const int unit = (e < 1 - bias ? 1 - bias : e) - mantissa; // weight of the last place
    const rational scaled{unit < 0 ? n.shifted_left(-unit) : n,
                          unit > 0 ? a.denominator.shifted_left(unit) : a.denominator};
    auto significand = static_cast<std::uint64_t>(round_to_integer(scaled).to_int64());
    int biased = unit + mantissa + bias;
    if (significand >> (mantissa + 1) != 0) {
        significand >>= 1;
        ++biased;
    }
    if (significand >> mantissa == 0) return sign | significand; // subnormal or zero
    const std::uint64_t infinity = ((std::uint64_t{1} << exponent) - 1) << mantissa;
    if (biased >= (1 << exponent) - 1) return sign | infinity;
    return sign | (static_cast<std::uint64_t>(biased) << mantissa) |
           (significand & ((std::uint64_t{1} << mantissa) - 1));
}

inline double nearest_double(const rational& a) { return std::bit_cast<double>(nearest_bits(a, 52, 11)); }
inline float nearest_float(const rational& a) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(nearest_bits(a, 23, 8)));
}

// A random bit pattern that is a finite number.
inline float any_finite_float(splitmix64& random) {
    for (;;) {
        const float f = std::bit_cast<float>(static_cast<std::uint32_t>(random.next()));
        if (std::isfinite(f)) return f;
    }
}

// significand * 2^exponent; every exponent of the range has the same probability.
inline double spread_double(splitmix64& random, int lowest_exponent, int highest_exponent) {
    const double s = static_cast<double>(static_cast<std::int64_t>(random.next()) >> 11); // 53 bits
    return std::ldexp(s, static_cast<int>(random.between(lowest_exponent, highest_exponent)) - 52);
}

} // namespace unit
