// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the modules for CPU and GPU: the shader that gives the vertices of a surface their values.

#include <voxelpipe/shader.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace voxelpipe::python {

// Columns of rows for the vertices and the triangles of a mesh, in the memory of the backend that draws: those of
// vertices come first.
template <class T>
struct value_columns {
    const T* of_vertices = nullptr;
    const T* of_triangles = nullptr;
    std::size_t num_of_vertices = 0, num_of_triangles = 0; // columns of either

    [[nodiscard]] std::size_t count() const { return num_of_vertices + num_of_triangles; }
};

// Floats in fours, interpolated where they are of vertices; integers of the triangle or its first vertex.
template <std::size_t Fours, std::size_t Integers>
struct column_shader {
    const glm::uvec3* triangles; // of all parts
    value_columns<float> floats;
    value_columns<std::int64_t> integers;

    VOXELPIPE_HD auto operator()(const fragment<>& f) const {
        return make(f, std::make_index_sequence<Fours>{}, std::make_index_sequence<Integers>{});
    }

private:
    template <std::size_t... F, std::size_t... I>
    VOXELPIPE_HD auto make(const fragment<>& f, std::index_sequence<F...>, std::index_sequence<I...>) const {
        return outputs(glm::vec4(at(f, 4 * F), at(f, 4 * F + 1), at(f, 4 * F + 2), at(f, 4 * F + 3))...,
                       integer(f, I)...);
    }
    [[nodiscard]] VOXELPIPE_HD float at(const fragment<>& f, std::size_t column) const {
        const std::size_t width = floats.num_of_vertices;
        if (column < width) {
            const glm::uvec3 t = triangles[f.primitive];
            const float* const from = floats.of_vertices + column;
            return core::member_traits<float>::mix(from[t.x * width], from[t.y * width], from[t.z * width],
                                                   f.barycentric.y, f.barycentric.z);
        }
        column -= width;
        if (column >= floats.num_of_triangles) return 0.0F;
        return floats.of_triangles[f.primitive * floats.num_of_triangles + column];
    }
    [[nodiscard]] VOXELPIPE_HD std::int64_t integer(const fragment<>& f, std::size_t column) const {
        if (column < integers.num_of_vertices)
            return integers.of_vertices[triangles[f.primitive].x * integers.num_of_vertices + column];
        column -= integers.num_of_vertices;
        if (column >= integers.num_of_triangles) return 0;
        return integers.of_triangles[f.primitive * integers.num_of_triangles + column];
    }
};

} // namespace voxelpipe::python
