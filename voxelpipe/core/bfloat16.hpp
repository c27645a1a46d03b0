// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// bfloat16: the upper half of a float as storage, with exact conversions (to nearest, ties to even), with the same bits
// on every compiler. Arithmetic is done in float by the caller.

#include <voxelpipe/core/bits.hpp>

#include <cstdint>

namespace voxelpipe {

// A number of 16 bits with a float's range, for targets. Conversions round to nearest, ties to even; a finite float
// beyond the greatest bfloat16 becomes that one, an infinite one stays infinite, and a NaN a NaN.
struct bfloat16 {
    std::uint16_t bits; // sign, 8 of exponent, 7 of mantissa

    bfloat16() = default;
    VOXELPIPE_HD
    constexpr explicit bfloat16(std::uint16_t raw, int) : bits(raw) {}
    // The nearest bfloat16.
    VOXELPIPE_HD
    explicit bfloat16(float value) : bits(from_float(core::bit_cast<std::uint32_t>(value))) {}

    // The number with these bits.
    [[nodiscard]] VOXELPIPE_HD static constexpr bfloat16 from_bits(std::uint16_t raw) { return bfloat16(raw, 0); }

    // Exact.
    VOXELPIPE_HD
    explicit operator float() const { return core::bit_cast<float>(std::uint32_t{bits} << 16); }

    friend constexpr bool operator==(bfloat16 a, bfloat16 b) = default; // bitwise

private:
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint16_t from_float(std::uint32_t raw) {
        const std::uint32_t magnitude = raw & 0x7fffffffu;
        const std::uint32_t sign = (raw >> 16) & 0x8000u;
        if (magnitude > 0x7f800000u) // a NaN stays a NaN even if its payload does not fit
            return static_cast<std::uint16_t>(sign | (magnitude >> 16) | 0x40u);
        if (magnitude == 0x7f800000u) return static_cast<std::uint16_t>(sign | 0x7f80u);
        // Patterns of one sign have the order of their values, so that a carry out of the mantissa is right.
        const std::uint32_t nearest = (magnitude + 0x7fffu + (magnitude >> 16 & 1u)) >> 16;
        return static_cast<std::uint16_t>(sign | (nearest < 0x7f80u ? nearest : 0x7f7fu));
    }
};
static_assert(sizeof(bfloat16) == 2);

} // namespace voxelpipe
