// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The value of a cleared voxel after n fragments of one value, without n folds: the same bits as folding blend_traits n
// times, for blends with such a closed form. add_unordered, which allows any order, gives the exact sum, rounded once
// to double and once to its type.

#include <voxelpipe/blend.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core {

// repeated_fold<Blend, T>(clear, value)(n), for n < 2^32; n = 0 gives the clear value's own bits.
template <class Blend, class T>
struct repeated_fold {
    static constexpr bool available = false;
};

template <class Blend>
inline constexpr bool is_sum_of_quanta = std::is_same_v<Blend, blend::add>;
template <int Log2Quantum>
inline constexpr bool is_sum_of_quanta<blend::add_quantum<Log2Quantum>> = true;

template <class Blend, class T>
requires(is_floating<T>&& is_sum_of_quanta<Blend>&& blend_traits<Blend, T>::available) struct repeated_fold<Blend, T> {
    static constexpr bool available = true;
    using traits = blend_traits<Blend, T>;

    VOXELPIPE_HD
    repeated_fold(T clear, T value) : clear_(clear), first_(traits::begin(clear)) { traits::apply(one_, value); }
    [[nodiscard]] VOXELPIPE_HD T operator()(std::uint32_t n) const {
        if (n == 0) return clear_;
        auto sum = repeat_sum(one_, n);
        add_sum(sum, first_);
        return traits::end(sum);
    }

private:
    T clear_;
    typename traits::accumulator first_, one_{};
};

template <class T>
requires(std::is_same_v<T, float> || std::is_same_v<T, double>) struct repeated_fold<blend::add_unordered, T> {
    static constexpr bool available = true;

    VOXELPIPE_HD
    repeated_fold(T clear, T value) : clear_(clear), value_(value) {}
    [[nodiscard]] VOXELPIPE_HD T operator()(std::uint32_t n) const {
        if (n == 0) return clear_;
        if constexpr (std::is_same_v<T, float>)
            return canonical(exact::to_float(exact::fma(exact::to_double(value_), n, exact::to_double(clear_))));
        else
            return canonical(exact::fma(value_, n, clear_));
    }

private:
    T clear_, value_;
};

// Integers: sums wrap, exclusive or depends on parity, and for the others a repetition changes nothing.
template <class Blend>
inline constexpr bool is_repeated_once = std::is_same_v<Blend, blend::min> || std::is_same_v<Blend, blend::max> ||
                                         std::is_same_v<Blend, blend::bit_and> || std::is_same_v<Blend, blend::bit_or>;

template <class Blend, class T>
requires(is_integer<T> &&
         (is_repeated_once<Blend> || std::is_same_v<Blend, blend::bit_xor> || std::is_same_v<Blend, blend::add> ||
          std::is_same_v<Blend, blend::count>)) struct repeated_fold<Blend, T> {
    static constexpr bool available = true;

    VOXELPIPE_HD
    repeated_fold(T clear, T value) : clear_(clear), value_(std::is_same_v<Blend, blend::count> ? T{1} : value) {}
    [[nodiscard]] VOXELPIPE_HD T operator()(std::uint32_t n) const {
        if constexpr (is_repeated_once<Blend> || std::is_same_v<Blend, blend::bit_xor>) {
            T a = clear_;
            if (is_repeated_once<Blend> ? n != 0 : n % 2 != 0) blend_traits<Blend, T>::apply(a, value_);
            return a;
        } else {
            return static_cast<T>(static_cast<std::uint64_t>(clear_) + static_cast<std::uint64_t>(value_) * n);
        }
    }

private:
    T clear_, value_;
};

} // namespace voxelpipe::core
