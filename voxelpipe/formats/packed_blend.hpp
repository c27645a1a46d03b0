// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blends of packed formats, component by component: min, max, add and add_saturate, which are the same here, and the
// mean. Where a step on the word gives the defined result in any order, the word is the accumulator. Otherwise the
// components are accumulated exactly and packed once, at the end (docs/guide.md, "Packed formats").

#include <voxelpipe/blend.hpp>
#include <voxelpipe/formats/exact_number.hpp>
#include <voxelpipe/formats/normalized.hpp>
#include <voxelpipe/formats/packed_floats.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

// ---- components -----------------------------------------------------------------------------------------------------

// Exact sums of the components of a format; log2_quantum is the unit of their terms.
template <int Lanes>
struct lane_sums {
    wide_sum<1> c[std::size_t{Lanes}];
};
template <int Lanes>
VOXELPIPE_HD void add_sum(lane_sums<Lanes>& a, const lane_sums<Lanes>& b) {
    for (int i = 0; i < Lanes; ++i) add_sum(a.c[i], b.c[i]);
}

// The same with the number of terms, and the value that a voxel keeps that gets none. Where sums are added, that of the
// second stays: stored values come last.
template <int Lanes>
struct lane_means {
    wide_sum<1> c[std::size_t{Lanes}];
    std::uint32_t count, kept_high, kept_low;
    std::uint32_t unused;
};
template <int Lanes>
VOXELPIPE_HD void add_sum(lane_means<Lanes>& a, const lane_means<Lanes>& b) {
    for (int i = 0; i < Lanes; ++i) add_sum(a.c[i], b.c[i]);
    a.count += b.count;
    a.kept_high = b.kept_high;
    a.kept_low = b.kept_low;
}

// Least or greatest components, as floats.
template <class Blend, int Lanes>
struct lane_extrema {
    float c[std::size_t{Lanes}];
};
template <class Blend, int Lanes>
VOXELPIPE_HD void add_sum(lane_extrema<Blend, Lanes>& a, const lane_extrema<Blend, Lanes>& b) {
    for (int i = 0; i < Lanes; ++i) blend_traits<Blend, float>::apply(a.c[i], b.c[i]);
}

// lane_format<T>: what sums of T's components are made of.
//   lanes, log2_quantum      number of components; exponent of the unit of a sum
//   add(sum, value, i)       adds component i of a T, or of a wide value, which is moved into T's range and not rounded
//   nearest(sums, n)         the T nearest to the sums over n, n > 0
template <class T>
struct lane_format;

template <bool Signed, int... Bits>
struct lane_format<normalized<Signed, Bits...>> {
    using format = normalized<Signed, Bits...>;
    static constexpr int lanes = format::lanes;
    static constexpr int log2_quantum = -40; // of a code
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const format& v, int i) {
        add_term(sum, static_cast<std::int64_t>(static_cast<std::uint64_t>(v.canonical().code(i)) << -log2_quantum));
    }
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const typename format::wide_type& v, int i) {
        add_term(sum, nearest_code<Signed>(v[i], format::greatest_code(i), -log2_quantum));
    }
    [[nodiscard]] VOXELPIPE_HD static format nearest(const wide_sum<1>* sums, std::uint32_t n) {
        format v = format::from_bits(0);
        for (int i = 0; i < lanes; ++i) {
            const exact_number mean = mean_of(sums[i], log2_quantum, n);
            const auto code = static_cast<std::int64_t>(mean.in_units(0)); // below 2^48
            v.set_code(i, mean.negative ? -code : code);
        }
        return v;
    }
};

template <>
struct lane_format<float11_11_10> {
    static constexpr int lanes = 3, log2_quantum = sum_format<float>::log2_quantum;
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const float11_11_10& v, int i) { add_float<log2_quantum>(sum, v.component(i)); }
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const glm::vec3& v, int i) {
        const float greatest = i < 2 ? 65024.0f : 64512.0f;
        float inside = v[i];
        if (inside <= 0) inside = 0;
        if (inside > greatest && inside <= 3.4028234663852886e38f) inside = greatest; // infinity stays
        add_float<log2_quantum>(sum, inside);
    }
    [[nodiscard]] VOXELPIPE_HD static float11_11_10 nearest(const wide_sum<1>* sums, std::uint32_t n) {
        auto v = float11_11_10::from_bits(0);
        for (int i = 0; i < lanes; ++i) v.set(i, mean_of(sums[i], log2_quantum, n));
        return v;
    }
};

