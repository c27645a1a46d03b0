// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: max_level must be 1 to 1024

#include "common.hpp"

struct program {
#ifndef VOXELPIPE_CONTROL
    static constexpr int max_level = 2000;
#else
    static constexpr int max_level = 1024;
#endif
    VOXELPIPE_HD int edge_level(const vp::vertex_output<>&, const vp::vertex_output<>&) const { return 2; }
    VOXELPIPE_HD glm::vec3 operator()(const vp::patch_point<vp::no_varyings>& p) const { return p.position(); }
};

int main() {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, counter> fb{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, vp::tessellate{program{}}, ones{}, fb).ok() ? 0
                                                                                                                    : 1;
}
