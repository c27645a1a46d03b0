// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// From rays to pixels: the nearest triangle along each ray; there a ray to the light, a cone for diffuse light and one
// for reflections; then the mean of what neighbours on the same surface received, and the colour. Or, in one pass, a
// view of the voxels of a level.

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

// Rays in the order in which they are worked on: blocks of 32 x 16. Threads that work side by side have neighbours, 8 x
// 4, or rays of one phase, which send their cones the same way.
struct ray_order {
    static constexpr int across = 32, down = 16, in_block = across * down;
    int width, height, blocks_across;
    explicit ray_order(const eye_rays& rays)
        : width(rays.width), height(rays.height), blocks_across((rays.width + across - 1) / across) {}

    [[nodiscard]] std::uint64_t count() const {
        return static_cast<std::uint64_t>(blocks_across) * static_cast<std::uint64_t>((height + down - 1) / down) *
               in_block;
    }
    // False for numbers without a ray.
    [[nodiscard]] VOXELPIPE_HD bool place(std::uint64_t i, bool by_phase, glm::ivec2& at) const {
        const auto block = static_cast<int>(i / in_block), number = static_cast<int>(i % in_block);
        const int group = number / 32, x = number & 7, y = number / 8 & 3, gx = group & 3, gy = group >> 2;
        at.x = block % blocks_across * across + (by_phase ? 4 * x + gx : 8 * gx + x);
        at.y = block / blocks_across * down + (by_phase ? 4 * y + gy : 4 * gy + y);
        return at.x < width && at.y < height;
    }
    [[nodiscard]] VOXELPIPE_HD std::size_t index(const glm::ivec2& at) const {
        return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(at.x);
    }
};

// The surface that a ray meets: for its own pixel, and for neighbours that ask.
struct seen_point {
    glm::vec3 normal{0.0f}; // towards the eye
    std::uint32_t triangle = 0;
    float y = 0, z = 0; // barycentric weights of the second and third corner
};
struct alignas(16) near_point {
    glm::vec3 position{0.0f};
    std::uint32_t facing = 0; // of the normal, packed; 0: the ray meets nothing
};
// The light that arrives at a point, as far as its phase knows it.
struct alignas(16) received_light {
    glm::vec3 diffuse{0.0f}; // irradiance / pi of the cones; of view_choice::ao, their occlusion
    float visible = -1;      // part of the light; less than 0: not known
};

// One of each for a ray.
struct ray_data {
    seen_point* seen;
    near_point* near;
    received_light* received;
    glm::vec3* mirrored;
    glm::vec3* moved; // of off_walls; null: cones start over their point

    // Sets the place and the number of ray i of an order; false for numbers without a ray, and rays that meet nothing.
    [[nodiscard]] VOXELPIPE_HD bool find(const ray_order& order, std::uint64_t i, bool by_phase, glm::ivec2& at,
                                         std::size_t& ray) const {
        if (!order.place(i, by_phase, at)) return false;
        ray = order.index(at);
        return near[ray].facing != 0;
    }
};

struct see_points {
    gi::world world;
    triangle_lists lists;
    eye_rays rays;
    ray_order order;
    ray_data data;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::ivec2 at;
        if (!order.place(i, false, at)) return;
        const glm::vec3 direction = rays.direction(at.x, at.y);
        const ray_hit hit = lists.trace(world, rays.eye, direction, 1e6f, false);
        seen_point p;
        near_point n;
        if (hit.found) {
            const surface s = world.at(hit.triangle, hit.weights);
            // By the triangle's own side, so that neighbours agree where the interpolated normal is across the ray.
            p.normal = glm::dot(world.across(hit.triangle), direction) > 0.0f ? -s.normal : s.normal;
            p.triangle = hit.triangle;
            p.y = hit.weights.y;
            p.z = hit.weights.z;
            n = {s.position, vp::pack_facing(p.normal)};
        }
        data.seen[order.index(at)] = p;
        data.near[order.index(at)] = n;
    }
};

