// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: vertex attributes must be trivially copyable

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
    const vp::mesh mesh{backend, positions, triangles, labels};
    return mesh.view().num_attributes == 1 ? 0 : 1;
}
