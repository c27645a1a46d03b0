// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers as text files have them, whatever the locale.

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>

namespace voxelize {

// All of WORD as a number: signs, a leading or trailing dot, exponents, "inf" and "nan" in any case, and what old C
// libraries print for those ("1.#INF", "-1.#IND", "1.#QNAN"). Numbers too large or too small for a double are infinite
// or 0. Nothing where WORD is no number.
[[nodiscard]] inline std::optional<double> number_of(std::string_view word) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const bool is_negative = word.starts_with('-');
    if (is_negative || word.starts_with('+')) word.remove_prefix(1);
    if (word.empty() || word.front() == '-' || word.front() == '+') return std::nullopt;
    const auto with_sign = [is_negative](double value) { return is_negative ? -value : value; };
    if (const std::size_t mark = word.find('#'); mark != std::string_view::npos) {
        if (mark < 2 || word[mark - 1] != '.') return std::nullopt;
        return with_sign(word.substr(mark + 1).starts_with("INF") ? infinity
                                                                  : std::numeric_limits<double>::quiet_NaN());
    }
    double value = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        // from_chars leaves the value as it was. The exponent's sign tells which, or that the digits before it are
        // many.
        const std::size_t exponent = word.find_first_of("eE");
        const bool is_small = exponent != std::string_view::npos ? word.substr(exponent + 1).starts_with('-')
                                                                 : word.starts_with("0") || word.starts_with(".");
        return with_sign(is_small ? 0 : infinity);
    }
    return with_sign(value);
}

} // namespace voxelize
