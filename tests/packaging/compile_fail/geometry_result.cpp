// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: a geometry program must return vp::triangles<N, Varyings>, N at most 256

#include "common.hpp"

struct program {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD vp::triangles<257> operator()(const vp::triangle<>&) const { return {}; }
#else
    VOXELPIPE_HD vp::triangles<256> operator()(const vp::triangle<>&) const { return {}; }
#endif
};

int main() {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, counter> fb{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, vp::geometry{program{}}, ones{}, fb).ok() ? 0
                                                                                                                  : 1;
}
