// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The value of a surface's vertex from those of its sheet's crossings, at most 7, in the order of their edges: the mean
// of floats, and the majority of integers.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/distance/core/point_triangle.hpp>
#include <voxelpipe/surfaces/core/place_vertex.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <type_traits>

namespace voxelpipe::core {

// How values of a type are combined.
template <class T>
struct vertex_value {
    static constexpr bool allowed = std::is_integral_v<T>;

    // The value that most have; of several the least.
    VOXELPIPE_HD
    static T combine(const T (&values)[sheet_points::most], int count) {
        T best = values[0];
        int most = 0;
        for (int i = 0; i < count; ++i) {
            int n = 0;
            for (int k = 0; k < count; ++k) n += values[k] == values[i] ? 1 : 0;
            if (n < most || (n == most && !(values[i] < best))) continue;
            most = n;
            best = values[i];
        }
        return best;
    }
};
// The sum in double, one rounding a term, over their number, rounded to float: values that agree are kept.
template <>
struct vertex_value<float> {
    static constexpr bool allowed = true;
    VOXELPIPE_HD
    static float combine(const float (&values)[sheet_points::most], int count) {
        double sum = exact::to_double(values[0]);
        for (int i = 1; i < count; ++i) sum = add_doubles(sum, exact::to_double(values[i]));
        return exact::to_float(exact::div(sum, static_cast<double>(count)));
    }
};
template <glm::length_t N, glm::qualifier Q>
struct vertex_value<glm::vec<N, float, Q>> {
    static constexpr bool allowed = true;
    using vector = glm::vec<N, float, Q>;
    VOXELPIPE_HD
    static vector combine(const vector (&values)[sheet_points::most], int count) {
        vector r;
        for (glm::length_t a = 0; a < N; ++a) {
            float one[sheet_points::most]{};
            for (int i = 0; i < count; ++i) one[i] = values[i][a];
            r[a] = vertex_value<float>::combine(one, count);
        }
        return r;
    }
};

} // namespace voxelpipe::core