// Noise that stands still, in [0, 1).
[[nodiscard]] VOXELPIPE_HD inline float noise_of(std::uint32_t number) {
    std::uint32_t h = (number ^ number >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return static_cast<float>((h ^ h >> 16) >> 8) * 0x1p-24f;
}

// The visible part of the light, by rays to points of it: the sun in 4 x 4 parts, a lamp in 4 x 8, those of the ray's
// phase, each at a place of its own. Less than 0 if the surface faces away from them.
struct see_light {
    gi::world world;
    triangle_lists lists;
    ray_order order;
    std::uint32_t finer; // times as many rays
    ray_data data;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::ivec2 at;
        std::size_t ray = 0;
        if (!data.find(order, i, false, at, ray)) return;
        const glm::vec3 position = data.near[ray].position, normal = data.seen[ray].normal;
        const std::uint32_t noise =
            static_cast<std::uint32_t>(at.x) * 0x9e3779b9u ^ static_cast<std::uint32_t>(at.y) * 0x85ebca6bu;
        const std::uint32_t count = (world.light.position.w == 0.0f ? 1 : 2) * finer;
        float all = 0.0f, seen = 0.0f;
        for (std::uint32_t k = 0; k < count; ++k) {
            const float within = (static_cast<float>(k) + noise_of(noise + 2 * k + 1)) / static_cast<float>(count);
            const float u = 0.5f * (static_cast<float>(at.x & 3) + noise_of(noise + 2 * k)) - 1.0f,
                        v = 0.5f * (static_cast<float>(at.y & 3) + within) - 1.0f;
            const light_sample l = sample_light(world.light, position, normal, false, u, v);
            if (l.part == 0.0f) continue;
            all = all + l.part;
            if (!lists.blocks(world, position + normal * 0.12f, l.direction, l.distance - 0.6f)) seen = seen + l.part;
        }
        data.received[ray].visible = all > 0.0f ? seen / all : -1.0f;
    }
};

constexpr float pixel_cone_width = 1.5f; // finer samples show the steps of walls that stand aslant as stripes

struct find_walls {
    gi::world world;
    triangle_lists lists;
    ray_order order;
    ray_data data;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::ivec2 at;
        std::size_t ray = 0;
        if (!data.find(order, i, false, at, ray)) return;
        data.moved[ray] = off_walls(world, lists, data.near[ray].position, data.seen[ray].normal, pixel_cone_width);
    }
};

struct receive_light {
    gi::world world;
    vp::direction_mips_view mips;
    ray_order order;
    bool wants_occlusion;
    cone_set cones; // of 16 phases
    ray_data data;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::ivec2 at;
        std::size_t ray = 0;
        if (!data.find(order, i, true, at, ray)) return;
        const cone_light around =
            gather(mips, world, cones, eye_rays::phase(at.x, at.y), data.near[ray].position, data.seen[ray].normal,
                   pixel_cone_width, data.moved != nullptr ? data.moved + ray : nullptr);
        data.received[ray].diffuse = wants_occlusion ? glm::vec3(around.occlusion) : around.light;
    }
};

// One cone along the mirrored ray, as wide as the surface is rough.
struct receive_mirrored {
    gi::world world;
    vp::direction_mips_view mips;
    eye_rays rays;
    ray_order order;
    ray_data data;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        glm::ivec2 at;
        std::size_t ray = 0;
        if (!data.find(order, i, false, at, ray)) return;
        const seen_point& p = data.seen[ray];
        const surface s = world.at(p.triangle, {1.0f - p.y - p.z, p.y, p.z});
        if (!s.is_shiny()) return;
        const glm::vec3 direction = rays.direction(at.x, at.y);
        const float along = glm::dot(direction, p.normal);
        const float spread = s.roughness * 0.55f > 0.025f ? s.roughness * 0.55f : 0.025f;
        const cone c{
            s.position + p.normal * 1.2f, direction - p.normal * (2.0f * along), -along, spread, 1.0f, 1.0f, 1e9f};
        data.mirrored[ray] = trace_cone(mips, world, c).light;
    }
};

