// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blends that one atomic on global memory performs: those of integers, and sums whose every partial sum is exact.

#include <voxelpipe/device/targets/blend_method.cuh>
#include <voxelpipe/device/targets/repeated_fold.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

// Or, and, and add without a result. Written in assembly, so that the compiler neither turns them into atomics that
// return a value, for which a warp would wait, nor handles addresses that are not global, as it does for floating-point
// sums.
__device__ VOXELPIPE_INLINE void reduce_or(word* at, word bits) {
    asm volatile("red.relaxed.gpu.global.or.b32 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "r"(bits) : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_and(word* at, word bits) {
    asm volatile("red.relaxed.gpu.global.and.b32 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "r"(bits) : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_add(float* at, float v) {
    asm volatile("red.relaxed.gpu.global.add.f32 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "f"(v) : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_add(double* at, double v) {
    asm volatile("red.relaxed.gpu.global.add.f64 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "d"(v) : "memory");
}
// The same if wanted, without a branch.
__device__ VOXELPIPE_INLINE void reduce_add_where(float* at, float v, bool wanted) {
    asm volatile("{ .reg .pred p; setp.ne.u32 p, %2, 0; @p red.relaxed.gpu.global.add.f32 [%0], %1; }" ::"l"(
                     __cvta_generic_to_global(at)),
                 "f"(v), "r"(static_cast<unsigned>(wanted))
                 : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_add_where(double* at, double v, bool wanted) {
    asm volatile("{ .reg .pred p; setp.ne.u32 p, %2, 0; @p red.relaxed.gpu.global.add.f64 [%0], %1; }" ::"l"(
                     __cvta_generic_to_global(at)),
                 "d"(v), "r"(static_cast<unsigned>(wanted))
                 : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_add(unsigned* at, unsigned n) {
    asm volatile("red.relaxed.gpu.global.add.u32 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "r"(n) : "memory");
}
__device__ VOXELPIPE_INLINE void reduce_add(unsigned long long* at, unsigned long long n) {
    asm volatile("red.relaxed.gpu.global.add.u64 [%0], %1;" ::"l"(__cvta_generic_to_global(at)), "l"(n) : "memory");
}

// global_blend<Blend, T>: blends a fragment of value v into a stored T.
//   available     allowed(value, target, most): true if up to `most` fragments of this value give the blend's bits
//   apply(T*, v)  apply_first(T*, v): true if it was the voxel's first fragment; count has it, if tells_first holds
//   apply_many(T*, v, n): n fragments at once, n > 0
template <class Blend, class T>
struct global_blend {
    static constexpr bool available = false;
};

template <class T>
inline constexpr bool is_atomic_integer = core::is_integer<T> && (sizeof(T) == 4 || sizeof(T) == 8);

template <class T>
using atomic_word =
    std::conditional_t<sizeof(T) == 8, std::conditional_t<std::is_signed_v<T>, long long, unsigned long long>,
                       std::conditional_t<std::is_signed_v<T>, int, unsigned>>;
template <class T>
using unsigned_word = std::conditional_t<sizeof(T) == 8, unsigned long long, unsigned>;

template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::count, T> {
    static constexpr bool available = true;
    template <class V, class Target>
    [[nodiscard]] static bool allowed(const V&, const Target&, std::uint64_t) {
        return true;
    }
    template <class Target>
    [[nodiscard]] static bool tells_first(const Target& t, std::uint64_t most) {
        return t.load == load_operation::clear && t.clear_value == 0 && most < 0xffffffffu;
    }
    template <class V>
    __device__ static void apply(T* at, const V&) {
        atomicAdd(reinterpret_cast<unsigned_word<T>*>(at), unsigned_word<T>{1});
    }
    template <class V>
    __device__ static void apply_many(T* at, const V&, unsigned n) {
        atomicAdd(reinterpret_cast<unsigned_word<T>*>(at), unsigned_word<T>{n});
    }
    // Returns true if it was the voxel's first fragment. In assembly, like reduce_or.
    template <class V>
    __device__ static bool apply_first(T* at, const V&) {
        if constexpr (sizeof(T) == 4) {
            unsigned old = 0;
            asm volatile("atom.relaxed.gpu.global.add.u32 %0, [%1], 1;"
                         : "=r"(old)
                         : "l"(__cvta_generic_to_global(at))
                         : "memory");
            return old == 0;
        } else {
            unsigned long long old = 0;
            asm volatile("atom.relaxed.gpu.global.add.u64 %0, [%1], 1;"
                         : "=l"(old)
                         : "l"(__cvta_generic_to_global(at))
                         : "memory");
            return old == 0;
        }
    }
};

// Base of blends that are always allowed, and never report first fragments.
template <class T>
struct always_immediate {
    static constexpr bool available = true;
    template <class Target>
    [[nodiscard]] static bool allowed(T, const Target&, std::uint64_t) {
        return true;
    }
    template <class Target>
    [[nodiscard]] static bool tells_first(const Target&, std::uint64_t) {
        return false;
    }
};

// Integer blends that are one atomic.
template <class Blend, class T>
struct global_integer_blend : always_immediate<T> {
    __device__ static void apply(T* at, T v) {
        if constexpr (std::is_same_v<Blend, blend::add>)
            atomicAdd(reinterpret_cast<unsigned_word<T>*>(at), static_cast<unsigned_word<T>>(v));
        else if constexpr (std::is_same_v<Blend, blend::min>)
            atomicMin(reinterpret_cast<atomic_word<T>*>(at), static_cast<atomic_word<T>>(v));
        else if constexpr (std::is_same_v<Blend, blend::max>)
            atomicMax(reinterpret_cast<atomic_word<T>*>(at), static_cast<atomic_word<T>>(v));
        else if constexpr (std::is_same_v<Blend, blend::bit_and>)
            atomicAnd(reinterpret_cast<unsigned_word<T>*>(at), static_cast<unsigned_word<T>>(v));
        else if constexpr (std::is_same_v<Blend, blend::bit_or>)
            atomicOr(reinterpret_cast<unsigned_word<T>*>(at), static_cast<unsigned_word<T>>(v));
        else
            atomicXor(reinterpret_cast<unsigned_word<T>*>(at), static_cast<unsigned_word<T>>(v));
    }
    __device__ static void apply_many(T* at, T v, unsigned n) {
        if constexpr (std::is_same_v<Blend, blend::add>)
            apply(at, static_cast<T>(static_cast<unsigned_word<T>>(v) * n)); // wraps
        else if (!std::is_same_v<Blend, blend::bit_xor> || n % 2 != 0)
            apply(at, v);
    }
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::add, T> : global_integer_blend<blend::add, T> {
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::min, T> : global_integer_blend<blend::min, T> {
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::max, T> : global_integer_blend<blend::max, T> {
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::bit_and, T> : global_integer_blend<blend::bit_and, T> {
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::bit_or, T> : global_integer_blend<blend::bit_or, T> {
};
template <class T>
requires is_atomic_integer<T>
struct global_blend<blend::bit_xor, T> : global_integer_blend<blend::bit_xor, T> {
};

// True if clear, clear + value, ..., clear + most * value are all exact in T, and the reproducible sum (quantum
// 2^Log2Quantum) rounds none of the terms. Then addition in T, in any order, gives that sum. Zero and non-finite values
// are excluded, because of signs and marks.
template <class T>
[[nodiscard]] bool sums_are_exact(T value, T clear, std::uint64_t most, int log2_quantum) {
    constexpr int digits = std::numeric_limits<T>::digits;
    if (!std::isfinite(value) || !std::isfinite(clear) || value == 0) return false;
    if (clear == 0 && std::signbit(clear)) return false;
    const auto lowest_bit = [](T v) { // exponent of the lowest bit set
        int exponent = 0;
        const double fraction = std::frexp(static_cast<double>(v), &exponent);
        const auto whole = static_cast<std::uint64_t>(std::abs(std::ldexp(fraction, 53)));
        return exponent - 53 + std::countr_zero(whole);
    };
    const int of_value = lowest_bit(value);
    const int of_clear = clear == 0 ? of_value : lowest_bit(clear);
    const int unit = of_value < of_clear ? of_value : of_clear;
    if (unit < log2_quantum || unit < -100) return false;
    // Terms count as infinite from this exponent on.
    const int log2_limit = log2_quantum + (sizeof(T) == sizeof(float) ? 63 : 127);
    // In units of 2^unit: |clear| + most * |value| <= 2^digits. The doubles are exact below 2^53 and only grow beyond.
    const double max_units = std::ldexp(std::abs(static_cast<double>(clear)), -unit) +
                             static_cast<double>(most) * std::ldexp(std::abs(static_cast<double>(value)), -unit);
    return max_units < std::ldexp(1.0, digits) && std::ldexp(max_units, unit) < std::ldexp(1.0, log2_limit);
}

template <class T, int Log2Quantum>
struct global_sum {
    static constexpr bool available = true;
    template <class Target>
    [[nodiscard]] static bool allowed(T v, const Target& t, std::uint64_t most) {
        return t.load == load_operation::clear && sums_are_exact(v, t.clear_value, most, Log2Quantum);
    }
    template <class Target>
    [[nodiscard]] static bool tells_first(const Target&, std::uint64_t) {
        return false;
    }
    __device__ static void apply(T* at, T v) { reduce_add(at, v); }
    __device__ static void apply_many(T* at, T v, unsigned n) { reduce_add(at, v * static_cast<T>(n)); } // exact
};
template <class T>
requires(std::is_same_v<T, float> || std::is_same_v<T, double>) struct global_blend<blend::add, T>
    : global_sum<T, core::sum_format<T>::log2_quantum> {
};
template <int Log2Quantum>
struct global_blend<blend::add_quantum<Log2Quantum>, float> : global_sum<float, Log2Quantum> {};

// Any order is right by definition.
template <class T>
requires(std::is_same_v<T, float> || std::is_same_v<T, double>) struct global_blend<blend::add_unordered, T>
    : always_immediate<T> {
    __device__ static void apply(T* at, T v) { reduce_add(at, v); }
    __device__ static void apply_many(T* at, T v, unsigned n) { reduce_add(at, v * static_cast<T>(n)); }
};

} // namespace voxelpipe::device
