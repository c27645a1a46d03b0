// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: needs .static constexpr bool order_free

#include "common.hpp"

struct surface {
    float distance;
};

struct nearest {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD surface identity() const { return {9}; }
    VOXELPIPE_HD surface combine(surface a, surface b) const { return a.distance < b.distance ? a : b; }
#else
    static constexpr bool order_free = true;
    VOXELPIPE_HD surface identity() const { return {9}; }
    VOXELPIPE_HD surface combine(surface a, surface b) const { return a.distance < b.distance ? a : b; }
#endif
};

// Not a template: a program as a user writes it.
int main() {
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<surface, nearest>> framebuffer{backend, {8, 8, 8}};
    const auto shader = vp::constant(surface{1.0f});
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, shader, framebuffer).ok() ? 0 : 1;
}