struct draw_pixels {
    gi::world world;
    eye_rays rays;
    view_choice view;
    int samples; // a side of a pixel
    float exposure;
    ray_order order;
    ray_data data;
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
    // Radiance to the range of a screen: white from 5 on, with a little contrast.
    [[nodiscard]] VOXELPIPE_HD static glm::vec3 tone(const glm::vec3& c) {
        glm::vec3 r;
        for (int k = 0; k < 3; ++k) {
            const float x = c[k] < 5.0f ? c[k] : 5.0f;
            const float y = x * (1.0f + x * 0.04f) / (1.0f + x);
            r[k] = 0.9f * y + 0.1f * (y * y * (3.0f - 2.0f * y));
        }
        return r;
    }

private:
    [[nodiscard]] VOXELPIPE_HD glm::vec3 radiance(int x, int y) const {
        const std::size_t ray = order.index({x, y});
        const glm::vec3 direction = rays.direction(x, y);
        if (data.near[ray].facing == 0)
            return view == view_choice::final || view == view_choice::direct ? world.sky(direction) : glm::vec3(0.0f);
        const received_light around = mean_around(x, y);
        if (view == view_choice::ao) return glm::vec3(3.0f * (1.0f - around.diffuse.x) / exposure);
        const seen_point& p = data.seen[ray];
        const surface s = world.at(p.triangle, {1.0f - p.y - p.z, p.y, p.z});
        const glm::vec3 diffuse = s.color * (1.0f - s.metallic);
        glm::vec3 light(0.0f);
        if (view != view_choice::indirect)
            light = s.emission +
                    diffuse * world.light.color *
                        (around.visible * mean_light(world.light, s.position, p.normal, false) * (1.0f / 3.14159265f));
        if (view == view_choice::direct) return light;
        light = light + diffuse * around.diffuse;
        if (s.is_shiny()) light = light + reflectance(s, p, direction) * data.mirrored[ray];
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
    [[nodiscard]] VOXELPIPE_HD received_light mean_around(int x, int y) const {
        const near_point p = data.near[order.index({x, y})];
        glm::vec3 normal;
        for (int a = 0; a < 3; ++a) normal[a] = part_of_facing(p.facing, a);
        received_light sum;
        sum.visible = 0.0f;
        float weights = 0.0f, light_weights = 0.0f;
        for (int row = y - 2; row <= y + 2; ++row)
            for (int column = x - 2; column <= x + 2; ++column) {
                if (row < 0 || column < 0 || row >= rays.height || column >= rays.width) continue;
                const near_point q = data.near[order.index({column, row})];
                const float apart = glm::dot(q.position - p.position, normal);
                float same = 0.0f;
                for (int a = 0; a < 3; ++a) same = same + normal[a] * part_of_facing(q.facing, a);
                if (!(apart < 0.7f && apart > -0.7f && same > 0.85f)) continue;
                const float weight =
                    (row == y - 2 || row == y + 2 ? 1.0f : 2.0f) * (column == x - 2 || column == x + 2 ? 1.0f : 2.0f);
                const received_light r = data.received[order.index({column, row})];
                sum.diffuse = sum.diffuse + r.diffuse * weight;
                weights = weights + weight;
                if (r.visible >= 0.0f) {
                    sum.visible = sum.visible + r.visible * weight;
                    light_weights = light_weights + weight;
                }
            }
        sum.diffuse = sum.diffuse / weights; // the ray itself is one of them
        if (light_weights > 0.0f) sum.visible = sum.visible / light_weights;
        return sum;
    }
    [[nodiscard]] VOXELPIPE_HD static float part_of_facing(std::uint32_t facing, int axis) {
        return static_cast<float>(static_cast<std::int8_t>(facing >> (8 * axis) & 0xffu)) * (1.0f / 127.0f);
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
                           glm::vec4 v = p.mips.fetch(p.level, towards, at.cell);
                           if (!(v.w > 0.06f)) return false;
                           // Light leaves on the side of a voxel's normal. The others show half of it, those of larger
                           // voxels what another side has: black would look like a hole.
                           if (p.level == 0) {
                               const std::size_t i = vp::direction_mips_view::index(p.mips.extent, at.cell);
                               const glm::vec4 all = vp::unpack_light(p.mips.finest[i]) * 0.5f;
                               if (v.x + v.y + v.z < all.x + all.y + all.z) v = glm::vec4(glm::vec3(all), v.w);
                           }
                           for (int side = 0; side < 6 && v.x + v.y + v.z == 0.0f; ++side) {
                               const glm::vec4 other = p.mips.fetch(p.level, side, at.cell);
                               if (other.w > 0.06f) v = other;
                           }
                           found = glm::vec3(v) / v.w;
                           return true;
                       });
        out[i] = voxelize::encode(*world.tables, glm::vec4(draw_pixels::tone(found * exposure), 1.0f));
    }
};

} // namespace gi
