// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: payload must be trivially copyable

#include "common.hpp"

#include <string>

#ifndef VOXELPIPE_CONTROL
using payload = std::string;
#else
using payload = float;
#endif

struct shader {
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>&) const { return vp::outputs(payload{}); }
};

int main() { return collect<payload>(shader{}) ? 0 : 1; }
