// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: output has another type than its render target

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(1);
#else
        return vp::outputs(1u);
#endif
    }
};

int main() { return draw_into<counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
