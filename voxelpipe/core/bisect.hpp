// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bisection of what is in order, for host and device.

#include <voxelpipe/config.hpp>

#include <cstdint>

namespace voxelpipe::core {

// The first number in [0, count] for which is_before(number) is false. It is true below that and not asked of `count`.
VOXELPIPE_ANY_CALLABLE
template <class IsBefore>
[[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t bisect(std::uint64_t count, const IsBefore& is_before) {
    std::uint64_t first = 0, last = count;
    while (first < last) {
        const std::uint64_t middle = first + (last - first) / 2;
        if (is_before(middle))
            first = middle + 1;
        else
            last = middle;
    }
    return first;
}

// The number of keys, ascending, that are less than `key`.
[[nodiscard]] VOXELPIPE_HD constexpr std::uint64_t count_below(const std::uint64_t* keys, std::uint64_t count,
                                                               std::uint64_t key) {
    return bisect(count, [=](std::uint64_t i) { return keys[i] < key; });
}

} // namespace voxelpipe::core
