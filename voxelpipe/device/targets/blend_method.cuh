// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How a target's fragments are combined on the device: the words of values, including user-defined blends and,
// component by component, vectors (targets/shared_blend.cuh has scalars); and those of bits.

#include <voxelpipe/device/targets/shared_blend.cuh>

#include <cstdint>
#include <cstring>
#include <type_traits>

namespace voxelpipe::device {

// ---- accumulators wider than their value ----------------------------------------------------------------------------
//
// Component by component, in shared memory: exact sums of packed formats, means, and the extrema of formats that are
// packed once at the end. core::blend_traits says which (formats/packed_blend.hpp); nothing here names a format.

// Traits with `lanes` sum components; traits with `lane_blend` compare them as floats.
template <class Blend, class S>
inline constexpr bool sums_lanes = requires {
    core::blend_traits<Blend, S>::lanes::log2_quantum;
};
template <class Blend, class S>
inline constexpr bool compares_lanes = requires {
    typename core::blend_traits<Blend, S>::lane_blend;
};

struct lane_sum_traits {
    using accumulator = core::wide_sum<1>;
};

// The sums of all components, then, for the mean, one word that counts fragments.
template <class Blend, class S>
requires sums_lanes<Blend, S>
struct scalar_blend<Blend, S> {
    using traits = core::blend_traits<Blend, S>;
    using format = typename traits::lanes;
    using cell = typename traits::accumulator;
    using part = wide_sum_blend<lane_sum_traits, float>;
    static constexpr bool available = true;
    static constexpr bool counts = std::is_same_v<Blend, blend::mean>;
    static constexpr int count_word = format::lanes * part::words;
    static constexpr int words = count_word + (counts ? 1 : 0);

    __device__ static void clear(word* plane, int i, int n) {
        for (int k = 0; k < words; ++k) plane[k * n + i] = 0;
    }
    template <class Value>
    __device__ static void accumulate(word* plane, int i, int n, const Value& v) {
        for (int c = 0; c < format::lanes; ++c) {
            core::wide_sum<1> term{};
            format::add(term, v, c);
            part::add(plane + c * part::words * n, i, n, term);
        }
        if constexpr (counts) atomicAdd(plane + count_word * n + i, 1u);
    }
    __device__ static cell load(const word* plane, int i, int n) {
        cell r{};
        for (int c = 0; c < format::lanes; ++c) r.c[c] = part::load(plane + c * part::words * n, i, n);
        if constexpr (counts) r.count = plane[count_word * n + i];
        return r;
    }
    template <class Value>
    __device__ static cell cell_of(const Value& v) {
        cell r{};
        traits::apply(r, v);
        return r;
    }
    __device__ static void merge(cell& a, const cell& b) { core::add_sum(a, b); }
    __device__ static S finish(const cell& c, const S& stored) {
        cell all = c;
        core::add_sum(all, traits::begin(stored));
        return traits::end(all);
    }
};

template <class Blend, class S>
requires compares_lanes<Blend, S>
struct scalar_blend<Blend, S> {
    using traits = core::blend_traits<Blend, S>;
    using part = scalar_blend<Blend, float>;
    static constexpr bool available = true;
    static constexpr int lanes = S::lanes, words = lanes * part::words;
    struct cell {
        typename part::cell c[lanes];
    };

