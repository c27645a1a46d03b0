// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values of a sample beside its distance: those of the nearest triangle, at its closest point.

#include "draw/surface.hpp"

#include <voxelpipe/distance/distance.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

namespace voxelize {

// Values and order of the render targets: distance, number of the nearest triangle (2^32 - 1: none), encoded colour,
// normal, world position along the depth axis. Alpha masks cut nothing out: a distance is to the whole triangle.
struct nearest_shader {
    surface_fragment_shader surface;
    bool wants_color = false;

    VOXELPIPE_HD auto operator()(const vp::distance_fragment<surface_varyings>& f) const {
        const float none = std::numeric_limits<float>::quiet_NaN();
        if (!f.in_band) return vp::outputs(f.distance, f.primitive, glm::u8vec4(0), glm::vec3(0.0f), none);
        glm::u8vec4 color(0);
        if (wants_color) color = encode(*surface.tables, surface.shade(at_closest(f), f.varyings));
        const int axis = surface.depth_axis;
        const float depth =
            vp::exact::to_float(vp::exact::to_double(f.varyings.position[axis]) + surface.depth_reference);
        return vp::outputs(f.distance, f.primitive, color, f.normal, depth);
    }

private:
    // What the surface's shader asks of its fragments: the side of a voxel as it is seen along the dominant axis.
    [[nodiscard]] static VOXELPIPE_HD vp::fragment<surface_varyings>
    at_closest(const vp::distance_fragment<surface_varyings>& f) {
        vp::fragment<surface_varyings> seen{};
        seen.triangle = f.triangle;
        seen.draw = f.draw;
        seen.instance = f.instance;
        seen.primitive = f.primitive;
        for (int a = 1; a < 3; ++a)
            if (std::abs(f.normal[a]) > std::abs(f.normal[seen.axis])) seen.axis = a;
        seen.front_facing = f.side >= 0;
        seen.voxel = f.voxel;
        seen.barycentric = f.barycentric;
        seen.normal = f.normal;
        seen.varyings = f.varyings;
        for (int i = 0; i < 3; ++i) seen.vertex_varyings[i] = f.vertex_varyings[i];
        return seen;
    }
};

} // namespace voxelize