template <>
struct lane_format<rgb9e5> {
    static constexpr int lanes = 3, log2_quantum = sum_format<float>::log2_quantum;
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const rgb9e5& v, int i) { add_float<log2_quantum>(sum, v.component(i)); }
    VOXELPIPE_HD
    static void add(wide_sum<1>& sum, const glm::vec3& v, int i) {
        const float inside = v[i] > 65408.0f ? 65408.0f : v[i] > 0 ? v[i] : 0.0f; // 0 for a NaN
        add_float<log2_quantum>(sum, inside);
    }
    [[nodiscard]] VOXELPIPE_HD static rgb9e5 nearest(const wide_sum<1>* sums, std::uint32_t n) {
        return rgb9e5::nearest(mean_of(sums[0], log2_quantum, n), mean_of(sums[1], log2_quantum, n),
                               mean_of(sums[2], log2_quantum, n));
    }
};

// Floating types are formats of one component, for the mean.
template <class T>
requires(std::is_same_v<T, half> || std::is_same_v<T, bfloat16> || std::is_same_v<T, float>) struct lane_format<T> {
    static constexpr int lanes = 1, log2_quantum = sum_format<float>::log2_quantum;
    template <class Value>
    VOXELPIPE_HD static void add(wide_sum<1>& sum, const Value& v, int) {
        add_float<log2_quantum>(sum, static_cast<float>(v));
    }
    [[nodiscard]] VOXELPIPE_HD static T nearest(const wide_sum<1>* sums, std::uint32_t n) {
        using bits = typename float_bits<T>::type;
        constexpr int mantissa = std::is_same_v<T, float> ? 23 : std::is_same_v<T, half> ? 10 : 7;
        constexpr int exponent = std::is_same_v<T, half> ? 5 : 8;
        const exact_number mean = mean_of(sums[0], log2_quantum, n);
        if (mean.is_nan()) return core::bit_cast<T>(float_bits<T>::nan);
        constexpr auto sign = static_cast<bits>(bits{1} << (mantissa + exponent));
        const bits magnitude =
            mean.is_infinite()
                ? float_bits<T>::infinity
                : static_cast<bits>(exact::round_to_binary(mean.magnitude, mean.exponent, mantissa, exponent));
        return core::bit_cast<T>(static_cast<bits>(mean.negative ? magnitude | sign : magnitude));
    }
};

// ---- on the word ----------------------------------------------------------------------------------------------------

template <class Blend>
inline constexpr bool is_packed_sum = std::is_same_v<Blend, blend::add> || std::is_same_v<Blend, blend::add_saturate>;
template <class Blend>
inline constexpr bool is_extremum = std::is_same_v<Blend, blend::min> || std::is_same_v<Blend, blend::max>;

// min and max of codes that have the order of their values. `compared` are components, each of which is left alone or
// taken over.
template <class Blend, class T>
struct word_extremum : in_place_blend<T> {
    static constexpr bool swaps = true; // a GPU may compare and swap the word
    VOXELPIPE_HD
    static void apply(T& a, const T& v) {
        const T other = v.canonical();
        for (int i = 0; i < T::lanes; ++i)
            if (std::is_same_v<Blend, blend::min> ? other.code(i) < a.code(i) : a.code(i) < other.code(i))
                a.set_code(i, other.code(i));
    }
};
template <class Blend, bool Signed, int... Bits>
requires is_extremum<Blend>
struct blend_traits<Blend, normalized<Signed, Bits...>> : word_extremum<Blend, normalized<Signed, Bits...>> {
    using format = normalized<Signed, Bits...>;
    VOXELPIPE_HD
    static format identity() {
        format v = format::from_bits(0);
        for (int i = 0; i < format::lanes; ++i) {
            const std::int32_t greatest = format::greatest_code(i);
            v.set_code(i, std::is_same_v<Blend, blend::min> ? greatest : -greatest);
        }
        return v;
    }
};
template <class Blend>
requires is_extremum<Blend>
struct blend_traits<Blend, float11_11_10> : word_extremum<Blend, float11_11_10> {
    VOXELPIPE_HD
    static float11_11_10 identity() {
        auto v = float11_11_10::from_bits(0);
        if constexpr (std::is_same_v<Blend, blend::min>)
            for (int i = 0; i < float11_11_10::lanes; ++i) v.set_code(i, float11_11_10::nan_code(i));
        return v;
    }
};

