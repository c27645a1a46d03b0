// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// max-errors: 2 (the backend that would store them says the same)
// expect: must be trivially copyable

#include "common.hpp"

#include <string>
#include <vector>

int main() {
    vp::cpu_backend backend;
#ifndef VOXELPIPE_CONTROL
    const std::vector<std::string> labels(3);
#else
    const std::vector<float> labels(3);
#endif
    vp::abuffer<vp::cpu_backend> lists{backend};
    const vp::mesh mesh{backend, positions, triangles, labels};
    return vp::voxelize(backend, mesh, small_grid(), vp::passthrough{}, ones{}, lists).ok() ? 0 : 1;
}
