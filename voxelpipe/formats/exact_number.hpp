// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Numbers before the one rounding of a packed format: a float, an exact sum, or a sum's exact mean.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/reproducible_sum.hpp>

#include <cstdint>

namespace voxelpipe::core {

// magnitude * 2^exponent with a sign, or no finite number. The last bit of a magnitude of more than 90 bits may stand
// for a rest below it, which is exact for a rounding to 64 bits or fewer.
struct exact_number {
    enum class kind : std::uint8_t { finite, infinite, nan };

    uint128 magnitude = 0;
    int exponent = 0;
    bool negative = false;
    kind is = kind::finite;

    [[nodiscard]] VOXELPIPE_HD bool is_nan() const { return is == kind::nan; }
    [[nodiscard]] VOXELPIPE_HD bool is_infinite() const { return is == kind::infinite; }
    // The exponent of the highest bit; only of finite numbers that are not 0.
    [[nodiscard]] VOXELPIPE_HD int log2() const { return exact::bit_width(magnitude) - 1 + exponent; }
    // |number| in units of 2^unit, to nearest, ties to even; finite, and below 2^64 units.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t in_units(int unit) const {
        const int shift = unit - exponent;
        if (magnitude == 0 || shift >= 128) return 0; // less than 2^128 * 2^exponent: with 128 or more, below a half
        return static_cast<std::uint64_t>(shift <= 0 ? magnitude << -shift : exact::shift_right_rne(magnitude, shift));
    }
};

[[nodiscard]] VOXELPIPE_HD inline exact_number number_of(float value) {
    const auto raw = core::bit_cast<std::uint32_t>(value);
    const std::uint32_t exponent = raw >> 23 & 0xffu, mantissa = raw & 0x7fffffu;
    exact_number n;
    n.negative = raw >> 31 != 0;
    if (exponent == 255) {
        n.is = mantissa != 0 ? exact_number::kind::nan : exact_number::kind::infinite;
    } else {
        n.magnitude = exponent != 0 ? mantissa | 0x800000u : mantissa;
        n.exponent = static_cast<int>(exponent != 0 ? exponent : 1) - 150;
    }
    return n;
}

// The sum of terms that are whole multiples of 2^log2_quantum, over n; n = 1 is the sum. n > 0. A sum of 0 is positive.
[[nodiscard]] VOXELPIPE_HD inline exact_number mean_of(const wide_sum<1>& sum, int log2_quantum, std::uint32_t n) {
    exact_number mean;
    if (sum.marks != 0) {
        mean.is = sum_is_nan(sum.marks) ? exact_number::kind::nan : exact_number::kind::infinite;
        mean.negative = (sum.marks & sum_negative_infinity) != 0;
        return mean;
    }
    const sum_magnitude m = to_magnitude(sum);
    mean.negative = m.negative;
    mean.magnitude = m.magnitude;
    mean.exponent = m.exponent + log2_quantum;
    if (n == 1 || m.magnitude == 0) return mean;
    const int shift = 126 - exact::bit_width(m.magnitude); // a quotient of at least 94 bits
    const exact::wide_quotient q = exact::divide(m.magnitude << shift, n);
    mean.magnitude = q.quotient | static_cast<uint128>(q.has_rest);
    mean.exponent -= shift;
    return mean;
}

} // namespace voxelpipe::core
