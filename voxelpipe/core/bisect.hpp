// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bisection of what is in order, for host and device.

#include <voxelpipe/config.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The first number in [0, count] for which is_before(number) is false. It is true below that and not asked of `count`.
VOXELPIPE_ANY_CALLABLE
template <class Number, class IsBefore>
[[nodiscard]] VOXELPIPE_HD constexpr Number bisect(Number count, const IsBefore& is_before) {
    Number first = 0, last = count;
    while (first < last) {
        const Number middle = first + (last - first) / 2;
        if (is_before(middle))
            first = middle + 1;
        else
            last = middle;
    }
    return first;
}

// The last number in [first, end) for which holds(number) is true. It is true below that, and not asked of `first`, for
// which it is known: a range of one number reads nothing.
VOXELPIPE_ANY_CALLABLE
template <class Number, class Holds>
[[nodiscard]] VOXELPIPE_HD constexpr Number bisect_last(Number first, Number end, const Holds& holds) {
    while (end - first > 1) {
        const Number middle = first + (end - first) / 2;
        if (holds(middle))
            first = middle;
        else
            end = middle;
    }
    return first;
}

// The number of keys, ascending, that are less than `key`.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t count_below(const std::uint64_t* keys, std::uint64_t count,
                                                               std::uint64_t key) {
    return bisect(count, [=](std::uint64_t i) { return keys[i] < key; });
}

} // namespace voxelpipe::core
