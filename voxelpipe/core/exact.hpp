// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Arithmetic with explicit roundings: the same bits from g++, clang and nvcc, on host and device, under every
// contraction flag and under -use_fast_math. The rule for reviewers: no product feeds a bare + or -; it feeds an fma.
// On the device the operations are inline PTX, which no compiler flag makes approximate or flushing. Also exact integer
// helpers (floor division, floor shift) and conversions between integers and floats.

#include <voxelpipe/config.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/wide_rounding.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

#if !defined(__CUDA_ARCH__) && defined(__SSE2__) && defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace voxelpipe::exact {

// ---- float and double operations, one rounding each -----------------------------------------------------------------

// a * b + c with one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float fma(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("fma.rn.f32 %0, %1, %2, %3;" : "=f"(r) : "f"(a), "f"(b), "f"(c));
    return r;
#elif defined(VOXELPIPE_SOFTWARE_FMA)
    return software_fma(a, b, c);
#else
    return __builtin_fmaf(a, b, c);
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double fma(double a, double b, double c) {
#if defined(__CUDA_ARCH__)
    return __fma_rn(a, b, c);
#elif defined(VOXELPIPE_SOFTWARE_FMA)
    return software_fma(a, b, c);
#else
    return __builtin_fma(a, b, c);
#endif
}

// a + b with one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float add(float a, float b) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("add.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
#else
    return a + b;
#endif
}

// a - b with one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float sub(float a, float b) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("sub.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
#else
    return a - b;
#endif
}

// The result must feed an fma, a function argument or memory, never a bare + or -.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float mul(float a, float b) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("mul.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
#else
    return a * b;
#endif
}

// a / b with one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float div(float a, float b) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("div.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
#else
    return a / b;
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double mul(double a, double b) {
#if defined(__CUDA_ARCH__)
    return __dmul_rn(a, b);
#else
    return a * b;
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double div(double a, double b) {
#if defined(__CUDA_ARCH__)
    return __ddiv_rn(a, b);
#else
    return a / b;
#endif
}

// Square root without a call that may set errno, so an unused result costs nothing.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double sqrt(double a) {
#if defined(__CUDA_ARCH__)
    return __dsqrt_rn(a);
#elif defined(__SSE2__) && defined(__x86_64__)
    return _mm_cvtsd_f64(_mm_sqrt_sd(_mm_set_sd(0.0), _mm_set_sd(a)));
#else
    return std::sqrt(a);
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float sqrt(float a) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("sqrt.rn.f32 %0, %1;" : "=f"(r) : "f"(a));
    return r;
#elif defined(__SSE2__) && defined(__x86_64__)
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(a)));
#else
    return std::sqrt(a);
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double to_double(float a) {
#if defined(__CUDA_ARCH__)
    double r;
    asm("cvt.f64.f32 %0, %1;" : "=d"(r) : "f"(a));
    return r;
#else
    return static_cast<double>(a);
#endif
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float to_float(double a) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("cvt.rn.f32.f64 %0, %1;" : "=f"(r) : "d"(a));
    return r;
#else
    return static_cast<float>(a);
#endif
}

// Nearest integer, ties to even. |a| < 2^63; the host must be in the default rounding mode.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int64_t round_to_int64(double a) {
#if defined(__CUDA_ARCH__)
    return __double2ll_rn(a);
#elif defined(__SSE2__) && defined(__x86_64__)
    return _mm_cvtsd_si64(_mm_set_sd(a));
#else
    return static_cast<std::int64_t>(std::llrint(a));
#endif
}

// 1 / a with relative error 2^-22, for magnitudes from 2^-126 to 2^126; infinity for zero. Differs between machines:
// use it only if that precision is proved to suffice.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float near_inverse(float a) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(a));
    return r;
#else
    return 1.0f / a;
#endif
}

// fma, clamped to [0, 1]; 0 for NaN.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float fma_saturated(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
    float r;
    asm("fma.rn.sat.f32 %0, %1, %2, %3;" : "=f"(r) : "f"(a), "f"(b), "f"(c));
    return r;
#else
    const float r = fma(a, b, c);
    return r > 0.0f ? r < 1.0f ? r : 1.0f : 0.0f;
