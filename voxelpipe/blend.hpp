// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blend modes: how the fragments of one voxel become one value (paper section 3, render targets). The fragments alone
// determine every result, never a race: see docs/design.md, "Blending".
//
// A blend that is not order-free is folded in triangle order. User-defined blends: core/user_blend.hpp. Blends of
// packed formats, and the mean: formats/packed_blend.hpp.

#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/core/reproducible_sum.hpp>
#include <voxelpipe/core/user_blend.hpp>
#include <voxelpipe/core/value_traits.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace voxelpipe {

namespace blend {

struct replace {};       // the last triangle wins: draw order, then triangle order
struct add {};           // integers wrap; floating types sum reproducibly; bit: exclusive or
struct add_saturate {};  // integers: the exact sum, then clamped to the type's range; bit: or
struct add_unordered {}; // floating types: plain additions in any order; tested to a bound, not to the bit, on a GPU
struct min {};           // floats by total order: -inf < ... < -0 < +0 < ... < inf < NaN
struct max {};           // floats by the same order
struct bit_and {};       // integers and bit
struct bit_or {};        // integers and bit
struct bit_xor {};       // integers and bit
struct mean {};          // half, bfloat16, float, packed formats: the exact mean of a call's fragments, rounded once
struct count {};         // adds 1 per fragment, whatever the shader returns; wraps

// add for float with a quantum of 2^Log2Quantum instead of 2^-32: terms from 2^(63 + Log2Quantum) on are infinite.
template <int Log2Quantum>
struct add_quantum {};

} // namespace blend

namespace core {

// blend_traits<Blend, T>: accumulator, identity(), begin(stored value), apply(accumulator, value), end(accumulator).
// The result of a blend is defined as begin, apply..., end in triangle order; if order_free, any order gives the same
// bits. T is a scalar here; vectors are blended component by component below.
template <class Blend, class T>
struct blend_traits : refused_blend<T> {};

template <class T>
struct in_place_blend {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using accumulator = T;
    VOXELPIPE_HD
    static T begin(T stored) { return stored; }
    VOXELPIPE_HD
    static T end(T value) { return value; }
};

template <class T>
struct blend_traits<blend::replace, T> : in_place_blend<T> {
    static constexpr bool order_free = false; // order-free only together with the primitive's number
    VOXELPIPE_HD
    static T identity() { return T{}; }
    VOXELPIPE_HD
    static void apply(T& a, T v) { a = canonical(v); }
};

template <class T>
requires is_scalar<T>
struct blend_traits<blend::min, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() {
        if constexpr (is_floating<T>)
            return core::bit_cast<T>(float_bits<T>::nan); // the greatest value of the order
        else
            return core::greatest<T>;
    }
    VOXELPIPE_HD
    static void apply(T& a, T v) {
        if (ordered_less(v, a)) a = canonical(v);
    }
};

template <class T>
requires is_scalar<T>
struct blend_traits<blend::max, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() {
        if constexpr (is_floating<T>) {
            using bits = typename float_bits<T>::type;
            return core::bit_cast<T>(static_cast<bits>(float_bits<T>::infinity | ~(static_cast<bits>(~bits{0}) >> 1)));
        } else {
            return core::lowest<T>;
        }
    }
    VOXELPIPE_HD
    static void apply(T& a, T v) {
        if (ordered_less(a, v)) a = canonical(v);
    }
};

template <class T>
requires(is_integer<T> || std::is_same_v<T, bool>) struct blend_traits<blend::bit_and, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() {
        if constexpr (std::is_same_v<T, bool>)
            return true;
        else
            return static_cast<T>(~T{0});
    }
    VOXELPIPE_HD
    static void apply(T& a, T v) { a = static_cast<T>(a & v); }
};
template <class T>
requires(is_integer<T> || std::is_same_v<T, bool>) struct blend_traits<blend::bit_or, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    VOXELPIPE_HD
    static void apply(T& a, T v) { a = static_cast<T>(a | v); }
};
template <class T>
requires(is_integer<T> || std::is_same_v<T, bool>) struct blend_traits<blend::bit_xor, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    VOXELPIPE_HD
    static void apply(T& a, T v) { a = static_cast<T>(a ^ v); }
};

