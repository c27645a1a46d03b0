// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: at most 8 render targets

#include "common.hpp"

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const {
#ifndef VOXELPIPE_CONTROL
        return vp::outputs(1u, 1u, 1u, 1u, 1u, 1u, 1u, 1u, 1u);
#else
        return vp::outputs(1u, 1u, 1u, 1u, 1u, 1u, 1u, 1u);
#endif
    }
};

int main() {
#ifndef VOXELPIPE_CONTROL
    return draw_into<counter, counter, counter, counter, counter, counter, counter, counter, counter>(vp::passthrough{},
                                                                                                      shader{})
               ? 0
               : 1;
#else
    return draw_into<counter, counter, counter, counter, counter, counter, counter, counter>(vp::passthrough{},
                                                                                             shader{})
               ? 0
               : 1;
#endif
}