#endif
}

// a * b + c, rounded once to an integer, up or down; c must be an integer, and |sum| <= 2^21.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float fma_up(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
    float sum;
    asm("fma.rp.f32 %0, %1, %2, %3;" : "=f"(sum) : "f"(a), "f"(b), "f"(c + 12582912.0f)); // 1.5 * 2^23
    return sub(sum, 12582912.0f);
#else
    return static_cast<float>(std::ceil(static_cast<double>(a) * b + c));
#endif
}
// The same, rounded down.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float fma_down(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
    float sum;
    asm("fma.rm.f32 %0, %1, %2, %3;" : "=f"(sum) : "f"(a), "f"(b), "f"(c + 12582912.0f));
    return sub(sum, 12582912.0f);
#else
    return static_cast<float>(std::floor(static_cast<double>(a) * b + c));
#endif
}
// The lesser; of +0 and -0 either.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float min(float a, float b) {
#if defined(__CUDA_ARCH__)
    return fminf(a, b);
#else
    return b < a ? b : a;
#endif
}
// The greater; of +0 and -0 either.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float max(float a, float b) {
#if defined(__CUDA_ARCH__)
    return fmaxf(a, b);
#else
    return a < b ? b : a;
#endif
}
// |a|.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float absolute(float a) {
#if defined(__CUDA_ARCH__)
    return fabsf(a);
#else
    return a < 0 ? -a : a;
#endif
}
// Converts a float that is an integer; |a| <= 2^21.
inline constexpr std::int32_t integer_shift = 0x4b400000;
// The integer; |a| <= 2^21.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t to_integer(float a) {
    return core::bit_cast<std::int32_t>(add(a, 12582912.0f)) - integer_shift;
}

// floor(a) and a - floor(a), for |a| <= 2^21; arbitrary for other numbers. Uses a sum with 1.5 * 2^23, whose last
// mantissa bits are the integer: conversion instructions run at a fraction of that rate.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t integer_below(float a, float& over) {
#if defined(__CUDA_ARCH__)
    float sum;
    asm("add.rm.f32 %0, %1, 0f4B400000;" : "=f"(sum) : "f"(a));
    over = sub(a, sub(sum, 12582912.0f));
    return core::bit_cast<std::int32_t>(sum) - integer_shift;
#else
    const float whole = std::floor(a);
    over = a - whole;
    return whole >= -0x1p21f && whole <= 0x1p21f ? static_cast<std::int32_t>(whole) : 0;
#endif
}

// round_to_int64(a) minus an even offset below 2^40, modulo 2^32, for |a| <= 2^30. Uses the sum with 1.5 * 2^52 -
// offset, whose last mantissa bits are the integer: one addition, whereas conversions run at a fraction of that rate on
// a GPU. An odd offset would turn ties to odd.
[[nodiscard]] constexpr double rounding_shift(std::int64_t offset) { return 0x1.8p52 - static_cast<double>(offset); }
// The integer; `shift` is rounding_shift(offset).
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int32_t round_to_int32(double a, double shift) {
#if defined(__CUDA_ARCH__)
    return __double2loint(__dadd_rn(a, shift));
#else
    const auto offset = static_cast<std::int64_t>(0x1.8p52 - shift); // unsigned below, in case `a` is out of range
    return static_cast<std::int32_t>(
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(round_to_int64(a)) - static_cast<std::uint64_t>(offset)));
#endif
}

// Sign, exponent and the upper 20 bits of the mantissa.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t high_word(double a) {
#if defined(__CUDA_ARCH__)
    return static_cast<std::uint32_t>(__double2hiint(a));
#else
    return static_cast<std::uint32_t>(core::bit_cast<std::uint64_t>(a) >> 32);
#endif
}

// x*x' + y*y' + z*z' with three roundings: x*x', then two fused steps. V is any type with float members x, y, z.
template <class V>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float dot(const V& a, const V& b) {
    return fma(a.z, b.z, fma(a.y, b.y, mul(a.x, b.x)));
}

// a + t*(b - a), two roundings; exact at t = 0 and wherever a == b.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float lerp(float a, float b, float t) { return fma(t, sub(b, a), a); }

