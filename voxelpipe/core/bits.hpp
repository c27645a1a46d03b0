// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What <bit> and <limits> have, for device code too: the standard library's constexpr functions are the host's only,
// unless nvcc is told --expt-relaxed-constexpr.

#include <voxelpipe/config.hpp>

#include <limits>
#include <type_traits>

namespace voxelpipe::core {

template <class To, class From>
[[nodiscard]] VOXELPIPE_HD constexpr To bit_cast(const From& from) noexcept {
    static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>);
    return __builtin_bit_cast(To, from);
}

// Of an arithmetic type: constants, which device code may read.
template <class T>
inline constexpr T greatest = std::numeric_limits<T>::max();
template <class T>
inline constexpr T lowest = std::numeric_limits<T>::lowest();

} // namespace voxelpipe::core