// Sums of fractions from 0 on only grow, so clamping at each step clamps the exact sum, in any order.
template <class Blend, int... Bits>
requires is_packed_sum<Blend>
struct blend_traits<Blend, normalized<false, Bits...>> : in_place_blend<normalized<false, Bits...>> {
    using format = normalized<false, Bits...>;
    static constexpr bool swaps = true;
    VOXELPIPE_HD
    static format identity() { return format::from_bits(0); }
    VOXELPIPE_HD
    static void apply(format& a, const format& v) {
        for (int i = 0; i < format::lanes; ++i) a.set_code(i, std::int64_t{a.code(i)} + v.code(i));
    }
};

// ---- by wide accumulators -------------------------------------------------------------------------------------------

// Sums that may shrink again (snorm), or that would be rounded at every step (floats): exact, packed once at the end.
template <class Blend, class T>
requires(is_packed_sum<Blend>&& is_packed<T>) struct blend_traits<Blend, T> {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using lanes = lane_format<T>;
    using accumulator = lane_sums<lanes::lanes>;
    VOXELPIPE_HD
    static T identity() { return T::from_bits(0); }
    VOXELPIPE_HD
    static accumulator begin(const T& stored) {
        accumulator a{};
        apply(a, stored);
        return a;
    }
    VOXELPIPE_HD
    static void apply(accumulator& a, const T& v) {
        for (int i = 0; i < lanes::lanes; ++i) lanes::add(a.c[i], v, i);
    }
    VOXELPIPE_HD
    static T end(const accumulator& a) { return lanes::nearest(a.c, 1); }
};

// A greater component takes the exponent of all with it, so rgb9e5 compares floats and packs them once at the end.
template <class Blend>
requires is_extremum<Blend>
struct blend_traits<Blend, rgb9e5> {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using lane_blend = blend_traits<Blend, float>;
    using accumulator = lane_extrema<Blend, rgb9e5::lanes>;
    VOXELPIPE_HD
    static rgb9e5 identity() { return rgb9e5::from_bits(std::is_same_v<Blend, blend::min> ? 0xffffffffu : 0u); }
    VOXELPIPE_HD
    static accumulator begin(const rgb9e5& stored) {
        return {{stored.component(0), stored.component(1), stored.component(2)}};
    }
    VOXELPIPE_HD
    static void apply(accumulator& a, const rgb9e5& v) {
        for (int i = 0; i < rgb9e5::lanes; ++i) lane_blend::apply(a.c[i], v.component(i));
    }
    VOXELPIPE_HD
    static rgb9e5 end(const accumulator& a) { return rgb9e5(glm::vec3(a.c[0], a.c[1], a.c[2])); }
};

// The mean of a call's fragments. A voxel without one keeps what it held; with one, that does not enter.
template <class T>
requires(is_packed<T> || requires { lane_format<T>::lanes; }) struct blend_traits<blend::mean, T> {
    static constexpr bool available = true;
    static constexpr bool order_free = true;
    using lanes = lane_format<T>;
    using accumulator = lane_means<lanes::lanes>;
    VOXELPIPE_HD
    static T identity() { return core::bit_cast<T>(word{0}); }
    VOXELPIPE_HD
    static accumulator begin(const T& stored) {
        accumulator a{};
        const std::uint64_t kept = core::bit_cast<word>(stored);
        a.kept_high = static_cast<std::uint32_t>(kept >> 32);
        a.kept_low = static_cast<std::uint32_t>(kept);
        return a;
    }
    template <class Value>
    VOXELPIPE_HD static void apply(accumulator& a, const Value& v) {
        for (int i = 0; i < lanes::lanes; ++i) lanes::add(a.c[i], v, i);
        ++a.count;
    }
    VOXELPIPE_HD
    static T end(const accumulator& a) {
        if (a.count != 0) return lanes::nearest(a.c, a.count);
        return core::bit_cast<T>(static_cast<word>(std::uint64_t{a.kept_high} << 32 | a.kept_low));
    }

private:
    using word = std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                    std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>;
};

} // namespace voxelpipe::core
