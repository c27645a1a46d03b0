// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The fragment shader that bakes attributes: rows of values, one for each vertex or one for each triangle, read by
// pointer, so that one pipeline serves both. Shared by the bindings of all languages, on CPU and GPU.

#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe::bindings {

// A scalar where there is one component.
template <class T, int Components>
using value_of = std::conditional_t<Components == 1, T, glm::vec<Components, T>>;

// Components [first, first + n) of each row of `values`, which begins at the first; components that a row does not have
// are 0. Values of vertices are interpolated at the fragment's point on its triangle, as varyings are; integers are
// taken from the triangle's first vertex.
template <class T>
struct value_rows {
    const T* values = nullptr;
    std::size_t columns = 0;               // of a row in memory
    int count = 0;                         // of them that are baked
    const glm::uvec3* triangles = nullptr; // null: one row for each triangle

    template <int Components>
    [[nodiscard]] VOXELPIPE_HD value_of<T, Components> at(const fragment<>& f) const {
        value_of<T, Components> result{};
        if (triangles == nullptr) {
            const T* const from = row(f.triangle);
            for (int c = 0; c < Components; ++c)
                if (c < count) component(result, c) = from[c];
            return result;
        }
        const glm::uvec3 t = triangles[f.triangle];
        if constexpr (std::is_integral_v<T>) {
            const T* const from = row(t.x);
            for (int c = 0; c < Components; ++c)
                if (c < count) component(result, c) = from[c];
        } else {
            const glm::vec3 b = f.clamped_barycentric();
            for (int c = 0; c < Components; ++c)
                if (c < count)
                    component(result, c) =
                        core::member_traits<float>::mix(row(t.x)[c], row(t.y)[c], row(t.z)[c], b.y, b.z);
        }
        return result;
    }

private:
    [[nodiscard]] VOXELPIPE_HD const T* row(std::uint32_t i) const { return values + i * columns; }
    [[nodiscard]] VOXELPIPE_HD static T& component(T& value, int) { return value; }
    template <int N>
    [[nodiscard]] VOXELPIPE_HD static T& component(glm::vec<N, T>& value, int c) {
        return value[c];
    }
};

// The value, and 1 to be added to the number of fragments.
template <class T, int Components>
struct counted_value_shader {
    value_rows<T> rows;
    VOXELPIPE_HD auto operator()(const fragment<>& f) const { return outputs(rows.template at<Components>(f), 1U); }
};

using number_of_fragments = target<std::uint32_t, blend::add>;

} // namespace voxelpipe::bindings
