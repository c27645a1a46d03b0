// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Integers of 128 bits in two words, for compilers that have none of their own (MSVC). They have the operators, and
// wrap, truncate and shift as `__int128` and `unsigned __int128` do, but for mixed signs: of two wide integers that
// differ in that, one is to be converted. Everything is constexpr. core/wide_rounding.hpp chooses.

#include <voxelpipe/config.hpp>

#include <compare>
#include <concepts>
#include <cstdint>
#include <type_traits>

#if defined(_MSC_VER) && !defined(__clang__)
#include <intrin.h>
#endif

namespace voxelpipe::core {

// A number of 128 bits without a sign: high * 2^64 + low.
struct word_pair {
    std::uint64_t low, high;
};

// a * b by products of 32 bits.
[[nodiscard]] VOXELPIPE_HD constexpr word_pair multiply_by_halves(std::uint64_t a, std::uint64_t b) {
    constexpr std::uint64_t half = 0xffffffffu;
    const std::uint64_t a_low = a & half, a_high = a >> 32, b_low = b & half, b_high = b >> 32;
    const std::uint64_t lowest = a_low * b_low;
    const std::uint64_t middle = a_high * b_low + (lowest >> 32); // both sums are at most 2^64 - 1
    const std::uint64_t other = a_low * b_high + (middle & half);
    return {other << 32 | (lowest & half), a_high * b_high + (middle >> 32) + (other >> 32)};
}

// a * b by the processor's own product where it has one.
[[nodiscard]] VOXELPIPE_HD constexpr word_pair multiply_words(std::uint64_t a, std::uint64_t b) {
    if (!std::is_constant_evaluated()) {
#if defined(__CUDA_ARCH__)
        return {a * b, __umul64hi(a, b)};
#elif defined(_MSC_VER) && !defined(__clang__) && defined(_M_X64)
        word_pair product{};
        product.low = _umul128(a, b, &product.high);
        return product;
#elif defined(_MSC_VER) && !defined(__clang__) && defined(_M_ARM64)
        return {a * b, __umulh(a, b)};
#elif defined(__SIZEOF_INT128__)
        __extension__ typedef unsigned __int128 wide;
        const wide product = static_cast<wide>(a) * b;
        return {static_cast<std::uint64_t>(product), static_cast<std::uint64_t>(product >> 64)};
#endif
    }
    return multiply_by_halves(a, b);
}

// How many of the highest bits are 0; a is not 0.
[[nodiscard]] VOXELPIPE_HD constexpr int leading_zeros(std::uint64_t a) {
    int zeros = 0;
    for (int step = 32; step != 0; step /= 2)
        if (a << zeros >> (64 - step) == 0) zeros += step;
    return zeros;
}

// A quotient, rounded down, and what is left.
struct word_quotient {
    std::uint64_t quotient, rest;
};

// n / divisor, with n.high < divisor: Knuth's algorithm D (The Art of Computer Programming 2, 4.3.1) on two digits of
// 32 bits.
[[nodiscard]] VOXELPIPE_HD constexpr word_quotient divide_words(const word_pair& n, std::uint64_t divisor) {
    constexpr std::uint64_t half = 0xffffffffu;
    const int shift = leading_zeros(divisor); // so that the divisor's top bit is set
    const std::uint64_t d = divisor << shift, d_high = d >> 32, d_low = d & half;
    const std::uint64_t low = n.low << shift;
    std::uint64_t rest = shift == 0 ? n.high : n.high << shift | n.low >> (64 - shift);
    std::uint64_t quotient = 0;
    for (int place = 32; place >= 0; place -= 32) {
        const std::uint64_t next = low >> place & half;
        std::uint64_t digit = rest / d_high, left = rest % d_high;
        while (digit > half || digit * d_low > (left << 32 | next)) { // at most twice
            --digit;
            left += d_high;
            if (left > half) break;
        }
        rest = (rest << 32 | next) - digit * d; // modulo 2^64, in which it fits
        quotient = quotient << 32 | digit;
    }
    return {quotient, rest >> shift};
}

// n / divisor; the divisor is not 0.
[[nodiscard]] VOXELPIPE_HD constexpr word_pair divide_pairs(const word_pair& n, const word_pair& divisor) {
    if (divisor.high == 0) {
        if (n.high == 0) return {n.low / divisor.low, 0};
        const std::uint64_t high = n.high / divisor.low;
        return {divide_words({n.low, n.high % divisor.low}, divisor.low).quotient, high};
    }
    // Half of n by the divisor's leading word, in which its top bit is set, gives at most one too much.
    const int shift = leading_zeros(divisor.high);
    const std::uint64_t leading = shift == 0 ? divisor.high : divisor.high << shift | divisor.low >> (64 - shift);
    const word_pair half{n.low >> 1 | n.high << 63, n.high >> 1};
    std::uint64_t q = divide_words(half, leading).quotient >> (63 - shift);
    if (q != 0) --q;
    const word_pair product = multiply_words(q, divisor.low);
    const std::uint64_t high = product.high + q * divisor.high;
    const std::uint64_t low_rest = n.low - product.low;
    const std::uint64_t high_rest = n.high - high - static_cast<std::uint64_t>(n.low < product.low);
    if (high_rest > divisor.high || (high_rest == divisor.high && low_rest >= divisor.low)) ++q;
    return {q, 0};
}

// An integer of 128 bits, in two's complement if it has a sign.
template <bool Signed>
class wide_integer {
public:
    wide_integer() = default;
    // Every integer converts, with its sign.
    template <std::integral T>
    VOXELPIPE_HD constexpr wide_integer(T v) : low_(static_cast<std::uint64_t>(v)), high_(sign_of(v)) {}
    // The same bits with the other meaning of the highest.
    VOXELPIPE_HD constexpr explicit wide_integer(const wide_integer<!Signed>& v) : low_(v.low()), high_(v.high()) {}
    VOXELPIPE_HD constexpr explicit wide_integer(const word_pair& v) : low_(v.low), high_(v.high) {}

