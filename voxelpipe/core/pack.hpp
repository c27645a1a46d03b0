// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// pack: a tuple that host and device compilers treat alike, and array_view: a pointer with a length.

#include <voxelpipe/config.hpp>

#include <concepts>
#include <cstddef>
#include <iterator>
#include <type_traits>
#include <utility>

namespace voxelpipe {

namespace core {

template <class... Ts>
struct pack {};

// No [[no_unique_address]]: nvcc 13.0 lays out such members differently on host and device.
template <class First>
struct pack<First> {
    First first;
};

template <class First, class Second, class... Rest>
struct pack<First, Second, Rest...> {
    First first;
    pack<Second, Rest...> rest;
};

template <std::size_t I, class... Ts>
struct pack_element;
template <class First, class... Rest>
struct pack_element<0, First, Rest...> {
    using type = First;
};
template <std::size_t I, class First, class... Rest>
struct pack_element<I, First, Rest...> : pack_element<I - 1, Rest...> {};

} // namespace core

template <std::size_t I, class... Ts>
[[nodiscard]] VOXELPIPE_HD constexpr auto& get(core::pack<Ts...>& p) {
    static_assert(I < sizeof...(Ts), "voxelpipe::get: index past the end");
    if constexpr (I >= sizeof...(Ts))
        return p; // does not compile; avoids a second error
    else if constexpr (I == 0)
        return p.first;
    else
        return get<I - 1>(p.rest);
}

template <std::size_t I, class... Ts>
[[nodiscard]] VOXELPIPE_HD constexpr const auto& get(const core::pack<Ts...>& p) {
    static_assert(I < sizeof...(Ts), "voxelpipe::get: index past the end");
    if constexpr (I >= sizeof...(Ts))
        return p; // does not compile; avoids a second error
    else if constexpr (I == 0)
        return p.first;
    else
        return get<I - 1>(p.rest);
}

namespace core {

[[nodiscard]] VOXELPIPE_HD constexpr pack<> make_pack() { return {}; }

#if defined(__CUDACC__)
#pragma nv_exec_check_disable // on the host it also packs types that only the host has
#endif
template <class First, class... Rest>
[[nodiscard]] VOXELPIPE_HD constexpr pack<First, Rest...> make_pack(First first, Rest... rest) {
    if constexpr (sizeof...(Rest) == 0)
        return {static_cast<First&&>(first)};
    else
        return {static_cast<First&&>(first), make_pack(static_cast<Rest&&>(rest)...)};
}

VOXELPIPE_ANY_CALLABLE
template <class F, std::size_t... I>
VOXELPIPE_HD constexpr void for_each_index(F&& f, std::index_sequence<I...>) {
    (f.template operator()<I>(), ...);
}
// Calls f.template operator()<I>() for I = 0 .. N - 1, in order.
template <std::size_t N, class F>
VOXELPIPE_HD constexpr void for_each_index(F&& f) {
    for_each_index(static_cast<F&&>(f), std::make_index_sequence<N>{});
}

} // namespace core

namespace core {
template <class T>
inline constexpr bool never = false; // for the static_assert of a function that must not be used
} // namespace core

// A non-owning array; T may be const. Unlike std::span it works in device code without flags.
template <class T>
struct array_view {
    T* elements = nullptr; // address of the first; null if there are none
    std::size_t count = 0; // number of elements

    constexpr array_view() = default;
    VOXELPIPE_HD
    constexpr array_view(T* elements_, std::size_t count_) : elements(elements_), count(count_) {}
    // Refers to a contiguous container of T on the host (std::vector, std::array, std::span).
    template <class Range>
    requires(!std::is_same_v<std::remove_cvref_t<Range>, array_view> &&
             requires(Range && r) {
                 { std::data(r) } -> std::convertible_to<T*>;
                 std::size(r);
             }) constexpr array_view(Range&& r)
        : elements(std::data(r)), count(std::size(r)) {} // NOLINT(*-explicit-*)

    [[nodiscard]] VOXELPIPE_HD constexpr T* data() const { return elements; }
    [[nodiscard]] VOXELPIPE_HD constexpr std::size_t size() const { return count; }
    [[nodiscard]] VOXELPIPE_HD constexpr bool empty() const { return count == 0; }
    [[nodiscard]] VOXELPIPE_HD constexpr T& operator[](std::size_t i) const {
        VOXELPIPE_EXPECTS(i < count);
        return elements[i];
    }
    [[nodiscard]] VOXELPIPE_HD constexpr T* begin() const { return elements; }
    [[nodiscard]] VOXELPIPE_HD constexpr T* end() const { return elements + count; }
};

// An array in the memory of a backend, which the host may be unable to read. If the backend runs on the host, this is
// host memory.
template <class T>
struct backend_view : array_view<T> {
    using array_view<T>::array_view;
    // The caller says that the backend can read it.
    constexpr backend_view() = default;
    VOXELPIPE_HD constexpr backend_view(const array_view<T>& a) : array_view<T>(a) {} // NOLINT(*-explicit-*)
};

} // namespace voxelpipe
