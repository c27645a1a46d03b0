// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A signed integer of Limbs * 64 bits that never overflows silently: an operation whose exact result needs more bits
// throws std::overflow_error. Sign and magnitude with schoolbook arithmetic, written to be checked by reading. The
// oracle uses it for expressions that do not provably fit in 64 or 128 bits. Nothing of voxelpipe/ is included.

#include <algorithm>
#include <array>
#include <compare>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace oracle {

__extension__ typedef __int128 int128;
__extension__ typedef unsigned __int128 uint128;

template <int Limbs>
class wide_int {
public:
    wide_int() = default;

    wide_int(int128 value) : negative_(value < 0) { // implicit, so that formulas read alike for every integer type
        const uint128 magnitude = value < 0 ? uint128{0} - static_cast<uint128>(value) : static_cast<uint128>(value);
        static_assert(Limbs >= 2);
        limbs_[0] = static_cast<std::uint64_t>(magnitude);
        limbs_[1] = static_cast<std::uint64_t>(magnitude >> 64);
        size_ = 2;
        trim();
    }
    wide_int(std::int64_t value) : wide_int(static_cast<int128>(value)) {}
    wide_int(int value) : wide_int(static_cast<int128>(value)) {}

    int sign() const { return size_ == 0 ? 0 : (negative_ ? -1 : 1); }

    // Position of the highest set bit of the magnitude plus one; 0 for zero.
    int bit_width() const {
        if (size_ == 0) return 0;
        int width = (size_ - 1) * 64;
        for (std::uint64_t top = at(size_ - 1); top != 0; top >>= 1) ++width;
        return width;
    }

    bool bit(int position) const {
        const int limb = position / 64;
        return limb < size_ && ((at(limb) >> (position % 64)) & 1u) != 0;
    }

    int128 to_int128() const {
        if (bit_width() > 127) throw std::overflow_error("wide_int: value does not fit in 127 bits");
        const uint128 magnitude = (static_cast<uint128>(size_ > 1 ? limbs_[1] : 0) << 64) | (size_ > 0 ? limbs_[0] : 0);
        return negative_ ? -static_cast<int128>(magnitude) : static_cast<int128>(magnitude);
    }

    std::int64_t to_int64() const {
        if (bit_width() > 63) throw std::overflow_error("wide_int: value does not fit in 63 bits");
        return static_cast<std::int64_t>(to_int128());
    }

    // Hexadecimal with sign, for messages.
    std::string to_string() const {
        if (size_ == 0) return "0";
        static constexpr char digits[] = "0123456789abcdef";
        std::string text;
        for (int nibble = (bit_width() + 3) / 4 - 1; nibble >= 0; --nibble)
            text += digits[(at(nibble / 16) >> (nibble % 16 * 4)) & 15u];
        return (negative_ ? "-0x" : "0x") + text;
    }

    wide_int operator-() const {
        wide_int result = *this;
        result.negative_ = size_ != 0 && !negative_;
        return result;
    }

    friend wide_int operator+(const wide_int& a, const wide_int& b) {
        if (a.size_ == 0) return b;
        if (b.size_ == 0) return a;
        wide_int result;
        if (a.negative_ == b.negative_) {
            result = add_magnitudes(a, b);
            result.negative_ = a.negative_;
        } else if (const int order = compare_magnitudes(a, b); order > 0) {
            result = subtract_magnitudes(a, b);
            result.negative_ = a.negative_;
        } else if (order < 0) {
            result = subtract_magnitudes(b, a);
            result.negative_ = b.negative_;
        }
        return result;
    }

    friend wide_int operator-(const wide_int& a, const wide_int& b) { return a + (-b); }

    friend wide_int operator*(const wide_int& a, const wide_int& b) {
        wide_int result;
        if (a.size_ == 0 || b.size_ == 0) return result;
        for (int i = 0; i < a.size_; ++i) {
            std::uint64_t carry = 0;
            for (int j = 0; j < b.size_ || carry != 0; ++j) {
                const uint128 product =
                    j < b.size_ ? static_cast<uint128>(a.at(i)) * static_cast<uint128>(b.at(j)) : uint128{0};
                if (i + j >= Limbs) {
                    if (product + carry != 0) throw std::overflow_error("wide_int: product");
                    continue;
                }
                const uint128 sum = product + result.at(i + j) + carry; // at most (2^64-1)^2 + 2 (2^64-1) < 2^128
                result.at(i + j) = static_cast<std::uint64_t>(sum);
                carry = static_cast<std::uint64_t>(sum >> 64);
            }
        }
        result.size_ = std::min(Limbs, a.size_ + b.size_);
        result.negative_ = a.negative_ != b.negative_;
        result.trim();
        return result;
    }

