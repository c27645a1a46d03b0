// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: needs at least one render target

#include "common.hpp"

int main() {
#ifndef VOXELPIPE_CONTROL
    return draw_into<>(vp::passthrough{}, vp::constant()) ? 0 : 1;
#else
    return draw_into<counter>(vp::passthrough{}, vp::constant(1u)) ? 0 : 1;
#endif
}
