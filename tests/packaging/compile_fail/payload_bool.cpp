// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: an A-buffer's payload cannot be bool

#include "common.hpp"

#ifndef VOXELPIPE_CONTROL
using payload = bool;
#else
using payload = std::uint8_t;
#endif

int main() {
    vp::cpu_backend backend;
    const vp::abuffer<vp::cpu_backend, payload> lists{backend};
    return static_cast<int>(lists.num_voxels());
}
