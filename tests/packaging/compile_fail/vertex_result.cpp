// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: vertex shader must return glm::vec3 or vertex_output

#include "common.hpp"

struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD
    glm::vec4 operator()(const vp::vertex<>& v) const { return glm::vec4(v.position, 1.0f); }
#else
    VOXELPIPE_HD
    glm::vec3 operator()(const vp::vertex<>& v) const { return v.position; }
#endif
};

int main() { return draw_into<counter>(shader{}, ones{}) ? 0 : 1; }
