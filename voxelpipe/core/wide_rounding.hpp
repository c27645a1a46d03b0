// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Integers of 128 bits, and their rounding to floating-point numbers: what the rest of core/exact.hpp stands on.
// By these, a * b + c with one rounding where there is neither an instruction nor a function for it.

#include <voxelpipe/config.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

#if defined(_MSC_VER) && !defined(VOXELPIPE_OWN_INT128)
#define VOXELPIPE_OWN_INT128
#endif
#if defined(VOXELPIPE_OWN_INT128)
#include <voxelpipe/core/int128.hpp>
#endif

// MinGW's functions round twice; WebAssembly has no instruction, and a function of its C library's choice, as MSVC has.
#if (defined(__MINGW32__) && !defined(__FMA__)) || defined(__wasm__) || defined(_MSC_VER)
#define VOXELPIPE_SOFTWARE_FMA
#endif

namespace voxelpipe {

// Integers of 128 bits are the compiler's, or ours where it has none. With VOXELPIPE_OWN_INT128 defined they are ours
// everywhere, for tests of these.
#if defined(VOXELPIPE_OWN_INT128)
using int128 = core::wide_integer<true>;
using uint128 = core::wide_integer<false>;
#else
// Integers of 128 bits, in which coverage of large triangles is decided.
__extension__ typedef __int128 int128;
// The same without a sign.
__extension__ typedef unsigned __int128 uint128;
#endif

namespace exact {

// Bits that hold a: 0 for 0.
[[nodiscard]] VOXELPIPE_HD inline int bit_width(std::uint64_t a) {
#if defined(__CUDA_ARCH__)
    return 64 - __clzll(static_cast<long long>(a));
#else
    return static_cast<int>(std::bit_width(a));
#endif
}

[[nodiscard]] VOXELPIPE_HD inline int bit_width(uint128 a) {
    const auto high = static_cast<std::uint64_t>(a >> 64);
    return high != 0 ? 64 + bit_width(high) : bit_width(static_cast<std::uint64_t>(a));
}

// Nearest integer multiple of 2^shift, in units of 2^shift, ties to even. 0 <= shift < 128.
[[nodiscard]] VOXELPIPE_HD inline uint128 shift_right_rne(uint128 a, int shift) {
    if (shift == 0) return a;
    const uint128 quotient = a >> shift;
    const uint128 rest = a & ((uint128{1} << shift) - 1);
    const uint128 half = uint128{1} << (shift - 1);
    return quotient + static_cast<uint128>(rest > half || (rest == half && (quotient & 1) != 0));
}

// magnitude * 2^exponent, rounded once (to nearest, ties to even) to a float with `mantissa_bits` stored mantissa bits
// and `exponent_bits` exponent bits. Returns the bit pattern without sign. Overflow gives infinity, underflow is
// gradual. 16-bit: (10, 5), float: (23, 8), double: (52, 11).
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t round_to_binary(uint128 magnitude, int exponent, int mantissa_bits,
                                                                int exponent_bits) {
    if (magnitude == 0) return 0;
    const int bias = (1 << (exponent_bits - 1)) - 1;
    const int width = bit_width(magnitude);
    // The value is 1.xxx * 2^e; below the normal range the last place is fixed at 2^(1 - bias - mantissa_bits).
    const int e = width - 1 + exponent;
    const int last_place = (e > 1 - bias ? e : 1 - bias) - mantissa_bits;
    const int shift = last_place - exponent;
    uint128 mantissa = 0;
    if (shift <= 0)
        mantissa = magnitude << -shift;
    else if (shift < 128)
        mantissa = shift_right_rne(magnitude, shift);
    // A mantissa with its top bit set adds 1 to the exponent; so does a carry out of the rounding.
    const std::uint64_t biased = e > 1 - bias ? static_cast<std::uint64_t>(e + bias - 1) : 0;
    const std::uint64_t bits = (biased << mantissa_bits) + static_cast<std::uint64_t>(mantissa);
    const std::uint64_t infinity = ((std::uint64_t{1} << exponent_bits) - 1) << mantissa_bits;
    return bits < infinity ? bits : infinity;
}

// float: the product is exact in double, and so is what its sum with c rounds away. Contraction changes nothing.
[[nodiscard]] inline float software_fma(float a, float b, float c) {
    const double product = double{a} * b, sum = product + c;
    const double back = sum - product, rest = (product - (sum - back)) + (c - back);
    auto bits = std::bit_cast<std::uint64_t>(sum);
    // Rounded to odd, the sum tells the rounding to float on which side of it the result lies. NaN compares as false.
    if ((rest > 0 || rest < 0) && (bits & 1) == 0) bits += (rest > 0) == (sum > 0) ? 1 : ~std::uint64_t{0};
    return static_cast<float>(std::bit_cast<double>(bits));
}

// A finite double's magnitude as an integer times 2^exponent.
struct integer_and_exponent {
    std::uint64_t integer; // below 2^53
    int exponent;          // of 2
};
// The magnitude of a finite number as a product of both.
[[nodiscard]] inline integer_and_exponent take_apart(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const auto field = static_cast<int>(bits >> 52 & 0x7ff);
    const std::uint64_t mantissa = bits & ((std::uint64_t{1} << 52) - 1);
    return field == 0 ? integer_and_exponent{mantissa, -1074}
                      : integer_and_exponent{mantissa | std::uint64_t{1} << 52, field - 1075};
}
// value * 2^shift, whose lowest bit is set where bits were lost.
[[nodiscard]] inline uint128 shift_and_keep_sticky(uint128 value, int shift) {
    if (shift >= 0) return value << shift;
    if (shift <= -128) return static_cast<uint128>(value != 0);
    const uint128 shifted = value >> -shift;
    return shifted | static_cast<uint128>((shifted << -shift) != value);
}
// double: in integers. The greater of product and c takes 126 bits; where the other loses bits, the greater is more
// than twice as large, so that a difference keeps more bits than the result has.
[[nodiscard]] inline double software_fma(double a, double b, double c) {
    const double product_sign = std::bit_cast<double>(
        (std::bit_cast<std::uint64_t>(a) ^ std::bit_cast<std::uint64_t>(b)) >> 63 << 63); // +0 or -0
    if (!std::isfinite(a) || !std::isfinite(b)) return a * b + c;
    if (!std::isfinite(c)) return c;
    if (a == 0.0 || b == 0.0) return product_sign + c;
    if (c == 0.0) return a * b;
    const integer_and_exponent x = take_apart(a), y = take_apart(b), z = take_apart(c);
    const uint128 product = static_cast<uint128>(x.integer) * y.integer;
    const int product_exponent = x.exponent + y.exponent;
    const int product_top = bit_width(product) + product_exponent, c_top = bit_width(z.integer) + z.exponent;
    const int exponent = (product_top > c_top ? product_top : c_top) - 126;
    const uint128 p = shift_and_keep_sticky(product, product_exponent - exponent);
    const uint128 q = shift_and_keep_sticky(z.integer, z.exponent - exponent);
    const std::uint64_t p_sign = std::bit_cast<std::uint64_t>(product_sign),
                        q_sign = std::bit_cast<std::uint64_t>(c) >> 63 << 63;
    if (p_sign == q_sign) return std::bit_cast<double>(round_to_binary(p + q, exponent, 52, 11) | p_sign);
    if (p == q) return 0.0;
    return p > q ? std::bit_cast<double>(round_to_binary(p - q, exponent, 52, 11) | p_sign)
                 : std::bit_cast<double>(round_to_binary(q - p, exponent, 52, 11) | q_sign);
}

} // namespace exact
} // namespace voxelpipe
