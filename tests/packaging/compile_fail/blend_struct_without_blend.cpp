// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: blend mode is not defined for this value type

#include "common.hpp"

struct sample {
    float depth;
    std::uint32_t id;
};

#ifndef VOXELPIPE_CONTROL
using blend = vp::blend::max;
#else
struct nearest {
    static constexpr bool order_free = true;
    VOXELPIPE_HD
    sample identity() const { return {1e30f, 0u}; }
    VOXELPIPE_HD
    sample combine(const sample& a, const sample& b) const {
        return a.depth < b.depth || (a.depth == b.depth && a.id < b.id) ? a : b;
    }
};
using blend = nearest;
#endif

int main() { return draw_into<vp::target<sample, blend>>(vp::passthrough{}, vp::constant(sample{1.0f, 1u})) ? 0 : 1; }
