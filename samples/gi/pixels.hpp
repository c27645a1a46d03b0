// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// From rays to pixels, in three passes: the nearest triangle along each ray; there a ray to the light, a few diffuse
// cones and a specular one; then the mean of what neighbours on the same surface received, and the colour. Or, in one
// pass, a view of the voxels of a level.

#include "cones.hpp"
#include "rays.hpp"
#include "settings.hpp"

#include <glm/gtc/type_precision.hpp>

namespace gi {

// The rays of a picture: a grid of points of it, `samples` a side of each pixel.
struct eye_rays {
    glm::vec3 eye, forward, right, up; // grid coordinates; right and up: half of the picture's sides at distance 1
    int width, height;                 // rays

    [[nodiscard]] VOXELPIPE_HD glm::vec3 direction(int x, int y) const {
        const float u = 2.0f * (static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 1.0f,
                    v = 1.0f - 2.0f * (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
        const glm::vec3 d = forward + right * u + up * v;
        return d / vp::exact::sqrt(glm::dot(d, d));
    }
    // Neighbours have different phases: each block of 4 x 4 rays has all of them.
    [[nodiscard]] VOXELPIPE_HD static int phase(int x, int y) { return (x & 3) + 4 * (y & 3); }
    static constexpr int num_phases = 16;
};

// What a ray meets.
struct alignas(16) seen_point {
    static constexpr std::uint32_t nothing = ~0u;
    glm::vec3 position{0.0f}; // grid coordinates
    std::uint32_t triangle = nothing;
    glm::vec3 normal{0.0f}; // towards the eye
    float y = 0, z = 0;     // barycentric weights of the second and third corner
};

struct see_points {
    gi::world world;
    triangle_lists lists;
    eye_rays rays;
    seen_point* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto n = static_cast<std::uint64_t>(rays.width);
        const glm::vec3 direction = rays.direction(static_cast<int>(i % n), static_cast<int>(i / n));
        const ray_hit hit = lists.trace(world, rays.eye, direction, 1e6f, false);
        seen_point p;
        if (hit.found) {
            const surface s = world.at(hit.triangle, hit.weights);
            p.position = s.position;
            // By the triangle's own side, so that neighbours agree where the interpolated normal is across the ray.
            p.normal = glm::dot(world.across(hit.triangle), direction) > 0.0f ? -s.normal : s.normal;
            p.triangle = hit.triangle;
            p.y = hit.weights.y;
            p.z = hit.weights.z;
        }
        out[i] = p;
    }
};

// Noise that stands still, in [0, 1).
[[nodiscard]] VOXELPIPE_HD inline float noise_of(std::uint32_t number) {
    std::uint32_t h = (number ^ number >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return static_cast<float>((h ^ h >> 16) >> 8) * 0x1p-24f;
}

// What arrives at a point, as far as its phase knows it.
struct alignas(16) received_light {
    glm::vec3 diffuse{0.0f}; // irradiance / pi of the cones
    float occlusion = 0;     // of the cones
    glm::vec3 mirrored{0.0f};
    float visible = -1; // part of the light; less than 0: not known
};

struct receive_light {
    gi::world world;
    vp::direction_mips_view mips;
    triangle_lists lists;
    eye_rays rays;
    view_choice view;
    cone_set cones; // of 16 phases
    const seen_point* points;
    received_light* out;

    // Rays of one phase come one after the other, 32 of each block of 32 x 16, so that threads that work side by side
    // send their cones the same way.
    static constexpr int block_x = 32, block_y = 16;
    [[nodiscard]] static std::uint64_t count(const eye_rays& rays) {
        const auto blocks = [](int n, int size) { return static_cast<std::uint64_t>((n + size - 1) / size); };
        return blocks(rays.width, block_x) * blocks(rays.height, block_y) * (block_x * block_y);
    }

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const int in_block = static_cast<int>(i % (block_x * block_y)), phase = in_block / 32, lane = in_block % 32;
        const auto block = static_cast<int>(i / (block_x * block_y)), across = (rays.width + block_x - 1) / block_x;
        const int x = block % across * block_x + 4 * (lane & 7) + (phase & 3),
                  y = block / across * block_y + 4 * (lane >> 3) + (phase >> 2);
        if (x >= rays.width || y >= rays.height) return;
        const std::size_t ray =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(rays.width) + static_cast<std::size_t>(x);
        const seen_point& p = points[ray];
        if (p.triangle == seen_point::nothing) return;
        received_light r;
        if (view == view_choice::final || view == view_choice::direct) r.visible = visible(p, x, y);
        if (view != view_choice::direct) {
            const cone_light around = gather(mips, world, cones, phase, p.position, p.normal, 1.0f);
            r.diffuse = around.light;
            r.occlusion = around.occlusion;
        }
        if (view == view_choice::final || view == view_choice::indirect) {
            const surface s = world.at(p.triangle, {1.0f - p.y - p.z, p.y, p.z});
            if (s.is_shiny()) r.mirrored = mirrored(p, s, rays.direction(x, y));
        }
        out[ray] = r;
    }

private:
    // The visible part of the light, by rays to points of it: the sun in 4 x 4 parts, a lamp in 4 x 8, those of the
    // ray's phase, each at a place of its own. Less than 0 if the surface faces away from them.
    [[nodiscard]] VOXELPIPE_HD float visible(const seen_point& p, int x, int y) const {
        const std::uint32_t noise =
            static_cast<std::uint32_t>(x) * 0x9e3779b9u ^ static_cast<std::uint32_t>(y) * 0x85ebca6bu;
        const std::uint32_t count = world.light.position.w == 0.0f ? 1 : 2;
        float all = 0.0f, seen = 0.0f;
        for (std::uint32_t k = 0; k < count; ++k) {
            const float within = (static_cast<float>(k) + noise_of(noise + 2 * k + 1)) / static_cast<float>(count);
            const float u = 0.5f * (static_cast<float>(x & 3) + noise_of(noise + 2 * k)) - 1.0f,
                        v = 0.5f * (static_cast<float>(y & 3) + within) - 1.0f;
            const light_sample l = sample_light(world.light, p.position, p.normal, false, u, v);
            if (l.part == 0.0f) continue;
            all = all + l.part;
            if (!lists.blocks(world, p.position + p.normal * 0.12f, l.direction, l.distance - 0.6f))
                seen = seen + l.part;
        }
        return all > 0.0f ? seen / all : -1.0f;
    }
    // One cone along the mirrored ray, as wide as the surface is rough.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 mirrored(const seen_point& p, const surface& s,
                                                  const glm::vec3& direction) const {
        const float along = glm::dot(direction, p.normal);
        const float spread = s.roughness * 0.7f > 0.03f ? s.roughness * 0.7f : 0.03f;
        return trace_cone(
                   mips, world,
                   {p.position + p.normal * 1.2f, direction - p.normal * (2.0f * along), -along, spread, 1.0f, 1.0f})
            .light;
    }
};

struct draw_pixels {
    gi::world world;
    eye_rays rays;
    view_choice view;
    int samples; // a side of a pixel
    float exposure;
    const seen_point* points;
    const received_light* received;
    glm::u8vec4* out; // rows from the top

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto n = static_cast<std::uint64_t>(rays.width / samples);
        const int x = samples * static_cast<int>(i % n), y = samples * static_cast<int>(i / n);
        glm::vec3 sum(0.0f);
        // Each sample is mapped to the screen's range before the mean, so that edges against lamps are smooth too.
        for (int s = 0; s < samples * samples; ++s)
            sum = sum + tone(radiance(x + s % samples, y + s / samples) * exposure);
        const glm::vec3 color = sum * (1.0f / static_cast<float>(samples * samples));
        out[i] = voxelize::encode(*world.tables, glm::vec4(color, 1.0f));
    }
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

private:
    [[nodiscard]] VOXELPIPE_HD std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(rays.width) + static_cast<std::size_t>(x);
    }
    [[nodiscard]] VOXELPIPE_HD glm::vec3 radiance(int x, int y) const {
        const seen_point& p = points[index(x, y)];
        const glm::vec3 direction = rays.direction(x, y);
        if (p.triangle == seen_point::nothing)
            return view == view_choice::final || view == view_choice::direct ? world.sky(direction) : glm::vec3(0.0f);
        const received_light around = mean_around(x, y, p);
        if (view == view_choice::ao) return glm::vec3(3.0f * (1.0f - around.occlusion) / exposure);
        const surface s = world.at(p.triangle, {1.0f - p.y - p.z, p.y, p.z});
        const glm::vec3 diffuse = s.color * (1.0f - s.metallic);
        glm::vec3 light(0.0f);
        if (view != view_choice::indirect)
            light = s.emission +
                    diffuse * world.light.color *
                        (around.visible * mean_light(world.light, s.position, p.normal, false) * (1.0f / 3.14159265f));
        if (view == view_choice::direct) return light;
        light = light + diffuse * around.diffuse;
        if (s.is_shiny()) light = light + reflectance(s, p, direction) * received[index(x, y)].mirrored;
        return light;
    }
    // Schlick's.
    [[nodiscard]] VOXELPIPE_HD static glm::vec3 reflectance(const surface& s, const seen_point& p,
                                                            const glm::vec3& direction) {
        const float grazing = 1.0f + glm::dot(direction, p.normal), squared = grazing * grazing,
                    power = squared * squared * grazing;
        const glm::vec3 straight = s.color * s.metallic + glm::vec3(0.04f * (1.0f - s.metallic));
        const float gloss = 1.0f - s.roughness;
        return straight + (glm::vec3(1.0f) - straight) * (power * gloss * gloss);
    }

    // The mean over the 5 x 5 rays around one that meet the same surface. Weights 1 2 2 2 1 along each side give every
    // phase the same part.
    [[nodiscard]] VOXELPIPE_HD received_light mean_around(int x, int y, const seen_point& p) const {
        received_light sum;
        sum.visible = 0.0f;
        float weights = 0.0f, light_weights = 0.0f;
        for (int row = y - 2; row <= y + 2; ++row)
            for (int column = x - 2; column <= x + 2; ++column) {
                if (row < 0 || column < 0 || row >= rays.height || column >= rays.width) continue;
                const seen_point& q = points[index(column, row)];
                if (q.triangle == seen_point::nothing) continue;
                const float apart = glm::dot(q.position - p.position, p.normal);
                if (!(apart < 0.7f && apart > -0.7f && glm::dot(p.normal, q.normal) > 0.85f)) continue;
                const float weight =
                    (row == y - 2 || row == y + 2 ? 1.0f : 2.0f) * (column == x - 2 || column == x + 2 ? 1.0f : 2.0f);
                const received_light& r = received[index(column, row)];
                sum.diffuse = sum.diffuse + r.diffuse * weight;
                sum.occlusion = sum.occlusion + r.occlusion * weight;
                if (r.visible >= 0.0f) {
                    sum.visible = sum.visible + r.visible * weight;
                    light_weights = light_weights + weight;
                }
                weights = weights + weight;
            }
        const float part = 1.0f / weights; // the ray itself is one of them
        sum.diffuse = sum.diffuse * part;
        sum.occlusion = sum.occlusion * part;
        if (light_weights > 0.0f) sum.visible = sum.visible / light_weights;
        return sum;
    }
};

// The first voxel of a level that is not empty, flat.
struct draw_level {
    gi::world world;
    vp::direction_mips_view mips;
    eye_rays rays;
    int level;
    float exposure;
    glm::u8vec4* out; // a pixel a ray

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto n = static_cast<std::uint64_t>(rays.width);
        const glm::vec3 direction = rays.direction(static_cast<int>(i % n), static_cast<int>(i / n));
        const float scale = 1.0f / static_cast<float>(1 << level);
        glm::vec3 found = world.sky(direction);
        const draw_level& p = *this;
        vp::walk_cells(vp::mip_extent(mips.extent, level), rays.eye * scale, direction, 1e6f,
                       [&](const vp::walked_cell<float>& at) {
                           const int towards = 2 * at.axis + (at.from_above ? 1 : 0);
                           const glm::vec4 v = p.mips.fetch(p.level, towards, at.cell);
                           if (!(v.w > 0.06f)) return false;
                           found = glm::vec3(v) / v.w;
                           return true;
                       });
        out[i] = voxelize::encode(*world.tables, glm::vec4(draw_pixels::tone(found * exposure), 1.0f));
    }
};

} // namespace gi
