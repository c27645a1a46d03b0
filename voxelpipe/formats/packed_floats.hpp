// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Three floats without a sign in 32 bits: float11_11_10, and rgb9e5 with one exponent for all. Conversions round the
// exact value once, to nearest, ties to even.

#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/half.hpp>
#include <voxelpipe/formats/exact_number.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <initializer_list>

namespace voxelpipe {

// Two floats of 11 bits and one of 10, the first in the lowest bits (B10G11R11_UFLOAT_PACK32): 5 bits of exponent, 6 or
// 5 of mantissa, as a half without its sign. Negative numbers and -infinity become 0. A finite number beyond the
// greatest (65024, 65024, 64512) becomes that one, infinity stays infinite, and a NaN a NaN.
struct float11_11_10 {
    static constexpr int lanes = 3;  // components
    using wide_type = glm::vec3;     // what a word is packed from
    using word_type = std::uint32_t; // what is stored

    std::uint32_t bits; // 11, 11 and 10, from the lowest bits up

    float11_11_10() = default;
    // The nearest numbers.
    VOXELPIPE_HD
    explicit float11_11_10(const glm::vec3& value) : bits(0) {
        for (int i = 0; i < lanes; ++i) set(i, core::number_of(value[i]));
    }
    // The vector with these bits.
    [[nodiscard]] VOXELPIPE_HD static constexpr float11_11_10 from_bits(std::uint32_t raw) {
        float11_11_10 v{};
        v.bits = raw;
        return v;
    }

    // Exact.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 unpack() const { return {component(0), component(1), component(2)}; }
    // The same as unpack().
    VOXELPIPE_HD
    explicit operator glm::vec3() const { return unpack(); }
    // Component i as a float. Exact.
    [[nodiscard]] VOXELPIPE_HD float component(int i) const {
        return static_cast<float>(half::from_bits(static_cast<std::uint16_t>(code(i) << (10 - mantissa_bits(i)))));
    }

    // The bits of component i. Codes of numbers have the order of the numbers.
    [[nodiscard]] VOXELPIPE_HD constexpr std::uint32_t code(int i) const {
        return bits >> (11 * i) & ((1u << (mantissa_bits(i) + 5)) - 1);
    }
    // Sets the bits of component i, no more than it has.
    VOXELPIPE_HD
    constexpr void set_code(int i, std::uint32_t code) {
        const std::uint32_t mask = ((1u << (mantissa_bits(i) + 5)) - 1) << (11 * i);
        bits = (bits & ~mask) | code << (11 * i);
    }
    // Sets component i to the nearest number.
    VOXELPIPE_HD
    void set(int i, const core::exact_number& value) {
        if (value.is_nan()) {
            set_code(i, nan_code(i));
        } else if (value.negative) {
            set_code(i, 0);
        } else if (value.is_infinite()) {
            set_code(i, infinity_code(i));
        } else {
            const auto nearest = static_cast<std::uint32_t>(
                exact::round_to_binary(value.magnitude, value.exponent, mantissa_bits(i), 5));
            set_code(i, nearest < infinity_code(i) ? nearest : infinity_code(i) - 1);
        }
    }
    // The same value with the one NaN that targets store.
    [[nodiscard]] VOXELPIPE_HD constexpr float11_11_10 canonical() const {
        float11_11_10 v = *this;
        for (int i = 0; i < lanes; ++i)
            if (code(i) > infinity_code(i)) v.set_code(i, nan_code(i));
        return v;
    }

    // 6 or 5.
    [[nodiscard]] VOXELPIPE_HD static constexpr int mantissa_bits(int i) { return i < 2 ? 6 : 5; }
    // The bits of infinity in component i.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint32_t infinity_code(int i) { return 31u << mantissa_bits(i); }
    // The greatest of the order.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint32_t nan_code(int i) {
        return infinity_code(i) | 1u << (mantissa_bits(i) - 1);
    }

