// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene as voxels, made again in every frame: bits at twice the resolution, insides filled, for opacity and
// shadows; then one pass with six targets, whose fragment shader lights each fragment by a ray through these bits; then
// one value of light a voxel, with what bounced in the last frame.

#include "cones.hpp"
#include "world.hpp"

#include <voxelpipe/dense_bits.hpp>
#include <voxelpipe/voxelpipe.hpp>

namespace gi {

using bits_target = vp::target<vp::bit, vp::blend::bit_or>;
using sum_target = vp::target<glm::vec3, vp::blend::add>;
using count_target = vp::target<std::uint32_t, vp::blend::count>;
using density_target = vp::target<float, vp::blend::max>;

template <class Backend>
using voxel_framebuffer = // reflected light, emission, colour, normal, number of fragments, density
    vp::framebuffer<Backend, sum_target, sum_target, sum_target, sum_target, count_target, density_target>;

struct light_fragments {
    gi::world world;
    vp::dense_bits bits; // at twice the resolution

    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const surface s = world.at(f.triangle, f.clamped_barycentric());
        const bool sheet = s.density > 1.0f;
        // A ray starts outside of the voxels that the surface itself fills.
        glm::vec3 irradiance(0.0f);
        constexpr float corners[4][2] = {{-0.5f, -0.5f}, {0.5f, -0.5f}, {-0.5f, 0.5f}, {0.5f, 0.5f}};
        const int samples = world.light.position.w == 0.0f ? 1 : 4;
        for (int i = 0; i < samples; ++i) {
            const float u = samples == 1 ? 0.0f : corners[i][0], v = samples == 1 ? 0.0f : corners[i][1];
            const light_sample l = sample_light(world.light, s.position, s.normal, sheet, u, v);
            if (l.irradiance == glm::vec3(0.0f)) continue;
            const float side = glm::dot(l.direction, s.normal) < 0.0f ? -1.0f : 1.0f;
            const glm::vec3 start = s.position + s.normal * (1.4f * side) + l.direction * 0.4f;
            const float limit = l.distance - 3.0f; // short of the lamp's own voxels
            if (limit > 0.0f && bits.blocks(start * 2.0f, l.direction, limit * 2.0f)) continue;
            irradiance = irradiance + l.irradiance * (1.0f / static_cast<float>(samples));
        }
        const glm::vec3 diffuse = s.color * (1.0f - 0.7f * s.metallic); // what a metal reflects blurs here
        return vp::outputs(diffuse * irradiance * (1.0f / 3.14159265f), s.is_light ? glm::vec3(0.0f) : s.emission,
                           diffuse, s.normal, 1u, s.density)
            .discard_if(s.cut);
    }
};

// The targets of one frame, as the steps below read them.
struct voxel_views {
    vp::target_view<sum_target> reflected, emitted, color, normal;
    vp::target_view<count_target> count;
    vp::target_view<density_target> density;
    vp::dense_bits bits;
    glm::ivec3 extent;

    [[nodiscard]] VOXELPIPE_HD glm::ivec3 voxel(std::uint64_t i) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        return {static_cast<int>(i % nx), static_cast<int>(i / nx % ny), static_cast<int>(i / (nx * ny))};
    }
    // The density times the share of the voxel's eighths that are filled, so that nothing jumps when a surface moves.
    [[nodiscard]] VOXELPIPE_HD float opacity(const glm::ivec3& v, float density_of_voxel) const {
        const float a = density_of_voxel * static_cast<float>(vp::exact::count_ones(bits.children(v))) * 0.125f;
        return a < 1.0f ? a : 1.0f;
    }
};

// Light of the voxels that a surface touches: its mean of the fragments, and the bounce of what the last frame's voxels
// sent there.
struct light_surfaces {
    voxel_views voxels;
    gi::world world;
    vp::direction_mips_view last;
    bool bounces; // false: there is no last frame
    glm::vec4* out;
    std::uint32_t* facings;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 v = voxels.voxel(i);
        const std::uint32_t n = voxels.count(v.x, v.y, v.z);
        out[i] = glm::vec4(0.0f);
        facings[i] = 0;
        if (n == 0) return;
        const float part = 1.0f / static_cast<float>(n), density = voxels.density(v.x, v.y, v.z);
        glm::vec3 light = (voxels.reflected(v.x, v.y, v.z) + voxels.emitted(v.x, v.y, v.z)) * part;
        const glm::vec3 sum = voxels.normal(v.x, v.y, v.z);
        const float length = vp::exact::sqrt(glm::dot(sum, sum));
        if (bounces && length > 0.0f) {
            const glm::vec3 normal = sum / length, at = glm::vec3(v) + 0.5f;
            glm::vec3 gathered = gather(last, world, at, normal, 2.0f, 0.0f).light;
            if (density > 1.0f) gathered = (gathered + gather(last, world, at, -normal, 2.0f, 0.0f).light) * 0.5f;
            light = light + voxels.color(v.x, v.y, v.z) * part * gathered;
        }
        const float a = voxels.opacity(v, density);
        out[i] = glm::vec4(light * a, a);
        // Light leaves on the side of the normal. Sheets let it through; a voxel that holds all of a small thing has no
        // side.
        if (density <= 1.0f && length > 0.3f * static_cast<float>(n)) facings[i] = vp::pack_facing(sum / length);
    }
};

// Filled voxels that no surface touches get the light of their neighbours: through a surface voxel that is filled in
// part, one sees the one behind it.
struct light_insides {
    voxel_views voxels;
    glm::vec4* out; // of light_surfaces; only other voxels are read than written
    std::uint32_t* facings;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 v = voxels.voxel(i);
        if (voxels.count(v.x, v.y, v.z) != 0) return;
        const float a = voxels.opacity(v, 1.0f);
        if (a == 0.0f) return;
        glm::vec4 sum(0.0f);
        glm::vec3 normal(0.0f);
        for (int side = 0; side < 6; ++side) {
            glm::ivec3 w = v;
            w[side >> 1] += (side & 1) != 0 ? 1 : -1;
            if (!voxels.count.has(w.x, w.y, w.z) || voxels.count(w.x, w.y, w.z) == 0) continue;
            sum = sum + out[vp::direction_mips_view::index(voxels.extent, w)];
            normal = normal + voxels.normal(w.x, w.y, w.z) * (1.0f / static_cast<float>(voxels.count(w.x, w.y, w.z)));
        }
        // Between two sides of a thin wall it stays dark.
        const float length = vp::exact::sqrt(glm::dot(normal, normal));
        const bool lit = sum.w > 0.0f && length > 0.5f;
        out[i] = lit ? glm::vec4(glm::vec3(sum) * (a / sum.w), a) : glm::vec4(0.0f, 0.0f, 0.0f, a);
        if (lit) facings[i] = vp::pack_facing(normal / length);
    }
};

} // namespace gi
