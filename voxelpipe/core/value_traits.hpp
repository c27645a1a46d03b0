// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Properties of a render target's value type: its components, its canonical NaN, and its order.

#include <voxelpipe/core/bfloat16.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/half.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe {

// Value type tag of a target with one bit per voxel, 32 to a word along x. Shaders return a bool for it.
struct bit {};

namespace core {

template <class T>
struct vector_traits {
    using element = T;
    static constexpr int components = 1;
};
template <glm::length_t N, class S, glm::qualifier Q>
struct vector_traits<glm::vec<N, S, Q>> {
    using element = S;
    static constexpr int components = N;
};

template <class T>
inline constexpr bool is_floating =
    std::is_same_v<T, float> || std::is_same_v<T, double> || std::is_same_v<T, half> || std::is_same_v<T, bfloat16>;
template <class T>
inline constexpr bool is_integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;
template <class T>
inline constexpr bool is_scalar = is_floating<T> || is_integer<T> || std::is_same_v<T, bool>;

// Formats of several components in one word (formats/formats.hpp).
template <class T>
inline constexpr bool is_packed = requires(const T& v) {
    typename T::wide_type;
    v.unpack();
    v.canonical();
};

template <class T>
struct float_bits;
template <>
struct float_bits<half> {
    using type = std::uint16_t;
    static constexpr type infinity = 0x7c00u, nan = 0x7e00u;
};
template <>
struct float_bits<bfloat16> {
    using type = std::uint16_t;
    static constexpr type infinity = 0x7f80u, nan = 0x7fc0u;
};
template <>
struct float_bits<float> {
    using type = std::uint32_t;
    static constexpr type infinity = 0x7f800000u, nan = 0x7fc00000u;
};
template <>
struct float_bits<double> {
    using type = std::uint64_t;
    static constexpr type infinity = 0x7ff0000000000000u, nan = 0x7ff8000000000000u;
};

// Every NaN that reaches a target of a built-in type is stored as the one positive quiet NaN: machines differ in which
// NaN an operation returns.
template <class T>
[[nodiscard]] VOXELPIPE_HD T canonical(T v) {
    if constexpr (is_floating<T>) {
        using bits = typename float_bits<T>::type;
        const auto raw = core::bit_cast<bits>(v);
        constexpr bits absolute = static_cast<bits>(~bits{0}) >> 1;
        return (raw & absolute) > float_bits<T>::infinity ? core::bit_cast<T>(float_bits<T>::nan) : v;
    } else if constexpr (vector_traits<T>::components > 1) {
        for (int i = 0; i < vector_traits<T>::components; ++i) v[i] = canonical(v[i]);
        return v;
    } else if constexpr (is_packed<T>) {
        return v.canonical();
    } else {
        return v;
    }
}

// The floats that a value is packed from; T itself for all other types.
template <class T>
struct wide_value {
    using type = T;
};
template <class T>
requires(std::is_same_v<T, half> || std::is_same_v<T, bfloat16>) struct wide_value<T> {
    using type = float;
};
template <class T>
requires is_packed<T>
struct wide_value<T> {
    using type = typename T::wide_type;
};
template <glm::length_t N, class S, glm::qualifier Q>
struct wide_value<glm::vec<N, S, Q>> {
    using type = glm::vec<N, typename wide_value<S>::type, Q>;
};

// Maps floats to integers of the same order, for shared-memory atomics on integers and for min and max.
template <class T>
[[nodiscard]] VOXELPIPE_HD auto order_key(T v) {
    using bits = typename float_bits<T>::type;
    using key = std::make_signed_t<bits>;
    const auto raw = core::bit_cast<bits>(canonical(v));
    constexpr bits absolute = static_cast<bits>(~bits{0}) >> 1;
    return static_cast<key>((raw & ~absolute) != 0 ? raw ^ absolute : raw);
}

template <class T>
[[nodiscard]] VOXELPIPE_HD bool ordered_less(T a, T b) {
    if constexpr (is_floating<T>)
        return order_key(a) < order_key(b);
    else
        return a < b;
}

} // namespace core
} // namespace voxelpipe
