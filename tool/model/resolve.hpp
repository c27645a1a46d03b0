// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// From render targets to channels of the volume: what a voxel's value becomes. Functors over the backend's memory, for
// every backend; an empty voxel gets the channel's empty value.

#include "srgb.hpp"

#include <voxelpipe/voxelpipe.hpp>

#include <glm/gtc/type_precision.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelize {

template <class T>
struct as_it_is {
    const T* elements;
    [[nodiscard]] VOXELPIPE_HD T operator()(std::size_t i) const { return elements[i]; }
};

// The mean of linear colours by their weights, as sRGB, and of the weights, which are alphas, as alpha.
struct mean_color {
    const glm::vec4* sums;
    const std::uint32_t* counts;
    const color_tables* tables;

    [[nodiscard]] VOXELPIPE_HD glm::u8vec4 operator()(std::size_t i) const {
        if (counts[i] == 0) return glm::u8vec4(0);
        const auto n = static_cast<float>(counts[i]);
        glm::vec4 mean;
        for (int c = 0; c < 4; ++c) {
            mean[c] = voxelpipe::exact::div(sums[i][c], c < 3 ? sums[i].a : n);
            if (mean[c] > 1.0F) mean[c] = 1.0F;
        }
        return encode(*tables, mean);
    }
};

// The colour in the low word of outer_fragment_shader's values.
struct outer_color {
    const std::uint64_t* values;

    [[nodiscard]] VOXELPIPE_HD glm::u8vec4 operator()(std::size_t i) const {
        const auto color = static_cast<std::uint32_t>(values[i]);
        return {static_cast<std::uint8_t>(color >> 24), static_cast<std::uint8_t>(color >> 16),
                static_cast<std::uint8_t>(color >> 8), static_cast<std::uint8_t>(color)};
    }
};

// A sum of normals, made unit. What is left of normals that cancel is rounding; it has no direction.
struct unit_normal {
    const glm::vec3* sums;

    [[nodiscard]] VOXELPIPE_HD glm::vec3 operator()(std::size_t i) const {
        namespace exact = voxelpipe::exact;
        const double x = sums[i].x;
        const double y = sums[i].y;
        const double z = sums[i].z;
        const double length = exact::sqrt(exact::fma(z, z, exact::fma(y, y, exact::mul(x, x))));
        constexpr double least = 0x1p-10;
        if (!(length > least)) return glm::vec3(0);
        return {static_cast<float>(exact::div(x, length)), static_cast<float>(exact::div(y, length)),
                static_cast<float>(exact::div(z, length))};
    }
};

// A draw by the number of its first triangle.
struct numbered_draw {
    std::uint64_t first_triangle;
    std::int32_t material;
};

// The material of a triangle's draw; -1 for no triangle, which is the greatest number.
struct material_of_triangle {
    const std::uint32_t* triangles;
    const numbered_draw* draws; // by ascending first triangle
    std::size_t num_draws;

    [[nodiscard]] VOXELPIPE_HD std::int32_t operator()(std::size_t i) const {
        if (triangles[i] == UINT32_MAX) return -1;
        std::size_t at = 0; // the last draw that begins at the triangle or before
        std::size_t end = num_draws;
        while (end - at > 1) {
            const std::size_t middle = at + (end - at) / 2;
            if (draws[middle].first_triangle <= triangles[i])
                at = middle;
            else
                end = middle;
        }
        return draws[at].material;
    }
};

} // namespace voxelize
