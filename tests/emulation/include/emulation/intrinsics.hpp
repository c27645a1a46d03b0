// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// CUDA's keywords and intrinsics for threads that are fibers. All fibers run on one CPU thread, so an atomic operation
// is an ordinary one.

#include <emulation/block.hpp>

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

#define __host__
#define __device__
#define __global__
#define __constant__
#define __shared__ static
#define __grid_constant__
#define __launch_bounds__(...)
#define __align__(n) __attribute__((aligned(n)))
#define __noinline__ // also inside __attribute__, as the standard library writes it

// ---- vectors --------------------------------------------------------------------------------------------------------

struct alignas(8) uint2 {
    unsigned x, y;
};
struct alignas(16) float4 {
    float x, y, z, w;
};
struct alignas(16) uint4 {
    unsigned x, y, z, w;
};
[[nodiscard]] inline uint2 make_uint2(unsigned x, unsigned y) { return {x, y}; }
[[nodiscard]] inline uint4 make_uint4(unsigned x, unsigned y, unsigned z, unsigned w) { return {x, y, z, w}; }

// ---- numbers --------------------------------------------------------------------------------------------------------

template <class T>
[[nodiscard]] T min(T a, T b) {
    return b < a ? b : a;
}
template <class T>
[[nodiscard]] T max(T a, T b) {
    return a < b ? b : a;
}
[[nodiscard]] inline int __popc(unsigned a) { return std::popcount(a); }
[[nodiscard]] inline int __popcll(unsigned long long a) { return std::popcount(a); }
[[nodiscard]] inline int __ffs(int a) { return __builtin_ffs(a); }
[[nodiscard]] inline int __ffsll(long long a) { return __builtin_ffsll(a); }
[[nodiscard]] inline int __clz(int a) { return std::countl_zero(static_cast<unsigned>(a)); }
[[nodiscard]] inline int __clzll(long long a) { return std::countl_zero(static_cast<unsigned long long>(a)); }
[[nodiscard]] inline unsigned __brev(unsigned a) {
    unsigned r = 0;
    for (int i = 0; i < 32; ++i) r |= (a >> i & 1u) << (31 - i);
    return r;
}
// The upper word of (high, low) << shift % 32.
[[nodiscard]] inline unsigned __funnelshift_l(unsigned low, unsigned high, unsigned shift) {
    const std::uint64_t both = std::uint64_t{high} << 32 | low;
    return static_cast<unsigned>(both << (shift & 31u) >> 32);
}
// The lower word of (high, low) >> shift % 32.
[[nodiscard]] inline unsigned __funnelshift_r(unsigned low, unsigned high, unsigned shift) {
    return static_cast<unsigned>((std::uint64_t{high} << 32 | low) >> (shift & 31u));
}
template <class T>
[[nodiscard]] T __ldg(const T* p) {
    return *p;
}
template <class T>
[[nodiscard]] T __ldca(const T* p) {
    return *p;
}
template <class T>
[[nodiscard]] T __ldcg(const T* p) {
    return *p;
}
template <class T>
void __stcs(T* p, const T& value) {
    *p = value;
}
inline void __threadfence() {}
inline void __threadfence_system() {}
[[nodiscard]] inline std::size_t __cvta_generic_to_global(const void* p) { return reinterpret_cast<std::size_t>(p); }
[[nodiscard]] inline std::size_t __cvta_generic_to_shared(const void* p) { return emulation::shared_address(p); }

// ---- threads that wait for one another ------------------------------------------------------------------------------

inline void __syncthreads() { (void)emulation::meet_block(false); }
[[nodiscard]] inline int __syncthreads_count(int predicate) {
    return static_cast<int>(emulation::meet_block(predicate != 0));
}
[[nodiscard]] inline int __syncthreads_or(int predicate) { return emulation::meet_block(predicate != 0) != 0; }

