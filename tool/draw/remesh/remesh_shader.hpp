// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What --remesh makes of the model where its surface crosses an edge of the grid: the colour, filtered over a voxel as
// in the tool's voxels, and the normal.

#include "draw/surface.hpp"

namespace voxelize {

struct remesh_shader {
    surface_fragment_shader surface;

    // Linear colour times its weight, and the weight; the normal, which looks outward. What a mask cuts off, or is
    // invisible, weighs next to nothing: a vertex at nothing else has its colour.
    VOXELPIPE_HD auto operator()(const vp::fragment<surface_varyings>& f) const {
        glm::vec4 color(1.0F);
        if (surface.wanted.linear_color) color = surface.shade(f, f.varyings);
        float weight = color.a;
        if (surface.alpha == alpha_mode::mask && surface.is_cut_off(f.varyings)) weight = 0.0F;
        weight = weight > surface_fragment_shader::least_weight ? weight : surface_fragment_shader::least_weight;
        for (int i = 0; i < 3; ++i) color[i] = vp::exact::mul(color[i], weight);
        color.a = weight;
        return vp::outputs(color, f.normal);
    }
};

// The colour of a vertex: a mean of shaded colours.
[[nodiscard]] inline glm::vec3 resolved_color(const glm::vec4& mean) {
    glm::vec3 color(0.0F);
    for (int i = 0; i < 3 && mean.a > 0.0F; ++i) color[i] = vp::exact::div(mean[i], mean.a);
    return color;
}

// The unit normal of a vertex from a mean of normals; 0 where they cancel each other.
[[nodiscard]] inline glm::vec3 resolved_normal(const glm::vec3& mean) {
    const double x = vp::exact::to_double(mean.x), y = vp::exact::to_double(mean.y), z = vp::exact::to_double(mean.z);
    const double square = vp::exact::fma(z, z, vp::exact::fma(y, y, vp::exact::mul(x, x)));
    if (!(square > 1e-12)) return glm::vec3(0.0F);
    const double length = vp::exact::sqrt(square);
    return {vp::exact::to_float(vp::exact::div(x, length)), vp::exact::to_float(vp::exact::div(y, length)),
            vp::exact::to_float(vp::exact::div(z, length))};
}

} // namespace voxelize
