// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene as shaders see it on a backend, in grid coordinates: voxel (i, j, k) is the box from (i, j, k) to
// (i + 1, j + 1, k + 1). CMake compiles this program without contraction of a * b + c, so the expressions below round
// as they are written, on every backend.

#include "scene.hpp"

#include "draw/surface.hpp"

#include <voxelpipe/levels/direction_mips.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <glm/glm.hpp>

#include <cstdint>

namespace gi {

namespace vp = voxelpipe;

// The material that a triangle shows at one of its points.
struct surface {
    glm::vec3 position{0.0f}; // grid coordinates
    glm::vec3 normal{0.0f};   // interpolated, unit
    glm::vec3 color{0.0f};
    glm::vec3 emission{0.0f};
    float roughness = 1, metallic = 0, density = 1;
    bool is_light = false;
    bool cut = false; // by its material's alpha

    [[nodiscard]] VOXELPIPE_HD bool is_shiny() const { return roughness < 0.99f || metallic > 0.0f; }
};

// How wide a cone's samples are, and what they count.
struct cone_shape {
    float widest = 1e9f;  // voxels at most
    float overlap = 1.9f; // by half of the cone's width
    float lift = 0.7f;    // by the height over the surface that the cone starts from, at most
    // Linear filtering spreads a wall over several samples. Steps of three quarters of a sample's width add up to a
    // wall with a weight of 3/4; more closes cones that are widening too.
    float weight = 1.1f;
};

// Memory of the backend, not owned.
struct world {
    const glm::vec3 *positions = nullptr, *normals = nullptr, *colors = nullptr;
    const glm::vec2* texcoords = nullptr;
    const glm::uvec3* triangles = nullptr;
    const std::uint32_t* triangle_materials = nullptr;
    const material* materials = nullptr;
    const voxelize::sampled_texture* textures = nullptr;
    const voxelize::color_tables* tables = nullptr;
    gi::light light;
    glm::vec3 sky_above{0.0f}, sky_level{0.0f};
    cone_shape shape;

    // weights: barycentric, of the triangle's three corners.
    [[nodiscard]] VOXELPIPE_HD surface at(std::uint32_t triangle, const glm::vec3& weights) const {
        const glm::uvec3 t = triangles[triangle];
        const auto mixed = [&](const auto* of) {
            return of[t.x] * weights.x + of[t.y] * weights.y + of[t.z] * weights.z;
        };
        const material& m = materials[triangle_materials[triangle]];
        surface s;
        s.position = mixed(positions);
        const glm::vec3 n = mixed(normals);
        const float length = vp::exact::sqrt(glm::dot(n, n));
        s.normal = length > 0.0f ? n / length : glm::vec3(0, 1, 0);
        s.color = m.color * mixed(colors);
        if (m.texture >= 0) {
            const glm::vec4 texel = voxelize::sample(textures[m.texture], *tables, mixed(texcoords));
            s.color = s.color * glm::vec3(texel);
            s.cut = texel.w < m.cutoff;
        }
        s.emission = m.emission;
        if (m.emission_texture >= 0)
            s.emission =
                s.emission * glm::vec3(voxelize::sample(textures[m.emission_texture], *tables, mixed(texcoords)));
        s.roughness = m.roughness;
        s.metallic = m.metallic;
        if (m.roughness_texture >= 0) {
            const glm::vec4 texel = voxelize::sample<voxelize::linear_texel_decoder>(textures[m.roughness_texture],
                                                                                     *tables, mixed(texcoords));
            s.roughness = s.roughness * texel.y;
            s.metallic = s.metallic * texel.z;
        }
        s.density = m.density;
        s.is_light = m.is_light;
        return s;
    }

    // A vector across the triangle, towards the side from which it runs counter-clockwise.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 across(std::uint32_t triangle) const {
        const glm::uvec3 t = triangles[triangle];
        return glm::cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x]);
    }

    // Radiance that comes from outside the grid, against `direction`.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 sky(const glm::vec3& direction) const {
        const float up = direction.y > 0.0f ? direction.y : 0.0f;
        return sky_level + (sky_above - sky_level) * vp::exact::sqrt(up);
    }
};

// The light of one point of the light source at a surface: where it is, and by what the light's colour is to be
// multiplied for the irradiance that this point would give if it stood for the whole light; 0 if the surface faces
// away. Sheets take light from both sides.
struct light_sample {
    glm::vec3 direction{0.0f}; // unit, from the surface
    float distance = 0;        // to the rectangle, or far out of the grid
    float part = 0;
};

// u, v: the point of the source, each from -1 to 1.
[[nodiscard]] VOXELPIPE_HD inline light_sample
sample_light(const light& l, const glm::vec3& from, const glm::vec3& normal, bool both_sides, float u, float v) {
    const glm::vec3 point = glm::vec3(l.position) + l.side_u * u + l.side_v * v;
    const bool sun = l.position.w == 0.0f;
    const glm::vec3 way = sun ? point : point - from;
    light_sample s;
    const float squared = glm::dot(way, way), length = vp::exact::sqrt(squared);
    if (!(length > 0.0f)) return s;
    s.direction = way / length;
    s.distance = sun ? 1e6f : length;
    float cosine = glm::dot(s.direction, normal);
    if (both_sides && cosine < 0.0f) cosine = -cosine;
    if (!(cosine > 0.0f)) return s;
    s.part = cosine;
    if (!sun) {
        const glm::vec3 across = glm::cross(l.side_u, l.side_v); // a quarter of its area; the front looks down
        const float sent = across.y > 0.0f ? glm::dot(s.direction, across) : -glm::dot(s.direction, across);
        s.part = sent > 0.0f ? cosine * (4.0f * sent / squared) : 0.0f;
    }
    return s;
}

// Points that stand for the whole light: the sun's middle, or those of a lamp's quarters.
[[nodiscard]] VOXELPIPE_HD inline int num_light_points(const light& l) { return l.position.w == 0.0f ? 1 : 4; }
[[nodiscard]] VOXELPIPE_HD inline light_sample
sample_light_point(const light& l, const glm::vec3& from, const glm::vec3& normal, bool both_sides, int number) {
    if (l.position.w == 0.0f) return sample_light(l, from, normal, both_sides, 0.0f, 0.0f);
    return sample_light(l, from, normal, both_sides, (number & 1) != 0 ? 0.5f : -0.5f,
                        (number & 2) != 0 ? 0.5f : -0.5f);
}
// By what the light's colour is to be multiplied for the irradiance where nothing is in its way.
[[nodiscard]] VOXELPIPE_HD inline float mean_light(const light& l, const glm::vec3& from, const glm::vec3& normal,
                                                   bool both_sides) {
    float sum = 0.0f;
    const int count = num_light_points(l);
    for (int i = 0; i < count; ++i) sum = sum + sample_light_point(l, from, normal, both_sides, i).part;
    return sum / static_cast<float>(count);
}

} // namespace gi
