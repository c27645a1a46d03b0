// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sources of a mesh: vertex data in separate arrays or interleaved; indices as triangles, flat, of 8, 16 or 32 bits, or
// none. mesh converts them on the host when it is constructed. Views, calls and kernels know only glm::vec3 and
// glm::uvec3, so other forms cost neither compile time nor kernels.

#include <voxelpipe/core/pack.hpp>

#include <glm/vec3.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace voxelpipe {

// `count` values of T in host memory, `stride` bytes apart, such as a member of the vertices of an interleaved array.
// Does not own them.
template <class T>
struct strided_view {
    using value_type = T;
    static_assert(std::is_trivially_copyable_v<T> && !std::is_const_v<T>);

    const void* first = nullptr;    // address of the first value
    std::size_t count = 0;          // number of values
    std::size_t stride = sizeof(T); // bytes; the values need no alignment

    [[nodiscard]] T operator[](std::size_t i) const {
        VOXELPIPE_EXPECTS(i < count);
        T value;
        // NOLINTNEXTLINE(clang-analyzer-core.NonNullParamChecker): first is null where count is 0
        std::memcpy(&value, static_cast<const unsigned char*>(first) + i * stride, sizeof(T));
        return value;
    }
};

// One member of each vertex: member_of(vertices, &my_vertex::position). The range must outlive the view.
template <class Range, class Vertex, class T>
[[nodiscard]] strided_view<T> member_of(const Range& vertices, T Vertex::*member) {
    const Vertex* const first = std::data(vertices);
    return {std::size(vertices) == 0 ? nullptr : &(first->*member), std::size(vertices), sizeof(Vertex)};
}

// For a mesh in which every three consecutive vertices are a triangle: vp::mesh{backend, positions, vp::no_indices{}}.
struct no_indices {};

// Views flat indices as triangles, three indices each, in the memory of any backend, for a mesh_view. Throws
// std::invalid_argument if the number of indices is no multiple of 3.
[[nodiscard]] inline backend_view<const glm::uvec3> as_triangles(array_view<const std::uint32_t> indices) {
    static_assert(sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t) && alignof(glm::uvec3) == alignof(std::uint32_t));
    if (indices.size() % 3 != 0) throw std::invalid_argument("voxelpipe: the number of indices is no multiple of 3");
    return array_view<const glm::uvec3>(reinterpret_cast<const glm::uvec3*>(indices.data()), indices.size() / 3);
}

namespace core {

template <class Range>
using range_value = std::remove_cvref_t<decltype(*std::data(std::declval<const Range&>()))>;
template <class T>
inline constexpr bool is_index =
    std::is_integral_v<T> && !std::is_same_v<T, bool> && sizeof(T) <= sizeof(std::uint32_t);
template <class T>
inline constexpr bool is_index_triple = false;
template <class I, glm::qualifier Q>
inline constexpr bool is_index_triple<glm::vec<3, I, Q>> = is_index<I>;

template <class Range>
struct source_value {
    using type = range_value<Range>;
};
template <class T>
struct source_value<strided_view<T>> {
    using type = T;
};

} // namespace core

// Values of T for a mesh: a contiguous range (std::vector, std::span, array_view, backend_view), or a strided_view.
template <class T>
class vertex_source {
public:
    vertex_source() = default;
    vertex_source(const T* first, std::size_t count) : view_(first, count) {}
    template <class Range>
    requires std::convertible_to<const Range&, array_view<const T>> vertex_source(const Range& range)
        : view_(range) {}                           // NOLINT(*-explicit-*)
    vertex_source(const strided_view<T>& strided) { // NOLINT(*-explicit-*)
        copy_.reserve(strided.count);
        for (std::size_t i = 0; i < strided.count; ++i) copy_.push_back(strided[i]);
        view_ = copy_;
    }
    vertex_source(const vertex_source&) = delete; // view_ may refer to copy_
    vertex_source& operator=(const vertex_source&) = delete;

    // Refers to the source, or to its copy in here.
    [[nodiscard]] array_view<const T> view() const { return view_; }

private:
    std::vector<T> copy_;
    array_view<const T> view_;
};

// Triangles for a mesh: glm::uvec3 in a contiguous range, which are used in place; triples of other integers of up to
// 32 bits; flat integers, three per triangle; or no_indices. Negative indices are out of range, like too large ones.
// Throws std::invalid_argument if the number of flat indices, or of vertices without indices, is no multiple of 3.
class triangle_source {
public:
    triangle_source() = default;
    triangle_source(const glm::uvec3* first, std::size_t count) : view_(first, count) {}
    template <class Range>
    requires std::convertible_to<const Range&, array_view<const glm::uvec3>> triangle_source(const Range& range)
        : view_(range) {}                                            // NOLINT(*-explicit-*)
    triangle_source(const backend_view<const glm::uvec3>& triangles) // NOLINT(*-explicit-*)
        : view_(triangles), is_in_backend_(true) {}
    template <class Range>
    requires(core::is_index_triple<core::range_value<Range>> && !std::is_same_v<core::range_value<Range>, glm::uvec3>)
        triangle_source(const Range& range) { // NOLINT(*-explicit-*)
        copy_.reserve(std::size(range));
        for (std::size_t i = 0; i < std::size(range); ++i) {
            const auto& t = std::data(range)[i];
            copy_.emplace_back(to_index(t.x), to_index(t.y), to_index(t.z));
        }
        view_ = copy_;
    }
    template <class Range>
    requires core::is_index<core::range_value<Range>> triangle_source(const Range& range) { // NOLINT(*-explicit-*)
        const auto* const index = std::data(range);
        copy_.reserve(check_triples(std::size(range)));
        for (std::size_t i = 0; i < std::size(range); i += 3)
            copy_.emplace_back(to_index(index[i]), to_index(index[i + 1]), to_index(index[i + 2]));
        view_ = copy_;
    }
    triangle_source(no_indices) : counts_vertices_(true) {} // NOLINT(*-explicit-*)
    triangle_source(const triangle_source&) = delete;       // view_ may refer to copy_
    triangle_source& operator=(const triangle_source&) = delete;

    // The triangles of a mesh with this many vertices.
    [[nodiscard]] array_view<const glm::uvec3> view(std::size_t num_vertices) {
        if (counts_vertices_ && copy_.empty()) {
            copy_.reserve(check_triples(num_vertices));
            for (std::size_t i = 0; i < num_vertices; i += 3) {
                const auto n = static_cast<std::uint32_t>(i);
                copy_.emplace_back(n, n + 1, n + 2);
            }
            view_ = copy_;
        }
        return view_;
    }
    // True if the host may be unable to read them.
    [[nodiscard]] bool is_in_backend() const { return is_in_backend_; }

private:
    template <class I>
    [[nodiscard]] static std::uint32_t to_index(I i) {
        return static_cast<std::uint32_t>(i);
    }
    [[nodiscard]] static std::size_t check_triples(std::size_t count) {
        if (count % 3 != 0)
            throw std::invalid_argument("voxelpipe: the number of indices, or of vertices without indices, is no "
                                        "multiple of 3");
        return count / 3;
    }
    std::vector<glm::uvec3> copy_;
    array_view<const glm::uvec3> view_;
    bool is_in_backend_ = false, counts_vertices_ = false;
};

} // namespace voxelpipe
