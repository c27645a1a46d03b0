// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: blend mode is not defined for this value type

#include "common.hpp"

#ifndef VOXELPIPE_CONTROL
using value = int;
#else
using value = float;
#endif

int main() {
    return draw_into<vp::target<value, vp::blend::add_unordered>>(vp::passthrough{}, vp::constant(value(1))) ? 0 : 1;
}