    __device__ static void clear(word* plane, int i, int n) {
        for (int c = 0; c < lanes; ++c) part::clear(plane + c * part::words * n, i, n);
    }
    __device__ static void accumulate(word* plane, int i, int n, const S& v) {
        for (int c = 0; c < lanes; ++c) part::accumulate(plane + c * part::words * n, i, n, v.component(c));
    }
    __device__ static cell load(const word* plane, int i, int n) {
        cell r;
        for (int c = 0; c < lanes; ++c) r.c[c] = part::load(plane + c * part::words * n, i, n);
        return r;
    }
    __device__ static cell cell_of(const S& v) {
        cell r;
        for (int c = 0; c < lanes; ++c) r.c[c] = part::cell_of(v.component(c));
        return r;
    }
    __device__ static void merge(cell& a, const cell& b) {
        for (int c = 0; c < lanes; ++c) part::merge(a.c[c], b.c[c]);
    }
    __device__ static S finish(const cell& r, const S& stored) {
        typename traits::accumulator all = traits::begin(stored);
        for (int c = 0; c < lanes; ++c) all.c[c] = part::finish(r.c[c], all.c[c]);
        return traits::end(all);
    }
};

// ---- methods --------------------------------------------------------------------------------------------------------

// How a target's fragments are combined on the device.
enum class blend_method : std::uint8_t {
    atomic,  // value_blend's words
    bits,    // one bit a voxel
    winner,  // replace: the highest primitive wins a word; its fragment is shaded again at the end
    ordered, // everything else: folded in primitive order through lists of fragments
};

// True for user-defined blends that are order-free, and for blends of packed words that say so, of at most 8 bytes:
// combined by compare-and-swap. combine(identity(), v) must be v.
template <class Blend, class T>
inline constexpr bool swaps_words = requires {
    core::blend_traits<Blend, T>::swaps;
};
template <class Blend, class T>
inline constexpr bool swaps = (core::user_blend<Blend, T> || core::user_blend_template<Blend, T> ||
                               swaps_words<Blend, T>)&&core::blend_traits<Blend, T>::order_free
                              && sizeof(T) <= 8;

template <class Blend, class T>
struct swap_blend {
    static constexpr bool available = true;
    static constexpr int words = sizeof(T) <= 4 ? 1 : 2;
    using traits = core::blend_traits<Blend, T>;
    using raw = std::conditional_t<words == 1, unsigned int, unsigned long long>;
    using cell = T;
    __device__ static raw to_raw(const T& v) {
        raw r = 0;
        memcpy(&r, &v, sizeof(T));
        return r;
    }
    __device__ static T from_raw(raw r) {
        T v;
        memcpy(&v, &r, sizeof(T));
        return v;
    }
    __device__ static raw* at(word* plane, int i) { return reinterpret_cast<raw*>(plane) + i; }
    __device__ static void clear(word* plane, int i, int) { *at(plane, i) = to_raw(traits::identity()); }
    __device__ static void accumulate(word* plane, int i, int, const T& v) {
        raw* const c = at(plane, i);
        raw old = *c, seen;
        do {
            seen = old;
            T value = from_raw(seen);
            traits::apply(value, v);
            old = atomicCAS(c, seen, to_raw(value));
        } while (old != seen);
    }
    __device__ static cell load(const word* plane, int i, int) { return from_raw(*at(const_cast<word*>(plane), i)); }
    __device__ static cell cell_of(const T& v) {
        T c = traits::identity();
        traits::apply(c, v);
        return c;
    }
    __device__ static void merge(cell& a, const cell& b) { traits::apply(a, b); }
    __device__ static T finish(const cell& c, T stored) {
        traits::apply(stored, c);
        return stored;
    }
};

// value_blend<Blend, T>: scalar_blend, component by component for vectors.
template <class Blend, class T>
struct value_blend : scalar_blend<Blend, T> {};
template <class Blend, class T>
requires swaps<Blend, T>
struct value_blend<Blend, T> : swap_blend<Blend, T> {
};
template <class Blend, glm::length_t N, class S, glm::qualifier Q>
requires(!core::user_blend<Blend, glm::vec<N, S, Q>> && !core::user_blend_template<Blend, glm::vec<N, S, Q>> &&
         (scalar_blend<Blend, S>::available || swaps<Blend, S>)) struct value_blend<Blend, glm::vec<N, S, Q>> {
    using part = value_blend<Blend, S>;
    using vector = glm::vec<N, S, Q>;
    static constexpr bool available = true;
    static constexpr int words = part::words * N;
    struct cell {
        typename part::cell c[N];
    };
    __device__ static void clear(word* plane, int i, int n) {
        for (int c = 0; c < N; ++c) part::clear(plane + c * part::words * n, i, n);
    }
    template <class Value>
    __device__ static void accumulate(word* plane, int i, int n, const Value& v) {
        for (int c = 0; c < N; ++c) {
            if constexpr (std::is_same_v<Blend, blend::count>)
                part::accumulate(plane + c * part::words * n, i, n, v);
            else
                part::accumulate(plane + c * part::words * n, i, n, v[c]);
        }
    }
    __device__ static cell load(const word* plane, int i, int n) {
        cell r;
        for (int c = 0; c < N; ++c) r.c[c] = part::load(plane + c * part::words * n, i, n);
        return r;
    }
    template <class Value>
    __device__ static cell cell_of(const Value& v) {
        cell r;
        for (int c = 0; c < N; ++c) {
            if constexpr (std::is_same_v<Blend, blend::count>)
                r.c[c] = part::cell_of(v);
            else
                r.c[c] = part::cell_of(v[c]);
        }
        return r;
    }
    __device__ static void merge(cell& a, const cell& b) {
        for (int c = 0; c < N; ++c) part::merge(a.c[c], b.c[c]);
    }
    __device__ static vector finish(const cell& r, vector stored) {
        for (int c = 0; c < N; ++c) stored[c] = part::finish(r.c[c], stored[c]);
        return stored;
    }
};

// Bits: what a fragment of value v does to the voxel's bit, as an or, and, or xor of a word.
template <class Blend>
struct bit_blend {
    static constexpr bool is_and = std::is_same_v<Blend, blend::bit_and>;
    static constexpr bool is_or = std::is_same_v<Blend, blend::bit_or> || std::is_same_v<Blend, blend::add_saturate>;
    static constexpr bool is_xor = std::is_same_v<Blend, blend::bit_xor> || std::is_same_v<Blend, blend::add> ||
                                   std::is_same_v<Blend, blend::count>;
    // min and max of bool are and and or.
    static constexpr bool clears = is_and || std::is_same_v<Blend, blend::min>;
    static constexpr bool sets = is_or || std::is_same_v<Blend, blend::max>;
    static constexpr bool available = clears || sets || is_xor;
    static constexpr word neutral = clears ? ~word{0} : 0;

    template <class Value>
    __device__ static void accumulate(word* w, word mask, const Value& v) {
        bool value = true;
        if constexpr (!std::is_same_v<Blend, blend::count>) value = v;
        if constexpr (clears) {
            if (!value && (*w & mask) != 0) atomicAnd(w, ~mask);
        } else if constexpr (sets) {
            if (value && (*w & mask) != mask) atomicOr(w, mask); // most fragments find their bits set
        } else {
            if (value) atomicXor(w, mask);
        }
    }
    __device__ static void merge(word& a, word b) {
        if constexpr (clears)
            a &= b;
        else if constexpr (sets)
            a |= b;
        else
            a ^= b;
    }
};

template <class Target>
[[nodiscard]] VOXELPIPE_HD constexpr blend_method method_of() {
    using blend_type = typename Target::blend_type;
    if constexpr (std::is_same_v<blend_type, blend::replace>)
        return blend_method::winner;
    else if constexpr (Target::map::is_bit)
        return bit_blend<blend_type>::available ? blend_method::bits : blend_method::ordered;
    else
        return value_blend<blend_type, typename Target::value_type>::available ? blend_method::atomic
                                                                               : blend_method::ordered;
}

} // namespace voxelpipe::device
