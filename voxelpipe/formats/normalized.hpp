// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vectors of fractions in one word: unorm8x4, unorm10_10_10_2, and snorm of 8 and 16 bits. A component is a whole
// number, its code, over the greatest code; conversions round the exact value to the nearest code, ties to even.

#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/exact.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe {

namespace core {

// The nearest integer to value * greatest * 2^log2_parts, ties to even. NaN gives 0; what is beyond the range gives its
// end. greatest is below 2^16, log2_parts at most 40.
template <bool Signed>
[[nodiscard]] VOXELPIPE_HD std::int64_t nearest_code(float value, std::int32_t greatest, int log2_parts = 0) {
    const auto raw = core::bit_cast<std::uint32_t>(value);
    const std::uint32_t exponent = raw >> 23 & 0xffu, mantissa = raw & 0x7fffffu;
    const bool negative = raw >> 31 != 0;
    if (exponent == 255 && mantissa != 0) return 0;
    if (!Signed && negative) return 0;
    std::int64_t code = std::int64_t{greatest} << log2_parts; // from 1 on
    if (exponent < 127) {
        // |value| * greatest * 2^log2_parts = product * 2^-shift, and the product is below 2^40.
        const std::uint64_t product = std::uint64_t{mantissa | 0x800000u} * static_cast<std::uint32_t>(greatest);
        const int shift = 150 - static_cast<int>(exponent) - log2_parts;
        if (shift > 40) return 0; // less than a half, and every denormal float
        if (shift > 0) {
            const std::uint64_t rest = product & ((std::uint64_t{1} << shift) - 1),
                                half = std::uint64_t{1} << (shift - 1);
            code = static_cast<std::int64_t>(product >> shift);
            code += static_cast<std::int64_t>(rest > half || (rest == half && (code & 1) != 0));
        } else {
            code = static_cast<std::int64_t>(product << -shift);
        }
    }
    return negative ? -code : code;
}

} // namespace core

// One component for each of Bits, the first in the lowest bits. Unsigned: codes 0 to 2^b - 1 for 0 to 1. Signed: two's
// complement from -(2^(b-1) - 1) to 2^(b-1) - 1 for -1 to 1; the code -2^(b-1) is -1 too, and targets store the other.
template <bool Signed, int... Bits>
struct normalized {
    static constexpr int lanes = sizeof...(Bits);   // components
    static constexpr bool is_signed = Signed;       // snorm, or unorm
    static constexpr int total_bits = (Bits + ...); // 16, 32 or 64
    using wide_type = glm::vec<lanes, float>;       // what a word is packed from
    // What is stored.
    using word_type = std::conditional_t<total_bits == 16, std::uint16_t,
                                         std::conditional_t<total_bits == 32, std::uint32_t, std::uint64_t>>;
    static_assert(total_bits == 16 || total_bits == 32 || total_bits == 64);
    static_assert(((Bits <= 16) && ...));

    word_type bits; // the components, from the lowest bits up

    normalized() = default;
    // The nearest codes. NaN gives 0, what is beyond the range its end.
    VOXELPIPE_HD
    explicit normalized(const wide_type& value) : bits(0) {
        for (int i = 0; i < lanes; ++i) set_code(i, core::nearest_code<Signed>(value[i], greatest_code(i)));
    }
    // The vector with these bits.
    [[nodiscard]] VOXELPIPE_HD static constexpr normalized from_bits(word_type raw) {
        normalized n{};
        n.bits = raw;
        return n;
    }

    // The values of the codes, each the nearest float.
    [[nodiscard]] VOXELPIPE_HD wide_type unpack() const {
        wide_type value(0.0f);
        for (int i = 0; i < lanes; ++i) {
            const std::int32_t c = code(i), greatest = greatest_code(i);
            value[i] = c < -greatest ? -1.0f : exact::div(static_cast<float>(c), static_cast<float>(greatest));
        }
        return value;
    }
    // The same as unpack().
    VOXELPIPE_HD
    explicit operator wide_type() const { return unpack(); }

    // Component i as a whole number.
    [[nodiscard]] VOXELPIPE_HD constexpr std::int32_t code(int i) const {
        const std::uint32_t mask = (1u << width(i)) - 1;
        const std::uint32_t raw = static_cast<std::uint32_t>(bits >> offset(i)) & mask;
        const std::uint32_t sign = Signed ? 1u << (width(i) - 1) : 0u;
        return static_cast<std::int32_t>((raw ^ sign) - sign);
    }
    // Sets component i to a whole number, which is moved into the range.
    VOXELPIPE_HD
    constexpr void set_code(int i, std::int64_t value) {
        const std::int64_t greatest = greatest_code(i), least = Signed ? -greatest : 0;
        const std::int64_t inside = value < least ? least : value > greatest ? greatest : value;
        const word_type mask = static_cast<word_type>(((word_type{1} << width(i)) - 1) << offset(i));
        const auto moved = static_cast<word_type>(static_cast<word_type>(inside) << offset(i));
        bits = static_cast<word_type>((bits & static_cast<word_type>(~mask)) | (moved & mask));
    }
    // The code of 1.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::int32_t greatest_code(int i) {
        return (std::int32_t{1} << (Signed ? width(i) - 1 : width(i))) - 1;
    }
    // The same value as targets store it: -1 has two codes.
    [[nodiscard]] VOXELPIPE_HD constexpr normalized canonical() const {
        normalized n = *this;
        if constexpr (Signed)
            for (int i = 0; i < lanes; ++i) n.set_code(i, code(i));
        return n;
    }

    friend constexpr bool operator==(normalized a, normalized b) = default; // bitwise

private:
    [[nodiscard]] VOXELPIPE_HD static constexpr int width(int i) {
        int at = 0, found = 0;
        ((found = at++ == i ? Bits : found), ...);
        return found;
    }
    [[nodiscard]] VOXELPIPE_HD static constexpr int offset(int i) {
        int at = 0, below = 0;
        ((below += at++ < i ? Bits : 0), ...);
        return below;
    }
};

using unorm8x4 = normalized<false, 8, 8, 8, 8>;           // four bytes, as R8G8B8A8_UNORM
using unorm10_10_10_2 = normalized<false, 10, 10, 10, 2>; // as A2B10G10R10_UNORM_PACK32
using snorm8x2 = normalized<true, 8, 8>;                  // as R8G8_SNORM
using snorm8x4 = normalized<true, 8, 8, 8, 8>;            // as R8G8B8A8_SNORM
using snorm16x2 = normalized<true, 16, 16>;               // as R16G16_SNORM
using snorm16x4 = normalized<true, 16, 16, 16, 16>;       // as R16G16B16A16_SNORM

} // namespace voxelpipe