inline void __syncwarp(unsigned mask = 0xffffffffu) {
    (void)emulation::meet(emulation::meeting_kind::syncwarp, mask, 0, 0);
}
[[nodiscard]] inline unsigned __ballot_sync(unsigned mask, int predicate) {
    return static_cast<unsigned>(
        emulation::meet(emulation::meeting_kind::ballot, mask, static_cast<std::uint64_t>(predicate != 0), 0));
}
[[nodiscard]] inline int __any_sync(unsigned mask, int predicate) {
    return static_cast<int>(
        emulation::meet(emulation::meeting_kind::any, mask, static_cast<std::uint64_t>(predicate != 0), 0));
}
[[nodiscard]] inline int __all_sync(unsigned mask, int predicate) {
    return static_cast<int>(
        emulation::meet(emulation::meeting_kind::all, mask, static_cast<std::uint64_t>(predicate != 0), 0));
}
template <class T>
[[nodiscard]] unsigned __match_any_sync(unsigned mask, T value) {
    static_assert(std::is_integral_v<T>);
    return static_cast<unsigned>(
        emulation::meet(emulation::meeting_kind::match, mask, static_cast<std::uint64_t>(value), 0));
}
[[nodiscard]] inline unsigned __reduce_add_sync(unsigned mask, unsigned value) {
    return static_cast<unsigned>(emulation::meet(emulation::meeting_kind::add, mask, value, 0));
}
[[nodiscard]] inline unsigned __reduce_max_sync(unsigned mask, unsigned value) {
    return static_cast<unsigned>(emulation::meet(emulation::meeting_kind::maximum, mask, value, 0));
}
[[nodiscard]] inline unsigned __reduce_min_sync(unsigned mask, unsigned value) {
    return ~__reduce_max_sync(mask, ~value);
}
[[nodiscard]] inline unsigned __reduce_or_sync(unsigned mask, unsigned value) {
    return static_cast<unsigned>(emulation::meet(emulation::meeting_kind::disjunction, mask, value, 0));
}
// The set of active lanes is unknown here, so only the calling lane is returned.
[[nodiscard]] inline unsigned __activemask() { return 1u << threadIdx.x % 32; }

namespace emulation {
template <class T>
[[nodiscard]] T shuffle(unsigned mask, T value, unsigned from) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= 8);
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(T));
    bits = meet(meeting_kind::shuffle, mask, bits, from);
    std::memcpy(&value, &bits, sizeof(T));
    return value;
}
} // namespace emulation
template <class T>
[[nodiscard]] T __shfl_sync(unsigned mask, T value, int from, int width = 32) {
    const unsigned lane = threadIdx.x % 32, w = static_cast<unsigned>(width);
    return emulation::shuffle(mask, value, lane / w * w + static_cast<unsigned>(from) % w);
}
template <class T>
[[nodiscard]] T __shfl_up_sync(unsigned mask, T value, unsigned by, int width = 32) {
    const unsigned lane = threadIdx.x % 32, w = static_cast<unsigned>(width);
    return emulation::shuffle(mask, value, lane % w < by ? lane : lane - by);
}
template <class T>
[[nodiscard]] T __shfl_down_sync(unsigned mask, T value, unsigned by, int width = 32) {
    const unsigned lane = threadIdx.x % 32, w = static_cast<unsigned>(width);
    return emulation::shuffle(mask, value, lane % w + by < w ? lane + by : lane);
}
template <class T>
[[nodiscard]] T __shfl_xor_sync(unsigned mask, T value, int by, int width = 32) {
    const unsigned lane = threadIdx.x % 32, w = static_cast<unsigned>(width);
    const unsigned from = lane ^ static_cast<unsigned>(by);
    return emulation::shuffle(mask, value, from / w > lane / w ? lane : from);
}

// ---- atomic operations: each returns what was there
// ------------------------------------------------------------------

namespace emulation {
template <class T, class F>
T exchange(T* p, const F& f) {
    const T old = *p;
    *p = f(old);
    return old;
}
} // namespace emulation
template <class T>
T atomicAdd(T* p, std::type_identity_t<T> v) {
    if constexpr (std::is_signed_v<T> && std::is_integral_v<T>) {
        using bits = std::make_unsigned_t<T>; // wraps round
        return emulation::exchange(
            p, [&](T a) { return static_cast<T>(static_cast<bits>(static_cast<bits>(a) + static_cast<bits>(v))); });
    } else {
        return emulation::exchange(p, [&](T a) { return static_cast<T>(a + v); });
    }
}
template <class T>
T atomicSub(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return static_cast<T>(a - v); });
}
template <class T>
T atomicMin(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return v < a ? v : a; });
}
template <class T>
T atomicMax(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return a < v ? v : a; });
}
template <class T>
T atomicAnd(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return static_cast<T>(a & v); });
}
template <class T>
T atomicOr(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return static_cast<T>(a | v); });
}
template <class T>
T atomicXor(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return static_cast<T>(a ^ v); });
}
template <class T>
T atomicExch(T* p, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T) { return v; });
}
template <class T>
T atomicCAS(T* p, std::type_identity_t<T> expected, std::type_identity_t<T> v) {
    return emulation::exchange(p, [&](T a) { return a == expected ? v : a; });
}

