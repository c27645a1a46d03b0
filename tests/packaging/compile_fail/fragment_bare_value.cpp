// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: fragment shader must return vp::outputs

#include "common.hpp"

struct shader {
#ifndef VOXELPIPE_CONTROL
    VOXELPIPE_HD
    std::uint32_t operator()(const vp::fragment<>&) const { return 1u; }
#else
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const { return vp::outputs(1u); }
#endif
};

int main() { return draw_into<counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
