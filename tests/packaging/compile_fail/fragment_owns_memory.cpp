// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// expect: fragment shader must be trivially copyable

#include "common.hpp"

#include <vector>

struct shader {
#ifndef VOXELPIPE_CONTROL
    std::vector<std::uint32_t> table;
#else
    vp::array_view<const std::uint32_t> table;
#endif
    VOXELPIPE_HD
    auto operator()(const vp::fragment<>& f) const { return vp::outputs(table.size() > f.triangle ? 2u : 1u); }
};

int main() { return draw_into<counter>(vp::passthrough{}, shader{}) ? 0 : 1; }