    // The lowest bits; for bool, whether any bit is set.
    template <std::integral T>
    [[nodiscard]] VOXELPIPE_HD constexpr explicit operator T() const {
        if constexpr (std::is_same_v<T, bool>)
            return (low_ | high_) != 0;
        else
            return static_cast<T>(low_);
    }
    // The nearest double, ties to even.
    [[nodiscard]] VOXELPIPE_HD constexpr explicit operator double() const {
        const word_pair m = magnitude();
        double nearest = static_cast<double>(m.low);
        if (m.high != 0) {
            const int shift = leading_zeros(m.high);
            std::uint64_t word = shift == 0 ? m.high : m.high << shift | m.low >> (64 - shift);
            if (m.low << shift != 0) word |= 1; // which is rounded away, but for telling which side of a tie it lies
            nearest = static_cast<double>(word) * static_cast<double>(std::uint64_t{1} << (63 - shift)) * 2.0;
        }
        return is_negative() ? -nearest : nearest;
    }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t low() const { return low_; }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t high() const { return high_; }

    VOXELPIPE_HD friend constexpr bool operator==(const wide_integer& a, const wide_integer& b) {
        return a.low_ == b.low_ && a.high_ == b.high_;
    }
    VOXELPIPE_HD friend constexpr std::strong_ordering operator<=>(const wide_integer& a, const wide_integer& b) {
        if (a.high_ == b.high_) return a.low_ <=> b.low_;
        constexpr std::uint64_t top = Signed ? std::uint64_t{1} << 63 : 0; // so that words without a sign tell
        return (a.high_ ^ top) <=> (b.high_ ^ top);
    }

