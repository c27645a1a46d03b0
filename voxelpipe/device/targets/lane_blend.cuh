// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blends whose accumulator is wider than their value, component by component, in shared memory: exact sums of packed
// formats, means, and the extrema of formats that are packed once at the end. core::blend_traits says which
// (formats/packed_blend.hpp); nothing here names a format.

#include <voxelpipe/device/targets/shared_blend.cuh>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::device {

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

} // namespace voxelpipe::device
