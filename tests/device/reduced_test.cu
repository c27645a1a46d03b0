// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every kernel on small loads, quick enough for compute-sanitizer.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

struct newest {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 0; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return a * 3 + b; }
};

TEST(Reduced, EveryKindOfTarget) {
    const any_values<vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>, vp::target<double, blend::max>,
                     vp::target<std::uint32_t, blend::replace>, vp::target<std::uint32_t, newest>>
        shader;
    for (const vp::coverage rule : both_rules)
        expect_same<vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>, vp::target<double, blend::max>,
                    vp::target<std::uint32_t, blend::replace>, vp::target<std::uint32_t, newest>>(
            mixed_triangles(300, 30.0f, 60), box_grid({30, 21, 33}), vp::passthrough{}, shader, rule);
}

TEST(Reduced, SplitTilesAndLargeTriangles) {
    mesh_data m = mixed_triangles(1500, 4.0f, 61);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    for (const vp::coverage rule : both_rules)
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid({150, 90, 70}), vp::passthrough{},
                                                        vp::constant(true), rule);
}

TEST(Reduced, Lists) {
    mesh_data m = mixed_triangles(300, 30.0f, 62);
    for (const vp::coverage rule : both_rules)
        expect_same_lists<void>(m, box_grid({30, 21, 33}), vp::passthrough{}, vp::constant(true), rule);
}

} // namespace