    VOXELPIPE_HD friend constexpr wide_integer operator+(const wide_integer& a, const wide_integer& b) {
        const std::uint64_t low = a.low_ + b.low_;
        return wide_integer(word_pair{low, a.high_ + b.high_ + static_cast<std::uint64_t>(low < a.low_)});
    }
    VOXELPIPE_HD friend constexpr wide_integer operator-(const wide_integer& a, const wide_integer& b) {
        return wide_integer(
            word_pair{a.low_ - b.low_, a.high_ - b.high_ - static_cast<std::uint64_t>(a.low_ < b.low_)});
    }
    VOXELPIPE_HD friend constexpr wide_integer operator*(const wide_integer& a, const wide_integer& b) {
        word_pair p = multiply_words(a.low_, b.low_);
        p.high += a.low_ * b.high_ + a.high_ * b.low_;
        return wide_integer(p);
    }
    // Rounded towards 0; b is not 0.
    VOXELPIPE_HD friend constexpr wide_integer operator/(const wide_integer& a, const wide_integer& b) {
        const wide_integer q(divide_pairs(a.magnitude(), b.magnitude()));
        return a.is_negative() != b.is_negative() ? -q : q;
    }
    // With the sign of a.
    VOXELPIPE_HD friend constexpr wide_integer operator%(const wide_integer& a, const wide_integer& b) {
        return a - a / b * b;
    }
    VOXELPIPE_HD friend constexpr wide_integer operator&(const wide_integer& a, const wide_integer& b) {
        return wide_integer(word_pair{a.low_ & b.low_, a.high_ & b.high_});
    }
    VOXELPIPE_HD friend constexpr wide_integer operator|(const wide_integer& a, const wide_integer& b) {
        return wide_integer(word_pair{a.low_ | b.low_, a.high_ | b.high_});
    }
    VOXELPIPE_HD friend constexpr wide_integer operator^(const wide_integer& a, const wide_integer& b) {
        return wide_integer(word_pair{a.low_ ^ b.low_, a.high_ ^ b.high_});
    }
    [[nodiscard]] VOXELPIPE_HD constexpr wide_integer operator-() const { return wide_integer(0) - *this; }
    [[nodiscard]] VOXELPIPE_HD constexpr wide_integer operator+() const { return *this; }
    [[nodiscard]] VOXELPIPE_HD constexpr wide_integer operator~() const {
        return wide_integer(word_pair{~low_, ~high_});
    }
    // By 0 to 127 bits.
    [[nodiscard]] VOXELPIPE_HD constexpr wide_integer operator<<(int bits) const {
        if (bits == 0) return *this;
        if (bits >= 64) return wide_integer(word_pair{0, low_ << (bits - 64)});
        return wide_integer(word_pair{low_ << bits, high_ << bits | low_ >> (64 - bits)});
    }
    // By 0 to 127 bits; an integer with a sign is rounded down.
    [[nodiscard]] VOXELPIPE_HD constexpr wide_integer operator>>(int bits) const {
        if (bits == 0) return *this;
        if (bits >= 64) return wide_integer(word_pair{shift_high(bits - 64), is_negative() ? ~std::uint64_t{0} : 0});
        return wide_integer(word_pair{low_ >> bits | high_ << (64 - bits), shift_high(bits)});
    }

    VOXELPIPE_HD constexpr wide_integer& operator+=(const wide_integer& b) { return *this = *this + b; }
    VOXELPIPE_HD constexpr wide_integer& operator-=(const wide_integer& b) { return *this = *this - b; }
    VOXELPIPE_HD constexpr wide_integer& operator*=(const wide_integer& b) { return *this = *this * b; }
    VOXELPIPE_HD constexpr wide_integer& operator/=(const wide_integer& b) { return *this = *this / b; }
    VOXELPIPE_HD constexpr wide_integer& operator%=(const wide_integer& b) { return *this = *this % b; }
    VOXELPIPE_HD constexpr wide_integer& operator&=(const wide_integer& b) { return *this = *this & b; }
    VOXELPIPE_HD constexpr wide_integer& operator|=(const wide_integer& b) { return *this = *this | b; }
    VOXELPIPE_HD constexpr wide_integer& operator^=(const wide_integer& b) { return *this = *this ^ b; }
    VOXELPIPE_HD constexpr wide_integer& operator<<=(int bits) { return *this = *this << bits; }
    VOXELPIPE_HD constexpr wide_integer& operator>>=(int bits) { return *this = *this >> bits; }
    VOXELPIPE_HD constexpr wide_integer& operator++() { return *this += 1; }
    VOXELPIPE_HD constexpr wide_integer& operator--() { return *this -= 1; }

private:
    template <class T>
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint64_t sign_of(T v) {
        if constexpr (std::is_signed_v<T>)
            return v < 0 ? ~std::uint64_t{0} : 0;
        else
            return 0;
    }
    [[nodiscard]] VOXELPIPE_HD constexpr bool is_negative() const { return Signed && high_ >> 63 != 0; }
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t shift_high(int bits) const {
        if constexpr (Signed)
            return static_cast<std::uint64_t>(static_cast<std::int64_t>(high_) >> bits);
        else
            return high_ >> bits;
    }
    [[nodiscard]] VOXELPIPE_HD constexpr word_pair magnitude() const {
        const wide_integer v = is_negative() ? -*this : *this;
        return {v.low_, v.high_};
    }

    std::uint64_t low_, high_;
};

} // namespace voxelpipe::core
