// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inputs of the fragment shader, from exact integers: barycentrics at the column's centre, varyings, the normal. These
// functions are forced inline, so values that a shader does not read are not computed.
// Varyings are aggregates of float, glm::vec2/3/4, std::array<float, N> (interpolated) or flat<T> (taken from the
// triangle's first vertex), with up to 12 members.

#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/core/small_triangle.hpp>
#include <voxelpipe/core/triangle_setup.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <type_traits>

namespace voxelpipe {

// A varying that is not interpolated: every fragment gets the value of its triangle's first vertex.
template <class T>
struct flat {
    T value; // of the triangle's first vertex
};

namespace core {

template <class T>
struct member_traits {
    static constexpr bool allowed = false;
};
template <>
struct member_traits<float> {
    static constexpr bool allowed = true;
    VOXELPIPE_HD
    static float mix(float a, float b, float c, float t1, float t2) {
        // Constant if the vertices agree; two roundings besides the differences.
        return exact::fma(t2, exact::sub(c, a), exact::fma(t1, exact::sub(b, a), a));
    }
};
template <glm::length_t N, glm::qualifier Q>
struct member_traits<glm::vec<N, float, Q>> {
    static constexpr bool allowed = true;
    using vector = glm::vec<N, float, Q>;
    VOXELPIPE_HD
    static vector mix(const vector& a, const vector& b, const vector& c, float t1, float t2) {
        vector r;
        for (glm::length_t i = 0; i < N; ++i) r[i] = member_traits<float>::mix(a[i], b[i], c[i], t1, t2);
        return r;
    }
};
template <std::size_t N>
struct member_traits<std::array<float, N>> {
    static constexpr bool allowed = true;
    using array = std::array<float, N>;
    struct plain { // std::array's functions are host-only
        float f[N];
    };
    VOXELPIPE_HD
    static array mix(const array& a, const array& b, const array& c, float t1, float t2) {
        const auto p = core::bit_cast<plain>(a), q = core::bit_cast<plain>(b), r = core::bit_cast<plain>(c);
        plain m;
        for (std::size_t i = 0; i < N; ++i) m.f[i] = member_traits<float>::mix(p.f[i], q.f[i], r.f[i], t1, t2);
        return core::bit_cast<array>(m);
    }
};
template <class T>
struct member_traits<flat<T>> {
    static constexpr bool allowed = std::is_trivially_copyable_v<T>;
    VOXELPIPE_HD
    static flat<T> mix(const flat<T>& a, const flat<T>&, const flat<T>&, float, float) { return a; }
};

// The number of members of an aggregate: the largest number of initialisers that it takes.
struct any_member {
    template <class T>
    constexpr operator T() const; // NOLINT(*-explicit-*): never called
};
template <class V, class... Init>
consteval std::size_t num_members() {
    if constexpr (requires { V{Init{}..., any_member{}}; })
        return num_members<V, Init..., any_member>();
    else
        return sizeof...(Init);
}

inline constexpr std::size_t max_varyings_members = 12;

// Pointers to the members, in order.
template <class V>
VOXELPIPE_HD constexpr auto tie_members(V& s) {
    constexpr std::size_t n = num_members<std::remove_const_t<V>>();
    static_assert(n <= max_varyings_members, "a varyings struct may have at most 12 members");
    const auto refs = [](auto&... m) { return make_pack((&m)...); };
    if constexpr (n == 0) {
        return make_pack();
    } else if constexpr (n == 1) {
        auto& [a] = s;
        return refs(a);
    } else if constexpr (n == 2) {
        auto& [a, b] = s;
        return refs(a, b);
    } else if constexpr (n == 3) {
        auto& [a, b, c] = s;
        return refs(a, b, c);
    } else if constexpr (n == 4) {
        auto& [a, b, c, d] = s;
        return refs(a, b, c, d);
    } else if constexpr (n == 5) {
        auto& [a, b, c, d, e] = s;
        return refs(a, b, c, d, e);
    } else if constexpr (n == 6) {
        auto& [a, b, c, d, e, f] = s;
        return refs(a, b, c, d, e, f);
    } else if constexpr (n == 7) {
        auto& [a, b, c, d, e, f, g] = s;
        return refs(a, b, c, d, e, f, g);
    } else if constexpr (n == 8) {
        auto& [a, b, c, d, e, f, g, h] = s;
        return refs(a, b, c, d, e, f, g, h);
    } else if constexpr (n == 9) {
        auto& [a, b, c, d, e, f, g, h, i] = s;
        return refs(a, b, c, d, e, f, g, h, i);
    } else if constexpr (n == 10) {
        auto& [a, b, c, d, e, f, g, h, i, j] = s;
        return refs(a, b, c, d, e, f, g, h, i, j);
    } else if constexpr (n == 11) {
        auto& [a, b, c, d, e, f, g, h, i, j, k] = s;
        return refs(a, b, c, d, e, f, g, h, i, j, k);
    } else {
        auto& [a, b, c, d, e, f, g, h, i, j, k, l] = s;
        return refs(a, b, c, d, e, f, g, h, i, j, k, l);
    }
}

template <class P>
struct all_allowed : std::false_type {};
template <class... Ms>
struct all_allowed<pack<Ms*...>> : std::bool_constant<(member_traits<Ms>::allowed && ...)> {};

// True if a struct has at most as many members as varyings may have, as far as they can be counted.
template <class V>
consteval bool has_few_members() {
    if constexpr (std::is_aggregate_v<V>) return num_members<V>() <= max_varyings_members;
    return true;
}

template <class V>
consteval bool is_varyings() {
    // Two conditions: the second is invalid for a type that is not an aggregate.
    if constexpr (!std::is_aggregate_v<V> || !std::is_trivially_copyable_v<V>)
        return false; // NOLINT(bugprone-branch-clone)
    else if constexpr (num_members<V>() > max_varyings_members)
        return false;
    else
        return all_allowed<decltype(tie_members(std::declval<V&>()))>::value;
}

// a + t1 * (b - a) + t2 * (c - a), member by member, in float, two fused steps each.
template <class V>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE V mix(const V& a, const V& b, const V& c, float t1, float t2) {
    if constexpr (std::is_empty_v<V>) {
        return V{};
    } else {
        V r{};
        const auto out = tie_members(r);
        const auto pa = tie_members(a), pb = tie_members(b), pc = tie_members(c);
        for_each_index<num_members<V>()>([&]<std::size_t I>() {
            auto& m = *voxelpipe::get<I>(out);
            m = member_traits<std::remove_reference_t<decltype(m)>>::mix(*voxelpipe::get<I>(pa), *voxelpipe::get<I>(pb),
                                                                         *voxelpipe::get<I>(pc), t1, t2);
        });
        return r;
    }
}

// Barycentrics at the centre of column (u, v) (absolute voxel indices): quotients of exact integers, rounded to double
// and then to float. Outside the triangle some are negative. 1/3 each for a zero-area triangle.
template <class Int>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE glm::vec3 barycentric(const triangle_frame<Int>& t, std::int64_t u,
                                                                  std::int64_t v) {
    if (t.zero_area) return glm::vec3(1.0f / 3.0f);
    const Int x = static_cast<Int>(2 * (u - t.origin[0]) + 1)
                  << t.fraction; // doubled, so that the half remains an integer
    const Int y = static_cast<Int>(2 * (v - t.origin[1]) + 1) << t.fraction;
    const double area = exact::to_double(2 * t.normal[2]);
    const auto weight = [&](const triple<Int>& p, const triple<Int>& q) VOXELPIPE_INLINE_LAMBDA {
        const Int n = (q[0] - p[0]) * (y - 2 * p[1]) - (q[1] - p[1]) * (x - 2 * p[0]);
        return exact::to_float(exact::div(exact::to_double(n), area));
    };
    return {weight(t.p[1], t.p[2]), weight(t.p[2], t.p[0]), weight(t.p[0], t.p[1])};
}

// Barycentrics of a small triangle; (u, v) is relative to the lowest voxel of its bounding box, and lies in that box.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE glm::vec3 barycentric(const small_frame& t, int u, int v) {
    if (t.zero_area) return glm::vec3(1.0f / 3.0f);
    const std::int32_t x = (2 * u + 1) << t.fraction, y = (2 * v + 1) << t.fraction;
    const double area = exact::to_double(2 * t.normal[2]);
    const auto weight = [&](const triple<std::int32_t>& p, const triple<std::int32_t>& q) VOXELPIPE_INLINE_LAMBDA {
        const std::int64_t n = static_cast<std::int64_t>(q[0] - p[0]) * (y - 2 * p[1]) -
                               static_cast<std::int64_t>(q[1] - p[1]) * (x - 2 * p[0]);
        return exact::to_float(exact::div(exact::to_double(n), area));
    };
    return {weight(t.p[1], t.p[2]), weight(t.p[2], t.p[0]), weight(t.p[0], t.p[1])};
}

// Sets negative weights to 0 and scales to sum 1: a point on the triangle.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 clamp_barycentric(const glm::vec3& b) {
    const float x = b.x > 0.0f ? b.x : 0.0f, y = b.y > 0.0f ? b.y : 0.0f, z = b.z > 0.0f ? b.z : 0.0f;
    const float sum = exact::add(exact::add(x, y), z);
    return {exact::div(x, sum), exact::div(y, sum), exact::div(z, sum)};
}

// Unit normal in world space, in the direction of (p1 - p0) x (p2 - p0); zero for a zero-area triangle. Exact integers,
// then double: scaled by the voxels' shape, length by three fused steps, quotients rounded to float. Frame:
// triangle_frame or small_frame.
template <class Frame>
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE glm::vec3 unit_normal(const Frame& t, const triple<double>& factors) {
    if (t.zero_area) return glm::vec3(0.0f);
    const auto n = to_xyz(t.axis, t.normal[0], t.normal[1], t.normal[2]);
    const double x = exact::mul(exact::to_double(n[0]), factors[0]);
    const double y = exact::mul(exact::to_double(n[1]), factors[1]);
    const double z = exact::mul(exact::to_double(n[2]), factors[2]);
    const double length = exact::sqrt(exact::fma(z, z, exact::fma(y, y, exact::mul(x, x))));
    return {exact::to_float(exact::div(x, length)), exact::to_float(exact::div(y, length)),
            exact::to_float(exact::div(z, length))};
}

} // namespace core
} // namespace voxelpipe