    friend constexpr bool operator==(float11_11_10 a, float11_11_10 b) = default; // bitwise
};

// Three mantissas of 9 bits, the first in the lowest bits, and an exponent of 5 in the highest
// (E5B9G9R9_UFLOAT_PACK32): component i is mantissa i * 2^(exponent - 24). The exponent is the least at which the
// greatest component, rounded, fits; then each component is rounded at it, once. Negative numbers and NaN become 0,
// infinity and what is beyond the greatest number, 65408, become that one.
struct rgb9e5 {
    static constexpr int lanes = 3;  // components
    using wide_type = glm::vec3;     // what a word is packed from
    using word_type = std::uint32_t; // what is stored

    std::uint32_t bits; // 9, 9, 9 and 5, from the lowest bits up

    rgb9e5() = default;
    // The nearest numbers with one exponent.
    VOXELPIPE_HD
    explicit rgb9e5(const glm::vec3& value)
        : rgb9e5(nearest(core::number_of(value.x), core::number_of(value.y), core::number_of(value.z))) {}
    // The vector with these bits.
    [[nodiscard]] VOXELPIPE_HD static constexpr rgb9e5 from_bits(std::uint32_t raw) {
        rgb9e5 v{};
        v.bits = raw;
        return v;
    }
    // The word nearest to exact numbers.
    [[nodiscard]] VOXELPIPE_HD static rgb9e5 nearest(const core::exact_number& r, const core::exact_number& g,
                                                     const core::exact_number& b) {
        int exponent = 0;
        for (const core::exact_number* const n : {&r, &g, &b}) {
            const int needed = exponent_of(*n);
            exponent = needed > exponent ? needed : exponent;
        }
        return from_bits(mantissa(r, exponent) | mantissa(g, exponent) << 9 | mantissa(b, exponent) << 18 |
                         static_cast<std::uint32_t>(exponent) << 27);
    }

    // Exact.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 unpack() const { return {component(0), component(1), component(2)}; }
    // The same as unpack().
    VOXELPIPE_HD
    explicit operator glm::vec3() const { return unpack(); }
    // Component i as a float. Exact.
    [[nodiscard]] VOXELPIPE_HD float component(int i) const {
        const auto scale = core::bit_cast<float>(((bits >> 27) + 103u) << 23); // 2^(exponent - 24)
        return exact::mul(static_cast<float>(bits >> (9 * i) & 0x1ffu), scale);
    }
    // The same value as targets store it, with the least exponent.
    [[nodiscard]] VOXELPIPE_HD rgb9e5 canonical() const { return rgb9e5(unpack()); }

    friend constexpr bool operator==(rgb9e5 a, rgb9e5 b) = default; // bitwise

private:
    // 0 to 511, or 512 where it rounds up to the next power of two.
    [[nodiscard]] VOXELPIPE_HD static std::uint32_t rounded(const core::exact_number& n, int exponent) {
        if (n.is_nan() || n.negative) return 0;
        if (n.is_infinite() || (n.magnitude != 0 && n.log2() >= exponent - 15)) return 512;
        return static_cast<std::uint32_t>(n.in_units(exponent - 24));
    }
    [[nodiscard]] VOXELPIPE_HD static std::uint32_t mantissa(const core::exact_number& n, int exponent) {
        const std::uint32_t m = rounded(n, exponent);
        return m < 512 ? m : 511; // with the greatest exponent only
    }
    // The least exponent at which a number's mantissa fits, at most 31.
    [[nodiscard]] VOXELPIPE_HD static int exponent_of(const core::exact_number& n) {
        if (n.is_nan() || n.negative || (!n.is_infinite() && n.magnitude == 0)) return 0;
        if (n.is_infinite() || n.log2() > 15) return 31;
        const int least = n.log2() + 16 > 0 ? n.log2() + 16 : 0;
        return least < 31 && rounded(n, least) == 512 ? least + 1 : least;
    }
};

} // namespace voxelpipe
