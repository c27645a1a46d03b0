// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shaders, targets and the grid of the tests of programs on the device.

#include "../programs/amplify_cases.hpp"
#include "../programs/elements_cases.hpp"
#include "device_test.hpp"

#include <vector>

namespace programs_support {

namespace vp = voxelpipe;

// Copy i at place i, with or without a varying.
struct placed {
    VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
        const auto s = static_cast<float>(v.instance);
        return {vp::exact::fma(7.25f, s, v.position.x), vp::exact::fma(5.5f, s, v.position.y),
                vp::exact::fma(-3.0f, s, v.position.z)};
    }
};
struct spot {
    float along;
};
struct placed_spot {
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        return vp::vertex_output{placed{}(v), spot{vp::exact::mul(static_cast<float>(v.instance), v.position.x)}};
    }
};
struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<spot>& f) const {
        return vp::outputs(glm::uvec4(f.instance, f.triangle, f.primitive, 1), f.varyings.along)
            .discard_if(f.primitive % 5 == 0);
    }
};

using bits = vp::target<vp::bit, vp::blend::bit_or>;
using ids = vp::target<glm::uvec4, vp::blend::replace>;
using sums = vp::target<float, vp::blend::add>;

inline const glm::ivec3 extent{45, 39, 50};
constexpr vp::coverage async_rule = vp::coverage::thin;

template <class T>
vp::array_view<const T> array_of(const std::vector<T>& v) {
    return {v.data(), v.size()};
}

} // namespace programs_support