// Integer addition that wraps; bit: addition modulo 2.
template <class T>
requires(is_integer<T> || std::is_same_v<T, bool>) struct blend_traits<blend::add, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    VOXELPIPE_HD
    static void apply(T& a, T v) {
        if constexpr (std::is_same_v<T, bool>) {
            a = a != v;
        } else {
            using wide = std::make_unsigned_t<decltype(a + v)>;
            a = static_cast<T>(static_cast<wide>(a) + static_cast<wide>(v));
        }
    }
};

// The shader's value for a count target is ignored, whatever its type.
template <class T>
requires(is_integer<T> || std::is_same_v<T, bool>) struct blend_traits<blend::count, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    template <class Any>
    VOXELPIPE_HD static void apply(T& a, const Any&) {
        blend_traits<blend::add, T>::apply(a, T{1});
    }
};

template <class T, int Log2Quantum>
struct reproducible_blend {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using accumulator = typename sum_format<T>::sum;
    VOXELPIPE_HD
    static T identity() { return core::bit_cast<T>(typename float_bits<T>::type{0}); }
    VOXELPIPE_HD
    static accumulator begin(T stored) {
        accumulator a{};
        apply(a, stored);
        return a;
    }
    VOXELPIPE_HD
    static void apply(accumulator& a, T v) {
        if constexpr (std::is_same_v<T, float>)
            add_float<Log2Quantum>(a, v);
        else if constexpr (std::is_same_v<T, half>)
            add_half<Log2Quantum>(a, v);
        else if constexpr (std::is_same_v<T, bfloat16>)
            add_float<Log2Quantum>(a, static_cast<float>(v));
        else
            add_double<Log2Quantum>(a, v);
    }
    VOXELPIPE_HD
    static T end(const accumulator& a) {
        using bits = typename float_bits<T>::type;
        if constexpr (std::is_same_v<T, float>)
            return round_sum_to_float<Log2Quantum>(a);
        else if constexpr (std::is_same_v<T, half>)
            return core::bit_cast<T>(static_cast<bits>(round_sum(a, Log2Quantum, 10, 5)));
        else if constexpr (std::is_same_v<T, bfloat16>)
            return core::bit_cast<T>(static_cast<bits>(round_sum(a, Log2Quantum, 7, 8)));
        else
            return core::bit_cast<T>(static_cast<bits>(round_sum(a, Log2Quantum, 52, 11)));
    }
};
template <class T>
requires is_floating<T>
struct blend_traits<blend::add, T> : reproducible_blend<T, sum_format<T>::log2_quantum> {
};
template <int Log2Quantum>
struct blend_traits<blend::add_quantum<Log2Quantum>, float> : reproducible_blend<float, Log2Quantum> {};

template <class T>
requires is_floating<T>
struct blend_traits<blend::add_unordered, T> : in_place_blend<T> {
    static constexpr bool order_free = false;
    VOXELPIPE_HD
    static T identity() { return core::bit_cast<T>(typename float_bits<T>::type{0}); }
    VOXELPIPE_HD
    static void apply(T& a, T v) {
        if constexpr (std::is_same_v<T, half> || std::is_same_v<T, bfloat16>)
            a = canonical(T(exact::add(static_cast<float>(a), static_cast<float>(v))));
        else
            a = canonical(a + v);
    }
};

