// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: does it take the varyings that the program makes

#include "common.hpp"

struct heated {
    float heat;
};
struct program {
    VOXELPIPE_HD vp::triangles<1, heated> operator()(const vp::triangle<>&) const { return {}; }
};
struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD auto operator()(const vp::fragment<vp::no_varyings>&) const { return vp::outputs(1u); }
#else
    VOXELPIPE_HD auto operator()(const vp::fragment<heated>&) const { return vp::outputs(1u); }
#endif
};

int main() {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, counter> fb{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, vp::geometry{program{}}, shader{}, fb).ok() ? 0
                                                                                                                    : 1;
}
