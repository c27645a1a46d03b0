// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: index past the end

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    glm::vec3 operator()(const vp::vertex<float>& v) const {
#ifndef VOXELPIPE_CONTROL
        static_cast<void>(vp::get<1>(v));
#else
        static_cast<void>(vp::get<0>(v));
#endif
        return v.position;
    }
};

int main() {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, counter> framebuffer{backend, {8, 8, 8}};
    const vp::mesh mesh{backend, positions, triangles, heat};
    return vp::voxelize(backend, mesh, small_grid(), shader{}, ones{}, framebuffer).ok() ? 0 : 1;
}