// Unsigned sums only grow, so clamping at each step clamps the exact sum.
template <class T>
requires(std::is_unsigned_v<T>) struct blend_traits<blend::add_saturate, T> : in_place_blend<T> {
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    VOXELPIPE_HD
    static void apply(T& a, T v) {
        if constexpr (std::is_same_v<T, bool>)
            a = a || v;
        else
            a = static_cast<T>(a + v) < a ? core::greatest<T> : static_cast<T>(a + v);
    }
};
// Signed sums may shrink again, so they are clamped at the end.
template <class T>
requires(is_integer<T>&& std::is_signed_v<T>) struct blend_traits<blend::add_saturate, T> {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using accumulator = wide_sum<1>;
    VOXELPIPE_HD
    static T identity() { return T{0}; }
    VOXELPIPE_HD
    static accumulator begin(T stored) {
        accumulator a{};
        add_term(a, std::int64_t{stored});
        return a;
    }
    VOXELPIPE_HD
    static void apply(accumulator& a, T v) { add_term(a, std::int64_t{v}); }
    VOXELPIPE_HD
    static T end(const accumulator& a) {
        const int128 sum = (static_cast<int128>(a.top) << 64) | a.limb[0];
        if (sum > core::greatest<T>) return core::greatest<T>;
        if (sum < core::lowest<T>) return core::lowest<T>;
        return static_cast<T>(sum);
    }
};

// Vectors, component by component.
template <class Blend, glm::length_t N, class S, glm::qualifier Q>
requires(blend_traits<Blend, S>::available && !user_blend<Blend, glm::vec<N, S, Q>> &&
         !user_blend_template<Blend, glm::vec<N, S, Q>> &&
         !std::is_same_v<Blend, blend::replace>) struct blend_traits<Blend, glm::vec<N, S, Q>> {
    using vector = glm::vec<N, S, Q>;
    using element = blend_traits<Blend, S>;
    static constexpr bool available = true;
    static constexpr bool order_free = element::order_free;
    struct sums {
        typename element::accumulator c[std::size_t{N}];
    };
    static constexpr bool in_place = std::is_same_v<typename element::accumulator, S>;
    using accumulator = std::conditional_t<in_place, vector, sums>;
    VOXELPIPE_HD
    static vector identity() {
        vector r;
        for (glm::length_t i = 0; i < N; ++i) r[i] = element::identity();
        return r;
    }
    VOXELPIPE_HD
    static accumulator begin(const vector& stored) {
        if constexpr (in_place) {
            return stored;
        } else {
            accumulator a;
            for (glm::length_t i = 0; i < N; ++i) a.c[i] = element::begin(stored[i]);
            return a;
        }
    }
    template <class Value>
    VOXELPIPE_HD static void apply(accumulator& a, const Value& v) {
        for (glm::length_t i = 0; i < N; ++i) {
            if constexpr (std::is_same_v<Blend, blend::count>)
                element::apply(a[i], v);
            else if constexpr (in_place)
                element::apply(a[i], v[i]);
            else
                element::apply(a.c[i], v[i]);
        }
    }
    VOXELPIPE_HD
    static vector end(const accumulator& a) {
        if constexpr (in_place) {
            return a;
        } else {
            vector r;
            for (glm::length_t i = 0; i < N; ++i) r[i] = element::end(a.c[i]);
            return r;
        }
    }
};

template <class Blend, class T>
requires(user_blend<Blend, T> || user_blend_template<Blend, T>) struct blend_traits<Blend, T> : in_place_blend<T> {
    static constexpr bool order_free = Blend::order_free;
    VOXELPIPE_HD
    static T identity() {
        if constexpr (user_blend<Blend, T>)
            return Blend{}.identity();
        else
            return Blend{}.template identity<T>();
    }
    VOXELPIPE_HD
    static void apply(T& a, const T& v) { a = Blend{}.combine(a, v); }
};

// Returns true. Does not compile if Blend is a user-defined blend that cannot be used; one line says why. A blend of a
// vector's components is a blend of the vector too, which blend_traits knows.
template <class Blend, class T>
[[nodiscard]] constexpr bool explain_user_blend() {
    if constexpr (has_blend_member<Blend> && !(blend_traits<Blend, T>::available && std::is_empty_v<Blend>))
        static_cast<void>(check_user_blend<Blend, T>());
    return true;
}

} // namespace core
} // namespace voxelpipe
