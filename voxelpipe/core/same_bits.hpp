// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Comparison of values by their bits, on the host: -0 is not 0, and a NaN is itself.

#include <voxelpipe/core/pack.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <type_traits>

namespace voxelpipe::core {

// True if two values have the same bits, padding included: the padding of structs may make equal values differ.
template <class T>
[[nodiscard]] constexpr bool has_same_bits(const T& a, const T& b) {
    static_assert(std::is_trivially_copyable_v<T>);
    using bytes = std::array<std::byte, sizeof(T)>;
    return std::bit_cast<bytes>(a) == std::bit_cast<bytes>(b);
}

// True if the values of two packs have the same bits, one by one. Padding between the values does not matter.
template <class... Ts>
[[nodiscard]] constexpr bool has_same_bits(const pack<Ts...>& a, const pack<Ts...>& b) {
    bool same = true;
    for_each_index<sizeof...(Ts)>(
        [&]<std::size_t I>() { same = same && has_same_bits(voxelpipe::get<I>(a), voxelpipe::get<I>(b)); });
    return same;
}

// True if the draws' shaders, which are constant_output, all give the same values. No draws: true.
template <class Draws>
[[nodiscard]] bool have_same_values(const Draws& draws) {
    for (const auto& d : draws)
        if (!has_same_bits(d.fragment_shader.values, draws[0].fragment_shader.values)) return false;
    return true;
}

} // namespace voxelpipe::core
