// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// User-defined blends: functors with
//   static constexpr bool order_free;   T identity() const;   T combine(T, T) const;
// or templates of the two functions, and without data members, because the library constructs one wherever it needs it.
// Checks them with a one-line reason if one is not usable.

#include <voxelpipe/config.hpp>

#include <concepts>
#include <type_traits>

namespace voxelpipe::core {

template <class Blend, class T>
concept user_blend = requires(const Blend& f, T a, T b) {
    { Blend::order_free } -> std::convertible_to<bool>;
    { f.identity() } -> std::same_as<T>;
    { f.combine(a, b) } -> std::same_as<T>;
};
// The same with templates: identity<T>(), combine<T>(a, b).
template <class Blend, class T>
concept user_blend_template = requires(const Blend& f, T a, T b) {
    { Blend::order_free } -> std::convertible_to<bool>;
    { f.template identity<T>() } -> std::same_as<T>;
    { f.combine(a, b) } -> std::same_as<T>;
};

// True if a class is meant as a user-defined blend: it has one of the members.
template <class Blend>
concept has_blend_member = requires {
    Blend::order_free;
}
|| requires { &Blend::identity; }
|| requires { &Blend::combine; }
|| requires { &Blend::template identity<float>; };

// True if Blend can be a user-defined blend of T. Otherwise the compiler reports the first thing that is wrong with it,
// in one line.
template <class Blend, class T>
[[nodiscard]] constexpr bool check_user_blend() {
    constexpr bool empty = std::is_empty_v<Blend>;
    static_assert(empty,
                  "voxelpipe: a blend of your own must not have data members: the library makes a Blend{} wherever "
                  "it needs one, and what they hold would be ignored");
    if constexpr (empty) {
        constexpr bool says_order = requires {
            { Blend::order_free } -> std::convertible_to<bool>;
        };
        static_assert(says_order,
                      "voxelpipe: a blend of your own needs 'static constexpr bool order_free': true if the "
                      "order of combine does not matter");
        constexpr bool plain_identity = requires(const Blend& f) { f.identity(); };
        constexpr bool template_identity = requires(const Blend& f) { f.template identity<T>(); };
        constexpr bool has_identity = plain_identity || template_identity;
        static_assert(!says_order || has_identity,
                      "voxelpipe: a blend of your own needs 'T identity() const', or a template identity<T>(): is it "
                      "there, public, const, and VOXELPIPE_HD?");
        if constexpr (says_order && has_identity) {
            constexpr bool gives_value = [] {
                if constexpr (requires(const Blend& f) { f.identity(); }) return requires(const Blend& f) {
                        { f.identity() } -> std::same_as<T>;
                    };
                else
                    return requires(const Blend& f) {
                        { f.template identity<T>() } -> std::same_as<T>;
                    };
            }();
            static_assert(gives_value,
                          "voxelpipe: identity() of a blend of your own must return the target's value type");
            constexpr bool combines = requires(const Blend& f, T a) { f.combine(a, a); };
            static_assert(
                !gives_value || combines,
                "voxelpipe: a blend of your own needs 'T combine(T, T) const', for the target's value type: is it "
                "there, public, const, and does it take two values?");
            if constexpr (gives_value && combines) {
                constexpr bool gives_combined = requires(const Blend& f, T a) {
                    { f.combine(a, a) } -> std::same_as<T>;
                };
                static_assert(gives_combined,
                              "voxelpipe: combine() of a blend of your own must return the target's value type");
                return gives_combined;
            }
        }
    }
    return false;
}

// Replaces the traits of a refused blend, so that the reason is the only error.
template <class T>
struct refused_blend {
    static constexpr bool available = false;
    static constexpr bool order_free = true;
    using accumulator = T;
    VOXELPIPE_HD static T identity() { return T{}; }
    VOXELPIPE_HD static T begin(const T& stored) { return stored; }
    template <class Value>
    VOXELPIPE_HD static void apply(T&, const Value&) {}
    VOXELPIPE_HD static T end(const T& value) { return value; }
};

} // namespace voxelpipe::core
