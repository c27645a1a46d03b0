// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: VoxelPipe needs C\+\+20
// max-errors: 2
// flags: -std=c++17

#include <voxelpipe/voxelpipe.hpp>

int main() { return 0; }
