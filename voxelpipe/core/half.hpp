// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// half: IEEE 754 binary16 storage with exact conversions (to nearest, ties to even), with the same bits on every
// compiler. Arithmetic is done in float by the caller.

#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/exact.hpp>

#include <cstdint>

namespace voxelpipe {

// An IEEE 754 number of 16 bits, for targets: conversions round to nearest, ties to even, the same everywhere.
// Arithmetic is that of float.
struct half {
    std::uint16_t bits; // sign, 5 of exponent, 10 of mantissa

    half() = default;
    VOXELPIPE_HD
    constexpr explicit half(std::uint16_t raw, int) : bits(raw) {}
    // The nearest half.
    VOXELPIPE_HD
    explicit half(float value) : bits(from_float(value)) {}

    // The number with these bits.
    [[nodiscard]] VOXELPIPE_HD static constexpr half from_bits(std::uint16_t raw) { return half(raw, 0); }

    // Exact.
    VOXELPIPE_HD
    explicit operator float() const {
        const std::uint32_t sign = static_cast<std::uint32_t>(bits & 0x8000u) << 16;
        const std::uint32_t exponent = (bits >> 10) & 0x1fu;
        const std::uint32_t mantissa = bits & 0x3ffu;
        std::uint32_t r = 0;
        if (exponent == 31) {
            r = 0x7f800000u | (mantissa << 13);
        } else if (exponent != 0) {
            r = ((exponent + 112) << 23) | (mantissa << 13);
        } else if (mantissa != 0) {
            const int shift = 11 - exact::bit_width(static_cast<std::uint64_t>(mantissa));
            r = (static_cast<std::uint32_t>(113 - shift) << 23) | (((mantissa << shift) & 0x3ffu) << 13);
        }
        return core::bit_cast<float>(sign | r);
    }

    friend constexpr bool operator==(half a, half b) = default; // bitwise

private:
    [[nodiscard]] VOXELPIPE_HD static std::uint16_t from_float(float value) {
        const auto raw = core::bit_cast<std::uint32_t>(value);
        const auto sign = static_cast<std::uint16_t>((raw >> 16) & 0x8000u);
        const std::uint32_t exponent = (raw >> 23) & 0xffu;
        const std::uint32_t mantissa = raw & 0x7fffffu;
        if (exponent == 255) // a NaN stays a NaN even if its payload does not fit
            return static_cast<std::uint16_t>(sign | 0x7c00u | (mantissa != 0 ? 0x200u | (mantissa >> 13) : 0u));
        if (exponent == 0) return sign; // below 2^-126, far under the smallest half
        const uint128 significand = mantissa | 0x800000u;
        const auto r = exact::round_to_binary(significand, static_cast<int>(exponent) - 150, 10, 5);
        return static_cast<std::uint16_t>(sign | r);
    }
};
static_assert(sizeof(half) == 2);

} // namespace voxelpipe
