// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The words and numbers of the command line.

#include "run/command_line.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

// "1,2,3" or "1x2x3" -> numbers; LEAST to 3 of them.
template <class Number>
[[nodiscard]] std::vector<Number> parse_list(const std::string& option, const std::string& text, std::size_t least) {
    std::vector<Number> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    constexpr bool is_whole = std::is_integral_v<Number>;
    while (true) {
        Number number{};
        const auto [next, error] = std::from_chars(at, end, number);
        bool good = error == std::errc{} && (next == end || *next == ',' || *next == 'x');
        if (error == std::errc::result_out_of_range) {
            std::string message = option;
            message += ": \"";
            message += text;
            message += "\" has a number that is ";
            message += is_whole ? "too large" : "too large or too close to 0";
            throw usage_error(message);
        }
        if constexpr (!is_whole) good = good && std::isfinite(number);
        if (!good) break;
        numbers.push_back(number);
        if (next == end) {
            if (numbers.size() < least || (numbers.size() != 1 && numbers.size() != 3)) break;
            return numbers;
        }
        at = next + 1;
    }
    const std::string whole = is_whole ? "whole " : "";
    throw usage_error(
        option + " takes " +
        (least == 3 ? "three " + whole + "numbers, X,Y,Z" : "one " + whole + "number or three, X,Y,Z or XxYxZ") +
        ", not \"" + text + '"');
}

// One member of every entry, with commas between.
template <class List, class Member>
[[nodiscard]] std::string names(const List& list, Member member) {
    std::string text;
    for (const auto& entry : list) {
        if (!text.empty()) text += ", ";
        text += entry.*member;
    }
    return text;
}

[[nodiscard]] inline std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

// "y or z", "weight, cutoff or ignore".
template <class T>
[[nodiscard]] std::string in_words(const std::vector<std::pair<const char*, T>>& choices) {
    std::string text;
    for (std::size_t i = 0; i < choices.size(); ++i)
        text += std::string(i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i].first;
    return text;
}

} // namespace voxelize
