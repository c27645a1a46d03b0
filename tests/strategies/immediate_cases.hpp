// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes and comparisons of the strategy `immediate`, shared by immediate_test.cu and immediate_*_test.cu. Each of
// these files has framebuffers of its own, because every list of targets compiles its kernels.

#include "cells.hpp"

#include <cstdint>
#include <random>

namespace device_test {

namespace blend = voxelpipe::blend;

// Runs of 1 to 40 triangles within a voxel, one voxel after the other.
inline mesh_data specks() {
    mesh_data m;
    for (int run = 1; run <= 40; ++run)
        for (int i = 0; i < run; ++i) {
            const glm::vec3 corner(static_cast<float>(run) - 0.9f, 1.1f + static_cast<float>(run % 3), 1.2f);
            const float step = 0.01f * static_cast<float>(i);
            add_triangle(m, corner + glm::vec3(step, 0.0f, 0.1f), corner + glm::vec3(0.3f, 0.5f, step),
                         corner + glm::vec3(0.1f, 0.2f + step, 0.3f));
        }
    return m;
}

// Slivers and other triangles with bounding boxes of 2 to 40 voxels, or up to `longest`, in all directions.
inline mesh_data middling_triangles(glm::ivec3 extent, std::uint32_t seed, int count = 3000, float longest = 40.0f) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 a = glm::vec3(unit(random), unit(random), unit(random)) * glm::vec3(extent);
        const float length = 2.0f + (longest - 2.0f) * unit(random);
        const auto side = [&](float scale) {
            return scale * glm::vec3(unit(random) - 0.5f, unit(random) - 0.5f, unit(random) - 0.5f);
        };
        const glm::vec3 b = a + side(2.0f * length);
        add_triangle(m, a, b, (i % 2 == 0 ? b : a) + side(i % 4 < 2 ? 2.0f : length));
    }
    return m;
}

// Cleared and loaded, with and without the voxel counter, in a grid that cuts triangles at every side.
template <class Targets, class... Values>
void compare_constants(Targets targets, const vp::constant_output<Values...>& shader) {
    for (const vp::coverage rule : both_rules) {
        const mesh_data m = mixed_triangles(3000, 60.0f, 81);
        expect_same(targets, m, box_grid({60, 47, 71}), vp::passthrough{}, shader, rule);
        expect_same(targets, m, box_grid({97, 9, 31}), vp::passthrough{}, shader, vp::voxelize_options{rule, false},
                    start::load);
        expect_same(targets, mixed_triangles(200, 1.0f, 82), box_grid({1, 1, 1}), vp::passthrough{}, shader, rule);
        // Odd and even numbers of neighbouring triangles that share one voxel.
        expect_same(targets, specks(), box_grid({40, 5, 3}), vp::passthrough{}, shader,
                    vp::voxelize_options{rule, false});
    }
}

template <class T>
void compare_integers(T value) {
    using targets = target_list<vp::target<T, blend::add>, vp::target<T, blend::min>, vp::target<T, blend::max>,
                                vp::target<T, blend::bit_and>, vp::target<T, blend::bit_or>,
                                vp::target<T, blend::bit_xor>, vp::target<T, blend::count>>;
    compare_constants(targets{}, vp::constant(value, value, value, value, value, value, value));
}

} // namespace device_test
