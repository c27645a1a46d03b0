// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: varyings may have at most 12 members

#include "common.hpp"

struct many {
    float a, b, c, d, e, f, g, h, i, j, k, l;
#ifndef VOXELPIPE_CONTROL
    float m;
#endif
};

struct vertex_shader {
    template <class Vertex>
    VOXELPIPE_HD auto operator()(const Vertex& v) const {
        return vp::vertex_output<many>{v.position, {}};
    }
};
struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<many>&) const { return vp::outputs(1u); }
};

int main() { return draw_into<counter>(vertex_shader{}, shader{}) ? 0 : 1; }
