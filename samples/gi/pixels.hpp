// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A pixel: the nearest triangle along its ray, direct light by shadow rays, indirect light by six diffuse cones and one
// specular cone; or another view of the voxels.

#include "cones.hpp"
#include "rays.hpp"
#include "settings.hpp"

#include <glm/gtc/type_precision.hpp>

namespace gi {

// Noise that stands still: of a pixel's place and a number.
[[nodiscard]] VOXELPIPE_HD inline float noise_of(std::uint32_t pixel, std::uint32_t number) { // in [0, 1)
    std::uint32_t h = pixel * 0x9e3779b9u ^ (number + 1u) * 0x85ebca6bu;
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return static_cast<float>((h ^ h >> 16) >> 8) * 0x1p-24f;
}

struct eye_rays {                      // grid coordinates
    glm::vec3 eye, forward, right, up; // right and up: half of the picture's sides at distance 1
};

struct draw_pixels {
    gi::world world;
    vp::direction_mips_view mips;
    triangle_lists lists;
    eye_rays eye;
    view_choice view;
    int level;                  // of view_choice::level
    int width, height, samples; // samples a side of a pixel
    float exposure;
    glm::u8vec4* out; // rows from the top

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto pixel = static_cast<std::uint32_t>(i);
        const int x = static_cast<int>(pixel % static_cast<std::uint32_t>(width)),
                  y = static_cast<int>(pixel / static_cast<std::uint32_t>(width));
        glm::vec3 sum(0.0f);
        const auto side = static_cast<float>(samples);
        for (int s = 0; s < samples * samples; ++s) {
            const int column = s % samples, row = s / samples;
            const float across = (static_cast<float>(column) + 0.5f) / side,
                        down = (static_cast<float>(row) + 0.5f) / side;
            const float u = 2.0f * (static_cast<float>(x) + across) / static_cast<float>(width) - 1.0f,
                        v = 1.0f - 2.0f * (static_cast<float>(y) + down) / static_cast<float>(height);
            const glm::vec3 d = eye.forward + eye.right * u + eye.up * v;
            const glm::vec3 direction = d / vp::exact::sqrt(glm::dot(d, d));
            // Each sample is mapped to the screen's range before the mean, so that edges against lamps are smooth too.
            sum = sum + tone(radiance(direction, pixel, static_cast<std::uint32_t>(s)) * exposure);
        }
        const glm::vec3 color = sum * (1.0f / (side * side));
        out[i] = voxelize::encode(*world.tables, glm::vec4(color, 1.0f));
    }

private:
    // Radiance to the range of a screen: white from 5 on, with some contrast.
    [[nodiscard]] VOXELPIPE_HD static glm::vec3 tone(const glm::vec3& c) {
        glm::vec3 r;
        for (int k = 0; k < 3; ++k) {
            const float x = c[k] < 5.0f ? c[k] : 5.0f;
            const float y = x * (1.0f + x * 0.04f) / (1.0f + x);
            r[k] = 0.6f * y + 0.4f * (y * y * (3.0f - 2.0f * y));
        }
        return r;
    }

    [[nodiscard]] VOXELPIPE_HD glm::vec3 radiance(const glm::vec3& direction, std::uint32_t pixel,
                                                  std::uint32_t sample) const {
        if (view == view_choice::level) return voxel_color(direction);
        const ray_hit hit = lists.trace(world, eye.eye, direction, 1e6f, false);
        if (!hit.found)
            return view == view_choice::final || view == view_choice::direct ? world.sky(direction) : glm::vec3(0.0f);
        surface s = world.at(hit.triangle, hit.weights);
        if (glm::dot(s.normal, direction) > 0.0f) s.normal = -s.normal;
        const glm::vec3 diffuse = s.color * (1.0f - s.metallic);
        glm::vec3 light(0.0f);
        if (view == view_choice::final || view == view_choice::direct)
            light = s.emission + diffuse * direct(s, pixel, sample) * (1.0f / 3.14159265f);
        if (view == view_choice::direct) return light;
        const cone_light around = gather(mips, world, s.position, s.normal, 1.0f,
                                         static_cast<float>(sample) / static_cast<float>(samples * samples));
        if (view == view_choice::ao) return glm::vec3(3.0f * (1.0f - around.occlusion) / exposure);
        light = light + diffuse * around.light;
        if (s.roughness < 0.99f || s.metallic > 0.0f) light = light + reflection(s, direction);
        return light;
    }

    [[nodiscard]] VOXELPIPE_HD glm::vec3 direct(const surface& s, std::uint32_t pixel, std::uint32_t sample) const {
        // A 2 x 2 pattern of points of the light, each anywhere in its quarter.
        glm::vec3 sum(0.0f);
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t number = 8 * sample + 2 * k;
            const float u = static_cast<float>(k & 1u) - noise_of(pixel, number),
                        v = static_cast<float>(k >> 1) - noise_of(pixel, number + 1);
            const light_sample l = sample_light(world.light, s.position, s.normal, false, u, v);
            if (l.irradiance == glm::vec3(0.0f)) continue;
            if (lists.blocks(world, s.position + s.normal * 0.12f, l.direction, l.distance - 0.6f)) continue;
            sum = sum + l.irradiance * 0.25f;
        }
        return sum;
    }

    // One cone along the mirrored ray, as wide as the surface is rough, by Schlick's reflectance.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 reflection(const surface& s, const glm::vec3& direction) const {
        const float along = glm::dot(direction, s.normal);
        const glm::vec3 mirrored = direction - s.normal * (2.0f * along);
        const float grazing = 1.0f + along, squared = grazing * grazing, power = squared * squared * grazing;
        const glm::vec3 straight = s.metallic > 0.0f ? s.color : glm::vec3(0.04f);
        const float gloss = 1.0f - s.roughness;
        const glm::vec3 share = straight + (glm::vec3(1.0f) - straight) * (power * gloss * gloss);
        const float spread = s.roughness * 0.7f > 0.03f ? s.roughness * 0.7f : 0.03f;
        return share * trace_cone(mips, world, s.position + s.normal * 1.2f, mirrored, spread, 1.0f, 1.0f).light;
    }

    // The first voxel of a level that is not empty, flat.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 voxel_color(const glm::vec3& direction) const {
        const float scale = 1.0f / static_cast<float>(1 << level);
        glm::vec3 found = world.sky(direction);
        const draw_pixels& p = *this;
        vp::walk_cells(vp::mip_extent(mips.extent, level), eye.eye * scale, direction, 1e6f,
                       [&](const vp::walked_cell<float>& at) {
                           const int towards = 2 * at.axis + (at.from_above ? 1 : 0);
                           const glm::vec4 v = p.mips.fetch(p.level, towards, at.cell);
                           if (!(v.w > 0.06f)) return false;
                           found = glm::vec3(v) / v.w;
                           return true;
                       });
        return found;
    }
};

} // namespace gi
