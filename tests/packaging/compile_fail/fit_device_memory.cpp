// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: these positions may be in device memory

#include "common.hpp"

int main() {
    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles};
#ifndef VOXELPIPE_CONTROL
    const vp::grid grid = vp::fit(mesh.view().positions, {8, 8, 8});
#else
    const vp::grid grid = vp::fit(vp::bounds(backend, mesh.view().positions), {8, 8, 8});
#endif
    return grid.extent.x == 8 ? 0 : 1;
}