// ---- integers -------------------------------------------------------------------------------------------------------

// floor(a / 2^bits)
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr Int floor_shift(Int a, int bits) {
    return a >> bits; // arithmetic shift in C++20
}

// ceil(a / 2^bits)
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr Int ceil_shift(Int a, int bits) {
    return -((-a) >> bits);
}

// floor(a / b), b > 0, where it stands in any width. For kernels whose time is that of a few threads with long loops:
// ptxas writes YIELD into the loops of a kernel that calls a function.
template <class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE constexpr Int floor_div_inline(Int a, Int b) {
    const Int q = a / b;
    return q - static_cast<Int>(q * b > a);
}

// floor(a / b), b > 0; out of line in device code, where a division in 128 bits takes 300 instructions.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_DEVICE_NOINLINE constexpr int128 floor_div_wide(int128 a, int128 b) {
    return floor_div_inline(a, b);
}

// floor(a / b), b > 0
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr Int floor_div(Int a, Int b) {
    if constexpr (sizeof(Int) == sizeof(int128)) {
        return floor_div_wide(a, b);
    } else {
        const Int q = a / b;
        return q - static_cast<Int>(a % b < 0);
    }
}

// ceil(a / b), b > 0
template <class Int>
[[nodiscard]] VOXELPIPE_HD constexpr Int ceil_div(Int a, Int b) {
    return -floor_div(-a, b);
}

// Index of the highest bit set; a != 0. One instruction less than the lowest on a GPU.
[[nodiscard]] VOXELPIPE_HD inline int highest_one(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
    return 31 - __clz(static_cast<int>(a));
#else
    return 31 - std::countl_zero(a);
#endif
}

// Bits that are one.
[[nodiscard]] VOXELPIPE_HD inline int count_ones(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
    return __popc(a);
#else
    return std::popcount(a);
#endif
}

// Index of the lowest bit set; a != 0.
[[nodiscard]] VOXELPIPE_HD inline int lowest_one(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
    return __ffs(static_cast<int>(a)) - 1;
#else
    return std::countr_zero(a);
#endif
}
[[nodiscard]] VOXELPIPE_HD inline int lowest_one(std::uint64_t a) {
#if defined(__CUDA_ARCH__)
    return __ffsll(static_cast<long long>(a)) - 1;
#else
    return std::countr_zero(a);
#endif
}

// A quotient rounded down, and whether something is left.
struct wide_quotient {
    uint128 quotient; // rounded down
    bool has_rest;    // what was divided is no multiple
};
// a / b; b is not 0. Divisors below 2^32 take three divisions of 64 bits, where 128 bits have none of their own.
[[nodiscard]] VOXELPIPE_HD inline wide_quotient divide(uint128 a, std::uint64_t b) {
    if (b >> 32 != 0) {
        const uint128 quotient = a / b;
        return {quotient, quotient * b != a};
    }
    const auto high = static_cast<std::uint64_t>(a >> 64), low = static_cast<std::uint64_t>(a);
    const std::uint64_t top = high / b;
    const std::uint64_t middle = (high - top * b) << 32 | low >> 32, middle_quotient = middle / b;
    const std::uint64_t rest = (middle - middle_quotient * b) << 32 | (low & 0xffffffffu), low_quotient = rest / b;
    return {static_cast<uint128>(top) << 64 | middle_quotient << 32 | low_quotient, low_quotient * b != rest};
}

// Nearest double, ties to even, of a wide integer. Compilers and devices differ in how they convert __int128.
[[nodiscard]] VOXELPIPE_HD inline double to_double(int128 a) {
    const bool negative = a < 0;
    const uint128 magnitude = negative ? uint128{0} - static_cast<uint128>(a) : static_cast<uint128>(a);
    const std::uint64_t bits = round_to_binary(magnitude, 0, 52, 11) | (negative ? std::uint64_t{1} << 63 : 0);
    return core::bit_cast<double>(bits);
}

[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double to_double(std::int64_t a) { return static_cast<double>(a); }
// Nearest float, ties to even, by one rounding.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE float to_float(std::int64_t a) { return static_cast<float>(a); }

} // namespace voxelpipe::exact
