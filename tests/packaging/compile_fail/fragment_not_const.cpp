// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: fragment shader cannot be called with

#include "common.hpp"

struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) { return vp::outputs(1u); }
#else
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const { return vp::outputs(1u); }
#endif
};

int main() { return draw_into<counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
