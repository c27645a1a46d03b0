// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: must return one value per render target

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>& f) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(f.normal.z);
#else
        return vp::outputs(f.normal.z, 1u);
#endif
    }
};

int main() { return draw_into<vp::target<float, vp::blend::max>, counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
