// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: for an A-buffer must return one value

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>& f) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(f.barycentric.x, f.barycentric.y);
#else
        return vp::outputs(f.barycentric.x);
#endif
    }
};

int main() { return collect<float>(shader{}) ? 0 : 1; }
