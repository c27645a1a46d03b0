// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: varyings must be an aggregate of

#include "common.hpp"

struct surface {
#ifndef VOXELPIPE_CONTROL
    surface() {} // no aggregate any more
#endif
    float u;
};

struct place {
    VOXELPIPE_HD
    auto operator()(const vp::vertex<>& v) const { return vp::vertex_output{v.position, surface{}}; }
};

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<surface>&) const { return vp::outputs(1u); }
};

int main() { return draw_into<counter>(place{}, shader{}) ? 0 : 1; }
