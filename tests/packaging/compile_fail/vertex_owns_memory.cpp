// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: vertex shader must be trivially copyable

#include "common.hpp"

#include <string>

struct shader {
#ifndef VOXELPIPE_CONTROL
    std::string name;
#else
    const char* name;
#endif
    VOXELPIPE_HD
    glm::vec3 operator()(const vp::vertex<>& v) const { return v.position; }
};

int main() { return draw_into<counter>(shader{}, ones{}) ? 0 : 1; }
