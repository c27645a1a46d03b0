// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How the values of a node's children become its own: the reducers of octree levels.
//
//   reduce::sum, mean<C>, mean_of_voxels, mean_of_volume   of all terms below a node, summed exactly and rounded once
//   reduce::min, max, bit_or, majority                     of the node's children, level by level
//   a functor of your own   T operator()(std::span<const T> children) const: the children that exist, in Morton order

#include <voxelpipe/blend.hpp>
#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/reproducible_sum.hpp>
#include <voxelpipe/core/value_traits.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe {

namespace reduce {

// The sum of the terms below. Of floats: of the terms as their blend rounded them, if the framebuffer keeps its sums,
// otherwise of the voxels' values; rounded once. Of integers: exact modulo 2^64, as a 64-bit integer.
struct sum {};
// The sum over the number of fragments, which target C of the framebuffer counts (blend::count).
template <std::size_t C>
struct mean {};
// The sum over the number of voxels that exist.
struct mean_of_voxels {};
// The sum over all voxels of the node, 8^level, existing or not: a coverage, for a target of ones.
struct mean_of_volume {};
struct min {};      // floats in the total order of blend::min
struct max {};      // in the same order
struct bit_or {};   // integers and bit
struct majority {}; // the value that most children have; of several the least, component by component

} // namespace reduce

namespace core {

// Reducers of all terms below a node.
template <class Reducer>
inline constexpr bool sums_terms =
    std::is_same_v<Reducer, reduce::sum> || std::is_same_v<Reducer, reduce::mean_of_voxels> ||
    std::is_same_v<Reducer, reduce::mean_of_volume>;
template <std::size_t C>
inline constexpr bool sums_terms<reduce::mean<C>> = true;

// A sum that holds the sums of 2^63 voxels: as wide_sum, with 64 bits at the top.
template <int Limbs>
struct tree_sum {
    std::uint64_t limb[std::size_t{Limbs}]{};
    std::int64_t top = 0;
    std::uint32_t marks = 0;

