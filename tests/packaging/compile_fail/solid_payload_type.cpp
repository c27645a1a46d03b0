// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: another type than the A-buffer's payload

#include "common.hpp"

struct shader {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(f.winding);
#else
        return vp::outputs(f.draw);
#endif
    }
};

int main() {
    vp::cpu_backend backend;
    vp::abuffer<vp::cpu_backend, std::uint32_t> lists{backend};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize_solid(backend, mesh, small_grid(), vp::passthrough{}, shader{}, lists).ok() ? 0 : 1;
}
