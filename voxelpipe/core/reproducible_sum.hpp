// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reproducible addition: sums that do not depend on the order of their terms, for float, double and half, and for
// saturating signed integers. Terms become fixed point by one rounding, the integer sum is exact for up to 2^32 terms,
// and the result is rounded once (docs/design.md, "Reproducible addition").

#include <voxelpipe/core/bfloat16.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/half.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

inline constexpr std::uint32_t sum_positive_infinity = 1;
inline constexpr std::uint32_t sum_negative_infinity = 2;
inline constexpr std::uint32_t sum_nan = 4;

// 64 * Limbs + 32 bits, two's complement, with marks for terms that are not finite.
template <int Limbs>
struct wide_sum {
    std::uint64_t limb[std::size_t{Limbs}];
    std::int32_t top;
    std::uint32_t marks;
};

VOXELPIPE_HD
inline void add_term(wide_sum<1>& s, std::int64_t term) {
    const auto low = static_cast<std::uint64_t>(term);
    s.limb[0] += low;
    s.top += static_cast<std::int32_t>(s.limb[0] < low) - static_cast<std::int32_t>(term < 0);
}

VOXELPIPE_HD
inline void add_term(wide_sum<2>& s, int128 term) {
    const uint128 old = (static_cast<uint128>(s.limb[1]) << 64) | s.limb[0];
    const auto low = static_cast<uint128>(term);
    const uint128 sum = old + low;
    s.limb[0] = static_cast<std::uint64_t>(sum);
    s.limb[1] = static_cast<std::uint64_t>(sum >> 64);
    s.top += static_cast<std::int32_t>(sum < low) - static_cast<std::int32_t>(term < 0);
}

// n times a sum, marks included; exact if the product fits the sum's width. Two's complement: a product of words modulo
// 2^(64 * Limbs + 32).
template <int Limbs>
[[nodiscard]] VOXELPIPE_HD inline wide_sum<Limbs> repeat_sum(const wide_sum<Limbs>& s, std::uint32_t n) {
    wide_sum<Limbs> r{};
    std::uint64_t carry = 0;
    for (int k = 0; k < Limbs; ++k) {
        const uint128 product = static_cast<uint128>(s.limb[k]) * n + carry;
        r.limb[k] = static_cast<std::uint64_t>(product);
        carry = static_cast<std::uint64_t>(product >> 64);
    }
    r.top = static_cast<std::int32_t>(static_cast<std::uint32_t>(s.top) * n + static_cast<std::uint32_t>(carry));
    r.marks = n == 0 ? 0 : s.marks;
    return r;
}

// Adds another sum, marks included.
template <int Limbs>
VOXELPIPE_HD inline void add_sum(wide_sum<Limbs>& s, const wide_sum<Limbs>& other) {
    std::uint64_t carry = 0;
    for (int k = 0; k < Limbs; ++k) {
        const uint128 sum = static_cast<uint128>(s.limb[k]) + other.limb[k] + carry;
        s.limb[k] = static_cast<std::uint64_t>(sum);
        carry = static_cast<std::uint64_t>(sum >> 64);
    }
    s.top = static_cast<std::int32_t>(static_cast<std::uint32_t>(s.top) + static_cast<std::uint32_t>(other.top) +
                                      static_cast<std::uint32_t>(carry));
    s.marks |= other.marks;
}

// |sum| as magnitude * 2^exponent. Bits beyond 128 are merged into a sticky last bit, which is exact for any rounding
// to 53 bits or fewer.
struct sum_magnitude {
    bool negative;
    uint128 magnitude;
    int exponent;
};

[[nodiscard]] VOXELPIPE_HD inline sum_magnitude to_magnitude(const wide_sum<1>& s) {
    const int128 v = (static_cast<int128>(s.top) << 64) | s.limb[0];
    return {v < 0, v < 0 ? uint128{0} - static_cast<uint128>(v) : static_cast<uint128>(v), 0};
}

[[nodiscard]] VOXELPIPE_HD inline sum_magnitude to_magnitude(const wide_sum<2>& s) {
    uint128 low = (static_cast<uint128>(s.limb[1]) << 64) | s.limb[0];
    auto top = static_cast<std::uint32_t>(s.top);
    const bool negative = s.top < 0;
    if (negative) {
        low = uint128{0} - low;
        top = ~top + static_cast<std::uint32_t>(low == 0);
    }
    if (top == 0) return {negative, low, 0};
    const uint128 sticky = static_cast<uint128>((low & 0xffffffffu) != 0);
    return {negative, (static_cast<uint128>(top) << 96) | (low >> 32) | sticky, 32};
}

// ---- the fixed-point format of each floating type -------------------------------------------------------------------

template <class T>
struct sum_format;