    // value * 2^count, count >= 0.
    wide_int shifted_left(int count) const {
        if (size_ == 0) return {};
        if (bit_width() + count > Limbs * 64) throw std::overflow_error("wide_int: shift");
        wide_int result;
        const int limbs = count / 64;
        const int bits = count % 64;
        for (int i = 0; i < size_; ++i) {
            result.at(i + limbs) |= at(i) << bits;
            if (bits != 0 && i + limbs + 1 < Limbs) result.at(i + limbs + 1) |= at(i) >> (64 - bits);
        }
        result.size_ = std::min(Limbs, size_ + limbs + 1);
        result.negative_ = negative_;
        result.trim();
        return result;
    }

    struct division {
        wide_int quotient;
        wide_int remainder;
    };

    // |numerator| / |denominator| by long division, one bit at a time: quotient and remainder of the magnitudes.
    static division divide_magnitudes(const wide_int& numerator, const wide_int& denominator) {
        if (denominator.size_ == 0) throw std::domain_error("wide_int: division by zero");
        wide_int divisor = denominator;
        divisor.negative_ = false;
        division result;
        for (int position = numerator.bit_width() - 1; position >= 0; --position) {
            result.remainder = result.remainder.shifted_left(1) + wide_int(numerator.bit(position) ? 1 : 0);
            if (result.remainder >= divisor) {
                result.remainder = result.remainder - divisor;
                result.quotient.limbs_[static_cast<std::size_t>(position / 64)] |= std::uint64_t{1} << (position % 64);
            }
        }
        result.quotient.size_ = Limbs;
        result.quotient.trim();
        return result;
    }

    // The largest integer that is not above numerator / denominator.
    static wide_int floor_divide(const wide_int& numerator, const wide_int& denominator) {
        const division parts = divide_magnitudes(numerator, denominator);
        if (numerator.sign() * denominator.sign() >= 0) return parts.quotient;
        return parts.remainder.size_ == 0 ? -parts.quotient : -parts.quotient - wide_int(1);
    }

    friend bool operator==(const wide_int& a, const wide_int& b) { return (a <=> b) == 0; }
    friend std::strong_ordering operator<=>(const wide_int& a, const wide_int& b) {
        if (a.sign() != b.sign()) return a.sign() <=> b.sign();
        const int order = compare_magnitudes(a, b);
        return (a.negative_ ? -order : order) <=> 0;
    }

private:
    std::uint64_t at(int limb) const { return limbs_[static_cast<std::size_t>(limb)]; }
    std::uint64_t& at(int limb) { return limbs_[static_cast<std::size_t>(limb)]; }

    void trim() {
        while (size_ > 0 && at(size_ - 1) == 0) --size_;
        if (size_ == 0) negative_ = false;
    }

    static int compare_magnitudes(const wide_int& a, const wide_int& b) {
        if (a.size_ != b.size_) return a.size_ < b.size_ ? -1 : 1;
        for (int i = a.size_ - 1; i >= 0; --i)
            if (a.at(i) != b.at(i)) return a.at(i) < b.at(i) ? -1 : 1;
        return 0;
    }

    static wide_int add_magnitudes(const wide_int& a, const wide_int& b) {
        wide_int result;
        std::uint64_t carry = 0;
        const int size = std::max(a.size_, b.size_);
        for (int i = 0; i < size; ++i) { // limbs above a number's size are zero
            const uint128 sum = static_cast<uint128>(a.at(i)) + b.at(i) + carry;
            result.at(i) = static_cast<std::uint64_t>(sum);
            carry = static_cast<std::uint64_t>(sum >> 64);
        }
        result.size_ = size;
        if (carry != 0) {
            if (size == Limbs) throw std::overflow_error("wide_int: sum");
            result.at(size) = carry;
            ++result.size_;
        }
        return result;
    }

    // |a| - |b| for |a| > |b|.
    static wide_int subtract_magnitudes(const wide_int& a, const wide_int& b) {
        wide_int result;
        std::uint64_t borrow = 0;
        for (int i = 0; i < a.size_; ++i) {
            const uint128 take = static_cast<uint128>(b.at(i)) + borrow;
            borrow = a.at(i) < take ? 1 : 0;
            result.at(i) = static_cast<std::uint64_t>((static_cast<uint128>(borrow) << 64) + a.at(i) - take);
        }
        result.size_ = a.size_;
        result.trim();
        return result;
    }

    std::array<std::uint64_t, static_cast<std::size_t>(Limbs)> limbs_{}; // little-endian magnitude, zero above size_
    int size_ = 0;                                                       // limbs in use; 0 means the value is zero
    bool negative_ = false;                                              // never set for zero
};

} // namespace oracle
