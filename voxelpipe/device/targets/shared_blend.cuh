// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blending in shared memory: for every (blend, scalar type) the words that a voxel of a tile holds, an atomic that adds
// a fragment, an exact merge of two partial results, and the final value. The words are order-free, so any order of
// fragments, blocks and merges ends in the bits that core/blend's fold in triangle order defines.
//
// Words of 32 bits lie in planes: one word of every voxel of the tile, then the next. Native 32-bit shared-memory
// atomics serve wherever the blend allows (64-bit ones are compare-and-swap loops); floats become integers of the same
// order.

#include <voxelpipe/blend.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/device/base/warp.cuh>

#include <cstdint>
#include <limits>
#include <type_traits>

namespace voxelpipe::device {

// A plane of words, aligned to 8 bytes, as 64-bit cells.
template <class Cell>
[[nodiscard]] __device__ VOXELPIPE_INLINE Cell* as_cells(word* plane) {
    static_assert(sizeof(Cell) == 8);
    return reinterpret_cast<Cell*>(plane);
}
template <class Cell>
[[nodiscard]] __device__ VOXELPIPE_INLINE const Cell* as_cells(const word* plane) {
    static_assert(sizeof(Cell) == 8);
    return reinterpret_cast<const Cell*>(plane);
}

// scalar_blend<Blend, S>: available (an atomic exists), words per voxel, and for a tile of n voxels
//   clear(plane, i, n)   accumulate(plane, i, n, value)   cell load(plane, i, n)   merge(cell&, cell)
//   finish(cell, stored)   cell cell_of(value), of one fragment
template <class Blend, class S>
struct scalar_blend {
    static constexpr bool available = false;
};

// ---- min and max ----------------------------------------------------------------------------------------------------

// Maps values to integers of the same order, 32 or 64 bits, and back.
template <class S>
struct key_map {
    using key = std::conditional_t<
        sizeof(S) == 8, std::conditional_t<core::is_floating<S> || std::is_signed_v<S>, long long, unsigned long long>,
        std::conditional_t<core::is_floating<S> || std::is_signed_v<S>, int, unsigned>>;
    __device__ static key to_key(S v) {
        if constexpr (core::is_floating<S>)
            return static_cast<key>(core::order_key(v));
        else
            return static_cast<key>(v);
    }
    __device__ static S from_key(key k) {
        if constexpr (core::is_floating<S>) {
            using bits = typename core::float_bits<S>::type;
            constexpr bits absolute = static_cast<bits>(~bits{0}) >> 1;
            const auto raw = static_cast<bits>(k);
            return core::bit_cast<S>(static_cast<bits>(k < 0 ? raw ^ absolute : raw));
        } else {
            return static_cast<S>(k);
        }
    }
};

template <class Blend, class S>
struct extremum {
    static constexpr bool available = true;
    static constexpr int words = sizeof(S) == 8 ? 2 : 1;
    static constexpr bool is_min = std::is_same_v<Blend, blend::min>;
    using map = key_map<S>;
    using cell = typename map::key;
    __device__ static cell neutral() { return is_min ? core::greatest<cell> : core::lowest<cell>; }
    __device__ static cell* at(word* plane, int i) {
        if constexpr (words == 2)
            return as_cells<cell>(plane) + i;
        else
            return reinterpret_cast<cell*>(plane) + i; // int and unsigned may alias
    }
    __device__ static void clear(word* plane, int i, int) { *at(plane, i) = neutral(); }
    __device__ static cell load(const word* plane, int i, int) { return *at(const_cast<word*>(plane), i); }
    __device__ static void accumulate(word* plane, int i, int, S v) {
        cell* const c = at(plane, i);
        const cell k = map::to_key(v);
        if constexpr (is_min)
            atomicMin(c, k);
        else
            atomicMax(c, k);
    }
    __device__ static cell cell_of(S v) { return map::to_key(v); }
    __device__ static void merge(cell& a, cell b) { a = is_min ? (b < a ? b : a) : (a < b ? b : a); }
    __device__ static S finish(cell c, S stored) {
        core::blend_traits<Blend, S>::apply(stored, map::from_key(c));
        return stored;
    }
};
template <class S>
requires(core::is_integer<S> || core::is_floating<S>) struct scalar_blend<blend::min, S> : extremum<blend::min, S> {
};
template <class S>
requires(core::is_integer<S> || core::is_floating<S>) struct scalar_blend<blend::max, S> : extremum<blend::max, S> {
};

// ---- bitwise and wrapping -------------------------------------------------------------------------------------------

// Bits do not affect each other, so a 64-bit value is two words with one operation each.
template <class Blend, class S>
struct bitwise {
    static constexpr bool available = true;
    static constexpr int words = sizeof(S) == 8 ? 2 : 1;
    using cell = std::conditional_t<words == 2, std::uint64_t, word>;
    static constexpr word neutral = std::is_same_v<Blend, blend::bit_and> ? ~word{0} : 0;
    __device__ static void one(word* w, word v) {
        if constexpr (std::is_same_v<Blend, blend::bit_and>)
            atomicAnd(w, v);
        else if constexpr (std::is_same_v<Blend, blend::bit_or>)
            atomicOr(w, v);
        else
            atomicXor(w, v);
    }
    __device__ static void clear(word* plane, int i, int n) {
        for (int k = 0; k < words; ++k) plane[k * n + i] = neutral;
    }
    __device__ static void accumulate(word* plane, int i, int n, S v) {
        for (int k = 0; k < words; ++k) one(plane + k * n + i, static_cast<word>(static_cast<cell>(v) >> (k * 32)));
    }
    __device__ static cell load(const word* plane, int i, int n) {
        if constexpr (words == 2)
            return plane[i] | (static_cast<cell>(plane[n + i]) << 32);
        else
            return plane[i];
    }
    __device__ static cell cell_of(S v) { return static_cast<cell>(v); }
    __device__ static void merge(cell& a, cell b) { core::blend_traits<Blend, cell>::apply(a, b); }
    __device__ static S finish(cell c, S stored) {
        core::blend_traits<Blend, S>::apply(stored, static_cast<S>(c));
        return stored;
    }
};
template <class S>
requires core::is_integer<S>
struct scalar_blend<blend::bit_and, S> : bitwise<blend::bit_and, S> {
};
template <class S>
requires core::is_integer<S>
struct scalar_blend<blend::bit_or, S> : bitwise<blend::bit_or, S> {
};
template <class S>
requires core::is_integer<S>
struct scalar_blend<blend::bit_xor, S> : bitwise<blend::bit_xor, S> {
};

// Adds modulo 2^64 to two words with a carry: two native atomics instead of a compare-and-swap loop.
__device__ VOXELPIPE_INLINE void add_two_words(word* plane, int i, int n, std::uint64_t v) {
    const auto low = static_cast<word>(v);
    const word old = low != 0 ? atomicAdd(plane + i, low) : 0;
    const word high = static_cast<word>(v >> 32) + static_cast<word>(low != 0 && old + low < low);
    if (high != 0) atomicAdd(plane + n + i, high);
}
[[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t load_two_words(const word* plane, int i, int n) {
    return plane[i] | (static_cast<std::uint64_t>(plane[n + i]) << 32);
}

template <class S>
requires core::is_integer<S>
struct scalar_blend<blend::add, S> {
    static constexpr bool available = true;
    static constexpr int words = sizeof(S) == 8 ? 2 : 1;
    using cell = std::conditional_t<words == 2, std::uint64_t, word>;
    __device__ static void clear(word* plane, int i, int n) {
        for (int k = 0; k < words; ++k) plane[k * n + i] = 0;
    }
    __device__ static void accumulate(word* plane, int i, int n, S v) {
        if constexpr (words == 2)
            add_two_words(plane, i, n, static_cast<std::uint64_t>(v));
        else
            atomicAdd(plane + i, static_cast<word>(v));
    }
    __device__ static cell load(const word* plane, int i, int n) {
        if constexpr (words == 2)
            return load_two_words(plane, i, n);
        else
            return plane[i];
    }
    __device__ static cell cell_of(S v) { return static_cast<cell>(v); }
    __device__ static void merge(cell& a, cell b) { a += b; }
    __device__ static S finish(cell c, S stored) {
        core::blend_traits<blend::add, S>::apply(stored, static_cast<S>(c));
        return stored;
    }
};

// A voxel has fewer than 2^32 fragments in one work item, so one word counts them for any type.
template <class S>
requires core::is_integer<S>
struct scalar_blend<blend::count, S> {
    static constexpr bool available = true;
    static constexpr int words = 1;
    using cell = std::uint64_t;
    __device__ static void clear(word* plane, int i, int) { plane[i] = 0; }
    template <class Any>
    __device__ static void accumulate(word* plane, int i, int, const Any&) {
        atomicAdd(plane + i, 1u);
    }
    __device__ static cell load(const word* plane, int i, int) { return plane[i]; }
    template <class Any>
    __device__ static cell cell_of(const Any&) {
        return 1;
    }
    __device__ static void merge(cell& a, cell b) { a += b; }
    __device__ static S finish(cell c, S stored) {
        core::blend_traits<blend::add, S>::apply(stored, static_cast<S>(c));
        return stored;
    }
};

// ---- exact sums -----------------------------------------------------------------------------------------------------

// core::wide_sum as words: the limbs, then one word with the top (29 bits: a work item has fewer than 2^28 fragments a
// voxel) and the three marks. core's own function turns a term into limbs. Carries and marks are rare, so a fragment
// costs about two native atomics a limb.
template <class Traits, class S>
struct wide_sum_blend {
    using cell = typename Traits::accumulator;
    static constexpr int limbs = sizeof(cell{}.limb) / 8;
    static constexpr bool available = true;
    static constexpr int words = 2 * limbs + 1;
    static constexpr int mark_bits = 3;

    __device__ static void clear(word* plane, int i, int n) {
        for (int k = 0; k < words; ++k) plane[k * n + i] = 0;
    }
    __device__ static void accumulate(word* plane, int i, int n, S v) {
        cell term{};
        Traits::apply(term, v);
        add(plane, i, n, term);
    }
    // Adds a sum with a top of 29 bits.
    __device__ static void add(word* plane, int i, int n, const cell& term) {
        word carry = 0;
#pragma unroll
        for (int k = 0; k < 2 * limbs; ++k) {
            const auto part = static_cast<word>(term.limb[k / 2] >> (k % 2 * 32));
            const word add = part + carry; // wraps only if part is all ones: then the carry moves on
            const word passed = static_cast<word>(add < part);
            const word old = add != 0 ? atomicAdd(plane + k * n + i, add) : 0;
            carry = passed + static_cast<word>(add != 0 && old + add < add);
        }
        const word top = static_cast<word>(term.top) + carry;
        if (top != 0) atomicAdd(plane + 2 * limbs * n + i, top << mark_bits);
        if (term.marks != 0) atomicOr(plane + 2 * limbs * n + i, term.marks);
    }
    __device__ static cell load(const word* plane, int i, int n) {
        cell c;
        for (int k = 0; k < limbs; ++k) c.limb[k] = load_two_words(plane + 2 * k * n, i, n);
        const word last = plane[2 * limbs * n + i];
        c.top = static_cast<std::int32_t>(last) >> mark_bits;
        c.marks = last & ((1u << mark_bits) - 1);
        return c;
    }
    __device__ static cell cell_of(S v) {
        cell c{};
        Traits::apply(c, v);
        return c;
    }
    __device__ static void merge(cell& a, const cell& b) {
        std::uint64_t carry = 0;
        for (int k = 0; k < limbs; ++k) {
            const std::uint64_t add = b.limb[k] + carry;
            const std::uint64_t passed = add < carry ? 1 : 0;
            a.limb[k] += add;
            carry = passed + (a.limb[k] < add ? 1 : 0);
        }
        a.top += b.top + static_cast<std::int32_t>(carry);
        a.marks |= b.marks;
    }
    __device__ static S finish(const cell& c, S stored) {
        cell all = Traits::begin(stored);
        merge(all, c);
        return Traits::end(all);
    }
};
template <class S>
requires core::is_floating<S>
struct scalar_blend<blend::add, S> : wide_sum_blend<core::blend_traits<blend::add, S>, S> {
};
template <int Log2Quantum>
struct scalar_blend<blend::add_quantum<Log2Quantum>, float>
    : wide_sum_blend<core::blend_traits<blend::add_quantum<Log2Quantum>, float>, float> {};
template <class S>
requires(core::is_integer<S>&& std::is_signed_v<S>) struct scalar_blend<blend::add_saturate, S>
    : wide_sum_blend<core::blend_traits<blend::add_saturate, S>, S> {
};

// Unsigned saturation: the exact sum of up to 2^32 terms of 32 bits fits 64 bits; 64-bit terms are clamped at each
// step.
template <class S>
requires(core::is_integer<S>&& std::is_unsigned_v<S>) struct scalar_blend<blend::add_saturate, S> {
    static constexpr bool available = true;
    static constexpr int words = 2;
    using cell = std::uint64_t;
    __device__ static cell plus(cell a, cell b) { return a + b < a ? ~cell{0} : a + b; }
    __device__ static void clear(word* plane, int i, int n) {
        if constexpr (sizeof(S) == 8)
            as_cells<unsigned long long>(plane)[i] = 0;
        else
            plane[i] = plane[n + i] = 0;
    }
    __device__ static void accumulate(word* plane, int i, int n, S v) {
        if constexpr (sizeof(S) == 8) {
            unsigned long long* const c = as_cells<unsigned long long>(plane) + i;
            unsigned long long old = *c, seen;
            do {
                seen = old;
                if (plus(seen, v) == seen) break;
                old = atomicCAS(c, seen, static_cast<unsigned long long>(plus(seen, v)));
            } while (old != seen);
        } else {
            add_two_words(plane, i, n, v);
        }
    }
    __device__ static cell load(const word* plane, int i, int n) {
        if constexpr (sizeof(S) == 8)
            return as_cells<unsigned long long>(plane)[i];
        else
            return load_two_words(plane, i, n);
    }
    __device__ static cell cell_of(S v) { return v; }
    __device__ static void merge(cell& a, cell b) { a = plus(a, b); }
    __device__ static S finish(cell c, S stored) {
        const cell sum = plus(c, stored);
        return sum > core::greatest<S> ? core::greatest<S> : static_cast<S>(sum);
    }
};

// ---- sums in any order ----------------------------------------------------------------------------------------------

// half is summed in float and rounded once.
template <class S>
requires core::is_floating<S>
struct scalar_blend<blend::add_unordered, S> {
    static constexpr bool available = true;
    static constexpr int words = sizeof(S) == 8 ? 2 : 1;
    using cell = std::conditional_t<sizeof(S) == 8, double, float>;
    __device__ static cell* at(word* plane, int i) { return reinterpret_cast<cell*>(plane) + i; }
    __device__ static void clear(word* plane, int i, int) { *at(plane, i) = 0; }
    __device__ static void accumulate(word* plane, int i, int, S v) { atomicAdd(at(plane, i), static_cast<cell>(v)); }
    __device__ static cell load(const word* plane, int i, int) { return *at(const_cast<word*>(plane), i); }
    __device__ static cell cell_of(S v) { return static_cast<cell>(v); }
    __device__ static void merge(cell& a, cell b) { a += b; }
    __device__ static S finish(cell c, S stored) {
        return core::canonical(static_cast<S>(static_cast<cell>(stored) + c));
    }
};

} // namespace voxelpipe::device
