// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cones through the levels of light: at each step the level whose voxels are as wide as the cone, front to back. A
// point sends a few of a set of cones over its hemisphere; its neighbours send the others, and a mean over the
// neighbours has them all.

#include "rays.hpp"

#include <cmath>
#include <numbers>

namespace gi {

// Cones around +z that share the hemisphere: each stands for the same part of the irradiance.
struct cone_set {
    static constexpr int most = 64;
    glm::vec3 directions[most];
    int count = 0;
    int phases = 0;   // a point of phase p sends cones p, p + phases, p + 2 * phases ...
    float spread = 0; // tangent of half of a cone's angle
};

// count is a multiple of phases, at most cone_set::most.
[[nodiscard]] inline cone_set make_cone_set(int count, int phases) {
    cone_set s;
    s.count = count;
    s.phases = phases;
    const double each = 1.0 - 1.0 / count; // cosine of half the angle of a cone with its part of the hemisphere
    s.spread = static_cast<float>(std::sqrt(1 - each * each) / each);
    for (int i = 0; i < count; ++i) { // a spiral, as sunflowers have it
        const double squared = (i + 0.5) / count, r = std::sqrt(squared);
        const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
        s.directions[i] = glm::vec3(r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - squared));
    }
    return s;
}

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

// One cone, from `start` voxels away on; it is 2 * spread * t voxels wide at distance t.
struct cone {
    glm::vec3 from, direction; // of a surface; unit
    float rise;                // height over the surface that a sample may use, for each voxel of the way
    float spread, start;
    float narrowest, widest; // voxels that samples are wide at least and at most
};
[[nodiscard]] VOXELPIPE_HD inline cone_light trace_cone(const vp::direction_mips_view& mips, const world& w,
                                                        const cone& c) {
    cone_light result;
    float opacity = 0.0f, t = c.start;
    const auto longest = static_cast<float>(mips.extent.x > mips.extent.y ? mips.extent.x : mips.extent.y);
    const float reach =
        1.8f * (longest > static_cast<float>(mips.extent.z) ? longest : static_cast<float>(mips.extent.z));
    const float near = 0.16f * longest; // what AO counts
    while (t < reach && opacity < 0.99f) {
        // Narrower than the cone, than reaches down to the surface that it starts from, and than would reach through
        // the thinnest wall.
        const float high = w.shape.lift * (c.narrowest + c.rise * t), most = high < c.widest ? high : c.widest;
        const float wide = w.shape.overlap * c.spread * t < most ? w.shape.overlap * c.spread * t : most;
        const float width = wide > c.narrowest ? wide : c.narrowest;
        const glm::vec3 at = c.from + c.direction * t;
        bool outside = false; // and on its way out
        for (int a = 0; a < 3; ++a)
            outside = outside ||
                      (c.direction[a] < 0.0f ? at[a] < -width : at[a] > static_cast<float>(mips.extent[a]) + width);
        if (outside) break;
        const glm::vec4 v = mips.sample(level_of(width), at, c.direction);
        if (v.w > 0.0f) {
            // Opacities along a cone are added: multiplied they let a fifth of the light through a closed room's walls.
            const float closed = w.shape.weight * v.w, open = 1.0f - opacity;
            const float weight = closed < open ? closed : open;
            result.light = result.light + glm::vec3(v) * (weight / v.w);
            result.occlusion = result.occlusion + weight * (near / (near + t));
            opacity = opacity + weight;
        }
        t = t + 0.75f * width;
    }
    result.light = result.light + w.sky(c.direction) * (opacity < 0.99f ? 1.0f - opacity : 0.0f);
    return result;
}

// Any two vectors across a normal that turn with it continuously around most of the sphere.
struct tangents {
    glm::vec3 p, q;
};
[[nodiscard]] VOXELPIPE_HD inline tangents tangents_of(const glm::vec3& normal) {
    const glm::vec3 other = normal.y > -0.9f && normal.y < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    const glm::vec3 c = glm::cross(normal, other), p = c / vp::exact::sqrt(glm::dot(c, c));
    return {p, glm::cross(p, normal)};
}
// A voxel, and a sample of its width, reach farther along a normal that is no axis: by the sum of its components. With
// one height for all normals, samples over a wall that is turned meet its steps, in stripes.
[[nodiscard]] VOXELPIPE_HD inline float reach_of(const glm::vec3& normal) {
    return (normal.x < 0.0f ? -normal.x : normal.x) + (normal.y < 0.0f ? -normal.y : normal.y) +
           (normal.z < 0.0f ? -normal.z : normal.z);
}
// Where the cones of a surface's point start.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 start_over(const glm::vec3& at, const glm::vec3& normal, float narrowest) {
    return at + normal * (1.3f * narrowest * reach_of(normal));
}
// The way from there that the cones of settings::thorough start at: off walls beside the point, up to the height over
// its own surface. Samples next to a wall read its voxels from within, which are dark, whatever light the wall has:
// corners would be black seams.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 off_walls(const world& w, const triangle_lists& lists, const glm::vec3& at,
                                                      const glm::vec3& normal, float narrowest) {
    const tangents t = tangents_of(normal);
    const glm::vec3 from = start_over(at, normal, narrowest);
    const float room = 1.3f * narrowest * reach_of(normal);
    // Between two walls the ways cancel.
    return t.p * (lists.trace(w, from, t.p, room, false).distance - lists.trace(w, from, -t.p, room, false).distance) +
           t.q * (lists.trace(w, from, t.q, room, false).distance - lists.trace(w, from, -t.q, room, false).distance);
}

// The mean of a phase's cones: irradiance / pi, and occlusion, as far as this phase knows them.
[[nodiscard]] VOXELPIPE_HD inline cone_light gather(const vp::direction_mips_view& mips, const world& w,
                                                    const cone_set& set, int phase, const glm::vec3& at,
                                                    const glm::vec3& normal, float narrowest,
                                                    const glm::vec3* moved = nullptr) {
    const tangents t = tangents_of(normal);
    const glm::vec3 p = t.p, q = t.q;
    const float reach = reach_of(normal);
    cone_light sum;
    glm::vec3 from = start_over(at, normal, narrowest);
    if (moved != nullptr) from = from + *moved;
    for (int i = phase; i < set.count; i += set.phases) {
        const glm::vec3 d = set.directions[i];
        const cone_light l = trace_cone(mips, w,
                                        {from, p * d.x + q * d.y + normal * d.z, d.z / reach, set.spread,
                                         0.6f * narrowest, narrowest, w.shape.widest});
        sum.light = sum.light + l.light;
        sum.occlusion = sum.occlusion + l.occlusion;
    }
    const float part = static_cast<float>(set.phases) / static_cast<float>(set.count);
    return {sum.light * part, sum.occlusion * part};
}

} // namespace gi
