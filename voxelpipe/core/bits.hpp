// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Parts of <bit> and <limits> for device code: the standard library's constexpr functions are host-only unless nvcc
// gets --expt-relaxed-constexpr.

#include <voxelpipe/config.hpp>

#include <limits>
#include <type_traits>

namespace voxelpipe::core {

template <class To, class From>
[[nodiscard]] VOXELPIPE_HD constexpr To bit_cast(const From& from) noexcept {
    static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>);
    return __builtin_bit_cast(To, from);
}

// Limits of an arithmetic type, as constants, which device code may read.
template <class T>
inline constexpr T greatest = std::numeric_limits<T>::max();
template <class T>
inline constexpr T lowest = std::numeric_limits<T>::lowest();

} // namespace voxelpipe::core
