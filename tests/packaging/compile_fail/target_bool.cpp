// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: a target of bits is written target<voxelpipe::bit

#include "common.hpp"

#ifndef VOXELPIPE_CONTROL
using value = bool;
#else
using value = vp::bit;
#endif

int main() { return draw_into<vp::target<value, vp::blend::bit_or>>(vp::passthrough{}, vp::constant(true)) ? 0 : 1; }