// 2^-32: a float of magnitude 2^-8 or more is exact, a smaller one is off by at most 2^-33; from 2^31 on it is
// infinite.
template <>
struct sum_format<float> {
    using sum = wide_sum<1>;
    static constexpr int log2_quantum = -32;
};
template <>
struct sum_format<bfloat16> : sum_format<float> {};
// 2^-24 is the smallest half: every term is exact.
template <>
struct sum_format<half> {
    using sum = wide_sum<1>;
    static constexpr int log2_quantum = -24;
};
// 2^-64: a double of magnitude 2^-12 or more is exact; from 2^63 on it is infinite.
template <>
struct sum_format<double> {
    using sum = wide_sum<2>;
    static constexpr int log2_quantum = -64;
};

template <int Log2Quantum>
VOXELPIPE_HD inline void add_float(wide_sum<1>& s, float term) {
    static_assert(Log2Quantum >= -126 && Log2Quantum <= 64);
    constexpr double scale = core::bit_cast<double>(static_cast<std::uint64_t>(1023 - Log2Quantum) << 52);
    if ((core::bit_cast<std::uint32_t>(term) & 0x7fffffffu) > 0x7f800000u) {
        s.marks |= sum_nan;
        return;
    }
    const double scaled = exact::mul(exact::to_double(term), scale); // exact: a power of two
    if (scaled >= 0x1p63)
        s.marks |= sum_positive_infinity;
    else if (scaled <= -0x1p63)
        s.marks |= sum_negative_infinity;
    else
        add_term(s, exact::round_to_int64(scaled));
}

template <int Log2Quantum>
VOXELPIPE_HD inline void add_half(wide_sum<1>& s, half term) {
    add_float<Log2Quantum>(s, static_cast<float>(term));
}

template <int Log2Quantum>
VOXELPIPE_HD inline void add_double(wide_sum<2>& s, double term) {
    const auto bits = core::bit_cast<std::uint64_t>(term);
    const bool negative = (bits >> 63) != 0;
    const int exponent = static_cast<int>((bits >> 52) & 0x7ffu);
    const std::uint64_t mantissa = bits & ((std::uint64_t{1} << 52) - 1);
    if (exponent == 0x7ff && mantissa != 0) {
        s.marks |= sum_nan;
        return;
    }
    // |term| = significand * 2^(exponent - 1075); in quanta, a shift by that exponent minus the quantum's.
    const int shift = exponent - 1075 - Log2Quantum;
    if (shift > 127 - 53) {
        s.marks |= negative ? sum_negative_infinity : sum_positive_infinity;
        return;
    }
    if (exponent == 0 || shift < -54) return; // less than half a quantum
    const uint128 significand = mantissa | (std::uint64_t{1} << 52);
    const uint128 units = shift >= 0 ? significand << shift : exact::shift_right_rne(significand, -shift);
    const auto signed_units = static_cast<int128>(units);
    add_term(s, negative ? -signed_units : signed_units);
}

[[nodiscard]] VOXELPIPE_HD constexpr bool sum_is_nan(std::uint32_t marks) {
    return (marks & sum_nan) != 0 || (marks & 3u) == 3u;
}

// The sum, rounded once, as the bit pattern of a format with the given mantissa and exponent bits.
template <int Limbs>
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t round_sum(const wide_sum<Limbs>& s, int log2_quantum, int mantissa_bits,
                                                          int exponent_bits) {
    const std::uint64_t infinity = ((std::uint64_t{1} << exponent_bits) - 1) << mantissa_bits;
    const std::uint64_t sign = std::uint64_t{1} << (mantissa_bits + exponent_bits);
    if (sum_is_nan(s.marks)) return infinity | (std::uint64_t{1} << (mantissa_bits - 1));
    if ((s.marks & sum_positive_infinity) != 0) return infinity;
    if ((s.marks & sum_negative_infinity) != 0) return infinity | sign;
    const sum_magnitude m = to_magnitude(s);
    return exact::round_to_binary(m.magnitude, m.exponent + log2_quantum, mantissa_bits, exponent_bits) |
           (m.negative ? sign : 0);
}

// The sum rounded to float, usually by one conversion: if the sum fits 64 bits and has no marks. Its last place is a
// normal float, so the product is exact.
template <int Log2Quantum>
[[nodiscard]] VOXELPIPE_HD inline float round_sum_to_float(const wide_sum<1>& s) {
    static_assert(Log2Quantum >= -126 && Log2Quantum <= 64);
    const auto units = static_cast<std::int64_t>(s.limb[0]);
    if (s.marks == 0 && s.top == static_cast<std::int32_t>(units >> 63)) {
        constexpr float quantum = core::bit_cast<float>(static_cast<std::uint32_t>(127 + Log2Quantum) << 23);
        return exact::mul(exact::to_float(units), quantum);
    }
    return core::bit_cast<float>(static_cast<std::uint32_t>(round_sum(s, Log2Quantum, 23, 8)));
}

} // namespace voxelpipe::core
