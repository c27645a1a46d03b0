// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: value type must be trivially copyable

#include "common.hpp"

#include <memory>

struct sample {
#ifndef VOXELPIPE_CONTROL
    std::shared_ptr<int> owner;
#else
    const int* owner;
#endif
};

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const { return vp::outputs(sample{}); }
};

int main() { return draw_into<vp::target<sample, vp::blend::replace>>(vp::passthrough{}, shader{}) ? 0 : 1; }
