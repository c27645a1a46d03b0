// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cones through the levels of light: at each step the level whose voxels are as wide as the cone, front to back.

#include "world.hpp"

namespace gi {

// log2 of a width of at least 1, linear between powers of two: the same bits on every machine.
[[nodiscard]] VOXELPIPE_HD inline float level_of(float width) {
    const auto bits = vp::core::bit_cast<std::uint32_t>(width);
    const auto whole = static_cast<float>(static_cast<int>(bits >> 23) - 127);
    return whole + (vp::core::bit_cast<float>((bits & 0x7fffffu) | 0x3f800000u) - 1.0f);
}

struct cone_light {
    glm::vec3 light{0.0f};  // radiance that arrives, the sky's included
    float occlusion = 0.0f; // by what is near: 0 open, 1 closed
};

// From `start` voxels away on; the cone is 2 * spread * t voxels wide at distance t. Samples are `narrowest` voxels
// wide at least.
[[nodiscard]] VOXELPIPE_HD inline cone_light trace_cone(const vp::direction_mips_view& mips, const world& w,
                                                        const glm::vec3& from, const glm::vec3& direction, float spread,
                                                        float start, float narrowest) {
    cone_light result;
    float opacity = 0.0f, t = start;
    const auto longest = static_cast<float>(mips.extent.x > mips.extent.y ? mips.extent.x : mips.extent.y);
    const float reach =
        1.8f * (longest > static_cast<float>(mips.extent.z) ? longest : static_cast<float>(mips.extent.z));
    const float near = 0.16f * longest; // what AO counts
    while (t < reach && opacity < 0.99f) {
        // Narrower than the cone, and not much wider than walls are thick: a wider sample would reach behind the
        // surface that the cone starts from, to the far side of its wall.
        const float wide = 1.4f * spread * t < w.widest ? 1.4f * spread * t : w.widest;
        const float width = wide > narrowest ? wide : narrowest;
        const glm::vec3 at = from + direction * t;
        bool outside = false; // and on its way out
        for (int a = 0; a < 3; ++a)
            outside =
                outside || (direction[a] < 0.0f ? at[a] < -width : at[a] > static_cast<float>(mips.extent[a]) + width);
        if (outside) break;
        const glm::vec4 v = mips.sample(level_of(width), at, direction);
        if (v.w > 0.0f) {
            // Opacities along a cone are added, not multiplied. A sample is the part of the cone that is closed there;
            // linear filtering spreads a wall over several samples, which multiplied let a fifth of the light through a
            // closed room's walls. Steps of three quarters of a sample's width would add up to a wall with a weight of
            // 3/4; somewhat more closes cones that are widening too.
            const float closed = 0.95f * v.w, open = 1.0f - opacity;
            const float weight = closed < open ? closed : open;
            result.light = result.light + glm::vec3(v) * (weight / v.w);
            result.occlusion = result.occlusion + weight * (near / (near + t));
            opacity = opacity + weight;
        }
        t = t + 0.75f * width;
    }
    result.light = result.light + w.sky(direction) * (opacity < 0.99f ? 1.0f - opacity : 0.0f);
    return result;
}

// Six cones over the hemisphere around the normal: irradiance / pi, and mean occlusion by the cosine. turn, from 0 to
// 1, turns five of them from where they are to their neighbours.
[[nodiscard]] VOXELPIPE_HD inline cone_light gather(const vp::direction_mips_view& mips, const world& w,
                                                    const glm::vec3& at, const glm::vec3& normal, float narrowest,
                                                    float turn) {
    // Any two vectors across the normal that turn with it continuously around most of the sphere.
    const glm::vec3 other = normal.y > -0.9f && normal.y < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    const glm::vec3 c = glm::cross(normal, other);
    const glm::vec3 p = c / vp::exact::sqrt(glm::dot(c, c)), q = glm::cross(p, normal);
    const float half = 0.72654253f * turn, scale = 1.0f / (1.0f + half * half); // tan 36 degrees
    const float cosine = (1.0f - half * half) * scale, sine = 2.0f * half * scale;
    const glm::vec3 u = p * cosine + q * sine, v = q * cosine - p * sine;
    // One along the normal, five at 60 degrees from it, each 60 degrees wide.
    constexpr float sides[6][3] = {{0.0f, 0.0f, 1.0f},
                                   {0.8660254f, 0.0f, 0.5f},
                                   {0.26761657f, 0.82363910f, 0.5f},
                                   {-0.70062927f, 0.50903696f, 0.5f},
                                   {-0.70062927f, -0.50903696f, 0.5f},
                                   {0.26761657f, -0.82363910f, 0.5f}};
    cone_light sum;
    const glm::vec3 from = at + normal * narrowest;
    for (int i = 0; i < 6; ++i) {
        const glm::vec3 d = u * sides[i][0] + v * sides[i][1] + normal * sides[i][2];
        const cone_light l = trace_cone(mips, w, from, d, 0.57735f, 0.6f * narrowest, narrowest);
        const float part = i == 0 ? 0.25f : 0.15f;
        sum.light = sum.light + l.light * part;
        sum.occlusion = sum.occlusion + l.occlusion * part;
    }
    return sum;
}

} // namespace gi
