// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: output has another type than the A-buffer's payload

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>& f) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(double{f.barycentric.x});
#else
        return vp::outputs(f.barycentric.x);
#endif
    }
};

int main() { return collect<float>(shader{}) ? 0 : 1; }