// ---- PTX: what translate.py puts in the place of inline assembly
// ------------------------------------------------------

namespace emulation::ptx {
template <class T>
[[nodiscard]] T* global(std::uint64_t address) {
    return reinterpret_cast<T*>(address); // NOLINT(performance-no-int-to-ptr)
}
template <class T>
[[nodiscard]] T* shared(std::uint32_t address) {
    return static_cast<T*>(shared_pointer(address));
}
inline void red_or_b32(std::uint64_t p, std::uint32_t v) { *global<std::uint32_t>(p) |= v; }
inline void red_and_b32(std::uint64_t p, std::uint32_t v) { *global<std::uint32_t>(p) &= v; }
inline void red_or_b32_where(std::uint64_t p, std::uint32_t v) {
    if (v != 0) red_or_b32(p, v);
}
inline void red_and_b32_where(std::uint64_t p, std::uint32_t wanted, std::uint32_t v) {
    if (wanted != 0) red_and_b32(p, v);
}
inline void red_add_f32(std::uint64_t p, float v) { *global<float>(p) += v; }
inline void red_add_f64(std::uint64_t p, double v) { *global<double>(p) += v; }
inline void red_add_f32_where(std::uint64_t p, float v, std::uint32_t wanted) {
    if (wanted != 0) red_add_f32(p, v);
}
inline void red_add_f64_where(std::uint64_t p, double v, std::uint32_t wanted) {
    if (wanted != 0) red_add_f64(p, v);
}
inline void red_add_u32(std::uint64_t p, std::uint32_t v) { *global<std::uint32_t>(p) += v; }
inline void red_add_u64(std::uint64_t p, std::uint64_t v) { *global<std::uint64_t>(p) += v; }
template <class T>
void atom_increment_u32(T& old, std::uint64_t p) {
    old = static_cast<T>((*global<std::uint32_t>(p))++);
}
template <class T>
void atom_increment_u64(T& old, std::uint64_t p) {
    old = static_cast<T>((*global<std::uint64_t>(p))++);
}
inline void ld_u32(std::uint32_t& v, std::uint64_t p) { v = *global<std::uint32_t>(p); }
inline void ld_u64(unsigned long long& v, std::uint64_t p) { v = *global<std::uint64_t>(p); }
inline void st_u32(std::uint64_t p, std::uint32_t v) { *global<std::uint32_t>(p) = v; }
inline void st_u64(std::uint64_t p, std::uint64_t v) { *global<std::uint64_t>(p) = v; }
inline void atom_shared_cas_b32(std::uint32_t& old, std::uint32_t p, std::uint32_t expected, std::uint32_t v) {
    old = atomicCAS(shared<std::uint32_t>(p), expected, v);
}
inline void red_shared_or_b32_second(std::uint32_t p, std::uint32_t v) { shared<std::uint32_t>(p)[1] |= v; }
inline void mov_u32(std::uint32_t& to, std::uint32_t from) { to = from; }
inline void st_shared_u32(std::uint32_t p, std::uint32_t v) { *shared<std::uint32_t>(p) = v; }
inline void ld_shared_u32(std::uint32_t& v, std::uint32_t p) { v = *shared<std::uint32_t>(p); }
// Copies at once, so that there is nothing to wait for.
inline void cp_async_4(std::uint32_t to, std::uint64_t from) {
    *shared<std::uint32_t>(to) = *global<std::uint32_t>(from);
}
inline void cp_async_16(std::uint32_t to, std::uint64_t from) { *shared<uint4>(to) = *global<uint4>(from); }
inline void cp_async_wait_all() {}
template <class T>
void keep(T&) {} // an empty statement that the compiler must not see through
} // namespace emulation::ptx
