// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: compile without -ffast-math
// flags: -ffast-math

#include "common.hpp"

int main() { return draw_into<counter>(vp::passthrough{}, ones{}) ? 0 : 1; }
