// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: write vp::output<T...> instead of auto

#include "common.hpp"

// A shader for the device only, as a host compiler sees it: nvcc leaves out the body.
struct shader {
#ifndef VOXELPIPE_CONTROL
    auto operator()(const vp::fragment<>&) const {}
#else
    vp::output<std::uint32_t> operator()(const vp::fragment<>&) const { return {}; }
#endif
};

int main() { return draw_into<counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
