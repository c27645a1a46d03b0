// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: the solid's shader cannot be called with const solid_fragment&

#include "common.hpp"

struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.draw); }
#else
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const { return vp::outputs(f.draw); }
#endif
};

int main() {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, counter> framebuffer{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize_solid(backend, mesh, small_grid(), vp::passthrough{}, shader{}, framebuffer).ok() ? 0 : 1;
}
