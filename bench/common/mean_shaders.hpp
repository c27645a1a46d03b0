// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The shaders of the sparse benchmarks' mean: the sums of four floats that vary, and a count.

#include <voxelpipe/blend.hpp>
#include <voxelpipe/shader.hpp>

#include <glm/vec4.hpp>

#include <cstdint>

namespace bench {

struct position_varying {
    glm::vec4 value;
};
struct pass_position {
    template <class Vertex>
    VOXELPIPE_HD voxelpipe::vertex_output<position_varying> operator()(const Vertex& v) const {
        return {v.position, {glm::vec4(v.position, 1.0f)}};
    }
};
struct give_position {
    VOXELPIPE_HD voxelpipe::output<glm::vec4, std::uint32_t>
    operator()(const voxelpipe::fragment<position_varying>& f) const {
        return voxelpipe::outputs(f.varyings.value, 1u);
    }
};

} // namespace bench