    VOXELPIPE_HD void add(const tree_sum& other) {
        std::uint64_t carry = 0;
        for (int k = 0; k < Limbs; ++k) {
            const uint128 sum = static_cast<uint128>(limb[k]) + other.limb[k] + carry;
            limb[k] = static_cast<std::uint64_t>(sum);
            carry = static_cast<std::uint64_t>(sum >> 64);
        }
        top =
            static_cast<std::int64_t>(static_cast<std::uint64_t>(top) + static_cast<std::uint64_t>(other.top) + carry);
        marks |= other.marks;
    }
};

template <int Limbs>
[[nodiscard]] VOXELPIPE_HD inline tree_sum<Limbs> widen(const wide_sum<Limbs>& s) {
    tree_sum<Limbs> r;
    for (int k = 0; k < Limbs; ++k) r.limb[k] = s.limb[k];
    r.top = s.top;
    r.marks = s.marks;
    return r;
}

// |sum| as magnitude * 2^exponent, the last bit sticky where bits fall off.
template <int Limbs>
[[nodiscard]] VOXELPIPE_HD inline sum_magnitude to_magnitude(const tree_sum<Limbs>& s) {
    std::uint64_t limb[std::size_t{Limbs + 1}];
    for (int k = 0; k < Limbs; ++k) limb[k] = s.limb[k];
    limb[Limbs] = static_cast<std::uint64_t>(s.top);
    const bool negative = s.top < 0;
    if (negative) {
        std::uint64_t carry = 1;
        for (std::uint64_t& l : limb) {
            l = ~l + carry;
            carry = carry != 0 && l == 0 ? 1 : 0;
        }
    }
    if constexpr (Limbs == 1) {
        return {negative, static_cast<uint128>(limb[1]) << 64 | limb[0], 0};
    } else {
        static_assert(Limbs == 2);
        const uint128 low = static_cast<uint128>(limb[1]) << 64 | limb[0];
        if (limb[2] == 0) return {negative, low, 0};
        return {negative, (static_cast<uint128>(limb[2]) << 64 | limb[1]) | static_cast<uint128>(limb[0] != 0), 64};
    }
}

// sum / divisor * 2^log2_quantum, rounded once; the divisor is not 0.
template <int Limbs>
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t round_quotient(const tree_sum<Limbs>& s, std::uint64_t divisor,
                                                               int log2_quantum, int mantissa_bits, int exponent_bits) {
    const std::uint64_t infinity = ((std::uint64_t{1} << exponent_bits) - 1) << mantissa_bits;
    const std::uint64_t sign = std::uint64_t{1} << (mantissa_bits + exponent_bits);
    if (sum_is_nan(s.marks)) return infinity | std::uint64_t{1} << (mantissa_bits - 1);
    if ((s.marks & sum_positive_infinity) != 0) return infinity;
    if ((s.marks & sum_negative_infinity) != 0) return infinity | sign;
    sum_magnitude m = to_magnitude(s);
    if (m.magnitude == 0) return 0;
    if (divisor != 1) { // a quotient of 64 bits or more, and whether anything is left
        const int shift = 128 - exact::bit_width(m.magnitude);
        const uint128 shifted = m.magnitude << shift;
        const exact::wide_quotient q = exact::divide(shifted, divisor);
        m.magnitude = q.quotient | static_cast<uint128>(q.has_rest);
        m.exponent -= shift;
    }
    return exact::round_to_binary(m.magnitude, m.exponent + log2_quantum, mantissa_bits, exponent_bits) |
           (m.negative ? sign : 0);
}

// ---- what sums of a component's type are made of and become
// -----------------------------------------------------------

template <class S>
struct tree_sum_of { // integers
    using sum = tree_sum<1>;
    using total = std::conditional_t<std::is_signed_v<S>, std::int64_t, std::uint64_t>;
    using quotient = double;
    VOXELPIPE_HD static sum begin(S v) {
        sum s;
        s.limb[0] = static_cast<std::uint64_t>(static_cast<std::int64_t>(v));
        if constexpr (std::is_signed_v<S>) s.top = v < 0 ? -1 : 0;
        return s;
    }
    VOXELPIPE_HD static total end(const sum& s) { return static_cast<total>(s.limb[0]); }
    VOXELPIPE_HD static quotient divide(const sum& s, std::uint64_t by) {
        return core::bit_cast<double>(round_quotient(s, by, 0, 52, 11));
    }
};
template <class S, int Limbs, int Log2Quantum, int Mantissa, int Exponent>
struct float_tree_sum {
    using sum = tree_sum<Limbs>;
    using total = S;
    using quotient = S;
    VOXELPIPE_HD static total end(const sum& s) { return divide(s, 1); }
    VOXELPIPE_HD static quotient divide(const sum& s, std::uint64_t by) {
        using bits = typename float_bits<S>::type;
        return core::bit_cast<S>(static_cast<bits>(round_quotient(s, by, Log2Quantum, Mantissa, Exponent)));
    }
};
template <>
struct tree_sum_of<float> : float_tree_sum<float, 1, -32, 23, 8> {
    VOXELPIPE_HD static sum begin(float v) {
        wide_sum<1> s{};
        add_float<-32>(s, v);
        return widen(s);
    }
};
template <>
struct tree_sum_of<half> : float_tree_sum<half, 1, -24, 10, 5> {
    VOXELPIPE_HD static sum begin(half v) {
        wide_sum<1> s{};
        add_half<-24>(s, v);
        return widen(s);
    }
};
template <>
struct tree_sum_of<bfloat16> : float_tree_sum<bfloat16, 1, -32, 7, 8> {
    VOXELPIPE_HD static sum begin(bfloat16 v) { return tree_sum_of<float>::begin(static_cast<float>(v)); }
};
template <>
struct tree_sum_of<double> : float_tree_sum<double, 2, -64, 52, 11> {
    VOXELPIPE_HD static sum begin(double v) {
        wide_sum<2> s{};
        add_double<-64>(s, v);
        return widen(s);
    }
};

// The quantum of a blend's sums is the format's own, unless the blend says so.
template <class Blend, class S>
struct blend_tree_sum : tree_sum_of<S> {};
template <int Log2Quantum>
struct blend_tree_sum<blend::add_quantum<Log2Quantum>, float> : float_tree_sum<float, 1, Log2Quantum, 23, 8> {
    VOXELPIPE_HD static tree_sum<1> begin(float v) {
        wide_sum<1> s{};
        add_float<Log2Quantum>(s, v);
        return widen(s);
    }
};

// A value is reduced component by component.
template <class T>
struct components_of {
    static constexpr int count = 1;
    using scalar = T;
    template <class R>
    using with = R;
    template <class V>
    VOXELPIPE_HD static auto& at(V& v, int) {
        return v;
    }
};
template <glm::length_t N, class S, glm::qualifier Q>
struct components_of<glm::vec<N, S, Q>> {
    static constexpr int count = N;
    using scalar = S;
    template <class R>
    using with = glm::vec<N, R, Q>;
    template <class V>
    VOXELPIPE_HD static auto& at(V& v, int c) {
        return v[c];
    }
};

// ---- reducers that fold children
// --------------------------------------------------------------------------------------

template <class T>
[[nodiscard]] VOXELPIPE_HD bool least_first(const T& a, const T& b) {
    using parts = components_of<T>;
    for (int c = 0; c < parts::count; ++c) {
        if (ordered_less(parts::at(a, c), parts::at(b, c))) return true;
        if (ordered_less(parts::at(b, c), parts::at(a, c))) return false;
    }
    return false;
}

template <class Reducer, class T>
struct fold_of {
    VOXELPIPE_HD static T fold(const Reducer& f, std::span<const T> children) {
        static_assert(std::is_invocable_r_v<T, const Reducer&, std::span<const T>>,
                      "voxelpipe: a reducer of your own is called as T operator()(std::span<const T>) const");
        return f(children);
    }
};
template <class Blend, class T>
[[nodiscard]] VOXELPIPE_HD T fold_by_blend(std::span<const T> children) {
    T value = children[0];
    for (const T& v : children.subspan(1)) blend_traits<Blend, T>::apply(value, v);
    return value;
}
template <class T>
struct fold_of<reduce::min, T> {
    VOXELPIPE_HD static T fold(reduce::min, std::span<const T> children) { return fold_by_blend<blend::min>(children); }
};
template <class T>
struct fold_of<reduce::max, T> {
    VOXELPIPE_HD static T fold(reduce::max, std::span<const T> children) { return fold_by_blend<blend::max>(children); }
};
template <class T>
struct fold_of<reduce::bit_or, T> {
    VOXELPIPE_HD static T fold(reduce::bit_or, std::span<const T> children) {
        return fold_by_blend<blend::bit_or>(children);
    }
};
template <class T>
struct fold_of<reduce::majority, T> {
    VOXELPIPE_HD static T fold(reduce::majority, std::span<const T> children) {
        T best = children[0];
        std::size_t most = 0;
        for (const T& v : children) {
            std::size_t n = 0;
            for (const T& other : children) n += !least_first(v, other) && !least_first(other, v) ? 1 : 0;
            if (n > most || (n == most && least_first(v, best))) {
                most = n;
                best = v;
            }
        }
        return best;
    }
};

} // namespace core
} // namespace voxelpipe
