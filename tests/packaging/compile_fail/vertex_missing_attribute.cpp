// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: vertex shader cannot be called with

#include "common.hpp"

struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD
    glm::vec3 operator()(const vp::vertex<float>& v) const { return v.position * vp::get<0>(v); }
#else
    VOXELPIPE_HD
    glm::vec3 operator()(const vp::vertex<>& v) const { return v.position; }
#endif
};

int main() { return draw_into<counter>(shader{}, ones{}) ? 0 : 1; }
